//! Plans of buildings as files, and the doors that people drew in them.

use std::collections::BTreeSet;
use std::path::Path;

use anyhow::Context;
use meetpoint_geometry::Point2;
use meetpoint_occupancy::{ImportParams, MapMode, MapYaml, Raster, imported, read_png};
use meetpoint_topology::{FreeSpace, partition};

/// What has up to so many cells is no room.
const N_SPECK_CELLS: u32 = 100;

/// The cells of a plan of 0.05 m a cell, free where it is nearly white, walls elsewhere.
pub(super) fn plan(path: &Path) -> anyhow::Result<Raster> {
    let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
    let yaml = MapYaml {
        image: String::new(),
        resolution_m: 0.05,
        origin: [0.0; 3],
        negate: false,
        occupied_thresh: 0.05,
        free_thresh: 0.04,
        mode: MapMode::Trinary,
    };
    Ok(imported(&read_png(&bytes)?, &yaml, &ImportParams::MAP_SERVER)?.raster)
}

/// The doors between drawn rooms: free cells of the plan that belong to no room and touch two of
/// them, as far as they hang together. Middles of each, in metres.
pub(super) fn doors(plan: &Raster, rooms: &Path) -> anyhow::Result<Vec<Vec<Point2<f64>>>> {
    let space = FreeSpace::from_raster(plan, FreeSpace::PROBABILITY_MAX);
    let rooms =
        partition(&FreeSpace::from_raster(&self::plan(rooms)?, FreeSpace::PROBABILITY_MAX), []);
    if rooms.info() != space.info() {
        anyhow::bail!("the plan and its rooms are not of one size");
    }
    let sizes = rooms.sizes();
    let room =
        |index: usize| rooms.region_at(index).filter(|room| N_SPECK_CELLS < sizes[room.0 as usize]);
    let width = space.info().width as usize;
    let around = |index: usize| {
        let rows = [index - width, index, index + width];
        rows.into_iter().flat_map(|middle| [middle - 1, middle, middle + 1])
    };
    let is_door = |index: usize| space.is_free()[index] && room(index).is_none();
    let mut seen = vec![false; space.is_free().len()];
    let mut doors = vec![];
    for start in 0..seen.len() {
        let (mut cells, mut open, mut between) = (vec![], vec![start], BTreeSet::new());
        while let Some(index) = open.pop() {
            if is_door(index) && !seen[index] {
                seen[index] = true;
                cells.push(index);
                between.extend(around(index).filter_map(room));
                open.extend(around(index));
            }
        }
        if 1 < between.len() {
            let center = |&index: &usize| {
                let cell = space.info().cells().nth(index);
                cell.map(|cell| space.info().frame.center_of(cell))
            };
            doors.push(cells.iter().filter_map(center).collect());
        }
    }
    Ok(doors)
}
