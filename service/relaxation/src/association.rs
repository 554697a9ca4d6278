//! Which landmark every sighting saw, read off what EM found.

use meetpoint_geometry::{Point2, Pose};

use crate::consolidation::renumber;
use crate::landmark::{Landmark, LandmarkKind};
use crate::travel::Travel;

/// A sighting further than this from every landmark is of none, in metres.
const DISTANCE_MAX_M: f64 = 3.0;

/// By sighting: index of the nearest landmark to where it was seen from `poses` (one a step), in
/// the order in which landmarks are first seen. Two sightings of one step are of two landmarks: the
/// nearer pair counts.
pub(crate) fn nearest_landmarks(
    travel: &Travel,
    poses: &[Pose],
    landmarks: &[Landmark],
) -> Vec<Option<u32>> {
    let mut association = of_known(travel, poses, landmarks);
    renumber(&mut association);
    association
}

/// The same by their indices among the landmarks.
pub(crate) fn of_known(
    travel: &Travel,
    poses: &[Pose],
    landmarks: &[Landmark],
) -> Vec<Option<u32>> {
    let mut association = Vec::with_capacity(travel.n_sightings());
    for (step, pose) in travel.steps.iter().zip(poses) {
        let places: Vec<(Point2<f64>, LandmarkKind)> = step
            .sightings
            .iter()
            .map(|seen| (*pose * seen.offset_m(), LandmarkKind::of(seen)))
            .collect();
        let found = matched(&places, landmarks).into_iter();
        association.extend(found.map(|it| it.and_then(|index| u32::try_from(index).ok())));
    }
    association
}

/// Landmarks of places seen at once, nearest pairs first.
fn matched(places: &[(Point2<f64>, LandmarkKind)], landmarks: &[Landmark]) -> Vec<Option<usize>> {
    let mut pairs = Vec::new();
    for (index, (place, kind)) in places.iter().enumerate() {
        for (landmark, known) in landmarks.iter().enumerate() {
            let distance_m = (known.position - place).norm();
            if known.kind == *kind && distance_m < DISTANCE_MAX_M {
                pairs.push((distance_m, index, landmark));
            }
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut found = vec![None; places.len()];
    for (_, index, landmark) in pairs {
        if found[index].is_none() && !found.contains(&Some(landmark)) {
            found[index] = Some(landmark);
        }
    }
    found
}
