//! One map of several travels, each relaxed by itself before, once it is known about how they lie to
//! each other.
//!
//! 1. The landmarks of each travel are matched with those of the travels before it, where its placement
//!    puts them ([`crate::alignment_fit`]).
//! 2. All travels are fitted with the landmarks that they share ([`crate::together`]).
//! 3. Two landmarks of different travels that the fit puts at one place are one, if that is more
//!    probable than two so near each other; then all is fitted again, until no two are left.
//!
//! As for one travel, sightings of key steps alone are fitted: others err by the same.

use meetpoint_geometry::{Point2, Pose};
use nalgebra::{DMatrix, Matrix2};

use crate::alignment::AlignmentParams;
use crate::alignment_fit::Judge;
use crate::calibration::Calibration;
use crate::consolidation::log_same_place;
use crate::constellation::{Constellation, Star, exists};
use crate::coverage::Coverage;
use crate::key_steps::KeySteps;
use crate::landmark::{Landmark, LandmarkKind};
use crate::outcome::Outcome;
use crate::relaxation::RelaxationParams;
use crate::shape::shape_covariance;
use crate::together::{Member, RefinedTogether, refined_together};
use crate::travel::Travel;

/// Rounds of taking two landmarks for one.
const N_ROUNDS_MAX: u32 = 10;
/// Two landmarks that were seen at one step in up to this share of the sightings of either may be one even
/// so: one of the two was taken for a neighbour.
const AT_ONCE_SHARE_MAX: f64 = 0.1;

/// Landmarks farther apart than this many times what their places may be wrong are not compared.
const FIT_STDS: f64 = 4.0;

/// A travel that was relaxed by itself, and about where it lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed<'a> {
    /// What the robot measured.
    pub travel: &'a Travel,
    /// What follows from it alone, in the frame of its first pose.
    pub outcome: &'a Outcome,
    /// That frame, in the one that all share.
    pub site_from_travel: Pose,
}

/// One map of several travels.
#[derive(Clone, Debug, PartialEq)]
pub struct JointOutcome {
    /// Where each robot was at every step, in the frame that all share: the first travel's first pose is
    /// where it was placed.
    pub poses: Vec<Vec<Pose>>,
    /// What undoes the steady errors of each travel's odometry.
    pub calibrations: Vec<Calibration>,
    /// In the order in which travels and steps saw them first.
    pub landmarks: Vec<JointLandmark>,
    /// Half of the weighted sum of squares.
    pub cost: f64,
}

/// A landmark with what several travels saw of it.
#[derive(Clone, Debug, PartialEq)]
pub struct JointLandmark {
    /// In the frame that all share, in metres.
    pub position: Point2<f64>,
    /// How wrong that may be, seen from the first travel's first pose, in square metres.
    pub covariance_m2: Matrix2<f64>,
    /// The same seen from all landmarks together.
    pub shape_covariance_m2: Matrix2<f64>,
    /// What it is.
    pub kind: LandmarkKind,
    /// The least certainty that one of the travels gave it.
    pub certainty: f64,
    /// The sightings that are of it: travel, step, and index within the step.
    pub sightings: Vec<(usize, usize, usize)>,
}

impl JointOutcome {
    /// The map for those who want to find themselves on it, as [`Outcome::known_map`].
    pub fn known_map(&self) -> Vec<Landmark> {
        let known = |landmark: &JointLandmark| Landmark {
            position: landmark.position,
            covariance_m2: landmark.shape_covariance_m2,
            kind: landmark.kind,
            certainty: exists(landmark.sightings.len()),
        };
        self.landmarks.iter().map(known).collect()
    }
}

