//! What was found against the truth.

use meetpoint_geometry::{Point2, Pose};
use meetpoint_relaxation::Outcome;

use super::super::rigid_motion::rigid_motion;
use super::simulated::Simulated;

/// How wrong an outcome is. All lengths after the rigid motion that takes the landmarks nearest to
/// the true ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Judgement {
    /// Pairs of sightings that are told to be of one landmark and are not, or the other way round.
    pub(super) n_wrong_pairs: usize,
    /// Median distance of a landmark from the true one, in metres.
    pub(super) landmark_off_m: f64,
    /// Root mean square of the distances of poses from the true ones at all steps, in metres.
    pub(super) path_off_m: f64,
}

impl Judgement {
    /// Judges an outcome.
    pub(super) fn of(outcome: &Outcome, simulated: &Simulated) -> Self {
        let pairs = landmark_pairs(outcome, simulated);
        let truth_from_found = rigid_motion(&pairs);
        let off_m =
            |(from, to): &(Point2<f64>, Point2<f64>)| (truth_from_found * *from - to).norm();
        let mut off: Vec<f64> = pairs.iter().map(off_m).collect();
        off.sort_by(f64::total_cmp);
        Self {
            n_wrong_pairs: n_wrong_pairs(&outcome.association, &simulated.truth),
            landmark_off_m: off.get(off.len() / 2).copied().unwrap_or(f64::NAN),
            path_off_m: path_off_m(truth_from_found, &outcome.poses, &simulated.poses),
        }
    }
}

/// Landmarks found, each with the true one that its first sighting is of.
fn landmark_pairs(outcome: &Outcome, simulated: &Simulated) -> Vec<(Point2<f64>, Point2<f64>)> {
    let mut pairs = Vec::new();
    for (index, landmark) in (0_u32..).zip(&outcome.landmarks) {
        let first = outcome.association.iter().position(|found| *found == Some(index));
        if let Some(sighting) = first {
            pairs.push((landmark.position, simulated.landmarks[simulated.truth[sighting]]));
        }
    }
    pairs
}

fn path_off_m(truth_from_found: Pose, found: &[Pose], truth: &[Pose]) -> f64 {
    let squares = found.iter().zip(truth).map(|(found, truth)| {
        (truth_from_found * found.position() - truth.position()).norm_squared()
    });
    (squares.sum::<f64>() / found.len() as f64).sqrt()
}

/// Pairs of sightings that are told to be of one landmark and are not, or the other way round.
fn n_wrong_pairs(found: &[Option<u32>], truth: &[usize]) -> usize {
    let mut n = 0;
    for (a, &true_a) in truth.iter().enumerate() {
        for (b, &true_b) in truth[..a].iter().enumerate() {
            let is_same = found[a].is_some() && found[a] == found[b];
            n += usize::from(is_same != (true_a == true_b));
        }
    }
    n
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_count_whatever_landmarks_are_called() {
        let truth = [5, 7, 5, 9];
        assert_eq!(n_wrong_pairs(&[Some(0), Some(1), Some(0), Some(2)], &truth), 0, "right");
        assert_eq!(n_wrong_pairs(&[Some(0), Some(1), Some(1), Some(2)], &truth), 2, "one moved");
        assert_eq!(
            n_wrong_pairs(&[None, Some(1), None, Some(2)], &truth),
            1,
            "none is no landmark"
        );
    }
}
