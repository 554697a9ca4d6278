//! The steps of a travel that the search over associations looks at.
//!
//! A camera sees the same landmarks from about the same place many times a second. What such
//! sightings err by they have in common, so that they tell little that the first did not, and a
//! search that takes them for independent is too sure too soon. Between key steps the robot has
//! moved; the sightings of the others are told once the search is over.

use crate::motion::Motion;
use crate::travel::{Step, Travel};

/// The key steps of a travel, as a travel of their own.
#[derive(Clone, Debug)]
pub(crate) struct KeySteps {
    /// All of them have sightings.
    pub(crate) travel: Travel,
    /// Indices of the steps in the whole travel.
    pub(crate) steps: Vec<usize>,
    /// Indices of their sightings among all sightings.
    pub(crate) sightings: Vec<usize>,
}

impl KeySteps {
    /// The first step with sightings, and each after the robot has driven so many metres or turned
    /// by so many radians since the last, by odometry; and each that shows a landmark by name for
    /// the first time.
    pub(crate) fn of(travel: &Travel, (way_m, turn_rad): (f64, f64)) -> Self {
        let (mut steps, mut indices, mut sightings) = (Vec::new(), Vec::new(), Vec::new());
        let (mut legs, mut names) = (Vec::new(), Vec::new());
        let mut n_sightings = 0;
        for (index, step) in travel.steps.iter().enumerate() {
            legs.extend_from_slice(step.motion.legs());
            let here = n_sightings..n_sightings + step.sightings.len();
            n_sightings = here.end;
            let driven_m: f64 = legs.iter().map(|leg| leg.distance_m()).sum();
            let turned_rad: f64 = legs.iter().map(|leg| leg.theta_rad).sum();
            let mut shown = step.sightings.iter().filter_map(|seen| seen.identity);
            let has_moved = way_m <= driven_m || turn_rad <= turned_rad.abs();
            let is_key = steps.is_empty() || has_moved || shown.any(|name| !names.contains(&name));
            if !is_key || step.sightings.is_empty() {
                continue;
            }
            for name in step.sightings.iter().filter_map(|seen| seen.identity) {
                if !names.contains(&name) {
                    names.push(name);
                }
            }
            let motion = Motion::new(std::mem::take(&mut legs));
            steps.push(Step { motion, sightings: step.sightings.clone() });
            indices.push(index);
            sightings.extend(here);
        }
        let travel = Travel { detector: travel.detector, steps };
        Self { travel, steps: indices, sightings }
    }

    /// Of all sightings' landmarks those of the key steps.
    pub(crate) fn picked(&self, association: &[Option<u32>]) -> Vec<Option<u32>> {
        self.sightings.iter().map(|&sighting| association[sighting]).collect()
    }
}

#[cfg(test)]
mod tests {
    use meetpoint_geometry::Pose;

    use super::*;
    use crate::travel::{Detector, Sighting};

    fn seen(identity: Option<u32>) -> Sighting {
        Sighting { identity, landmark_type: 0, range_m: 1.0, bearing_rad: 0.0 }
    }

    /// Steps after so many metres and radians, with sightings.
    fn travel(steps: &[(f64, f64, Vec<Sighting>)]) -> Travel {
        let detector = Detector { range_max_m: 5.0, half_field_of_view_rad: 0.5 };
        let steps = steps.iter().map(|(way_m, turn_rad, sightings)| Step {
            motion: Motion::new(vec![Pose::new(*way_m, 0.0, *turn_rad)]),
            sightings: sightings.clone(),
        });
        Travel { detector, steps: steps.collect() }
    }

    #[test]
    fn a_key_step_after_a_way_or_a_turn() {
        let one = || vec![seen(None)];
        let travel = travel(&[
            (1.0, 0.0, Vec::new()),
            (0.0, 0.0, vec![seen(None), seen(None)]),
            (0.06, 0.0, one()),
            (0.06, 0.0, one()),
            (0.0, -0.2, one()),
            (0.0, 0.1, one()),
            (0.2, 0.0, Vec::new()),
            (0.0, 0.0, one()),
        ]);
        let keys = KeySteps::of(&travel, (0.1, 0.15));
        assert_eq!(keys.steps, [1, 3, 4, 7], "the first, 0.12 m, a turn, 0.2 m before");
        assert_eq!(keys.sightings, [0, 1, 3, 4, 6], "of all seven");
        let ways: Vec<f64> = keys
            .travel
            .steps
            .iter()
            .map(|step| step.motion.legs().iter().map(|leg| leg.distance_m()).sum())
            .collect();
        assert_eq!(ways, [1.0, 0.12, 0.0, 0.2], "nothing of the way is lost");
        let all: Vec<_> = (0..7).map(Some).collect();
        assert_eq!(keys.picked(&all), [0, 1, 3, 4, 6].map(Some), "theirs");
    }

    #[test]
    fn every_name_is_in_a_key_step() {
        let travel = travel(&[
            (0.0, 0.0, vec![seen(Some(4))]),
            (0.01, 0.0, vec![seen(Some(4))]),
            (0.01, 0.0, vec![seen(Some(4)), seen(Some(7))]),
        ]);
        assert_eq!(
            KeySteps::of(&travel, (0.1, 0.15)).steps,
            [0, 2],
            "the second tells nothing new"
        );
        assert_eq!(KeySteps::of(&travel, (0.0, 0.0)).steps, [0, 1, 2], "all are asked for");
    }
}
