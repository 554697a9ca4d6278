//! The direction in which a building's walls stand, and whether they do.
//!
//! Walls are taken to be parallel or orthogonal to one another. The direction is the mean of the first walls,
//! as angles modulo a quarter turn,
//!
//! ```text
//! theta_wall = 1/4 arg( sum over walls of w e^(4 i theta) )        w = s² / (s² + h²)
//! ```
//!
//! each weighed by how sure the robot's heading is when it is heard, of variance h² by reckoning, beside the s² of
//! walls themselves: the first are heard from the heading that defines the map's frame. How far it is true of a
//! building is told by the mean resultant length R of the walls about the direction, 1 if all agree and near 0
//! for any directions (K. Mardia and P. Jupp, "Directional statistics" (2000), section 2.3), kept up with every
//! wall. The term is off until enough walls were heard, and while R is small.
//!
//! ```text
//! sigma(alpha) = (|alpha| - 15°)²  if |alpha| <= 15°, else 0      alpha = (theta + wall - theta_wall) mod 90°
//! ```
//!
//! S. Thrun, "Learning metric-topological maps for indoor mobile robot navigation", Artificial Intelligence 99
//! (1998), section 2.3 (iii) and Fig. 8; here divided by its value at 0, so that it is 1 for a wall that
//! stands as it should.

use std::f64::consts::{FRAC_PI_2, PI};

use meetpoint_geometry::Pose;

use crate::params::WallParams;

/// What walls have told of a building's direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct WallOrientation {
    /// Variance of the heading by reckoning alone since the robot set out, in square radians.
    pub(crate) heading_rad2: f64,
    /// Walls that the direction was estimated from, by their weights.
    pub(crate) n_walls: f64,
    /// Sum of `e^(4 i theta)` over them, by weight.
    pub(crate) sum: [f64; 2],
    /// Mean resultant length of the recent walls about the direction.
    pub(crate) resultant: f64,
}

impl WallOrientation {
    /// Takes a wall whose normal has that direction in the map, in radians.
    pub(crate) fn note(&mut self, direction_rad: f64, params: &WallParams) {
        if self.is_beginning(params) {
            let (sin, cos) = (4.0 * direction_rad).sin_cos();
            let variance = params.direction_std_rad.powi(2);
            let weight = variance / (variance + self.heading_rad2);
            self.n_walls += weight;
            self.sum = [self.sum[0] + weight * cos, self.sum[1] + weight * sin];
            self.resultant = self.sum[0].hypot(self.sum[1]) / self.n_walls;
            if !self.is_beginning(params) && self.resultant < params.resultant_min {
                // These were no such walls; the next may be.
                *self = Self { heading_rad2: self.heading_rad2, ..Self::default() };
            }
        } else {
            let agrees = (4.0 * (direction_rad - self.direction_rad())).cos();
            self.resultant += params.resultant_weight * (agrees - self.resultant);
        }
    }

    /// Takes a step into account that the robot reckoned.
    pub(crate) fn drive(&mut self, step: Pose, params: &WallParams) {
        self.heading_rad2 += params.heading_rad2_per_m * step.distance_m()
            + params.heading_rad2_per_rad * step.theta_rad.abs();
    }

    /// True while directions are still being gathered.
    pub(crate) fn is_beginning(&self, params: &WallParams) -> bool {
        self.n_walls < params.n_first
    }

    /// The direction, if walls stand by it.
    pub(crate) fn known_rad(&self, params: &WallParams) -> Option<f64> {
        let is_known = !self.is_beginning(params) && params.resultant_min <= self.resultant;
        is_known.then(|| self.direction_rad())
    }

    fn direction_rad(&self) -> f64 {
        self.sum[1].atan2(self.sum[0]) / 4.0
    }
}

/// Walls turned by more than this have no effect, in radians (the paper's 15 degrees).
const TURN_MAX_RAD: f64 = 15.0 * PI / 180.0;

/// Sigma of an angle over its value at 0, and its derivative per radian. At 0, where it has a peak, the
/// derivative is given as 0.
pub(crate) fn sigma(alpha_rad: f64) -> (f64, f64) {
    let left = 1.0 - alpha_rad.abs() / TURN_MAX_RAD;
    if left <= 0.0 || alpha_rad == 0.0 {
        return (left.max(0.0).powi(2), 0.0);
    }
    (left * left, -2.0 * left * alpha_rad.signum() / TURN_MAX_RAD)
}

/// An angle modulo a quarter turn, in [-π/4, π/4).
pub(crate) fn quarter(angle_rad: f64) -> f64 {
    (angle_rad + FRAC_PI_2 / 2.0).rem_euclid(FRAC_PI_2) - FRAC_PI_2 / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const PARAMS: WallParams = WallParams::INDOOR;

    #[test]
    fn walls_at_right_angles_tell_the_direction() {
        let mut walls = WallOrientation::default();
        for step in 0..40 {
            walls.note(
                0.3 + f64::from(step % 4) * FRAC_PI_2 + 0.02 * f64::from(step % 3 - 1),
                &PARAMS,
            );
        }
        let known_rad = walls.known_rad(&PARAMS).expect("they agree");
        assert!(quarter(known_rad - 0.3).abs() < 0.01, "{known_rad} rad");
    }

    #[test]
    fn a_round_building_has_none_and_one_that_gets_round_loses_it() {
        let mut walls = WallOrientation::default();
        for step in 0..500 {
            walls.note(f64::from(step) * 0.377, &PARAMS);
            assert_eq!(walls.known_rad(&PARAMS), None, "after {step} walls");
        }
        let mut walls = WallOrientation::default();
        for _ in 0..60 {
            walls.note(0.1, &PARAMS);
        }
        assert!(walls.known_rad(&PARAMS).is_some(), "straight so far");
        for step in 0..300 {
            walls.note(f64::from(step) * 0.377, &PARAMS);
        }
        assert_eq!(walls.known_rad(&PARAMS), None, "round for long");
    }

    proptest! {
        #[test]
        fn sigma_slopes_as_it_differs(alpha_rad in -0.5_f64..0.5) {
            const STEP: f64 = 1e-6;
            let kinks = [0.0, TURN_MAX_RAD, -TURN_MAX_RAD];
            prop_assume!(kinks.iter().all(|kink| 2.0 * STEP < (alpha_rad - kink).abs()));
            let by_difference = (sigma(alpha_rad + STEP).0 - sigma(alpha_rad - STEP).0) / (2.0 * STEP);
            prop_assert!((sigma(alpha_rad).1 - by_difference).abs() < 1e-5);
        }

        #[test]
        fn quarters_are_near_and_alike(angle_rad in -9.0_f64..9.0, n in -4_i32..5) {
            let near = quarter(angle_rad);
            prop_assert!((-PI / 4.0..PI / 4.0).contains(&near), "{near}");
            let again = quarter(angle_rad + f64::from(n) * FRAC_PI_2);
            prop_assert!(quarter(near - again).abs() < 1e-9, "{near} and {again}");
        }
    }
}
