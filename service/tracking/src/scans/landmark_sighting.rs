//! What a robot saw of landmarks that have names.

use meetpoint_geometry::Point2;

/// A landmark seen along a travel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LandmarkSighting {
    /// Place among the travel's scans of the one at whose moment it was seen, or before it.
    pub scan: usize,
    /// Where, from the robot as it stood at that scan, in metres.
    pub robot_from_landmark: Point2<f64>,
    /// Which: sightings with the same number, of whatever travel, are said to be of one landmark. They
    /// may be wrong about it.
    pub landmark: usize,
    /// Standard deviation of the place along each axis, in metres.
    pub std_m: f64,
}

/// No sighting is surer, in metres: robots are as long as that, and detectors not at their centres.
const STD_MIN_M: f64 = 0.05;
/// Nothing is seen farther off than this, in metres, and nothing said that is less sure.
const FARTHEST_M: f64 = 1000.0;

impl LandmarkSighting {
    /// The same with a deviation that can be; `None` if it says nothing of any of `n_scans` scans.
    pub(crate) fn checked(self, n_scans: usize) -> Option<Self> {
        let is_near = self.robot_from_landmark.coords.norm() <= FARTHEST_M;
        let is_sure = 0.0 < self.std_m && self.std_m <= FARTHEST_M;
        (self.scan < n_scans && is_near && is_sure)
            .then(|| Self { std_m: self.std_m.max(STD_MIN_M), ..self })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_says_nothing_is_left_out() {
        let seen = LandmarkSighting {
            scan: 2,
            robot_from_landmark: Point2::new(3.0, -1.0),
            landmark: 7,
            std_m: 0.2,
        };
        assert_eq!(seen.checked(3), Some(seen), "as it is");
        assert_eq!(seen.checked(2), None, "of no scan");
        for x_m in [f64::NAN, f64::INFINITY, 1e300] {
            let far = LandmarkSighting { robot_from_landmark: Point2::new(x_m, 0.0), ..seen };
            assert_eq!(far.checked(3), None, "{x_m} m off");
        }
        for std_m in [f64::NAN, f64::INFINITY, 0.0, -1.0] {
            assert_eq!(LandmarkSighting { std_m, ..seen }.checked(3), None, "{std_m} m");
        }
        let sure = LandmarkSighting { std_m: 1e-9, ..seen }.checked(3);
        assert_eq!(sure.map(|seen| seen.std_m), Some(STD_MIN_M), "not as sure as that");
    }
}
