//! The cells of a map held against the building.

use meetpoint_geometry::{Cell, Point2};
use meetpoint_occupancy::Grid;
use meetpoint_sim::Building;

/// Log-odds of 0.7: what is beyond, or below their negative, is decided.
const DECIDED: f32 = 0.8473;

/// How the cells of a building were decided.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Decided {
    /// Decided cells.
    pub(super) n: usize,
    /// Of these, rightly decided ones.
    pub(super) n_right: usize,
    /// Decided cells that are wall.
    pub(super) n_walls: usize,
    /// Of these, rightly decided ones.
    pub(super) n_right_walls: usize,
    /// Free cells, decided or not.
    pub(super) n_free: usize,
    /// Of these, those decided to be free.
    pub(super) n_found_free: usize,
}

impl Decided {
    /// Of the cells that are farther than `off_faces_m` from where wall and free space meet.
    pub(super) fn new(grid: &Grid, building: &Building, off_faces_m: f64) -> Self {
        let info = building.info();
        let mut decided = Self::default();
        for cell in info.cells() {
            let place = info.frame.center_of(cell);
            if is_near_face(building, cell, off_faces_m) {
                continue;
            }
            let is_wall = building.is_wall(cell);
            let log_odds = log_odds(grid, place);
            let is_decided = DECIDED < log_odds.abs();
            let is_right = is_decided && (0.0 < log_odds) == is_wall;
            decided.n += usize::from(is_decided);
            decided.n_right += usize::from(is_right);
            decided.n_walls += usize::from(is_decided && is_wall);
            decided.n_right_walls += usize::from(is_right && is_wall);
            decided.n_free += usize::from(!is_wall);
            decided.n_found_free += usize::from(is_right && !is_wall);
        }
        decided
    }
}

/// Of the cells of walls' faces, the share with a cell nearer than `near_m` that is decided to be wall.
pub(super) fn faces_found(grid: &Grid, building: &Building, near_m: f64) -> f64 {
    let info = building.info();
    let edge_m = info.frame.resolution_m();
    let (mut n_faces, mut n_found) = (0_usize, 0_usize);
    for cell in info.cells() {
        if !building.is_wall(cell) || !is_near_face(building, cell, edge_m) {
            continue;
        }
        n_faces += 1;
        let is_wall = |near: Cell| DECIDED < log_odds(grid, info.frame.center_of(near));
        n_found += usize::from(around(cell, near_m / edge_m).any(is_wall));
    }
    n_found as f64 / n_faces.max(1) as f64
}

fn log_odds(grid: &Grid, place: Point2<f64>) -> f32 {
    grid.log_odds(grid.frame().cell_at(place)).unwrap_or(0.0)
}

/// True if a cell is wall and one so near is free, or the other way around; cells beyond the building's edge
/// are neither.
fn is_near_face(building: &Building, cell: Cell, near_m: f64) -> bool {
    let info = building.info();
    let is_wall = building.is_wall(cell);
    let is_other = |near: Cell| info.index_of(near).is_some() && building.is_wall(near) != is_wall;
    around(cell, near_m / info.frame.resolution_m()).any(is_other)
}

/// The cells whose middle lies so near to that of a cell, in cells.
fn around(cell: Cell, near: f64) -> impl Iterator<Item = Cell> {
    #[expect(clippy::cast_possible_truncation, reason = "some cells")]
    let side = (near + 1e-9).floor() as i32;
    (-side..=side).flat_map(move |y| (-side..=side).map(move |x| (x, y))).filter_map(
        move |(x, y)| {
            let is_near = f64::from(x * x + y * y) <= near * near + 1e-9;
            is_near.then_some(Cell { x: cell.x + x, y: cell.y + y })
        },
    )
}
