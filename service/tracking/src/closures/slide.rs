//! Slides: what a match leaves open along a line, as along a bare corridor.
//!
//! Rivals of a match say that one of several places is right and the others are wrong. If all lie on a
//! line, one thing is certain whichever is right: where the submap lies across that line, and its
//! heading. A match says this much when its covariance is open along the line.

use meetpoint_geometry::{Pose, wrap_angle};
use nalgebra::{Matrix3, Vector3};

/// A line is straight to this, in metres: two cells...
const ASIDE_MAX_M: f64 = 0.1;
/// ...and radians: two steps of the headings.
const TURN_MAX_RAD: f64 = 0.035;
/// Deviation of what is not known, in metres: larger than what any way errs by, so that it pulls
/// nothing.
pub(crate) const OPEN_STD_M: f64 = 100.0;

/// The line along which a match is open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Slide {
    /// Its direction in the frame that the match is seen from, as covariances of matches are.
    axis: Vector3<f64>,
}

impl Slide {
    /// The line on which a match and all its rivals lie, if there is one.
    pub(crate) fn through(pose: Pose, rivals: impl Iterator<Item = Pose>) -> Option<Self> {
        let shift = |rival: Pose| {
            let turn_rad = wrap_angle(rival.theta_rad - pose.theta_rad);
            Vector3::new(rival.x_m - pose.x_m, rival.y_m - pose.y_m, turn_rad)
        };
        let shifts: Vec<Vector3<f64>> = rivals.map(shift).collect();
        let length_m = |shift: &Vector3<f64>| shift.x.hypot(shift.y);
        let farthest = shifts.iter().max_by(|a, b| length_m(a).total_cmp(&length_m(b)))?;
        let axis = Vector3::new(farthest.x, farthest.y, 0.0).try_normalize(ASIDE_MAX_M)?;
        let is_on = |shift: &Vector3<f64>| {
            let aside_m = axis.x * shift.y - axis.y * shift.x;
            aside_m.abs() <= ASIDE_MAX_M && shift.z.abs() <= TURN_MAX_RAD
        };
        shifts.iter().all(is_on).then_some(Self { axis })
    }

    /// A match's covariance, open along the line.
    pub(crate) fn open(&self, covariance: &Matrix3<f64>) -> Matrix3<f64> {
        covariance + self.axis * self.axis.transpose() * OPEN_STD_M.powi(2)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    #[test]
    fn rivals_along_a_corridor_leave_it_open_and_nothing_else() {
        let pose = Pose::new(3.0, 1.0, FRAC_PI_2);
        let rivals = [(-1.0, 0.02), (0.6, 0.0), (2.4, -0.03)];
        let rivals = rivals.map(|(x_m, y_m)| pose * Pose::new(x_m, y_m, 0.01));
        let slide = Slide::through(pose, rivals.into_iter()).expect("they lie on a line");
        let open = slide.open(&(Matrix3::identity() * 1e-4));
        assert!(
            90.0 < open[(1, 1)].sqrt(),
            "along, which is upwards from where it is seen: {open}"
        );
        assert!(open[(0, 0)].sqrt() < 2.0 && open[(2, 2)].sqrt() < 0.02, "across: {open}");
    }

    #[test]
    fn rivals_around_a_corner_or_turned_leave_more_open() {
        let rivals = |other: Pose| [Pose::new(2.0, 0.0, 0.0), other].into_iter();
        let slide = |other: Pose| Slide::through(Pose::IDENTITY, rivals(other));
        assert_eq!(slide(Pose::new(0.0, 2.0, 0.0)), None, "around a corner");
        assert_eq!(slide(Pose::new(-1.0, 0.0, 0.2)), None, "turned");
        assert_eq!(Slide::through(Pose::IDENTITY, std::iter::empty()), None, "no rival at all");
    }
}
