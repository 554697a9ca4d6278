//! The part of the map around a robot, between whose cells is interpolated.
//!
//! A cell's value is `2 p - 1` for its probability of being occupied: -1 free, 1 occupied, 0 where it was
//! never observed. Between the middles of four cells it is their bilinear mean, so that the value is
//! continuous and almost everywhere differentiable in the place.

use meetpoint_geometry::{Cell, GridFrame, Point2};
use meetpoint_occupancy::Grid;

/// A square of the map.
#[derive(Clone, Debug)]
pub(crate) struct Patch {
    frame: GridFrame,
    first: Cell,
    /// Cells along each side.
    width: usize,
    /// Row-major along +x, the lowest row first, in -1..=1.
    values: Vec<f64>,
}

/// A value and its derivatives along x and y, per metre.
pub(crate) type Slope = (f64, f64, f64);

impl Patch {
    /// The cells within `reach_m` of a place along either axis.
    pub(crate) fn around(grid: &Grid, middle: Point2<f64>, reach_m: f64) -> Self {
        let frame = grid.frame();
        let corner = |side_m: f64| frame.cell_at(middle.map(|at_m| at_m + side_m));
        let (low, high) = (corner(-reach_m), corner(reach_m));
        let width = high.x.abs_diff(low.x).max(high.y.abs_diff(low.y)) as usize + 1;
        let side = |first: i32| {
            (0..i32::try_from(width).unwrap_or(0)).map(move |step| first.saturating_add(step))
        };
        let cells = side(low.y).flat_map(|y| side(low.x).map(move |x| Cell { x, y }));
        let values = cells.map(|cell| grid.followed_log_odds(cell).map_or(0.0, occupied)).collect();
        Self { frame, first: low, width, values }
    }

    /// The value at a place; 0 and level outside the patch.
    pub(crate) fn interpolate(&self, place: Point2<f64>) -> Slope {
        let edge_m = self.frame.resolution_m();
        let corner = self.frame.center_of(self.first);
        let (x, y) = ((place.x - corner.x) / edge_m, (place.y - corner.y) / edge_m);
        let last = (self.width - 1) as f64;
        if !(0.0 <= x && x < last && 0.0 <= y && y < last) {
            return (0.0, 0.0, 0.0);
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "within the patch, as was just checked"
        )]
        let (column, row) = (x as usize, y as usize);
        let (right, up) = (x - column as f64, y - row as f64);
        let at = |dx: usize, dy: usize| self.values[(row + dy) * self.width + column + dx];
        let (a, b, c, d) = (at(0, 0), at(1, 0), at(0, 1), at(1, 1));
        let (lower, upper) = (a + right * (b - a), c + right * (d - c));
        let along_x = (b - a) + up * ((d - c) - (b - a));
        (lower + up * (upper - lower), along_x / edge_m, (upper - lower) / edge_m)
    }
}

/// `2 p - 1` of log-odds.
pub(crate) fn occupied(log_odds: f32) -> f64 {
    (0.5 * f64::from(log_odds)).tanh()
}
