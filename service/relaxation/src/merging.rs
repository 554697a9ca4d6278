//! Landmarks that are one, asked of the evidence.
//!
//! A search that has taken one landmark for two believes both; they end up beside each other, surer
//! than they should be, so that their covariances speak against their being one. What the whole
//! travel would say if they were one is therefore tried: sightings of both are of one, all are fitted,
//! every sighting goes to the landmark that fits it best, and the evidence decides.

use crate::consolidation::{reassigned, renumber};
use crate::error_model::ErrorModel;
use crate::hypothesis::Hypothesis;
use crate::refine::refined;
use crate::travel::Travel;

/// Landmarks farther apart than this are two, in metres.
const APART_MAX_M: f64 = 0.6;
/// Pairs that are tried at a time, the nearest first.
const N_TRIED_MAX: usize = 8;
/// Two landmarks that were seen at one step in more than this share of the sightings of either are
/// two.
const AT_ONCE_SHARE_MAX: f64 = 0.2;

/// Associations of a hypothesis about a travel whose steps all have sightings, each with two
/// landmarks near each other taken for one.
pub(crate) fn mergers(
    travel: &Travel,
    model: &ErrorModel,
    hypothesis: &Hypothesis,
) -> Vec<Vec<Option<u32>>> {
    let mut associations = Vec::new();
    for (first, second) in near_pairs(travel, hypothesis) {
        let mut association = hypothesis.association.clone();
        let mut seen = &mut association[..];
        for step in &travel.steps {
            let (here, later) = seen.split_at_mut(step.sightings.len());
            let is_taken = here.contains(&Some(first));
            for landmark in here.iter_mut().filter(|landmark| **landmark == Some(second)) {
                *landmark = (!is_taken).then_some(first);
            }
            seen = later;
        }
        renumber(&mut association);
        let start = (hypothesis.poses.clone(), hypothesis.calibration);
        let Some(fit) = refined(travel, model, &association, start) else { continue };
        let mut again = reassigned(travel, model, (&association, &fit));
        renumber(&mut again);
        associations.push(again);
    }
    associations
}

/// Landmarks that may be one, the nearest first.
fn near_pairs(travel: &Travel, hypothesis: &Hypothesis) -> Vec<(u32, u32)> {
    let places = &hypothesis.landmarks;
    let mut pairs = Vec::new();
    for (second, place) in (0_u32..).zip(places) {
        for (first, other) in (0..second).zip(places) {
            let apart_m = (place - other).norm();
            if apart_m < APART_MAX_M && !are_two(travel, &hypothesis.association, [first, second]) {
                pairs.push((apart_m, (first, second)));
            }
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    pairs.truncate(N_TRIED_MAX);
    pairs.into_iter().map(|(_, pair)| pair).collect()
}

/// Whether two landmarks were seen at once too often.
fn are_two(travel: &Travel, association: &[Option<u32>], pair: [u32; 2]) -> bool {
    let (mut n_seen, mut n_at_once) = ([0_u32; 2], 0_u32);
    let mut rest = association;
    for step in &travel.steps {
        let (here, later) = rest.split_at(step.sightings.len());
        let is_seen = pair.map(|landmark| here.contains(&Some(landmark)));
        n_seen = [0, 1].map(|which| n_seen[which] + u32::from(is_seen[which]));
        n_at_once += u32::from(is_seen == [true, true]);
        rest = later;
    }
    AT_ONCE_SHARE_MAX * f64::from(n_seen[0].min(n_seen[1])) < f64::from(n_at_once)
}

#[cfg(test)]
mod tests {
    use meetpoint_geometry::{Point2, Pose};

    use super::*;
    use crate::calibration::Calibration;
    use crate::motion::Motion;
    use crate::travel::{Detector, Sighting, Step};

    /// A robot that goes straight on by 0.2 m a step past two posts, which it sees at each step, and
    /// takes the first for another from the third step on.
    fn split() -> (Travel, Hypothesis) {
        let posts = [Point2::new(3.0, 1.0), Point2::new(3.5, -1.0)];
        let poses: Vec<Pose> =
            (0..6).map(|step| Pose::new(0.2 * f64::from(step), 0.0, 0.0)).collect();
        let step = |pose: &Pose| Step {
            motion: Motion::new(vec![Pose::new(0.2, 0.0, 0.0)]),
            sightings: posts.iter().map(|post| seen(pose.inverse() * *post)).collect(),
        };
        let detector = Detector { range_max_m: 5.0, half_field_of_view_rad: 0.6 };
        let travel = Travel { detector, steps: poses.iter().map(step).collect() };
        let association = [0, 1, 0, 1, 2, 1, 2, 1, 2, 1, 2, 1].map(Some).to_vec();
        let landmarks = vec![posts[0], posts[1], posts[0] + nalgebra::Vector2::new(0.1, 0.0)];
        let calibration = Calibration::NONE;
        (travel, Hypothesis { association, log_evidence: 0.0, poses, landmarks, calibration })
    }

    fn seen(offset_m: Point2<f64>) -> Sighting {
        let (range_m, bearing_rad) = (offset_m.coords.norm(), offset_m.y.atan2(offset_m.x));
        Sighting { identity: None, landmark_type: 0, range_m, bearing_rad }
    }

    #[test]
    fn what_was_taken_for_two_is_tried_as_one() {
        let (travel, hypothesis) = split();
        let tried = mergers(&travel, &ErrorModel::CAMERA, &hypothesis);
        let once = [0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1].map(Some).to_vec();
        assert_eq!(tried, [once], "only these two are near, and never seen at once");
    }

    #[test]
    fn what_was_seen_at_once_is_two() {
        let (travel, mut hypothesis) = split();
        hypothesis.landmarks[1] = hypothesis.landmarks[0];
        hypothesis.landmarks[2] = Point2::new(9.0, 9.0);
        assert!(mergers(&travel, &ErrorModel::CAMERA, &hypothesis).is_empty(), "at every step");
    }
}
