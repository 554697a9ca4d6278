//! Dead reckoning that drifts as wheels do.
//!
//! A true step of length `d` with a turn `a` is measured as
//!
//! ```text
//! length   scale d  +  e,      e ~ N(0, distance_std² d)
//! turn     a (1 + drift_per_rad)  +  d drift_per_m  +  e,   e ~ N(0, heading_std² d + turn_std² |a|)
//! ```
//!
//! Variances, not deviations, grow with the motion, so that the error of a drive does not depend
//! on how finely it is cut into steps.

use meetpoint_geometry::Pose;
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;

/// How odometry errs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OdometryError {
    /// Metres measured for a metre driven; 1 is right.
    pub scale: f64,
    /// Radians gained with every metre driven: one wheel larger than the other.
    pub drift_rad_per_m: f64,
    /// Radians gained with every radian turned: the wheels' distance taken too small.
    pub drift_rad_per_rad: f64,
    /// Standard deviation of the length measured for one metre, in metres.
    pub distance_std_m: f64,
    /// Standard deviation of the heading after one metre, in radians.
    pub heading_std_rad: f64,
    /// Standard deviation of the heading after a turn of one radian, in radians.
    pub turn_std_rad: f64,
}

impl OdometryError {
    /// Odometry that never errs.
    pub const NONE: Self = Self {
        scale: 1.0,
        drift_rad_per_m: 0.0,
        drift_rad_per_rad: 0.0,
        distance_std_m: 0.0,
        heading_std_rad: 0.0,
        turn_std_rad: 0.0,
    };

    /// Wheels that were never calibrated: 2 % too long, a degree of drift in four metres, 3 % of
    /// every turn. About what the worse of the classic indoor logs show.
    pub const UNCALIBRATED: Self = Self {
        scale: 1.02,
        drift_rad_per_m: 0.004,
        drift_rad_per_rad: 0.03,
        distance_std_m: 0.01,
        heading_std_rad: 0.008,
        turn_std_rad: 0.02,
    };
}

/// The counter of a robot's wheels.
#[derive(Clone, Debug)]
pub struct Odometer {
    error: OdometryError,
    odometry_from_robot: Pose,
}

impl Odometer {
    /// A counter that stands at the origin of its own frame.
    pub fn new(error: OdometryError) -> Self {
        Self { error, odometry_from_robot: Pose::IDENTITY }
    }

    /// The pose by dead reckoning, in the odometry frame.
    pub fn odometry_from_robot(&self) -> Pose {
        self.odometry_from_robot
    }

    /// Counts a true step, seen from the robot before it.
    pub fn count(&mut self, step: Pose, rng: &mut impl Rng) {
        let error = &self.error;
        let length_m = step.distance_m();
        let turn_rad = step.theta_rad;
        let mut normal = || rng.sample::<f64, _>(StandardNormal);
        let stretch =
            error.scale + ratio(error.distance_std_m * length_m.sqrt(), length_m) * normal();
        let turn_std_rad = (error.heading_std_rad.powi(2) * length_m
            + error.turn_std_rad.powi(2) * turn_rad.abs())
        .sqrt();
        let measured_turn_rad = turn_rad * (1.0 + error.drift_rad_per_rad)
            + length_m * error.drift_rad_per_m
            + turn_std_rad * normal();
        let measured = Pose::new(stretch * step.x_m, stretch * step.y_m, measured_turn_rad);
        self.odometry_from_robot = self.odometry_from_robot * measured;
    }
}

/// `part / whole`, 0 for a step of no length.
fn ratio(part: f64, whole: f64) -> f64 {
    if whole == 0.0 { 0.0 } else { part / whole }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    /// The pose measured after 10 m straight on, in `n_steps`, and then a turn of 1 rad.
    fn measured(error: OdometryError, n_steps: u32, seed: u64) -> Pose {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut odometer = Odometer::new(error);
        for _ in 0..n_steps {
            odometer.count(Pose::new(10.0 / f64::from(n_steps), 0.0, 0.0), &mut rng);
        }
        odometer.count(Pose::new(0.0, 0.0, 1.0), &mut rng);
        odometer.odometry_from_robot()
    }

    #[test]
    fn without_error_it_is_the_truth() {
        let pose = measured(OdometryError::NONE, 1000, 1);
        assert!((pose.x_m - 10.0).abs() < 1e-9, "{} m", pose.x_m);
        assert!((pose.theta_rad - 1.0).abs() < 1e-12, "{} rad", pose.theta_rad);
    }

    #[test]
    fn drifts_as_set() {
        let error =
            OdometryError { drift_rad_per_m: 0.01, drift_rad_per_rad: 0.1, ..OdometryError::NONE };
        let pose = measured(error, 100, 1);
        assert!((pose.theta_rad - 1.2).abs() < 1e-9, "0.1 from the metres, 0.1 from the turn");
        let stretched = measured(OdometryError { scale: 1.03, ..OdometryError::NONE }, 100, 1);
        assert!((stretched.x_m - 10.3).abs() < 1e-9, "{} m", stretched.x_m);
    }

    #[test]
    fn random_error_does_not_depend_on_the_steps() {
        let error = OdometryError {
            distance_std_m: 0.02,
            heading_std_rad: 0.01,
            turn_std_rad: 0.03,
            ..OdometryError::NONE
        };
        for n_steps in [1, 50] {
            let poses: Vec<Pose> = (0..2000).map(|seed| measured(error, n_steps, seed)).collect();
            let std = |of: &dyn Fn(&Pose) -> f64| {
                (poses.iter().map(|pose| of(pose).powi(2)).sum::<f64>() / 2000.0).sqrt()
            };
            let length_std_m = std(&|pose| pose.distance_m() - 10.0);
            let expected_m = 0.02 * 10.0_f64.sqrt();
            assert!((length_std_m / expected_m - 1.0).abs() < 0.1, "{length_std_m} m");
            let heading_std_rad = std(&|pose| pose.theta_rad - 1.0);
            let expected_rad = (10.0 * 0.01_f64.powi(2) + 0.03_f64.powi(2)).sqrt();
            assert!((heading_std_rad / expected_rad - 1.0).abs() < 0.1, "{heading_std_rad} rad");
        }
    }
}
