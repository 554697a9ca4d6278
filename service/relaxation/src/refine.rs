//! Poses at all steps and places of landmarks once associations are settled: corridors become
//! straight again, and nothing is rounded to a grid's cells.
//!
//! Least squares ([`crate::least_squares`]) over all steps, with the odometry's steady errors among
//! the unknowns, linearised anew about them until they stand still. A sighting that fits badly
//! pulls with limited force.

use meetpoint_geometry::{Point2, Pose};
use nalgebra::DMatrix;

use crate::calibration::Calibration;
use crate::chain::difference;
use crate::error_model::ErrorModel;
use crate::least_squares::{Chain, Estimate};
use crate::travel::{Step, Travel};

/// Sightings further off than this many standard deviations count linearly: what finds landmarks errs
/// by much more to one side than to the other (a camera takes a post for nearer than it is), which
/// the median withstands and the mean does not.
pub(crate) const DEVIATIONS_MAX: f64 = 1.0;
/// Rounds of linearising the ways anew.
pub(crate) const N_ROUNDS_MAX: u32 = 10;
/// A calibration that moved less than this stands still.
pub(crate) const CALIBRATION_STEP_MIN: f64 = 1e-6;
/// Steps smaller than this, in metres and radians, change nothing that matters.
pub(crate) const STEP_MIN: f64 = 1e-4;
/// Steps of a round.
pub(crate) const N_STEPS_MAX: u32 = 30;

/// What fits best.
#[derive(Clone, Debug, PartialEq)]
pub struct Refined {
    /// By step of the travel.
    pub poses: Vec<Pose>,
    /// By landmark of the association.
    pub landmarks: Vec<Point2<f64>>,
    /// How wrong the landmarks' places may be seen from the first step, in square metres: two rows
    /// and columns for each.
    pub landmark_covariance: DMatrix<f64>,
    /// What undoes the odometry's steady errors.
    pub calibration: Calibration,
    /// Half of the weighted sum of squares.
    pub cost: f64,
}

/// Poses and places that fit `association` (by sighting: the landmark's index) best, starting from
/// `poses` at all steps. `None` if the equations cannot be solved.
pub fn refined(
    travel: &Travel,
    model: &ErrorModel,
    association: &[Option<u32>],
    (poses, calibration): (Vec<Pose>, Calibration),
) -> Option<Refined> {
    let landmarks = places(travel, association, &poses);
    let mut estimate = Estimate { poses, landmarks, calibration };
    for round in 1..=N_ROUNDS_MAX {
        let about = estimate.calibration;
        let mut chain = Chain::new(travel, about, model, |_| true);
        chain.deviations_max = DEVIATIONS_MAX;
        let fit = chain.fit(estimate, association, None, (N_STEPS_MAX, STEP_MIN))?;
        let stands = difference(&fit.estimate.calibration, &about).amax() < CALIBRATION_STEP_MIN;
        estimate = fit.estimate;
        if stands || round == N_ROUNDS_MAX {
            let covariance =
                chain.linearised(&estimate, association, None).last_and_border_covariance()?;
            let n = 2 * estimate.landmarks.len();
            let landmark_covariance = covariance.view((6, 6), (n, n)).into_owned();
            let Estimate { poses, landmarks, calibration } = estimate;
            return Some(Refined {
                poses,
                landmarks,
                landmark_covariance,
                calibration,
                cost: fit.cost,
            });
        }
    }
    None
}

/// Poses at all steps, given those at some, by their indices: odometry from one to the next, its
/// error at the end left where it is.
pub(crate) fn poses_at_all_steps(
    travel: &Travel,
    (steps, known): (&[usize], &[Pose]),
    calibration: &Calibration,
) -> Vec<Pose> {
    let mut known = steps.iter().zip(known).peekable();
    let mut pose = Pose::IDENTITY;
    if let Some(&(&first, &at)) = known.peek() {
        pose = before(&travel.steps[..=first], at, calibration);
    }
    let mut poses = Vec::with_capacity(travel.steps.len());
    for (index, step) in travel.steps.iter().enumerate() {
        if 0 < index {
            pose = pose * step.motion.displacement(calibration);
        }
        if let Some((_, &at)) = known.next_if(|(known, _)| **known == index) {
            pose = at;
        }
        poses.push(pose);
    }
    poses
}

/// The pose at the first of `steps`, given that at the last.
fn before(steps: &[Step], last: Pose, calibration: &Calibration) -> Pose {
    let way = steps
        .iter()
        .skip(1)
        .fold(Pose::IDENTITY, |way, step| way * step.motion.displacement(calibration));
    last * way.inverse()
}

/// Where landmarks are, as their first sightings have them.
fn places(travel: &Travel, association: &[Option<u32>], poses: &[Pose]) -> Vec<Point2<f64>> {
    let n_landmarks = association.iter().flatten().max().map_or(0, |last| *last as usize + 1);
    let mut places = vec![None; n_landmarks];
    let sightings =
        travel.steps.iter().zip(poses).flat_map(|(step, pose)| {
            step.sightings.iter().map(move |seen| *pose * seen.offset_m())
        });
    for (place, landmark) in sightings.zip(association) {
        if let Some(landmark) = landmark {
            places[*landmark as usize].get_or_insert(place);
        }
    }
    places.into_iter().map(|place| place.unwrap_or_else(Point2::origin)).collect()
}
