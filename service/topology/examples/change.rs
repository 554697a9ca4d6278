//! What a change of the space costs: regions brought up to date against regions computed afresh.
//!
//! ```text
//! cargo run --release -p meetpoint-topology --example change -- MAP...
//! ```
//!
//! MAP is the YAML of a `map_server` map, or an image. Every door of the map (a critical line that
//! bounds regions) is closed in turn and opened again; a square of 20 by 20 obstacle cells is put down
//! and taken away at 20 free places. Both ways give equal regions, or the run ends with an error.

mod plan;

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use meetpoint_geometry::GridInfo;
use meetpoint_topology::{FreeSpace, Segmentation, TopologyParams, resegmentation, segmentation};
use plan::free_space;

/// Cells along each side of the square.
const PATCH_CELLS: usize = 20;

/// Places for the square.
const N_PATCHES: usize = 20;

fn main() -> Result<(), Box<dyn Error>> {
    println!("mean milliseconds      door: afresh  updated  ratio   patch: afresh  updated  ratio");
    for map in std::env::args().skip(1) {
        let space = free_space(Path::new(&map))?;
        let found = segmentation(&space, &TopologyParams::INDOOR);
        let doors: Vec<Vec<usize>> = found
            .lines
            .iter()
            .map(|line| {
                line.crossings.iter().flat_map(|crossing| [crossing.left, crossing.right]).collect()
            })
            .collect();
        let width = space.info().width as usize;
        let free: Vec<usize> =
            (0..space.is_free().len()).filter(|&index| space.is_free()[index]).collect();
        let patches: Vec<Vec<usize>> = (0..N_PATCHES)
            .map(|at| {
                let corner = free[at * free.len() / N_PATCHES];
                (0..PATCH_CELLS * PATCH_CELLS)
                    .map(|n| corner + n / PATCH_CELLS * width + n % PATCH_CELLS)
                    .collect()
            })
            .collect();
        let [door, patch] = [doors, patches].map(|edits| cost(&space, found.clone(), &edits));
        let (door, patch) = (door?, patch?);
        let name = Path::new(&map).file_stem().and_then(|name| name.to_str()).unwrap_or_default();
        println!("{name:24}{door}{patch}");
    }
    Ok(())
}

/// Closes cells and opens them again, edit by edit; mean times of all, as text.
fn cost(
    space: &FreeSpace,
    mut found: Segmentation,
    edits: &[Vec<usize>],
) -> Result<String, Box<dyn Error>> {
    let GridInfo { width, height, .. } = space.info();
    let inner = |index: usize| {
        let (x, y) = (index % width as usize, index / width as usize);
        index < space.is_free().len()
            && 0 < x
            && x + 1 < width as usize
            && 0 < y
            && y + 1 < height as usize
    };
    let (mut afresh_ms, mut updated_ms, mut n_times) = (0.0, 0.0, 0.0);
    for edit in edits {
        let mut cells = space.is_free().to_vec();
        for &index in edit.iter().filter(|&&index| inner(index)) {
            cells[index] = false;
        }
        let closed = with_cells(space, &cells);
        for space in [&closed, space] {
            let start = Instant::now();
            found = resegmentation(found, space);
            updated_ms += start.elapsed().as_secs_f64() * 1e3;
            let start = Instant::now();
            let afresh = segmentation(space, &TopologyParams::INDOOR);
            afresh_ms += start.elapsed().as_secs_f64() * 1e3;
            n_times += 1.0;
            if found != afresh {
                return Err(
                    "what was brought up to date differs from what is computed afresh".into()
                );
            }
        }
    }
    let (afresh_ms, updated_ms) = (afresh_ms / n_times, updated_ms / n_times);
    Ok(format!("  {afresh_ms:10.1} {updated_ms:8.1} {:6.1}     ", afresh_ms / updated_ms))
}

/// A space of the same rectangle.
fn with_cells(space: &FreeSpace, cells: &[bool]) -> FreeSpace {
    let info = space.info();
    let width = info.width as usize;
    let rows = cells.chunks_exact(width).skip(1).take(info.height as usize - 2);
    let inside: Vec<bool> = rows.flat_map(|row| row[1..width - 1].iter().copied()).collect();
    let first = meetpoint_geometry::Cell { x: info.first.x + 1, y: info.first.y + 1 };
    let info = GridInfo { first, width: info.width - 2, height: info.height - 2, ..info };
    FreeSpace::from_cells(info, &inside)
}
