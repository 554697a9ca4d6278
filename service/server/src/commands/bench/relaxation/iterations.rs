//! After how many iterations is expectation maximisation right, and sure?

use meetpoint_geometry::{Point2, Pose};
use meetpoint_relaxation::{Em, PeakParams, Travel};

use super::simulated::Simulated;

/// Sightings of one place on the path lie within this distance, in metres: landmarks of the paper's data
/// sets lie more than twice as far apart.
const ONE_PLACE_M: f64 = 4.0;
/// Landmarks that are surer than this are certain.
const CERTAIN: f64 = 0.9;

/// What came of EM's iterations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Iterations {
    /// The iteration from which on the path is topologically right, to the end: sightings are of one
    /// place if and only if they truly are.
    pub(super) right_after: Option<u32>,
    /// And that from which on all landmarks that were seen are certain, and no others there.
    pub(super) certain_after: Option<u32>,
    /// Wrong pairs at the end.
    pub(super) n_wrong_pairs: usize,
    /// How many there were.
    pub(super) n_iterations: u32,
}

impl Iterations {
    /// Judges the iteration that EM has just done.
    pub(super) fn note(&mut self, em: &Em<'_>, simulated: &Simulated) {
        self.n_iterations += 1;
        let landmarks = em.map().map(|map| map.landmarks(&PeakParams::BUTTON)).unwrap_or_default();
        let path = em.path().map_or(Vec::new(), |path| path.poses);
        self.n_wrong_pairs = n_pairs_apart(&seen(&simulated.travel, &path), &simulated.truth);
        let is_right = self.n_wrong_pairs == 0;
        self.right_after = is_right.then(|| self.right_after.unwrap_or(self.n_iterations));
        let n_certain = landmarks.iter().filter(|landmark| CERTAIN <= landmark.certainty).count();
        let are_certain =
            n_certain == landmarks.len() && n_certain == simulated.n_landmarks_seen() && is_right;
        self.certain_after = are_certain.then(|| self.certain_after.unwrap_or(self.n_iterations));
    }

    /// The iteration from which on it is right, or how wrong it is.
    pub(super) fn right_after(&self) -> String {
        match self.right_after {
            Some(iteration) => iteration.to_string(),
            None => format!("never in {}, {} wrong", self.n_iterations, self.n_wrong_pairs),
        }
    }

    /// The iteration from which on all landmarks are certain.
    pub(super) fn certain_after(&self) -> String {
        match self.certain_after {
            Some(iteration) => iteration.to_string(),
            None => format!("never in {}", self.n_iterations),
        }
    }
}

/// By sighting, where it was seen from a path.
fn seen(travel: &Travel, poses: &[Pose]) -> Vec<Point2<f64>> {
    let steps = travel.steps.iter().zip(poses);
    steps
        .flat_map(|(step, &pose)| step.sightings.iter().map(move |seen| pose * seen.offset_m()))
        .collect()
}

/// Pairs of sightings of one landmark that lie apart, or of two that lie together; all pairs if the
/// path has been lost.
fn n_pairs_apart(seen: &[Point2<f64>], truth: &[usize]) -> usize {
    let mut n = 0;
    for (a, true_a) in truth.iter().enumerate() {
        for (b, true_b) in truth[..a].iter().enumerate() {
            let places = seen.get(a).zip(seen.get(b));
            let is_right = places.is_some_and(|(place_a, place_b)| {
                ((place_a - place_b).norm() < ONE_PLACE_M) == (true_a == true_b)
            });
            n += usize::from(!is_right);
        }
    }
    n
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_are_right_where_places_meet_that_are_one() {
        let seen = [0.0, 10.0, 3.0, 30.0].map(|x_m| Point2::new(x_m, 0.0));
        assert_eq!(n_pairs_apart(&seen, &[0, 1, 0, 2]), 0, "the first and the third meet");
        assert_eq!(n_pairs_apart(&seen, &[0, 1, 1, 2]), 2, "they are not one, the others apart");
        assert_eq!(n_pairs_apart(&[], &[0, 1, 1]), 3, "a path that was lost");
    }
}
