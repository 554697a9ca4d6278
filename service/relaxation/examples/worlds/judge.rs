//! A relaxation's outcome against the truth.

use meetpoint_geometry::Point2;
use meetpoint_relaxation::Outcome;
use meetpoint_sim::LandmarkTravel;

/// How wrong an outcome is.
pub(crate) struct Judgement {
    /// Pairs of sightings that are told to be of one landmark and are not, or the other way round.
    pub(crate) n_wrong_pairs: usize,
    /// Median distance of a landmark from the true one, after the rigid motion that fits best.
    pub(crate) landmark_error_m: f64,
    /// Root mean square distance of the poses from the true ones, after the same motion.
    pub(crate) path_error_m: f64,
}

impl Judgement {
    pub(crate) fn of(outcome: &Outcome, simulated: &LandmarkTravel, truth: &[usize]) -> Self {
        let mut found = Vec::new();
        let mut meant = Vec::new();
        for (index, landmark) in (0_u32..).zip(&outcome.landmarks) {
            let of_it = truth.iter().zip(&outcome.association);
            let first = of_it.into_iter().find(|(_, found)| **found == Some(index));
            if let Some((&true_index, _)) = first {
                found.push(landmark.position);
                meant.push(simulated.landmarks[true_index].position);
            }
        }
        let motion = rigid_motion(&found, &meant);
        let off = |a: &Point2<f64>, b: &Point2<f64>| (motion(a) - b).norm();
        let mut errors: Vec<f64> = found.iter().zip(&meant).map(|(a, b)| off(a, b)).collect();
        errors.sort_by(f64::total_cmp);
        let sighted: Vec<Point2<f64>> = simulated
            .moments
            .iter()
            .filter(|moment| !moment.sightings.is_empty())
            .map(|moment| moment.truth.position())
            .collect();
        let steps = outcome.landmarks.iter().flat_map(|landmark| &landmark.sightings);
        let mut steps: Vec<usize> = steps.map(|&(step, _)| step).collect();
        steps.sort_unstable();
        steps.dedup();
        let squares: Vec<f64> = steps
            .iter()
            .zip(&sighted)
            .map(|(&step, truth)| off(&outcome.poses[step].position(), truth).powi(2))
            .collect();
        Self {
            n_wrong_pairs: n_wrong_pairs(&outcome.association, truth),
            landmark_error_m: errors.get(errors.len() / 2).copied().unwrap_or(f64::NAN),
            path_error_m: (squares.iter().sum::<f64>() / squares.len() as f64).sqrt(),
        }
    }
}

fn n_wrong_pairs(found: &[Option<u32>], truth: &[usize]) -> usize {
    let mut n = 0;
    for a in 0..truth.len() {
        for b in 0..a {
            let same = found[a].is_some() && found[a] == found[b];
            n += usize::from(same != (truth[a] == truth[b]));
        }
    }
    n
}

/// The rotation and shift that take `from` nearest to `to` (K. S. Arun, T. S. Huang and S. D.
/// Blostein, "Least-squares fitting of two 3-D point sets", PAMI 9 (1987), in the plane).
fn rigid_motion(from: &[Point2<f64>], to: &[Point2<f64>]) -> impl Fn(&Point2<f64>) -> Point2<f64> {
    let n = from.len().max(1) as f64;
    let center = |points: &[Point2<f64>]| {
        points.iter().fold(Point2::origin(), |sum: Point2<f64>, point| sum + point.coords / n)
    };
    let (from_center, to_center) = (center(from), center(to));
    let (mut dot, mut cross) = (0.0, 0.0);
    for (a, b) in from.iter().zip(to) {
        let (a, b) = (a - from_center, b - to_center);
        dot += a.dot(&b);
        cross += a.perp(&b);
    }
    let (sin, cos) = f64::atan2(cross, dot).sin_cos();
    move |point| {
        let from = point - from_center;
        let turned = Point2::new(cos * from.x - sin * from.y, sin * from.x + cos * from.y);
        turned + to_center.coords
    }
}
