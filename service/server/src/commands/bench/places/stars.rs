//! The stars of the drawn office, every one of them, and their picture: `service/places/stars.png`.

use std::path::Path;

use meetpoint_geometry::Point2;
use meetpoint_occupancy::Raster;
use meetpoint_places::{LocalParams, LocalPlace, parsed_map};
use meetpoint_sim::{Building, office};

use super::star_picture;

/// Log-odds of what is drawn: any are as good.
const SURE: f32 = 4.0;

/// Prints a row for every place, and saves the picture.
pub(super) fn print(pictures: Option<&Path>) -> anyhow::Result<()> {
    let raster = raster(&office().building);
    let parsed = parsed_map(&raster, &LocalParams::INDOOR);
    println!("| place | core, m | clearance, m | star | gateways lead to |");
    println!("|---|---|---|---|---|");
    for (id, place) in parsed.places() {
        let LocalPlace { core, clearance_m, star, .. } = place;
        let Point2 { coords } = core;
        let leads_to: Vec<String> = (0..star.n_gateways())
            .map(|index| parsed.map.leads_to(meetpoint_places::Gateway { place: id, index }))
            .map(|to| to.map_or_else(|| "?".to_owned(), |to| to.place.0.to_string()))
            .collect();
        println!(
            "| {} | {:.1}, {:.1} | {clearance_m:.1} | {star} | {} |",
            id.0,
            coords.x,
            coords.y,
            leads_to.join(", ")
        );
    }
    if let Some(folder) = pictures {
        star_picture::save(&raster, &[], &parsed.neighborhoods, &folder.join("stars.png"))?;
    }
    Ok(())
}

/// The building as a map that is sure of everything.
fn raster(building: &Building) -> Raster {
    let info = building.info();
    let log_odds =
        info.cells().map(|cell| if building.is_wall(cell) { SURE } else { -SURE }).collect();
    Raster { info, log_odds }
}
