//! `meetpoint places`: the places of a map, their gateways and stars, or those that a robot has found which
//! explores as it is told; or a drawing of them.

use std::path::{Path, PathBuf};

use meetpoint_proto::v1;

use super::asked::{ServerArgs, save};
use super::map::raster;
use super::place_picture;
use super::session_places::{self, Shown};
use crate::rest::PlaceList;

/// Places asked for at once.
const PAGE_SIZE: u32 = 1000;

/// Options of `meetpoint places`.
#[derive(Debug, clap::Args)]
pub struct PlacesArgs {
    /// The map
    #[arg(required_unless_present = "session")]
    map: Option<String>,
    /// Those that a robot found in this session, as it was told to explore step by step
    #[arg(long, value_name = "ID", conflicts_with_all = ["map", "version"])]
    session: Option<String>,
    /// The version; the published one where nothing is said
    #[arg(long, default_value_t = 0, hide_default_value = true)]
    version: u64,
    /// Draw them over the grid: gateways red, ways through the place blue where a path passes; those of a session
    /// as a graph: home green, the robot's red, unexplored directions orange
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,
    #[command(flatten)]
    server: ServerArgs,
}

/// Asks for the places, shows and draws them.
///
/// # Errors
/// If there is no such map or version, nothing was observed, or the picture cannot be written.
pub async fn run(args: PlacesArgs) -> anyhow::Result<()> {
    let PlacesArgs { map, session, version, png, server } = args;
    let client = server.client()?;
    if let Some(session) = session {
        let shown = Shown { session, json: server.json, png: png.as_deref() };
        return session_places::show(&client, shown).await;
    }
    let map = map.unwrap_or_default();
    let mut request = v1::ListPlacesRequest {
        map: map.clone(),
        version,
        page_size: PAGE_SIZE,
        ..Default::default()
    };
    let mut found = client.places(request.clone()).await?;
    while !found.next_page_token.is_empty() {
        // All pages are of the version that the first one names.
        (request.version, request.page_token) = (found.map_version, found.next_page_token);
        let page = client.places(request.clone()).await?;
        found.next_page_token = page.next_page_token;
        found.places.extend(page.places);
    }
    if let Some(path) = &png {
        let grid = client.grid(&map, found.map_version).await?;
        save(path, &place_picture::png(&raster(grid)?, &found.places)?)?;
    }
    if server.json {
        println!("{}", serde_json::to_string(&PlaceList::from(found))?);
    } else if png.as_deref() != Some(Path::new("-")) {
        table(&map, &found);
    }
    Ok(())
}

fn table(map: &str, found: &v1::ListPlacesResponse) {
    for place in &found.places {
        println!("{}", line(place));
    }
    println!(
        "map {map}, version {}: {} places, {} ways between their gateways, {} paths",
        found.map_version, found.place_count, found.edges, found.paths
    );
}

/// A place in a line: where it is, its star, and where its gateways lead.
fn line(place: &v1::Place) -> String {
    let v1::Point { x_m, y_m } = place.core.unwrap_or_default();
    let ways: Vec<String> = place.gateways.iter().map(way).collect();
    format!(
        "place {} at ({x_m:.2}, {y_m:.2}) m, {:.1} m from the walls: {} to {}",
        place.number,
        place.clearance_m,
        place.star,
        ways.join(", ")
    )
}

fn way(gateway: &v1::PlaceGateway) -> String {
    let to = gateway.to_place.map_or("?".to_owned(), |place| place.to_string());
    format!("{to} ({:.1} m)", gateway.width_m)
}