/// One map of all. `None` without a travel, or if the equations cannot be solved.
pub fn joint(placed: &[Placed<'_>], params: &AlignmentParams) -> Option<JointOutcome> {
    let mut members = Vec::new();
    let mut union = Constellation::default();
    // By landmark of the union: the travels that have it, and the index there.
    let mut shared: Vec<Vec<(usize, usize)>> = Vec::new();
    for (index, it) in placed.iter().enumerate() {
        let own = Constellation::of(it.travel, it.outcome);
        let judge = Judge::new(&union, &own, *params);
        let fitted = judge.fitted(it.site_from_travel);
        let site_from_travel = fitted.as_ref().map_or(it.site_from_travel, |it| it.site_from_other);
        let mut numbers = vec![None; own.stars.len()];
        for found in fitted.iter().flat_map(|it| &it.matches) {
            numbers[found.other] = Some(found.site);
        }
        for (of_travel, number) in numbers.iter_mut().enumerate() {
            let number = *number.get_or_insert_with(|| {
                shared.push(Vec::new());
                shared.len() - 1
            });
            shared[number].push((index, of_travel));
        }
        let moved = own.moved(site_from_travel);
        for (star, number) in moved.stars.into_iter().zip(&numbers) {
            if number.is_some_and(|number| union.stars.len() <= number) {
                union.stars.push(star);
            }
        }
        union.coverage.join(&moved.coverage, Pose::IDENTITY);
        members.push(member(it, site_from_travel, &numbers));
    }
    let mut fit = refined_together(&members)?;
    for _ in 0..N_ROUNDS_MAX {
        let pairs = pairs_that_are_one(placed, &shared, &fit, params);
        if pairs.is_empty() {
            break;
        }
        // The last first, so that indices before it stand.
        for &(kept, gone) in &pairs {
            let of_gone = shared.remove(gone);
            shared[kept].extend(of_gone);
            renumber(&mut members, (kept, gone));
        }
        go_on(&mut members, fit);
        fit = refined_together(&members)?;
    }
    Some(outcome(placed, &shared, fit))
}

/// A travel in the frame of all, with the sightings of its key steps.
fn member<'a>(
    placed: &Placed<'a>,
    site_from_travel: Pose,
    numbers: &[Option<usize>],
) -> Member<'a> {
    let Placed { travel, outcome, .. } = *placed;
    let params = RelaxationParams::of(travel);
    let keys = KeySteps::of(travel, (params.search.key_way_m, params.search.key_turn_rad));
    let mut association = vec![None; travel.n_sightings()];
    for &sighting in &keys.sightings {
        let landmark = outcome.association.get(sighting).copied().flatten();
        let number =
            landmark.and_then(|landmark| numbers.get(landmark as usize).copied().flatten());
        association[sighting] = number.and_then(|number| u32::try_from(number).ok());
    }
    Member {
        travel,
        model: params.refinement_model,
        poses: outcome.poses.iter().map(|&pose| site_from_travel * pose).collect(),
        calibration: outcome.calibration,
        association,
    }
}

