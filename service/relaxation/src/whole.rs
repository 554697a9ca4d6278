//! From what a search says of key steps to all steps.
//!
//! The sightings of the key steps are fitted with the ways between all steps; those of the others err
//! by much the same as their neighbours', and to count them would be to take one error for many. They
//! are of the landmarks that they fit best where the fit has the robot.

use meetpoint_geometry::Pose;

use crate::consolidation::reassigned;
use crate::error_model::ErrorModel;
use crate::hypothesis::Hypothesis;
use crate::key_steps::KeySteps;
use crate::refine::{Refined, poses_at_all_steps, refined};
use crate::travel::Travel;

/// All of a travel, fitted.
pub(crate) struct Whole {
    /// By sighting of the travel: index of the hypothesis' landmark.
    pub(crate) association: Vec<Option<u32>>,
    pub(crate) fit: Refined,
    /// By how far poses moved in the fit, on average, in metres.
    pub(crate) moved_m: f64,
}

impl Whole {
    /// What follows from a hypothesis about the key steps; `None` if it cannot be fitted.
    pub(crate) fn of(
        travel: &Travel,
        keys: &KeySteps,
        model: &ErrorModel,
        hypothesis: &Hypothesis,
    ) -> Option<Self> {
        let known = (&keys.steps[..], &hypothesis.poses[..]);
        let before = poses_at_all_steps(travel, known, &hypothesis.calibration);
        // A search begins where something is seen first; the travel's frame is its first pose.
        let before = seen_from_the_first(&before);
        let mut association = vec![None; travel.n_sightings()];
        for (&sighting, &landmark) in keys.sightings.iter().zip(&hypothesis.association) {
            association[sighting] = landmark;
        }
        let start = (before.clone(), hypothesis.calibration);
        let fit = refined(travel, model, &association, start)?;
        if keys.sightings.len() < association.len() {
            let mut all = reassigned(travel, model, (&association, &fit));
            // What the search told stands.
            for &sighting in &keys.sightings {
                all[sighting] = association[sighting];
            }
            association = all;
        }
        let moved_m = mean_distance_m(&before, &fit.poses);
        Some(Self { association, fit, moved_m })
    }
}

fn seen_from_the_first(poses: &[Pose]) -> Vec<Pose> {
    let Some(first) = poses.first() else { return Vec::new() };
    poses.iter().map(|&pose| first.step_to(pose)).collect()
}

fn mean_distance_m(before: &[Pose], after: &[Pose]) -> f64 {
    let distances_m = before.iter().zip(after).map(|(a, b)| (a.position() - b.position()).norm());
    distances_m.sum::<f64>() / before.len().max(1) as f64
}
