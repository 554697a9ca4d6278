//! Position and heading in the plane, which is also the transform between two frames.

use std::ops::Mul;

use nalgebra::{Point2, Vector2};

use crate::angle::wrap_angle;

/// Where something is and which way it faces, seen from a frame: metres and radians, x forward,
/// y left, counter-clockwise (REP 103).
///
/// A pose is also the transform into that frame: `map_from_robot` is the robot's pose in the map
/// and takes points from the robot's frame to the map's. Transforms compose by `*`:
/// `map_from_robot * robot_from_laser`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Metres along the frame's x axis.
    pub x_m: f64,
    /// Metres along the frame's y axis.
    pub y_m: f64,
    /// Heading from the frame's x axis. Invariant of [`Pose::new`] and `*`: in (−π, π].
    pub theta_rad: f64,
}

impl Pose {
    /// The frame's own origin and heading.
    pub const IDENTITY: Self = Self { x_m: 0.0, y_m: 0.0, theta_rad: 0.0 };

    /// A pose from metres and a heading of any number of turns.
    #[must_use]
    pub fn new(x_m: f64, y_m: f64, theta_rad: f64) -> Self {
        Self { x_m, y_m, theta_rad: wrap_angle(theta_rad) }
    }

    /// The way back: `robot_from_map` of `map_from_robot`.
    #[must_use]
    pub fn inverse(self) -> Self {
        let (sin, cos) = self.theta_rad.sin_cos();
        Self::new(
            -(cos * self.x_m + sin * self.y_m),
            sin * self.x_m - cos * self.y_m,
            -self.theta_rad,
        )
    }

    /// The step that leads from this pose to `later`, seen from this pose.
    #[must_use]
    pub fn step_to(self, later: Self) -> Self {
        self.inverse() * later
    }

    /// Where the frame's origin sits.
    #[must_use]
    pub fn position(self) -> Point2<f64> {
        Point2::new(self.x_m, self.y_m)
    }

    /// Distance from the origin, in metres.
    #[must_use]
    pub fn distance_m(self) -> f64 {
        self.x_m.hypot(self.y_m)
    }

    /// True if all three numbers are finite.
    #[must_use]
    pub fn is_finite(self) -> bool {
        self.x_m.is_finite() && self.y_m.is_finite() && self.theta_rad.is_finite()
    }

    /// The pose a share `t` of the way to `later`: position on the straight line, heading by the
    /// shorter turn. 0 is here, 1 is `later`; beyond them it extrapolates.
    #[must_use]
    pub fn interpolate(self, later: Self, t: f64) -> Self {
        Self::new(
            self.x_m + t * (later.x_m - self.x_m),
            self.y_m + t * (later.y_m - self.y_m),
            self.theta_rad + t * wrap_angle(later.theta_rad - self.theta_rad),
        )
    }
}

impl Mul for Pose {
    type Output = Pose;

    fn mul(self, inner: Pose) -> Pose {
        let point = self * inner.position();
        Pose::new(point.x, point.y, self.theta_rad + inner.theta_rad)
    }
}

impl Mul<Point2<f64>> for Pose {
    type Output = Point2<f64>;

    fn mul(self, point: Point2<f64>) -> Point2<f64> {
        let (sin, cos) = self.theta_rad.sin_cos();
        let turned = Vector2::new(cos * point.x - sin * point.y, sin * point.x + cos * point.y);
        self.position() + turned
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn pose() -> impl Strategy<Value = Pose> {
        (-50.0_f64..50.0, -50.0_f64..50.0, -4.0_f64..4.0).prop_map(|(x, y, t)| Pose::new(x, y, t))
    }

    fn close(a: Pose, b: Pose) -> bool {
        (a.x_m - b.x_m).abs() < 1e-9
            && (a.y_m - b.y_m).abs() < 1e-9
            && wrap_angle(a.theta_rad - b.theta_rad).abs() < 1e-9
    }

    proptest! {
        #[test]
        fn inverse_undoes(a in pose()) {
            prop_assert!(close(a * a.inverse(), Pose::IDENTITY));
            prop_assert!(close(a.inverse() * a, Pose::IDENTITY));
        }

        #[test]
        fn products_associate(a in pose(), b in pose(), c in pose()) {
            prop_assert!(close((a * b) * c, a * (b * c)));
        }

        #[test]
        fn a_step_leads_there(a in pose(), b in pose()) {
            prop_assert!(close(a * a.step_to(b), b));
        }

        #[test]
        fn interpolation_meets_both_ends(a in pose(), b in pose()) {
            prop_assert!(close(a.interpolate(b, 0.0), a));
            prop_assert!(close(a.interpolate(b, 1.0), b));
        }
    }
}
