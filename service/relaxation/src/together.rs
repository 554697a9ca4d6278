//! Least squares over several travels that saw the same landmarks: poses of all, the odometry's steady
//! errors of each, and one set of places.
//!
//! ```text
//! min  sum over travels of what refine.rs minimises, the landmarks being the same
//! ```
//!
//! The first travel's first pose is held where it is given; the others are free, tied by landmarks alone.
//! Each travel's poses are eliminated by itself ([`crate::arrow`]), what is left is added up over the
//! calibrations of all and the landmarks, solved by Cholesky's method, and put back. Time
//! O(steps landmarks² + (travels + landmarks)³) a step of Gauss and Newton's, damped as Levenberg's.

use std::f64::consts::TAU;

use meetpoint_geometry::{Point2, Pose};
use nalgebra::{Cholesky, DMatrix, DVector};

use crate::arrow::{Reduced, Solution, inverse};
use crate::calibration::Calibration;
use crate::chain::difference;
use crate::error_model::ErrorModel;
use crate::least_squares::{Chain, Estimate, FIRST_POSE_PRECISION, moved};
use crate::refine::{CALIBRATION_STEP_MIN, DEVIATIONS_MAX, N_ROUNDS_MAX, N_STEPS_MAX, STEP_MIN};
use crate::travel::Travel;

/// Precision of where a travel but the first begins: nothing, but enough to be invertible.
const FREE_PRECISION: f64 = 1e-6;

/// A travel with what is known of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Member<'a> {
    /// What the robot measured.
    pub travel: &'a Travel,
    /// How wrong that may be.
    pub model: ErrorModel,
    /// About where the robot was at every step, in the frame that all share.
    pub poses: Vec<Pose>,
    /// About what undoes the odometry's steady errors.
    pub calibration: Calibration,
    /// By sighting: index of the landmark among those that all share; `None` for one that does not count.
    pub association: Vec<Option<u32>>,
}

/// What fits best.
#[derive(Clone, Debug, PartialEq)]
pub struct RefinedTogether {
    /// By travel and step.
    pub poses: Vec<Vec<Pose>>,
    /// By travel.
    pub calibrations: Vec<Calibration>,
    /// By landmark of the associations.
    pub landmarks: Vec<Point2<f64>>,
    /// How wrong these may be seen from the first travel's first pose, in square metres: two rows and
    /// columns for each.
    pub landmark_covariance: DMatrix<f64>,
    /// Half of the weighted sum of squares.
    pub cost: f64,
    /// Logarithm of the density of all measurements, integrated over all unknowns by Laplace's method, with
    /// a uniform density of 1/m² for every landmark.
    pub log_evidence: f64,
}

/// Poses and places that fit all travels best. `None` without a travel, or if the equations cannot be
/// solved.
pub fn refined_together(members: &[Member<'_>]) -> Option<RefinedTogether> {
    let places = places(members);
    let estimate = |member: &Member<'_>| Estimate {
        poses: member.poses.clone(),
        landmarks: places.clone(),
        calibration: member.calibration,
    };
    let mut estimates: Vec<Estimate> = members.iter().map(estimate).collect();
    let associations: Vec<_> = members.iter().map(|member| &member.association[..]).collect();
    let mut chains = chains(members, &estimates);
    for round in 1..=N_ROUNDS_MAX {
        let cost = fit(&chains, &associations, &mut estimates)?;
        let moved = chains.iter().zip(&estimates);
        let moved = moved.map(|(chain, at)| difference(&at.calibration, &chain.calibration).amax());
        let stands = moved.fold(0.0, f64::max) < CALIBRATION_STEP_MIN;
        if stands || round == N_ROUNDS_MAX {
            let all = reduced(&chains, &associations, &estimates, 0.0)?;
            let factor = Cholesky::new(summed(&all).0)?;
            let log_determinant = factor.ln_determinant()
                + all.iter().map(|reduced| reduced.log_determinant).sum::<f64>();
            let log_volume = log_volume(&chains, &associations, places.len());
            let covariance = inverse(&factor.unpack());
            let (first, n) = (3 * members.len(), 2 * places.len());
            return Some(RefinedTogether {
                landmark_covariance: covariance.view((first, first), (n, n)).into_owned(),
                calibrations: estimates.iter().map(|estimate| estimate.calibration).collect(),
                landmarks: estimates.first()?.landmarks.clone(),
                poses: estimates.into_iter().map(|estimate| estimate.poses).collect(),
                cost,
                log_evidence: log_volume - log_determinant / 2.0 - cost,
            });
        }
        chains = self::chains(members, &estimates);
    }
    None
}

