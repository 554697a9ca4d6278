//! Systematic errors of a robot's odometry, and their correction.

use meetpoint_geometry::Pose;

/// What has to be done to a measured step to undo the steady part of its error.
///
/// A step that was measured as a length `l` and a turn `a` is taken to be
///
/// ```text
/// length   l scale
/// turn     a (1 + turn_per_rad)  +  l scale turn_per_m
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    /// True metres for a measured metre.
    pub scale: f64,
    /// Radians to be added for every metre driven.
    pub turn_per_m: f64,
    /// Radians to be added for every radian turned.
    pub turn_per_rad: f64,
}

impl Calibration {
    /// Odometry that is right on average.
    pub const NONE: Self = Self { scale: 1.0, turn_per_m: 0.0, turn_per_rad: 0.0 };

    /// A measured step, corrected; what is added to its turn happens evenly along it.
    pub fn corrected(&self, step: Pose) -> Pose {
        let length_m = step.distance_m() * self.scale;
        let turn_rad = step.theta_rad * self.turn_per_rad + length_m * self.turn_per_m;
        let (sin, cos) = (turn_rad / 2.0).sin_cos();
        let (x_m, y_m) = (step.x_m * self.scale, step.y_m * self.scale);
        Pose::new(cos * x_m - sin * y_m, sin * x_m + cos * y_m, step.theta_rad + turn_rad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_line_bends_by_the_drift() {
        let calibration = Calibration { scale: 1.1, turn_per_m: 0.1, turn_per_rad: 0.0 };
        let mut pose = Pose::IDENTITY;
        for _ in 0..100 {
            pose = pose * calibration.corrected(Pose::new(0.1, 0.0, 0.0));
        }
        // An arc of 11 m with a radius of 10 m.
        let expected = Pose::new(10.0 * 1.1_f64.sin(), 10.0 * (1.0 - 1.1_f64.cos()), 1.1);
        assert!((pose.position() - expected.position()).norm() < 1e-3, "{pose:?}");
        assert!((pose.theta_rad - expected.theta_rad).abs() < 1e-9, "{pose:?}");
    }

    #[test]
    fn a_turn_on_the_spot_grows_by_its_share() {
        let calibration = Calibration { scale: 1.0, turn_per_m: 0.3, turn_per_rad: 0.1 };
        let corrected = calibration.corrected(Pose::new(0.0, 0.0, 1.0));
        assert!((corrected.theta_rad - 1.1).abs() < 1e-12, "{corrected:?}");
    }
}
