//! A robot's travel past landmarks, with the truth beside what was measured.

use meetpoint_geometry::{Point2, Pose};

/// A place that is marked, or that can be recognised as a meet point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Landmark {
    /// Where it is in the building's frame, in metres.
    pub position: Point2<f64>,
    /// What kind of landmark it is, from 0; always 0 where all look alike.
    pub landmark_type: u32,
}

/// A landmark seen from the robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrueSighting {
    /// Which landmark it truly is: an index into [`LandmarkTravel::landmarks`].
    pub landmark: usize,
    /// What kind of landmark it looked like, which may be wrong.
    pub landmark_type: u32,
    /// Distance from the robot as measured, in metres; 0 for a button pressed upon a landmark.
    pub range_m: f64,
    /// Direction from the robot as measured, in radians, in (−π, π].
    pub bearing_rad: f64,
}

/// The robot after a control.
#[derive(Clone, Debug, PartialEq)]
pub struct Moment {
    /// Where its odometry has it, in a frame that begins where the travel begins.
    pub odometry: Pose,
    /// Where it truly is, in the building's frame.
    pub truth: Pose,
    /// Landmarks that it sights here.
    pub sightings: Vec<TrueSighting>,
}

/// The part of a travel that leads to one moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Stage<'a> {
    /// What odometry says of each control of the part: the pose after it, seen from the pose before.
    pub legs: Vec<Pose>,
    /// Where it leads.
    pub end: &'a Moment,
}

/// A robot's way through a building.
#[derive(Clone, Debug, PartialEq)]
pub struct LandmarkTravel {
    /// All landmarks of the building, whether sighted or not.
    pub landmarks: Vec<Landmark>,
    /// The start and then one for every control, in order. Invariant: not empty.
    pub moments: Vec<Moment>,
}

impl LandmarkTravel {
    /// Controls: moments but the first.
    pub fn n_controls(&self) -> usize {
        self.moments.len() - 1
    }

    /// Sightings of all moments.
    pub fn n_sightings(&self) -> usize {
        self.moments.iter().map(|moment| moment.sightings.len()).sum()
    }

    /// Length of the true way, in metres.
    pub fn length_m(&self) -> f64 {
        let step_m = |pair: &[Moment]| pair[0].truth.step_to(pair[1].truth).distance_m();
        self.moments.windows(2).map(step_m).sum()
    }

    /// From where the robot truly is at a moment to where its odometry has it, if both start at the
    /// same pose; seen from the true pose, in metres and radians.
    ///
    /// # Panics
    /// If there is no moment of that index.
    pub fn dead_reckoning_error(&self, moment: usize) -> Pose {
        let Moment { odometry, truth, .. } = self.moments[moment];
        truth.step_to(self.moments[0].truth * odometry)
    }

    /// How far off dead reckoning ends, in metres.
    pub fn final_error_m(&self) -> f64 {
        self.dead_reckoning_error(self.n_controls()).distance_m()
    }

    /// The moment at which sightings reach the number `n_sightings`, if they do.
    pub fn moment_of_sighting(&self, n_sightings: usize) -> Option<usize> {
        let mut n = 0;
        self.moments.iter().position(|moment| {
            n += moment.sightings.len();
            n_sightings <= n
        })
    }

    /// The travel cut into stages: the first ends where the travel begins, every other at a moment
    /// with sightings, or where `stage_m` metres of odometry lie behind the stage before. What
    /// follows the last end is left out.
    pub fn stages(&self, stage_m: f64) -> Vec<Stage<'_>> {
        let mut stages = Vec::new();
        let (mut legs, mut driven_m) = (Vec::new(), 0.0);
        let mut before: Option<Pose> = None;
        for moment in &self.moments {
            if let Some(before) = before.replace(moment.odometry) {
                let leg = before.step_to(moment.odometry);
                driven_m += leg.distance_m();
                legs.push(leg);
            }
            if stages.is_empty() || !moment.sightings.is_empty() || stage_m <= driven_m {
                stages.push(Stage { legs: std::mem::take(&mut legs), end: moment });
                driven_m = 0.0;
            }
        }
        stages
    }

    /// The travel up to the moment at which sightings reach the number `n_sightings`; all of it if
    /// they do not.
    pub fn until_sighting(&self, n_sightings: usize) -> Self {
        let last = self.moment_of_sighting(n_sightings).unwrap_or(self.n_controls());
        Self { landmarks: self.landmarks.clone(), moments: self.moments[..=last].to_vec() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ten metres straight on, a metre a control, with one landmark halfway.
    fn corridor() -> LandmarkTravel {
        let moment = |x_m: u32| {
            let pose = Pose::new(f64::from(x_m), 0.0, 0.0);
            let seen =
                TrueSighting { landmark: 0, landmark_type: 0, range_m: 0.0, bearing_rad: 0.0 };
            let sightings = if x_m == 5 { vec![seen] } else { Vec::new() };
            Moment { odometry: pose, truth: pose, sightings }
        };
        let landmark = Landmark { position: Point2::new(5.0, 0.0), landmark_type: 0 };
        LandmarkTravel { landmarks: vec![landmark], moments: (0..=10).map(moment).collect() }
    }

    #[test]
    fn stages_end_at_sightings_and_after_their_length() {
        let travel = corridor();
        let stages = travel.stages(3.0);
        let ends: Vec<f64> = stages.iter().map(|stage| stage.end.odometry.x_m).collect();
        assert_eq!(ends, [0.0, 3.0, 5.0, 8.0], "start, length, sighting, length; the rest is left");
        let n_legs: Vec<usize> = stages.iter().map(|stage| stage.legs.len()).collect();
        assert_eq!(n_legs, [0, 3, 2, 3], "every control once");
    }
}
