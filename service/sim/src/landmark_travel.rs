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

    /// The travel up to the moment at which sightings reach the number `n_sightings`; all of it if
    /// they do not.
    pub fn until_sighting(&self, n_sightings: usize) -> Self {
        let last = self.moment_of_sighting(n_sightings).unwrap_or(self.n_controls());
        Self { landmarks: self.landmarks.clone(), moments: self.moments[..=last].to_vec() }
    }
}