/// Landmarks that are one, each in one pair with the smaller index first; the pair with the largest
/// second index first.
fn pairs_that_are_one(
    placed: &[Placed<'_>],
    shared: &[Vec<(usize, usize)>],
    fit: &RefinedTogether,
    params: &AlignmentParams,
) -> Vec<(usize, usize)> {
    let n = shared.len().min(fit.landmarks.len());
    // Maps bend: what the fit says of its own errors is not all.
    let bending = DMatrix::identity(2 * n, 2 * n) * params.place_std_m.powi(2);
    let covariance = fit.landmark_covariance.view((0, 0), (2 * n, 2 * n)) + bending;
    let log_density = (n as f64 / area_m2(&fit.landmarks[..n])).ln();
    let reach_m = params.deviations_max * FIT_STDS * params.place_std_m;
    let mut found = Vec::new();
    for second in 0..n {
        for first in 0..second {
            let off_m = (fit.landmarks[first] - fit.landmarks[second]).norm();
            if reach_m < off_m || !may_be_one(placed, &shared[first], &shared[second]) {
                continue;
            }
            let pair = (first, second);
            let gain = log_same_place(&fit.landmarks, &covariance, pair) - log_density;
            if 0.0 < gain {
                found.push((gain, pair));
            }
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut is_taken = vec![false; n];
    let mut pairs: Vec<(usize, usize)> = Vec::new();
    for (_, (first, second)) in found {
        if !is_taken[first] && !is_taken[second] {
            (is_taken[first], is_taken[second]) = (true, true);
            pairs.push((first, second));
        }
    }
    pairs.sort_by_key(|pair| std::cmp::Reverse(pair.1));
    pairs
}

/// Whether two landmarks look alike, and no travel that has both saw them at once.
fn may_be_one(placed: &[Placed<'_>], a: &[(usize, usize)], b: &[(usize, usize)]) -> bool {
    let of = |&(travel, index): &(usize, usize)| &placed[travel].outcome.landmarks[index];
    let kinds_differ = a.iter().any(|a| b.iter().any(|b| of(a).kind != of(b).kind));
    if kinds_differ {
        return false;
    }
    let pairs = a.iter().flat_map(|a| b.iter().map(move |b| (a, b)));
    let mut at_once = pairs.filter(|(a, b)| a.0 == b.0).map(|(a, b)| {
        let (a, b) = (&of(a).sightings, &of(b).sightings);
        let n_at_once =
            a.iter().filter(|(step, _)| b.iter().any(|(other, _)| other == step)).count();
        n_at_once as f64 / a.len().min(b.len()).max(1) as f64
    });
    at_once.all(|share| share <= AT_ONCE_SHARE_MAX)
}

/// Area of the smallest upright rectangle around all, a metre wide at least, in square metres.
fn area_m2(places: &[Point2<f64>]) -> f64 {
    let along = |axis: usize| {
        let min = places.iter().map(|at| at[axis]).fold(f64::INFINITY, f64::min);
        let max = places.iter().map(|at| at[axis]).fold(f64::NEG_INFINITY, f64::max);
        (max - min).max(1.0)
    };
    along(0) * along(1)
}

/// What was of the second landmark is of the first, and those after it move up.
fn renumber(members: &mut [Member<'_>], (kept, gone): (usize, usize)) {
    for landmark in members.iter_mut().flat_map(|member| member.association.iter_mut().flatten()) {
        let index = *landmark as usize;
        if index == gone {
            *landmark = u32::try_from(kept).unwrap_or(u32::MAX);
        } else if gone < index {
            *landmark -= 1;
        }
    }
}

/// The next fit starts where the last one ended.
fn go_on(members: &mut [Member<'_>], fit: RefinedTogether) {
    let found = fit.poses.into_iter().zip(fit.calibrations);
    for (member, (poses, calibration)) in members.iter_mut().zip(found) {
        (member.poses, member.calibration) = (poses, calibration);
    }
}

fn outcome(
    placed: &[Placed<'_>],
    shared: &[Vec<(usize, usize)>],
    fit: RefinedTogether,
) -> JointOutcome {
    let shape = shape_covariance(&fit.landmarks, &fit.landmark_covariance);
    let block =
        |of: &DMatrix<f64>, index: usize| of.fixed_view::<2, 2>(2 * index, 2 * index).into_owned();
    let landmarks = shared.iter().zip(&fit.landmarks).enumerate();
    let landmarks = landmarks.filter_map(|(index, (parts, &position))| {
        let &(travel, first) = parts.first()?;
        let of = |&(travel, index): &(usize, usize)| &placed[travel].outcome.landmarks[index];
        let seen = parts.iter().flat_map(|part| {
            of(part).sightings.iter().map(|&(step, within)| (part.0, step, within))
        });
        Some(JointLandmark {
            position,
            covariance_m2: block(&fit.landmark_covariance, index),
            shape_covariance_m2: block(&shape, index),
            kind: of(&(travel, first)).kind,
            certainty: parts.iter().map(|part| of(part).certainty).fold(1.0, f64::min),
            sightings: seen.collect(),
        })
    });
    JointOutcome {
        landmarks: landmarks.collect(),
        poses: fit.poses,
        calibrations: fit.calibrations,
        cost: fit.cost,
    }
}

impl Constellation {
    /// What several travels say together, in the frame that they share. `travels` are those that the
    /// outcome is of, in their order.
    pub fn of_joint(travels: &[&Travel], outcome: &JointOutcome) -> Self {
        let star = |landmark: &JointLandmark| Star {
            position: landmark.position,
            covariance_m2: landmark.shape_covariance_m2,
            kind: landmark.kind,
            exists: exists(landmark.sightings.len()),
        };
        let mut coverage = Coverage::default();
        let found = outcome.poses.iter().zip(&outcome.calibrations);
        for (travel, (poses, calibration)) in travels.iter().zip(found) {
            coverage.join(&Coverage::of(travel, poses, calibration), Pose::IDENTITY);
        }
        Self { stars: outcome.landmarks.iter().map(star).collect(), coverage }
    }
}
