//! A corridor around a block, driven twice: S. Thrun, Artificial Intelligence 99 (1998), Fig. 10.

use meetpoint_geometry::Point2;
use rand::{Rng, RngExt};

use crate::building::{Building, InvalidBuilding};

/// Edge of a cell, in metres.
const CELL_M: f64 = 0.25;
/// Columns and rows of the outside: 60 m by 20 m.
const SIZE: (usize, usize) = (240, 80);
/// Cells across the corridor: 2 m.
const CORRIDOR: usize = 8;
/// Niches in the block, a metre wide: without doors a corridor tells nothing of where along it one is.
const N_NICHES: usize = 24;

/// A corridor of 2 m around a block of 60 m by 20 m from outside, with niches at any place, and a way twice
/// around it, in metres.
///
/// # Errors
/// [`InvalidBuilding`]: never, the drawing is a good one.
pub fn ring_corridor(rng: &mut impl Rng) -> Result<(Building, Vec<Point2<f64>>), InvalidBuilding> {
    let (width, height) = SIZE;
    let niches: Vec<usize> = (0..N_NICHES).map(|_| rng.random_range(12..width - 16)).collect();
    let within = |at: usize, all: usize| (CORRIDOR + 1..all - CORRIDOR - 1).contains(&at);
    let is_wall = |column: usize, row: usize| {
        let is_rim = row == 0 || row + 1 == height || column == 0 || column + 1 == width;
        let edges = [CORRIDOR + 1, height - CORRIDOR - 2];
        let is_niche = niches
            .iter()
            .enumerate()
            .any(|(index, &from)| row == edges[index % 2] && (from..from + 4).contains(&column));
        is_rim || (within(column, width) && within(row, height) && !is_niche)
    };
    let symbol = |column: usize, row: usize| if is_wall(column, row) { '#' } else { '.' };
    let row = |row: usize| (0..width).map(|column| symbol(column, row)).collect::<String>();
    let drawing = (0..height).map(row).collect::<Vec<_>>().join("\n");
    let [right_m, top_m] = [width, height].map(|n| n as f64 * CELL_M - 1.25);
    let corners = [(1.25, 1.25), (right_m, 1.25), (right_m, top_m), (1.25, top_m)];
    let round = corners.iter().cycle().skip(1).take(9);
    let way = std::iter::once(&(10.0, 1.25)).chain(round);
    let way = way.map(|&(x_m, y_m)| Point2::new(x_m, y_m)).collect();
    Ok((Building::from_drawing(&drawing, CELL_M)?, way))
}
