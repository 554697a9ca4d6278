//! Correlative search of large windows by branch and bound.
//!
//! The bound of a block of shifts is what the points would score if each found the best cell of
//! its block. Blocks are looked into in the order of their bounds until no bound beats the best
//! score: the outcome is that of the exhaustive search. W. Hess, D. Kohler, H. Rapp, D. Andor,
//! "Real-time loop closure in 2D LIDAR SLAM", ICRA 2016, section V-B, with two levels. Time
//! O(headings * blocks * points) with a small constant, and 16 times that for the blocks that are
//! looked into.

use std::cmp::Reverse;
use std::collections::HashMap;

use meetpoint_geometry::{Cell, Point2};
use meetpoint_occupancy::TileIndex;

use crate::matching::field::{BLOCK_CELLS, FULL, Field, FieldTile, STRIDE, tile_place};
use crate::matching::search::{
    Candidate, N_POINTS_MAX, Prior, Window, block_lows, headings, place_points, search_block,
};
use crate::matching::tile_hashing::TileHashing;

/// Blocks along a side of a tile.
const N_BLOCKS: usize = 4;

/// For each tile and each of its 4 by 4 blocks, the highest value of the 32 by 32 cells from the
/// block's first on: whatever cell of the block a block of shifts starts from, it stays below.
struct Bounds {
    tiles: HashMap<TileIndex, [u8; N_BLOCKS * N_BLOCKS], TileHashing>,
}

impl Bounds {
    fn new(field: &Field) -> Self {
        Self { tiles: field.tiles().map(|(index, tile)| (index, tile_bounds(tile))).collect() }
    }

    #[inline]
    fn at(&self, cell: Cell) -> u8 {
        let (tile, place) = tile_place(cell);
        let (x, y) = (place % 64 / BLOCK_CELLS, place / 64 / BLOCK_CELLS);
        self.tiles.get(&tile).map_or(0, |bounds| bounds[y * N_BLOCKS + x])
    }
}

fn tile_bounds(tile: &FieldTile) -> [u8; N_BLOCKS * N_BLOCKS] {
    let mut highest = [0_u8; (N_BLOCKS + 1) * (N_BLOCKS + 1)];
    for (y, row) in tile.values.chunks_exact(STRIDE).enumerate() {
        for (x, cells) in row.chunks_exact(BLOCK_CELLS).enumerate() {
            let block = &mut highest[y / BLOCK_CELLS * (N_BLOCKS + 1) + x];
            *block = cells.iter().fold(*block, |highest, &value| highest.max(value));
        }
    }
    std::array::from_fn(|i| {
        let at = i / N_BLOCKS * (N_BLOCKS + 1) + i % N_BLOCKS;
        let above = at + N_BLOCKS + 1;
        highest[at].max(highest[at + 1]).max(highest[above]).max(highest[above + 1])
    })
}

/// A block of shifts of one heading, and the sum that it cannot exceed.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Branch {
    bound: Reverse<u32>,
    heading: u32,
    low: (i32, i32),
}

/// The best pose of the window's lattice, as
/// [`best_in_window`](crate::matching::search::best_in_window) would find it, up to which of equals; the
/// window's middle if none scores more than `score_min`.
pub(crate) fn best_in_wide_window(
    field: &Field,
    points: &[Point2<f64>],
    window: &Window,
    (prior, score_min): (&Prior, f64),
) -> Candidate {
    let mut best = Candidate { pose: window.center, score: score_min };
    let points = &points[..points.len().min(N_POINTS_MAX)];
    if points.is_empty() || !window.center.is_finite() {
        return best;
    }
    let headings: Vec<_> = headings(window).collect();
    let half = window.half_cells(field.resolution_m());
    let bounds = Bounds::new(field);
    let mut cells = Vec::with_capacity(points.len());
    let mut branches = Vec::new();
    let scale = 1.0 / (FULL * points.len() as f64);
    for (heading, &pose) in (0_u32..).zip(&headings) {
        place_points(field, points, pose, &mut cells);
        for low in block_lows(half) {
            let bound = bound_sum(&bounds, &cells, low);
            if f64::from(bound) * scale <= score_min {
                continue;
            }
            branches.push(Branch { bound: Reverse(bound), heading, low: (low.x, low.y) });
        }
    }
    branches.sort_unstable();
    for Branch { bound: Reverse(bound), heading, low: (x, y) } in branches {
        if f64::from(bound) * scale <= best.score {
            break;
        }
        let pose = headings[heading as usize];
        place_points(field, points, pose, &mut cells);
        search_block(field, &cells, (pose, half), Cell { x, y }, (prior, &mut best));
    }
    best
}

fn bound_sum(bounds: &Bounds, cells: &[Cell], low: Cell) -> u32 {
    cells
        .iter()
        .map(|cell| u32::from(bounds.at(Cell { x: cell.x + low.x, y: cell.y + low.y })))
        .sum()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use meetpoint_geometry::{GridFrame, Pose};
    use meetpoint_occupancy::{BeamModel, Grid, LaserGeometry, ScanMarks};
    use proptest::prelude::*;

    use super::*;
    use crate::matching::search::best_in_window;
    use crate::params::FieldParams;

    const LASER: LaserGeometry = LaserGeometry {
        angle_min_rad: -PI,
        angle_increment_rad: PI / 20.0,
        n_beams: 40,
        range_min_m: 0.0,
        range_max_m: 9.0,
    };

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn finds_what_the_exhaustive_search_finds(
            ranges_m in prop::collection::vec(0.5_f32..5.0, 40),
            (x, y, turn) in (-0.9_f64..0.9, -0.9_f64..0.9, -0.4_f64..0.4),
        ) {
            let mut grid = Grid::new(GridFrame::new(0.05).expect("a length"));
            let model = BeamModel::INDOOR;
            grid.insert_scan(Pose::IDENTITY, &LASER, &ranges_m, &model, &mut ScanMarks::new());
            let params = FieldParams { hit_std_m: 0.05, occupied_log_odds_min: 0.0 };
            let field = Field::new(&grid, &params);
            let points: Vec<Point2<f64>> = (0_u32..)
                .zip(&ranges_m)
                .map(|(beam, &range_m)| {
                    let (sin, cos) = LASER.bearing_rad(beam).sin_cos();
                    Point2::new(f64::from(range_m) * cos, f64::from(range_m) * sin)
                })
                .collect();
            let center = Pose::new(x, y, turn);
            let window = Window { center, half_m: 1.0, half_rad: 0.5, step_rad: 0.02 };
            let prior = Prior { center, gain_per_m2: 0.1, gain_per_rad2: 0.1, loss_max: 0.3 };
            let slow = best_in_window(&field, &points, &window, &prior);
            let fast = best_in_wide_window(&field, &points, &window, (&prior, 0.0));
            prop_assert_eq!(fast.score, slow.score);
            let nothing_above = best_in_wide_window(&field, &points, &window, (&prior, slow.score));
            prop_assert_eq!(nothing_above.pose, center, "none beats the best");
        }
    }
}
