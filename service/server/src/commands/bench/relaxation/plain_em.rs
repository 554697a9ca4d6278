//! Plain expectation maximisation as in the paper: from the controls alone, odometry believed, no
//! search. After how many iterations is it right?

use meetpoint_geometry::{Point2, Pose};
use meetpoint_relaxation::{Area, Em, EmParams, PeakParams, PoseGrid, Start, Travel};

use super::simulated::Simulated;

/// The paper's area is 90 by 90 m; this is half of it less half a cell.
const HALF_SIDE_M: f64 = 44.5;
/// The paper's cells, in metres.
const RESOLUTION_M: f64 = 1.0;
/// And its headings: five degrees.
const N_HEADINGS: u32 = 72;
/// Sightings of one place on the path lie within this distance, in metres: landmarks of the paper's data
/// sets lie more than twice as far apart.
const ONE_PLACE_M: f64 = 4.0;
/// Landmarks that are surer than this are certain.
const CERTAIN: f64 = 0.9;

/// The paper's grid, about the true path, with as many threads as there are cores to measure on.
pub(super) fn paper_params(simulated: &Simulated) -> EmParams {
    let middle = |values: &dyn Fn(&Pose) -> f64| {
        let values = simulated.poses.iter().map(values);
        let [min, max] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[min, max], value| {
            [min.min(value), max.max(value)]
        });
        f64::midpoint(min, max)
    };
    let (x, y) = (middle(&|pose| pose.x_m), middle(&|pose| pose.y_m));
    let corner = |side_m: f64| Point2::new(x + side_m, y + side_m);
    let area = Area { min: corner(-HALF_SIDE_M), max: corner(HALF_SIDE_M) };
    let grid = PoseGrid::new(area, RESOLUTION_M, N_HEADINGS).expect("a small grid");
    EmParams { n_threads: super::TWO, n_coarse_iterations: 0, ..EmParams::button(grid) }
}

/// What came of plain iterations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct PlainEm {
    /// The iteration from which on the path is topologically right, to the end: sightings are of one
    /// place if and only if they truly are.
    pub(super) right_after: Option<u32>,
    /// And that from which on all landmarks that were seen are certain, and no others there.
    pub(super) certain_after: Option<u32>,
    /// Wrong pairs at the end.
    pub(super) n_wrong_pairs: usize,
    /// Iterations until it stopped by itself.
    pub(super) n_iterations: u32,
}

/// Iterates until it stops by itself, and judges each iteration.
pub(super) fn plain_em(simulated: &Simulated, params: EmParams) -> PlainEm {
    let mut em = Em::new(&simulated.travel, params, Start::Controls);
    let mut found = PlainEm::default();
    while !em.has_converged() {
        let iteration = em.iterate().iteration;
        let landmarks = em.map().map(|map| map.landmarks(&PeakParams::BUTTON)).unwrap_or_default();
        let path = em.path().map_or(Vec::new(), |path| path.poses);
        found.n_wrong_pairs = n_pairs_apart(&seen(&simulated.travel, &path), &simulated.truth);
        found.n_iterations = iteration;
        let is_right = found.n_wrong_pairs == 0;
        found.right_after = is_right.then(|| found.right_after.unwrap_or(iteration));
        let n_certain = landmarks.iter().filter(|landmark| CERTAIN <= landmark.certainty).count();
        let are_certain =
            n_certain == landmarks.len() && n_certain == simulated.n_landmarks_seen() && is_right;
        found.certain_after = are_certain.then(|| found.certain_after.unwrap_or(iteration));
    }
    found
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
