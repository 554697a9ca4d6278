//! Landmarks that are one: what a search took for two landmarks because the robot was lost for a
//! while comes together once the whole travel is fitted.
//!
//! Two landmarks `i`, `j` that were never seen at once are taken for one if that is more probable:
//!
//! ```text
//! ln N(l(i) - l(j); 0, covariance of the difference)  >  ln density
//! ```
//!
//! The surest pairs first, each landmark in one pair. Then every sighting goes to the landmark that
//! fits it best, two of one step to two landmarks, and all is fitted again, and so on: a pair that
//! closes a loop brings the others near.

use std::f64::consts::TAU;

use meetpoint_geometry::{Point2, Pose};
use nalgebra::{DMatrix, Matrix2};

use crate::calibration::Calibration;
use crate::error_model::ErrorModel;
use crate::landmark::LandmarkKind;
use crate::least_squares::{Bearing, sighting_residual};
use crate::refine::{Refined, refined};
use crate::travel::Travel;

/// Rounds of taking pairs for one.
const N_ROUNDS_MAX: u32 = 30;
/// Share of a round's gains, from the surest pair down, that are believed at once: what follows from
/// them is to be seen first.
const GAIN_SHARE_MIN: f64 = 0.5;

/// Two landmarks that were seen at one step in up to this share of the sightings of either may be one
/// even so: one of the two was taken for a neighbour.
const AT_ONCE_SHARE_MAX: f64 = 0.1;
/// A sighting further than this many standard deviations from every landmark is of none.
const DEVIATIONS_MAX: f64 = 5.0;

/// `association` with landmarks that are one taken together, and the fit that goes with it. `None`
/// if the equations cannot be solved.
pub(crate) fn consolidated(
    travel: &Travel,
    model: &ErrorModel,
    (mut association, mut poses, mut calibration): (Vec<Option<u32>>, Vec<Pose>, Calibration),
    density_per_m2: f64,
) -> Option<(Vec<Option<u32>>, Refined)> {
    for _ in 0..N_ROUNDS_MAX {
        let mut fit = refined(travel, model, &association, (poses, calibration))?;
        let mut again = reassigned(travel, model, (&association, &fit));
        renumber(&mut again);
        if again != association {
            association = again;
            fit = refined(travel, model, &association, (fit.poses, fit.calibration))?;
        }
        let pairs = pairs(travel, &association, &fit, density_per_m2);
        if pairs.is_empty() {
            return Some((association, fit));
        }
        for landmark in association.iter_mut().flatten() {
            if let Some(&(first, _)) = pairs.iter().find(|(_, second)| second == landmark) {
                *landmark = first;
            }
        }
        renumber(&mut association);
        (poses, calibration) = (fit.poses, fit.calibration);
    }
    let fit = refined(travel, model, &association, (poses, calibration))?;
    Some((association, fit))
}