/// The travels linearised about what their odometry errs by.
fn chains(members: &[Member<'_>], estimates: &[Estimate]) -> Vec<Chain> {
    let all = members.iter().zip(estimates).enumerate();
    all.map(|(index, (member, estimate))| {
        let mut chain = Chain::new(member.travel, estimate.calibration, &member.model, |_| true);
        chain.deviations_max = DEVIATIONS_MAX;
        chain.start = member.poses.first().copied().unwrap_or(Pose::IDENTITY);
        chain.start_precision = if index == 0 { FIRST_POSE_PRECISION } else { FREE_PRECISION };
        chain
    })
    .collect()
}

/// Goes downhill until a step is small, and tells the cost there.
fn fit(
    chains: &[Chain],
    associations: &[&[Option<u32>]],
    estimates: &mut Vec<Estimate>,
) -> Option<f64> {
    let cost_of = |estimates: &[Estimate]| -> f64 {
        let all = chains.iter().zip(associations).zip(estimates);
        all.map(|((chain, association), estimate)| {
            chain.cost_of(estimate, association, (None, 0..estimate.poses.len(), true))
        })
        .sum()
    };
    let (mut cost, mut damping) = (cost_of(estimates), 0.0);
    for _ in 0..N_STEPS_MAX {
        let all = reduced(chains, associations, estimates, damping)?;
        let (corner, gradient) = summed(&all);
        let border = -Cholesky::new(corner)?.solve(&gradient);
        let solutions = all.iter().enumerate().map(|(index, reduced)| {
            let border = border_of(&border, index, all.len());
            Solution { poses: reduced.poses(&border), border, log_determinant: 0.0 }
        });
        let solutions: Vec<Solution> = solutions.collect();
        let largest = solutions.iter().map(Solution::largest).fold(0.0, f64::max);
        let tried = estimates.iter().zip(&solutions);
        let tried: Vec<Estimate> = tried.map(|(at, step)| moved(at, step, 0)).collect();
        let tried_cost = cost_of(&tried);
        let is_small = largest < STEP_MIN;
        if tried_cost <= cost || is_small {
            (*estimates, cost) = (tried, tried_cost);
            damping /= 10.0;
        } else {
            damping = (damping * 10.0_f64).max(1.0);
        }
        if is_small {
            break;
        }
    }
    Some(cost)
}

/// What the evidence has besides the best fit and what fits about as well: densities of all measurements
/// at their best, and two numbers to integrate over for every landmark.
fn log_volume(chains: &[Chain], associations: &[&[Option<u32>]], n_landmarks: usize) -> f64 {
    let all = chains.iter().zip(associations).map(|(chain, association)| {
        let (log_precision, n_seen) =
            chain.log_precision(association, (None, 0..chain.nodes.len(), true));
        log_precision / 2.0 - f64::from(n_seen) * TAU.ln()
    });
    all.sum::<f64>() + n_landmarks as f64 * TAU.ln()
}

/// Equations of all travels, their poses taken out.
fn reduced(
    chains: &[Chain],
    associations: &[&[Option<u32>]],
    estimates: &[Estimate],
    damping: f64,
) -> Option<Vec<Reduced>> {
    let all = chains.iter().zip(associations).zip(estimates);
    all.map(|((chain, association), estimate)| {
        let mut arrow = chain.linearised(estimate, association, None);
        arrow.damp(damping);
        arrow.reduced()
    })
    .collect()
}

/// The borders' equations added up: first the calibrations of all, then the landmarks.
fn summed(all: &[Reduced]) -> (DMatrix<f64>, DVector<f64>) {
    let n_landmarks = all.first().map_or(0, |reduced| reduced.border_gradient().len() - 3);
    let first = 3 * all.len();
    let n = first + n_landmarks;
    let (mut corner, mut gradient) = (DMatrix::zeros(n, n), DVector::zeros(n));
    for (index, reduced) in all.iter().enumerate() {
        let of_border = |row: usize| if row < 3 { 3 * index + row } else { first + row - 3 };
        for column in 0..n_landmarks + 3 {
            gradient[of_border(column)] += reduced.border_gradient()[column];
            for row in 0..n_landmarks + 3 {
                corner[(of_border(row), of_border(column))] += reduced.corner()[(row, column)];
            }
        }
    }
    (corner, gradient)
}

/// One travel's part of the border.
fn border_of(border: &DVector<f64>, index: usize, n_travels: usize) -> DVector<f64> {
    let landmarks = border.rows(3 * n_travels, border.len() - 3 * n_travels);
    let calibration = border.rows(3 * index, 3);
    DVector::from_iterator(3 + landmarks.len(), calibration.iter().chain(landmarks.iter()).copied())
}

/// Where landmarks are, as their first sightings have them.
fn places(members: &[Member<'_>]) -> Vec<Point2<f64>> {
    let all = members.iter().flat_map(|member| member.association.iter().flatten());
    let n_landmarks = all.max().map_or(0, |last| *last as usize + 1);
    let mut places = vec![None; n_landmarks];
    for member in members {
        let steps = member.travel.steps.iter().zip(&member.poses);
        let seen = steps.flat_map(|(step, pose)| {
            step.sightings.iter().map(move |seen| *pose * seen.offset_m())
        });
        for (place, landmark) in seen.zip(&member.association) {
            if let Some(landmark) = landmark {
                places[*landmark as usize].get_or_insert(place);
            }
        }
    }
    places.into_iter().map(|place| place.unwrap_or_else(Point2::origin)).collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::motion::Motion;
    use crate::refine::refined;
    use crate::travel::{Detector, Sighting, Step};

    const POSTS: [[f64; 2]; 4] = [[3.0, 1.0], [5.0, -1.0], [7.0, 2.0], [2.0, -2.0]];

    /// A robot that starts there and goes on by a metre and a tenth of a radian a step; what its
    /// odometry says is a tenth too long.
    fn travel(start: Pose) -> Travel {
        let leg = Pose::new(1.0, 0.0, 0.1);
        let mut at = start;
        let mut steps = Vec::new();
        for index in 0..6 {
            let legs = if index == 0 { Vec::new() } else { vec![Pose::new(1.1, 0.0, 0.1)] };
            let seen = POSTS.map(Point2::from).map(|post| {
                let offset = (at.inverse() * post).coords;
                let (range_m, bearing_rad) = (offset.norm(), offset.y.atan2(offset.x));
                Sighting { identity: None, landmark_type: 0, range_m, bearing_rad }
            });
            steps.push(Step { motion: Motion::new(legs), sightings: seen.to_vec() });
            at = at * leg;
        }
        Travel { detector: Detector { range_max_m: 20.0, half_field_of_view_rad: PI }, steps }
    }

    fn member(travel: &Travel, start: Pose) -> Member<'_> {
        let reckoned = travel.dead_reckoning(&Calibration::NONE);
        Member {
            travel,
            model: ErrorModel::CAMERA,
            poses: reckoned.into_iter().map(|pose| start * pose).collect(),
            calibration: Calibration::NONE,
            association: [0, 1, 2, 3].map(Some).repeat(travel.steps.len()),
        }
    }

    #[test]
    fn two_travels_find_how_they_lie_to_each_other() {
        let start = Pose::new(4.0, -1.0, 2.0);
        let (first, second) = (travel(Pose::IDENTITY), travel(start));
        let rough = Pose::new(4.3, -0.8, 2.2);
        let members = [member(&first, Pose::IDENTITY), member(&second, rough)];
        let fit = refined_together(&members).expect("it can be solved");
        let off = fit.poses[1][0].step_to(start);
        // That scales are about right beforehand pulls a little.
        assert!(off.distance_m() < 0.03 && off.theta_rad.abs() < 0.005, "{off:?}");
        for (found, post) in fit.landmarks.iter().zip(POSTS.map(Point2::from)) {
            assert!((found - post).norm() < 0.03, "{found} {post}");
        }
    }

    #[test]
    fn one_travel_alone_is_what_it_was() {
        let travel = travel(Pose::IDENTITY);
        let alone = member(&travel, Pose::IDENTITY);
        let start = (alone.poses.clone(), alone.calibration);
        let expected =
            refined(&travel, &alone.model, &alone.association, start).expect("it can be solved");
        let mut chain = Chain::new(&travel, expected.calibration, &alone.model, |_| true);
        chain.deviations_max = DEVIATIONS_MAX;
        let (poses, landmarks) = (expected.poses.clone(), expected.landmarks.clone());
        let start = Estimate { poses, landmarks, calibration: expected.calibration };
        let judged = chain
            .fit(start, &alone.association, None, (N_STEPS_MAX, STEP_MIN))
            .expect("it can be solved");
        let fit = refined_together(&[alone]).expect("it can be solved");
        let apart = (fit.log_evidence - judged.log_evidence).abs();
        assert!(apart < 1e-3, "{} {}", fit.log_evidence, judged.log_evidence);
        for (a, b) in fit.poses[0].iter().zip(&expected.poses) {
            assert!((a.position() - b.position()).norm() < 1e-6, "{a:?} {b:?}");
        }
        let off = (&fit.landmark_covariance - &expected.landmark_covariance).amax();
        assert!(off < 1e-9, "covariances differ by {off}");
        assert!(refined_together(&[]).is_none(), "nobody");
    }
}
