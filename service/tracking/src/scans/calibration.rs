//! Scale of the odometry, from the steps that scans are sure of.
//!
//! ```text
//! length by scans = length_scale * length by odometry
//! turn by scans   = turn_scale * turn by odometry + turn_per_m * length by odometry
//! ```
//!
//! by weighted least squares with a prior about 1, 1 and 0; steps that disagree by many deviations,
//! where wheels slip or scans were matched wrongly, lose their weight (Geman and `McClure`, iterated).
//! Time O(steps).

use meetpoint_geometry::{Pose, angle_between};
use nalgebra::{Matrix2, Matrix3, Vector2};

use crate::scans::chain::ScannedStep;

/// What odometry is to be corrected by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    /// True metres for each metre of the odometry.
    pub length_scale: f64,
    /// True radians for each radian of the odometry.
    pub turn_scale: f64,
    /// Radians turned in truth for each metre of the odometry, beyond what it says.
    pub turn_per_m: f64,
}

impl Calibration {
    /// Odometry is right.
    pub const NONE: Self = Self { length_scale: 1.0, turn_scale: 1.0, turn_per_m: 0.0 };

    /// A step of the odometry as it was in truth.
    pub(crate) fn applied(&self, step: Pose) -> Pose {
        let length_m = step.distance_m();
        Pose::new(
            self.length_scale * step.x_m,
            self.length_scale * step.y_m,
            self.turn_scale * step.theta_rad + self.turn_per_m * length_m,
        )
    }
}

/// Deviation of a step's length and turn about what the scale says: slip.
const STEP_STD_M: f64 = 0.02;
const STEP_STD_RAD: f64 = 0.02;
/// Deviations of the scales before anything is known: 5 %, 10 %, and a degree for two metres.
const LENGTH_SCALE_STD: f64 = 0.05;
const TURN_SCALE_STD: f64 = 0.1;
const TURN_PER_M_STD: f64 = 0.01;
/// Square of a residual in deviations at which a step is half doubted.
const CHI2_TURN: f64 = 9.0;
/// Rounds of weighing.
const N_ROUNDS: u32 = 5;
/// What is added to the information of a step, so that it has a covariance: a metre, a radian.
const INFORMATION_MIN: f64 = 1.0;

/// The calibration by some steps: odometry's, and those of the scans.
pub(crate) fn calibration(steps: &[(Pose, ScannedStep)]) -> Calibration {
    let mut found = Calibration::NONE;
    for _ in 0..N_ROUNDS {
        found = weighed(steps, &found);
    }
    found
}

fn weighed(steps: &[(Pose, ScannedStep)], now: &Calibration) -> Calibration {
    let prior = LENGTH_SCALE_STD.powi(-2);
    let (mut squares, mut products) = (prior, prior);
    let turn_prior = Vector2::new(TURN_SCALE_STD.powi(-2), TURN_PER_M_STD.powi(-2));
    let mut hessian = Matrix2::from_diagonal(&turn_prior);
    let mut target = Vector2::new(turn_prior.x, 0.0);
    for (odometry, step) in steps {
        let information = step.information + Matrix3::identity() * INFORMATION_MIN;
        let Some(covariance) = information.try_inverse() else { continue };
        let corrected = now.applied(*odometry);
        let length_m = odometry.distance_m();
        if length_m > 0.0 {
            let (x, y) = (odometry.x_m / length_m, odometry.y_m / length_m);
            let variance = x * x * covariance[(0, 0)]
                + 2.0 * x * y * covariance[(0, 1)]
                + y * y * covariance[(1, 1)]
                + STEP_STD_M * STEP_STD_M;
            let seen_m = x * step.by_scans.x_m + y * step.by_scans.y_m;
            let weight = weight(seen_m - corrected.distance_m(), variance);
            squares += weight * length_m * length_m;
            products += weight * length_m * seen_m;
        }
        let variance = covariance[(2, 2)] + STEP_STD_RAD * STEP_STD_RAD;
        let error_rad = angle_between(corrected.theta_rad, step.by_scans.theta_rad);
        let weight = weight(error_rad, variance);
        let row = Vector2::new(odometry.theta_rad, length_m);
        let seen_rad = now.turn_scale * row.x + now.turn_per_m * row.y + error_rad;
        hessian += row * row.transpose() * weight;
        target += row * (seen_rad * weight);
    }
    let turn = hessian.try_inverse().map_or(Vector2::new(1.0, 0.0), |inverse| inverse * target);
    Calibration { length_scale: products / squares, turn_scale: turn.x, turn_per_m: turn.y }
}

/// Weight of a residual of that variance.
fn weight(error: f64, variance: f64) -> f64 {
    let chi2 = error * error / variance;
    (CHI2_TURN / (CHI2_TURN + chi2)).powi(2) / variance
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps of all kinds, as scans have them, and with odometry that errs; every tenth slips.
    fn steps(truth: &Calibration) -> Vec<(Pose, ScannedStep)> {
        (0..200)
            .map(|i| {
                let (length_m, turn_rad) = (0.3 * f64::from(i % 3), 0.2 * f64::from(i % 5 - 2));
                let odometry = Pose::new(length_m, 0.0, turn_rad);
                let slips = i % 10 == 0;
                let by_scans =
                    if slips { Pose::new(0.0, 0.1, 0.9) } else { truth.applied(odometry) };
                let information = Matrix3::identity() * 1e4;
                (odometry, ScannedStep { by_scans, information, doubt: Matrix3::zeros() })
            })
            .collect()
    }

    #[test]
    fn finds_the_scale_although_wheels_slip() {
        let truth = Calibration { length_scale: 0.97, turn_scale: 1.04, turn_per_m: -0.01 };
        let found = calibration(&steps(&truth));
        assert!((found.length_scale - truth.length_scale).abs() < 0.002, "{found:?}");
        assert!((found.turn_scale - truth.turn_scale).abs() < 0.004, "{found:?}");
        assert!((found.turn_per_m - truth.turn_per_m).abs() < 0.004, "{found:?}");
    }

    #[test]
    fn believes_the_odometry_where_scans_say_nothing() {
        let silent = |(odometry, step): (Pose, ScannedStep)| {
            (odometry, ScannedStep { information: Matrix3::zeros(), ..step })
        };
        let truth = Calibration { length_scale: 0.5, turn_scale: 1.0, turn_per_m: 0.0 };
        let found =
            calibration(&steps(&truth).into_iter().take(20).map(silent).collect::<Vec<_>>());
        assert!((found.length_scale - 1.0).abs() < 0.02, "{found:?}");
        assert_eq!(calibration(&[]), Calibration::NONE, "nothing was seen");
    }
}