/// Pairs of landmarks that are one, the smaller index first.
fn pairs(
    travel: &Travel,
    association: &[Option<u32>],
    fit: &Refined,
    density_per_m2: f64,
) -> Vec<(u32, u32)> {
    let n = fit.landmarks.len();
    let (kinds, at_once) = seen(travel, association, n);
    let is_often = |a: usize, b: usize| {
        let fewer = at_once[a * n + a].min(at_once[b * n + b]);
        AT_ONCE_SHARE_MAX * f64::from(fewer) < f64::from(at_once[b * n + a])
    };
    let mut found = Vec::new();
    for (second, number) in (0..n).zip(0_u32..) {
        for (first, smaller) in (0..second).zip(0_u32..) {
            if kinds[first] != kinds[second] || is_often(first, second) {
                continue;
            }
            let places = (&fit.landmarks, &fit.landmark_covariance);
            let gain = log_same_place(places.0, places.1, (first, second)) - density_per_m2.ln();
            if 0.0 < gain {
                found.push((gain, [first, second], (smaller, number)));
            }
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let least = found.first().map_or(0.0, |best| best.0 * GAIN_SHARE_MIN);
    let mut is_taken = vec![false; n];
    let mut pairs = Vec::new();
    for (gain, [first, second], pair) in found {
        if least <= gain && !is_taken[first] && !is_taken[second] {
            (is_taken[first], is_taken[second]) = (true, true);
            pairs.push(pair);
        }
    }
    pairs
}

/// Kinds of all landmarks, and how often two were seen at one step, by `second * n + first` with the
/// smaller index first; one with itself, how often it was seen.
fn seen(travel: &Travel, association: &[Option<u32>], n: usize) -> (Vec<LandmarkKind>, Vec<u32>) {
    let mut kinds = vec![LandmarkKind::Type(0); n];
    let mut at_once = vec![0; n * n];
    let mut rest = association;
    for step in &travel.steps {
        let (here, later) = rest.split_at(step.sightings.len());
        rest = later;
        for (index, (sighting, landmark)) in step.sightings.iter().zip(here).enumerate() {
            let Some(landmark) = landmark.map(|landmark| landmark as usize) else { continue };
            kinds[landmark] = LandmarkKind::of(sighting);
            for other in here[..=index].iter().flatten() {
                let other = *other as usize;
                at_once[landmark.max(other) * n + landmark.min(other)] += 1;
            }
        }
    }
    (kinds, at_once)
}

/// By sighting: the landmark that fits it best from where the fit has the robot, those that fit best
/// first.
pub(crate) fn reassigned(
    travel: &Travel,
    model: &ErrorModel,
    (before, fit): (&[Option<u32>], &Refined),
) -> Vec<Option<u32>> {
    let (kinds, _) = seen(travel, before, fit.landmarks.len());
    best_fitting(travel, model, &fit.poses, (&fit.landmarks, &kinds))
}

/// The same of landmarks of these kinds, from these poses.
pub(crate) fn best_fitting(
    travel: &Travel,
    model: &ErrorModel,
    poses: &[Pose],
    (landmarks, kinds): (&[Point2<f64>], &[LandmarkKind]),
) -> Vec<Option<u32>> {
    let mut association = Vec::with_capacity(travel.n_sightings());
    for (step, pose) in travel.steps.iter().zip(poses) {
        let mut pairs = Vec::new();
        for (index, sighting) in step.sightings.iter().enumerate() {
            let bearing = Bearing::new(index, sighting, model);
            for (landmark, point) in (0_u32..).zip(landmarks) {
                let (off, ..) = sighting_residual(*pose, *point, &bearing);
                let squares = off.dot(&(bearing.precision * off));
                let kind = LandmarkKind::of(sighting);
                // What says who it is, is it, however badly it fits.
                let is_certain = matches!(kind, LandmarkKind::Identity(_));
                let is_kind = kinds[landmark as usize] == kind;
                if is_kind && (is_certain || squares < DEVIATIONS_MAX.powi(2)) {
                    pairs.push((squares, index, landmark));
                }
            }
        }
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut found = vec![None; step.sightings.len()];
        for (_, index, landmark) in pairs {
            if found[index].is_none() && !found.contains(&Some(landmark)) {
                found[index] = Some(landmark);
            }
        }
        association.extend(found);
    }
    association
}

/// Logarithm of the density, in 1/m², that two landmarks are at one place.
pub(crate) fn log_same_place(
    places: &[Point2<f64>],
    covariance: &DMatrix<f64>,
    (first, second): (usize, usize),
) -> f64 {
    let difference = places[first] - places[second];
    let block =
        |row: usize, column: usize| covariance.fixed_view::<2, 2>(2 * row, 2 * column).into_owned();
    let shared = block(first, second);
    let spread: Matrix2<f64> =
        block(first, first) + block(second, second) - shared - shared.transpose();
    let Some(precision) = spread.try_inverse() else { return f64::NEG_INFINITY };
    -difference.dot(&(precision * difference)) / 2.0 - spread.determinant().ln() / 2.0 - TAU.ln()
}

/// Numbers landmarks in the order in which they are first seen.
pub(crate) fn renumber(association: &mut [Option<u32>]) {
    let n = association.iter().flatten().max().map_or(0, |last| *last as usize + 1);
    let mut numbers = vec![None; n];
    let mut n_seen = 0;
    for landmark in association.iter_mut().flatten() {
        *landmark = *numbers[*landmark as usize].get_or_insert_with(|| {
            n_seen += 1;
            n_seen - 1
        });
    }
}
