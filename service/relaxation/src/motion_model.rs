//! `P(xi' | u, xi)`: where a robot may have got to (TBF98 section 2.1).
//!
//! Errors are triangular, rotational and translational, with widths proportional to the motion
//! (footnote 1). A rotational error `e` comes about evenly along the way: the displacement turns by
//! `e / 2`, and what a heading that wanders adds to it sideways, uncorrelated with the heading at
//! the end, is a third triangular error. Second moments are then those of a heading that wanders:
//! for a way of length l, `l^2 var(e) / 3` sideways and `l var(e) / 2` in common.
//!
//! Splitting among the grid's nodes adds a variance of its own, about 0.4 m and 2 degrees a step on
//! the paper's grid; it is taken as part of the errors, not on top of them.

use std::f64::consts::PI;

use crate::calibration::Calibration;
use crate::kernel::Kernel;
use crate::motion::Motion;
use crate::pose_grid::PoseGrid;
use crate::spread::{Spread, triangular};

/// How wrong a robot's odometry may be; a width is the largest error that a triangular density
/// admits, 2.45 standard deviations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionParams {
    /// Width of the error of a way's length, for every metre driven.
    pub translation_per_m: f64,
    /// Width of the error of a turn, for every radian turned.
    pub rotation_per_rad: f64,
    /// Width of the error of the heading for every metre driven, in radians.
    pub rotation_per_m: f64,
    /// Width of the error of the position when nothing moved, in metres.
    pub translation_min_m: f64,
    /// Width of the error of the heading when nothing moved, in radians.
    pub rotation_min_rad: f64,
}

impl MotionParams {
    /// A robot on carpet and tiles, which "typically amplifies errors" (TBF98 section 6): a degree
    /// for every metre and a tenth of a turn, wide enough for corridors that turn the robot
    /// steadily by half of that.
    pub const CARPET: Self = Self {
        translation_per_m: 0.06,
        rotation_per_rad: 0.1,
        rotation_per_m: 0.02,
        translation_min_m: 0.1,
        rotation_min_rad: 0.02,
    };

    /// Variance of the heading at the end of a motion, in square radians.
    pub(crate) fn rotation_variance_rad2(&self, motion: &Motion) -> f64 {
        let width = self.rotation_per_rad * motion.turned_rad()
            + self.rotation_per_m * motion.distance_m()
            + self.rotation_min_rad;
        width * width / 6.0
    }

    /// Variance of the length of a motion, in square metres.
    pub(crate) fn translation_variance_m2(&self, motion: &Motion) -> f64 {
        let width = self.translation_per_m * motion.distance_m() + self.translation_min_m;
        width * width / 6.0
    }
}

/// Variance of a heading of which nothing is known any more: a triangle of half a turn to either
/// side.
const LOST_RAD2: f64 = PI * PI / 6.0;

/// Where one motion may end, on a grid.
#[derive(Clone, Debug)]
pub struct MotionModel {
    kernel: Kernel,
}

impl MotionModel {
    /// The table for a motion whose steady errors are corrected by `calibration`. Probabilities
    /// below `share` of the largest are dropped.
    pub fn new(
        grid: &PoseGrid,
        motion: &Motion,
        calibration: &Calibration,
        params: &MotionParams,
        share: f32,
    ) -> Self {
        let spreads = spreads(grid, motion, calibration, params);
        Self { kernel: Kernel::new(grid, &spreads, share) }
    }

    /// The probability to get `x` and `y` nodes and `turn` headings further from a heading.
    pub fn probability(&self, grid: &PoseGrid, heading: u32, (x, y, turn): (i32, i32, i32)) -> f32 {
        let (n_quarters, slabs) = self.kernel.slabs(grid, heading);
        let (x, y) = match n_quarters {
            0 => (x, y),
            1 => (y, -x),
            2 => (-x, -y),
            _ => (-y, x),
        };
        let turns = slabs.iter().filter(|slab| grid.turned(0, slab.turn) == grid.turned(0, turn));
        turns.map(|slab| slab.table.at(x, y)).sum()
    }

    pub(crate) fn kernel(&self) -> &Kernel {
        &self.kernel
    }
}

fn spreads(
    grid: &PoseGrid,
    motion: &Motion,
    calibration: &Calibration,
    params: &MotionParams,
) -> Vec<Spread> {
    let end = motion.displacement(calibration);
    let chord_m = end.distance_m();
    let turn_variance = params.rotation_variance_rad2(motion).min(LOST_RAD2);
    let split_turn = (turn_variance - grid.heading_variance_rad2()).max(0.0);
    let along = params.translation_variance_m2(motion) - grid.node_variance_m2();
    let wander = motion.distance_m().powi(2) * turn_variance / 3.0;
    let still = params.translation_min_m.powi(2) / 6.0;
    let sideways = wander + still - chord_m.powi(2) * split_turn / 4.0 - grid.node_variance_m2();

    let spacing_m = grid.resolution_m() / 2.0;
    let spacing_rad = (grid.heading_step_rad() / 2.0).min(2.0 * spacing_m / chord_m.max(1e-9));
    let direction = if chord_m > 1e-9 { end.y_m.atan2(end.x_m) } else { 0.0 };
    let mut spreads = Vec::new();
    for &(turn_rad, of_turn) in &triangular(split_turn, spacing_rad) {
        let (sin, cos) = (direction + turn_rad / 2.0).sin_cos();
        for &(further_m, of_length) in &triangular(along, spacing_m) {
            for &(aside_m, of_side) in &triangular(sideways, spacing_m) {
                let length_m = chord_m + further_m;
                spreads.push(Spread {
                    x_m: cos * length_m - sin * aside_m,
                    y_m: sin * length_m + cos * aside_m,
                    turn_rad: end.theta_rad + turn_rad,
                    weight: of_turn * of_length * of_side,
                });
            }
        }
    }
    spreads
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose_grid::Area;
    use meetpoint_geometry::{Point2, Pose};

    /// Second moments of a heading that wanders, as the head of this file has them.
    #[test]
    fn errors_are_those_of_a_heading_that_wanders() {
        let area = Area { min: Point2::new(-8.0, -8.0), max: Point2::new(8.0, 8.0) };
        let grid = PoseGrid::new(area, 0.25, 180).expect("a grid");
        let motion = Motion::new(vec![Pose::new(0.5, 0.0, 0.0); 20]);
        let params = MotionParams { rotation_per_m: 0.03, ..MotionParams::CARPET };
        let model = MotionModel::new(&grid, &motion, &Calibration::NONE, &params, 0.0);
        let (mut aside, mut turn, mut both, mut along) = (0.0, 0.0, 0.0, 0.0);
        let (_, slabs) = model.kernel().slabs(&grid, 0);
        for slab in slabs {
            for (x, y, weight) in slab.table.entries() {
                let weight = f64::from(weight);
                let (y_m, turn_rad) =
                    (f64::from(y) * 0.25, f64::from(slab.turn) * grid.heading_step_rad());
                along += weight * f64::from(x) * 0.25;
                aside += weight * y_m * y_m;
                turn += weight * turn_rad * turn_rad;
                both += weight * y_m * turn_rad;
            }
        }
        let variance = params.rotation_variance_rad2(&motion);
        assert!((turn / variance - 1.0).abs() < 0.1, "heading: {turn} of {variance}");
        assert!((aside / (100.0 * variance / 3.0) - 1.0).abs() < 0.1, "aside: {aside}");
        assert!((both / (10.0 * variance / 2.0) - 1.0).abs() < 0.1, "in common: {both}");
        assert!((along - 10.0).abs() < 0.1, "along: {along}");
    }
}
