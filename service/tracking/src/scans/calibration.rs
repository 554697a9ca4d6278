//! What the odometry is to be corrected by, from the steps that scans are sure of.
//!
//! ```text
//! step by scans = E S E^-1
//! position of S = length_scale * position by odometry
//! turn of S     = turn_scale * turn by odometry + turn_per_m * length by odometry
//! ```
//!
//! with E the frame whose motion odometry tells, seen from the robot's, in which lasers are declared: not the
//! same where a laser sits or looks elsewhere than declared. First the scales as if it were, then E and the
//! scale of lengths, in which positions are linear: the scale turned by the heading of E, and the position of
//! E. By weighted least squares with a prior about 1 and nothing; steps that disagree by many deviations,
//! where wheels slip or scans were matched wrongly, lose their weight (Geman and `McClure`, iterated).
//! After A. Censi, A. Franchi, L. Marchionni, G. Oriolo, "Simultaneous calibration of odometry and sensor
//! parameters for mobile robots", IEEE Transactions on Robotics 29 (2013), with steps in place of wheels.
//! Time O(steps).

use meetpoint_geometry::{Pose, angle_between};
use nalgebra::{Matrix2, Matrix2x4, Matrix3, Matrix4, Vector2, Vector4};

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
    /// The frame whose motion odometry tells, seen from the robot's frame, in which lasers are declared. A
    /// laser declared at D sits at the inverse of this times D.
    pub robot_from_wheels: Pose,
}

impl Calibration {
    /// Odometry is right.
    pub const NONE: Self = Self {
        length_scale: 1.0,
        turn_scale: 1.0,
        turn_per_m: 0.0,
        robot_from_wheels: Pose::IDENTITY,
    };

    /// A step of the odometry as the robot made it in truth.
    pub(crate) fn applied(&self, step: Pose) -> Pose {
        if self.is_elsewhere() {
            self.robot_from_wheels * self.scaled(step) * self.robot_from_wheels.inverse()
        } else {
            self.scaled(step)
        }
    }

    /// Whether lasers are so far from where they are declared that odometry is to be read by it: less is no
    /// worse than what steps are off.
    fn is_elsewhere(&self) -> bool {
        PLACE_OFF_MIN_M < self.robot_from_wheels.distance_m()
            || HEADING_OFF_MIN_RAD < self.robot_from_wheels.theta_rad.abs()
    }

    /// A step of the odometry as the frame that it tells of made it in truth.
    fn scaled(&self, step: Pose) -> Pose {
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
/// The same of where lasers look and sit: 6 degrees, and 0.2 m.
const HEADING_STD_RAD: f64 = 0.1;
const PLACE_STD_M: f64 = 0.2;
/// Lasers that are off by less are as declared: 5 cm and 2 degrees.
const PLACE_OFF_MIN_M: f64 = 0.05;
const HEADING_OFF_MIN_RAD: f64 = 0.035;
/// Square of a residual in deviations at which a step is half doubted.
const CHI2_TURN: f64 = 9.0;
/// Rounds of weighing.
const N_ROUNDS: u32 = 5;
/// What is added to the information of a step, so that it has a covariance: a metre, a radian.
const INFORMATION_MIN: f64 = 1.0;

/// The calibration by some steps: odometry's, and those of the scans.
pub(crate) fn calibration(steps: &[(Pose, ScannedStep)]) -> Calibration {
    let mut scaled = Calibration::NONE;
    for _ in 0..N_ROUNDS {
        scaled = weighed(steps, &scaled);
    }
    let mut placed = scaled;
    for _ in 0..N_ROUNDS {
        placed = placed_by(steps, &placed);
    }
    if placed.is_elsewhere() {
        placed
    } else {
        Calibration { robot_from_wheels: placed.robot_from_wheels, ..scaled }
    }
}

/// The scales, as if lasers were as declared.
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
    let length_scale = products / squares;
    Calibration { length_scale, turn_scale: turn.x, turn_per_m: turn.y, ..*now }
}

/// The scale of lengths, and where lasers are.
fn placed_by(steps: &[(Pose, ScannedStep)], now: &Calibration) -> Calibration {
    // Scale times cosine and sine of the heading; x and y.
    let prior = Vector4::new(LENGTH_SCALE_STD, HEADING_STD_RAD, PLACE_STD_M, PLACE_STD_M)
        .map(|std| std.powi(-2));
    let right = Vector4::new(1.0, 0.0, 0.0, 0.0);
    let (mut hessian, mut target) = (Matrix4::from_diagonal(&prior), Vector4::zeros());
    let wheels = now.robot_from_wheels;
    for (odometry, step) in steps {
        let information = step.information + Matrix3::identity() * INFORMATION_MIN;
        let Some(covariance) = information.try_inverse() else { continue };
        let of_place =
            covariance.fixed_view::<2, 2>(0, 0) + Matrix2::identity() * STEP_STD_M * STEP_STD_M;
        let Some(information) = of_place.try_inverse() else { continue };
        let corrected = wheels * now.scaled(*odometry) * wheels.inverse();
        let seen = step.by_scans.position().coords;
        let away = seen - corrected.position().coords;
        let chi2 = away.dot(&(information * away));
        let believed = information * (CHI2_TURN / (CHI2_TURN + chi2)).powi(2);
        let row = place_row(*odometry, step.by_scans.theta_rad);
        hessian += row.transpose() * believed * row;
        target += row.transpose() * believed * (seen - row * right);
    }
    let off = hessian.try_inverse().map(|inverse| inverse * target);
    let place = right + off.unwrap_or_default();
    Calibration {
        length_scale: place.x.hypot(place.y),
        robot_from_wheels: Pose::new(place.z, place.w, place.y.atan2(place.x)),
        ..*now
    }
}

/// Derivative of a step's position by scale times cosine and sine of the heading, and by x and y.
fn place_row(odometry: Pose, turn_rad: f64) -> Matrix2x4<f64> {
    let (x, y) = (odometry.x_m, odometry.y_m);
    let (sin, cos) = turn_rad.sin_cos();
    Matrix2x4::new(x, -y, 1.0 - cos, sin, y, x, -sin, 1.0 - cos)
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
        let truth = Calibration {
            length_scale: 0.97,
            turn_scale: 1.04,
            turn_per_m: -0.01,
            robot_from_wheels: Pose::new(-0.15, 0.1, 0.06),
        };
        let found = calibration(&steps(&truth));
        assert!((found.length_scale - truth.length_scale).abs() < 0.002, "{found:?}");
        assert!((found.turn_scale - truth.turn_scale).abs() < 0.004, "{found:?}");
        assert!((found.turn_per_m - truth.turn_per_m).abs() < 0.004, "{found:?}");
        let off = truth.robot_from_wheels.step_to(found.robot_from_wheels);
        assert!(off.distance_m() < 0.01 && off.theta_rad.abs() < 0.004, "{found:?}");
    }

    #[test]
    fn believes_the_odometry_where_scans_say_nothing() {
        let silent = |(odometry, step): (Pose, ScannedStep)| {
            (odometry, ScannedStep { information: Matrix3::zeros(), ..step })
        };
        let truth = Calibration { length_scale: 0.5, ..Calibration::NONE };
        let found =
            calibration(&steps(&truth).into_iter().take(20).map(silent).collect::<Vec<_>>());
        assert!((found.length_scale - 1.0).abs() < 0.02, "{found:?}");
        assert_eq!(calibration(&[]), Calibration::NONE, "nothing was seen");
    }
}
