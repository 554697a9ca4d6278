//! What was seen of a place of a travel: its local map, gateways and stars.

use std::path::Path;

use anyhow::Context;
use meetpoint_client::Client;
use meetpoint_proto::v1;

use super::asked::save;
use super::map::raster;
use super::place_picture;
use crate::rest::PlaceMap;

/// What is to be shown.
pub(super) struct Shown<'a> {
    pub(super) tree: v1::TreeName,
    pub(super) place: u32,
    /// JSON, for machines.
    pub(super) json: bool,
    /// Where the drawing is to be saved, if one is wanted: the local map with its gateways.
    pub(super) png: Option<&'a Path>,
}

/// Prints what is known of the place and saves the drawing.
pub(super) async fn show(client: &Client, shown: Shown<'_>) -> anyhow::Result<()> {
    let Shown { tree, place, json, png } = shown;
    let request = v1::GetPlaceMapRequest { tree: Some(tree), place, ..Default::default() };
    let told = client.place_map(request).await?;
    if let Some(path) = png {
        let grid = told.grid.clone().context("the service sent no grid")?;
        save(path, &place_picture::png(&raster(grid)?, told.star.as_slice())?)?;
    }
    if json {
        println!("{:#}", serde_json::to_value(PlaceMap::try_from(told)?)?);
    } else if png != Some(Path::new("-")) {
        print!("{}", in_words(&told));
    }
    Ok(())
}

fn in_words(told: &v1::GetPlaceMapResponse) -> String {
    let v1::GetPlaceMapResponse { hypothesis, place, visits, visit, scans, cut_short, .. } = told;
    let visits: Vec<String> = visits.iter().map(u32::to_string).collect();
    let cut_short = if *cut_short { ", cut short" } else { "" };
    let mut lines = vec![format!(
        "place {place} of {hypothesis}: visits {}; drawn from {scans} scans around visit {visit}{cut_short}",
        visits.join(", ")
    )];
    let v1::GetPlaceMapResponse { star, not_a_place, came_in_by, star_found, star_told, .. } = told;
    match star {
        None => lines.push(format!("no place is found there: {not_a_place}")),
        Some(star) => {
            let by = came_in_by.map_or_else(String::new, |by| {
                format!("; it came in by gateway {by}, from where that reads {star_found}")
            });
            lines.push(format!("its star is {}{by}, and was told as {star_told}", star.star));
            lines.extend((0..).zip(&star.gateways).map(gateway_line));
        }
    }
    lines.extend(told.states.iter().map(state_line));
    lines.join("\n") + "\n"
}

fn gateway_line((index, gateway): (u32, &v1::PlaceGateway)) -> String {
    let onward = gateway.continues_to.map_or_else(
        || "a path ends".to_owned(),
        |onward| format!("a path passes to gateway {onward}"),
    );
    let law = gateway.law().as_str_name().trim_start_matches("TRAVEL_LAW_").to_lowercase();
    format!("gateway {index}: {:.2} m wide, {onward}, away by {law}", gateway.width_m)
}

fn state_line(state: &v1::DistinctiveState) -> String {
    let v1::DistinctiveState { number, path, plus, ends, right, left, around } = state;
    let sign = if *plus { '+' } else { '-' };
    let path = if *ends { format!("(Pa{path}{sign})") } else { format!("Pa{path}{sign}") };
    let names = |states: &[u32]| {
        let names: Vec<String> = states.iter().map(|state| format!("ds{state}")).collect();
        if names.is_empty() { "nothing".to_owned() } else { names.join(", ") }
    };
    format!(
        "ds{number}, {path}: right to {}, left to {}, around to ds{around}",
        names(right),
        names(left)
    )
}
