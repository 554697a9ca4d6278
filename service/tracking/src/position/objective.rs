//! The objective that a robot's pose minimises.
//!
//! ```text
//! J(pose) = beta_1 |position - position*|² + beta_2 (theta - theta*)²
//!         - beta_3 corr(pose) - beta_4 sum over walls of sigma(alpha)
//! ```
//!
//! with `*` for what odometry says. S. Thrun, "Learning metric-topological maps for indoor mobile robot
//! navigation", Artificial Intelligence 99 (1998), eq. (4). Every gain can be 0, which switches its source off.
//! Time O(places + walls).

use meetpoint_geometry::{Pose, angle_between};

use super::correlation::correlation;
use super::local_map::LocalPlace;
use super::patch::Patch;
use super::wall_orientation::{quarter, sigma};
use crate::params::PositionParams;

/// What is known of a robot's pose at one firing.
pub(crate) struct Objective<'a> {
    /// By odometry.
    pub(crate) predicted: Pose,
    pub(crate) patch: &'a Patch,
    pub(crate) local: &'a [LocalPlace],
    /// Directions of the walls heard, seen from the robot, each less the building's direction, in radians.
    pub(crate) walls_rad: &'a [f64],
    pub(crate) params: &'a PositionParams,
}

impl Objective<'_> {
    /// J at a pose, and its derivatives along x, y (per metre) and by theta (per radian).
    pub(crate) fn at(&self, pose: Pose) -> (f64, [f64; 3]) {
        let PositionParams {
            odometry_gain_per_m2: per_m2,
            odometry_gain_per_rad2: per_rad2,
            correlation_gain,
            wall_gain,
            ..
        } = *self.params;
        let (dx, dy) = (pose.x_m - self.predicted.x_m, pose.y_m - self.predicted.y_m);
        let turn = angle_between(self.predicted.theta_rad, pose.theta_rad);
        let mut cost = per_m2 * (dx * dx + dy * dy) + per_rad2 * turn * turn;
        let mut slope = [2.0 * per_m2 * dx, 2.0 * per_m2 * dy, 2.0 * per_rad2 * turn];
        if correlation_gain != 0.0 {
            let (correlated, slopes) = correlation(self.patch, self.local, pose);
            cost -= correlation_gain * correlated;
            for (slope, part) in slope.iter_mut().zip(slopes) {
                *slope -= correlation_gain * part;
            }
        }
        for &wall_rad in self.walls_rad {
            let (agrees, per_rad) = sigma(quarter(pose.theta_rad + wall_rad));
            cost -= wall_gain * agrees;
            slope[2] -= wall_gain * per_rad;
        }
        (cost, slope)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::PositionParams;
    use meetpoint_geometry::GridFrame;
    use meetpoint_occupancy::{BeamModel, Grid, LaserGeometry, ScanMarks};
    use proptest::prelude::*;

    /// A grid of rays into a jagged room.
    fn grid() -> Grid {
        let laser = LaserGeometry {
            angle_min_rad: 0.0,
            angle_increment_rad: 0.02,
            n_beams: 314,
            range_min_m: 0.0,
            range_max_m: 9.0,
        };
        let mut grid = Grid::new(GridFrame::new(0.1).expect("a length"));
        let ranges_m: Vec<f32> = (0..314_u16).map(|i| 2.0 + (f32::from(i) * 0.3).sin()).collect();
        let at = Pose::new(0.03, 0.04, 0.0);
        grid.insert_scan(at, &laser, &ranges_m, &BeamModel::INDOOR, &mut ScanMarks::new());
        grid
    }

    proptest! {
        /// The slope against finite differences, for steps so short that no place leaves its four cells.
        #[test]
        fn slopes_as_it_differs(
            (x_m, y_m, theta_rad) in (-0.4_f64..0.4, -0.4_f64..0.4, -3.0_f64..3.0),
            places in prop::collection::vec((-3.0_f64..3.0, -3.0_f64..3.0, -1.0_f64..1.0), 1..40),
            walls_rad in prop::collection::vec(-1.0_f64..1.0, 0..3),
        ) {
            const STEP: f64 = 1e-7;
            let patch = Patch::around(&grid(), [0.0, 0.0].into(), 5.0);
            let local: Vec<LocalPlace> = places
                .into_iter()
                .map(|(x, y, value)| LocalPlace { at: [x, y].into(), value })
                .collect();
            let objective = Objective {
                predicted: Pose::new(0.1, -0.1, theta_rad + 0.05),
                patch: &patch,
                local: &local,
                walls_rad: &walls_rad,
                params: &PositionParams::SONAR,
            };
            let at = Pose { x_m, y_m, theta_rad };
            let kinks = local.iter().any(|place| {
                let on_map = at * place.at;
                [on_map.x, on_map.y].into_iter().any(|at_m| {
                    let cells = at_m / 0.1 - 0.5;
                    (cells - cells.round()).abs() < 1e-4
                })
            });
            prop_assume!(!kinks);
            let (_, slope) = objective.at(at);
            let moved = |dx: f64, dy: f64, turn: f64| Pose {
                x_m: x_m + dx,
                y_m: y_m + dy,
                theta_rad: theta_rad + turn,
            };
            let difference = |dx: f64, dy: f64, turn: f64| {
                let ahead = objective.at(moved(dx, dy, turn)).0;
                (ahead - objective.at(moved(-dx, -dy, -turn)).0) / (2.0 * STEP)
            };
            let expected =
                [difference(STEP, 0.0, 0.0), difference(0.0, STEP, 0.0), difference(0.0, 0.0, STEP)];
            for (slope, expected) in slope.iter().zip(expected) {
                prop_assert!((slope - expected).abs() < 1e-3 * (1.0 + expected.abs()), "{slope}, {expected}");
            }
        }
    }
}
