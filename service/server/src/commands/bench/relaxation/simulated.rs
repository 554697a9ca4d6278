//! Simulated travels as relaxation takes them, with the truth beside.

use std::f64::consts::PI;

use meetpoint_geometry::{Point2, Pose};
use meetpoint_relaxation::{Detector, Motion, Sighting, Step, Travel};
use meetpoint_sim::{LandmarkTravel, Stage};

/// A step after so many metres without a sighting (TBF98 section 5).
const STEP_M: f64 = 20.0;
/// A button is pressed upon a landmark.
const BUTTON: Detector = Detector { range_max_m: 0.0, half_field_of_view_rad: PI };

/// What a robot knows of its travel, and the truth.
pub(super) struct Simulated {
    /// What it knows.
    pub(super) travel: Travel,
    /// Which landmark each sighting truly is of.
    pub(super) truth: Vec<usize>,
    /// Where it truly was at every step, seen from its start.
    pub(super) poses: Vec<Pose>,
    /// Where landmarks truly are, by their indices, seen from the robot's start.
    pub(super) landmarks: Vec<Point2<f64>>,
    /// Controls that it was driven by.
    pub(super) n_controls: usize,
    /// How far off dead reckoning ends, in metres.
    pub(super) reckoned_off_m: f64,
}

impl Simulated {
    /// A travel, cut into steps.
    pub(super) fn of(simulated: &LandmarkTravel) -> Self {
        let start = simulated.moments[0].truth;
        let (mut steps, mut poses, mut truth) = (Vec::new(), Vec::new(), Vec::new());
        for Stage { legs, end } in simulated.stages(STEP_M) {
            let sightings = end.sightings.iter().map(|seen| Sighting {
                identity: None,
                landmark_type: seen.landmark_type,
                range_m: seen.range_m,
                bearing_rad: seen.bearing_rad,
            });
            steps.push(Step { motion: Motion::new(legs), sightings: sightings.collect() });
            poses.push(start.step_to(end.truth));
            truth.extend(end.sightings.iter().map(|seen| seen.landmark));
        }
        let from_start = |position: Point2<f64>| start.inverse() * position;
        Self {
            travel: Travel { detector: BUTTON, steps },
            truth,
            poses,
            landmarks: simulated.landmarks.iter().map(|known| from_start(known.position)).collect(),
            n_controls: simulated.n_controls(),
            reckoned_off_m: simulated.final_error_m(),
        }
    }

    /// Landmarks that are seen at all.
    pub(super) fn n_landmarks_seen(&self) -> usize {
        let mut seen = self.truth.clone();
        seen.sort_unstable();
        seen.dedup();
        seen.len()
    }
}

#[cfg(test)]
mod tests {
    use meetpoint_sim::first_data_set;

    use super::*;

    #[test]
    fn nothing_is_lost_in_cutting() {
        let whole = first_data_set(0);
        let cut = Simulated::of(&whole);
        assert_eq!(cut.travel.n_sightings(), whole.n_sightings(), "all sightings");
        assert_eq!((cut.truth.len(), cut.n_landmarks_seen()), (27, 13), "as its docs say");
        assert_eq!(cut.poses.len(), cut.travel.steps.len(), "a truth a step");
        let n_legs = cut.travel.steps.iter().map(|step| step.motion.legs().len()).sum::<usize>();
        assert_eq!(n_legs, whole.n_controls(), "all of the way");
        assert!(cut.poses[0].position().coords.norm() < 1e-12, "from the start on");
        let (first, seen) = (cut.landmarks[cut.truth[0]], cut.poses[0]);
        assert!((first - seen.position()).norm() < 0.31, "a button is pressed upon it: {first}");
    }
}
