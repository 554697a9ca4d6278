//! What finds landmarks: a person with a button, or a detector with range and bearing.

use meetpoint_geometry::{Pose, wrap_angle};
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;

use crate::landmark_travel::{Landmark, TrueSighting};

/// A detector that measures range and bearing at every moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LandmarkDetector {
    /// How far it sees, in metres.
    pub range_max_m: f64,
    /// Half of its field of view, in radians, in (0, π].
    pub half_field_of_view_rad: f64,
    /// Standard deviation of the range, in metres for a metre of range.
    pub range_std_per_m: f64,
    /// Standard deviation of the bearing, in radians.
    pub bearing_std_rad: f64,
}

/// How landmarks are sighted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sense {
    /// A person presses a button when the robot drives over a landmark: range and bearing are 0.
    Button,
    /// A detector on the robot.
    Detector(LandmarkDetector),
}

/// How landmarks are sighted, and how that fails.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LandmarkSensor {
    /// What sights them.
    pub sense: Sense,
    /// Share of sightings that are missed, in [0, 1].
    pub miss_share: f64,
    /// Share of sightings that look like a landmark of another type, in [0, 1].
    pub wrong_type_share: f64,
    /// Types there are; with fewer than 2 none can be taken for another.
    pub n_types: u32,
}

impl LandmarkSensor {
    /// A button that is always pressed, landmarks all alike: the paper's most difficult case.
    pub const BUTTON: Self =
        Self { sense: Sense::Button, miss_share: 0.0, wrong_type_share: 0.0, n_types: 1 };

    /// The sighting of landmark `index` by a robot at `truth`, if it is sighted. `is_upon` says
    /// that the robot drives over it at this moment.
    pub(crate) fn sighting(
        &self,
        (index, landmark): (usize, Landmark),
        truth: Pose,
        is_upon: bool,
        rng: &mut impl Rng,
    ) -> Option<TrueSighting> {
        let (range_m, bearing_rad) = match self.sense {
            Sense::Button => is_upon.then_some((0.0, 0.0))?,
            Sense::Detector(detector) => detector.measurement(landmark, truth, rng)?,
        };
        let is_missed = rng.random::<f64>() < self.miss_share;
        let landmark_type = self.seen_type(landmark.landmark_type, rng);
        (!is_missed).then_some(TrueSighting {
            landmark: index,
            landmark_type,
            range_m,
            bearing_rad,
        })
    }

    fn seen_type(&self, true_type: u32, rng: &mut impl Rng) -> u32 {
        if self.n_types < 2 || self.wrong_type_share <= rng.random::<f64>() {
            return true_type;
        }
        (true_type + rng.random_range(1..self.n_types)) % self.n_types
    }
}

impl LandmarkDetector {
    /// Range in metres and bearing in radians as measured; `None` outside the field of view.
    fn measurement(
        &self,
        landmark: Landmark,
        truth: Pose,
        rng: &mut impl Rng,
    ) -> Option<(f64, f64)> {
        let seen = truth.inverse() * landmark.position;
        let (range_m, bearing_rad) = (seen.x.hypot(seen.y), seen.y.atan2(seen.x));
        if self.range_max_m < range_m || self.half_field_of_view_rad < bearing_rad.abs() {
            return None;
        }
        let mut normal = || rng.sample::<f64, _>(StandardNormal);
        let measured_m = range_m * (1.0 + self.range_std_per_m * normal()).max(0.0);
        Some((measured_m, wrap_angle(bearing_rad + self.bearing_std_rad * normal())))
    }
}
