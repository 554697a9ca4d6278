//! The data that a map is made from: motions and sightings in turn (TBF98 equation (5)), coarse in
//! time as in section 5: a step for every sighting or after a long way without one.

use meetpoint_geometry::{Point2, Pose};

use crate::calibration::Calibration;
use crate::motion::Motion;

/// What finds landmarks: a person with a button, a camera that reads tags.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detector {
    /// How far it sees, in metres; 0 for a button that is pressed upon a landmark.
    pub range_max_m: f64,
    /// Half of its field of view, in radians, in (0, pi].
    pub half_field_of_view_rad: f64,
}

/// A detector that sees no farther is a button, in metres.
const BUTTON_RANGE_MAX_M: f64 = 1.0;

impl Detector {
    /// Whether it is a button that a person presses, and not a camera.
    pub fn is_button(&self) -> bool {
        self.range_max_m <= BUTTON_RANGE_MAX_M
    }
}

/// A landmark seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sighting {
    /// Which landmark it is, where that can be told.
    pub identity: Option<u32>,
    /// What kind of landmark it looks like, from 0; always 0 where all look alike.
    pub landmark_type: u32,
    /// Distance from the robot, in metres.
    pub range_m: f64,
    /// Direction seen from the robot, in radians.
    pub bearing_rad: f64,
}

impl Sighting {
    /// Where the landmark is, seen from the robot, in metres.
    pub fn offset_m(&self) -> Point2<f64> {
        let (sin, cos) = self.bearing_rad.sin_cos();
        Point2::new(self.range_m * cos, self.range_m * sin)
    }
}

/// A moment at which the robot's pose is estimated.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// The way from the step before; none for the first.
    pub motion: Motion,
    /// Landmarks seen here. None of the detector's others were, within its range.
    pub sightings: Vec<Sighting>,
}

/// One robot's travel.
#[derive(Clone, Debug, PartialEq)]
pub struct Travel {
    /// What it found landmarks with.
    pub detector: Detector,
    /// Its moments, in order.
    pub steps: Vec<Step>,
}

impl Travel {
    /// The poses at all steps by odometry alone, from the origin.
    pub fn dead_reckoning(&self, calibration: &Calibration) -> Vec<Pose> {
        let mut pose = Pose::IDENTITY;
        let mut poses = Vec::with_capacity(self.steps.len());
        for step in &self.steps {
            pose = pose * step.motion.displacement(calibration);
            poses.push(pose);
        }
        poses
    }

    /// The same backward in time: what was seen last comes first.
    pub(crate) fn reversed(&self) -> Self {
        let mut steps = Vec::with_capacity(self.steps.len());
        let mut motion = Motion::NONE;
        for step in self.steps.iter().rev() {
            let sightings = step.sightings.iter().rev().copied().collect();
            steps.push(Step { motion, sightings });
            motion =
                Motion::new(step.motion.legs().iter().rev().map(|leg| leg.inverse()).collect());
        }
        Self { detector: self.detector, steps }
    }

    /// Landmarks seen, each as often as it was.
    pub fn n_sightings(&self) -> usize {
        self.steps.iter().map(|step| step.sightings.len()).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn backward_the_way_leads_from_its_end_to_its_beginning() {
        let seen =
            |range_m| Sighting { identity: None, landmark_type: 0, range_m, bearing_rad: 0.0 };
        let leg = |x_m, theta_rad| Pose::new(x_m, 0.1, theta_rad);
        let detector = Detector { range_max_m: 5.0, half_field_of_view_rad: 0.5 };
        let steps = vec![
            Step { motion: Motion::NONE, sightings: vec![seen(1.0), seen(2.0)] },
            Step {
                motion: Motion::new(vec![leg(1.0, 0.5), leg(2.0, -0.3)]),
                sightings: vec![seen(3.0)],
            },
            Step { motion: Motion::new(vec![leg(0.5, 1.0)]), sightings: vec![seen(4.0)] },
        ];
        let travel = Travel { detector, steps };
        let backward = travel.reversed();
        let ranges =
            backward.steps.iter().flat_map(|step| &step.sightings).map(|seen| seen.range_m);
        assert_eq!(ranges.collect::<Vec<_>>(), [4.0, 3.0, 2.0, 1.0], "the last first");
        let there = travel.dead_reckoning(&Calibration::NONE);
        let back = backward.dead_reckoning(&Calibration::NONE);
        for (there, back) in there.iter().rev().zip(&back) {
            let off = (there_from_end(there, &travel)).step_to(*back);
            assert!(off.distance_m() < 1e-9 && off.theta_rad.abs() < 1e-9, "{off:?}");
        }
    }

    /// A pose seen from the travel's last.
    fn there_from_end(pose: &Pose, travel: &Travel) -> Pose {
        let all = travel.dead_reckoning(&Calibration::NONE);
        all[all.len() - 1].step_to(*pose)
    }
}
