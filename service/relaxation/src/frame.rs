//! All that the sightings of one step may be, taken together.
//!
//! Two sightings of one step are of two landmarks, and they share the robot's pose: what one says of
//! it tells the others apart. So sighting after sighting is told in every way that fits, each with
//! the covariance that follows from those before it,
//!
//! ```text
//! p(z1 .. zk | landmarks j1 .. jk)  =  product over i of  N(zi; h(ji), S(ji) given z1 .. z(i - 1))
//! ```
//!
//! and the best ways are kept: the joint compatibility of J. Neira and J. D. Tardós, "Data
//! association in stochastic mapping using the joint compatibility test", IEEE Transactions on
//! Robotics and Automation 17 (2001), with probabilities. Time O(sightings ways border²).

use std::f64::consts::TAU;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Matrix2, Matrix2x3, Vector2};

use crate::branch::Branch;
use crate::landmark::LandmarkKind;
use crate::least_squares::{Bearing, sighting_residual};
use crate::missed::Missed;
use crate::search::SearchParams;

/// One way to tell the sightings of a step.
#[derive(Clone, Debug)]
pub(crate) struct Reading {
    /// By sighting; new landmarks are numbered on.
    pub(crate) landmarks: Vec<Option<u32>>,
    /// Of landmarks new, false, mistaken and missed.
    pub(crate) log_prior: f64,
    /// Of the sightings, given their landmarks.
    pub(crate) log_density: f64,
    /// Kinds of the landmarks that are new.
    pub(crate) new_kinds: Vec<LandmarkKind>,
    /// What is known with the sightings so far.
    known: Arc<Known>,
}

impl Reading {
    fn log_probability(&self) -> f64 {
        self.log_prior + self.log_density
    }

    /// With one more sighting.
    fn with(&self, landmark: Option<u32>, log_prior: f64, log_density: f64) -> Self {
        let mut grown = self.clone();
        grown.landmarks.push(landmark);
        grown.log_prior += log_prior;
        grown.log_density += log_density;
        grown
    }
}

/// How far pose and border are from the branch's estimate, and how surely.
#[derive(Clone, Debug)]
struct Known {
    offset: DVector<f64>,
    covariance: DMatrix<f64>,
}

/// The sightings of a step, after one branch.
#[derive(Clone, Copy)]
pub(crate) struct Frame<'a> {
    pub(crate) branch: &'a Branch,
    pub(crate) params: &'a SearchParams,
    pub(crate) bearings: &'a [Bearing],
    /// What all sightings of the travel look like.
    pub(crate) kinds: &'a [LandmarkKind],
    /// The only association that is looked at, if one is asked about.
    pub(crate) only: Option<&'a [Option<u32>]>,
}

impl Frame<'_> {
    /// The best ways to tell the sightings, given the covariance of pose and border.
    pub(crate) fn readings(&self, covariance: DMatrix<f64>, missed: &Missed<'_>) -> Vec<Reading> {
        let offset = DVector::zeros(covariance.nrows());
        let nothing = Reading {
            landmarks: Vec::new(),
            log_prior: missed.known_landmarks(),
            log_density: 0.0,
            new_kinds: Vec::new(),
            known: Arc::new(Known { offset, covariance }),
        };
        let mut readings = vec![nothing];
        for index in 0..self.bearings.len() {
            let mut grown = Vec::new();
            let log_unseen = self.log_unseen(index, missed);
            for reading in &mut readings {
                if 0 < index {
                    self.learn(reading);
                }
                self.tell(index, log_unseen, reading, &mut grown);
            }
            grown.sort_by(|a, b| b.log_probability().total_cmp(&a.log_probability()));
            let best = grown.first().map_or(0.0, Reading::log_probability);
            grown.retain(|it| best - self.params.log_odds_max < it.log_probability());
            grown.truncate(self.params.n_kept_max);
            readings = grown;
        }
        readings
    }

    /// Logarithm of the probability that the landmark, if it is new, was not seen before.
    fn log_unseen(&self, index: usize, missed: &Missed<'_>) -> f64 {
        match (self.kinds[self.bearings[index].sighting], self.branch.fit.estimate.poses.last()) {
            (LandmarkKind::Type(_), Some(&pose)) => {
                missed.new_landmark(pose * self.bearings[index].offset_m)
            }
            _ => 0.0,
        }
    }

    /// Tells one sighting in every way that fits.
    fn tell(&self, index: usize, log_unseen: f64, before: &Reading, grown: &mut Vec<Reading>) {
        let seen = &self.bearings[index];
        let kind = self.kinds[seen.sighting];
        let is_asked = |landmark| self.only.is_none_or(|only| only[seen.sighting] == landmark);
        let log_new = self.params.density_per_m2.ln();
        if is_asked(None) {
            grown.push(before.with(None, self.params.false_share.ln() + log_new, 0.0));
        }
        let is_named = matches!(kind, LandmarkKind::Identity(_));
        let is_known =
            is_named && (self.branch.kinds.contains(&kind) || before.new_kinds.contains(&kind));
        let n_landmarks = self.branch.kinds.len() + before.new_kinds.len();
        let new = u32::try_from(n_landmarks).ok().filter(|n| *n < self.params.n_landmarks_max);
        if !is_known && new.is_some() && is_asked(new) {
            let mut reading = before.with(new, log_new + log_unseen, 0.0);
            reading.new_kinds.push(kind);
            grown.push(reading);
        }
        let squares_max = if is_known || self.only.is_some() {
            f64::INFINITY
        } else {
            self.params.deviations_max.powi(2)
        };
        for (landmark, known_kind) in (0_u32..).zip(&self.branch.kinds) {
            let Some(log_same) = log_same(*known_kind, kind, self.params) else { continue };
            if before.landmarks.contains(&Some(landmark)) || !is_asked(Some(landmark)) {
                continue;
            }
            let view = View::of(self.branch, landmark, seen);
            let log_density = view.and_then(|view| view.log_density(&before.known, squares_max));
            if let Some(log_density) = log_density {
                grown.push(before.with(Some(landmark), log_same, log_density));
            }
        }
    }

    /// Takes in what the last sighting says of pose and landmarks.
    fn learn(&self, reading: &mut Reading) {
        let last = reading.landmarks.len() - 1;
        let Some(landmark) = reading.landmarks[last] else { return };
        if self.branch.kinds.len() <= landmark as usize {
            return;
        }
        let view = View::of(self.branch, landmark, &self.bearings[last]);
        if let Some(known) = view.and_then(|view| view.learnt(&reading.known)) {
            reading.known = Arc::new(known);
        }
    }
}

/// A known landmark seen from the branch's pose, linearised.
struct View {
    residual: Vector2<f64>,
    by_pose: Matrix2x3<f64>,
    by_point: Matrix2<f64>,
    /// Of the landmark among pose and border.
    at: usize,
    noise: Matrix2<f64>,
}

impl View {
    fn of(branch: &Branch, landmark: u32, seen: &Bearing) -> Option<Self> {
        let estimate = &branch.fit.estimate;
        let (&pose, point) = (estimate.poses.last()?, estimate.landmarks[landmark as usize]);
        let (residual, by_pose, by_point) = sighting_residual(pose, point, seen);
        let at = 6 + 2 * landmark as usize;
        Some(Self { residual, by_pose, by_point, at, noise: seen.precision.try_inverse()? })
    }

    /// Residual and its covariance.
    fn off(&self, known: &Known) -> (Vector2<f64>, Matrix2<f64>) {
        let Known { offset, covariance } = known;
        let residual = self.residual
            + self.by_pose * offset.fixed_rows::<3>(0)
            + self.by_point * offset.fixed_rows::<2>(self.at);
        let by_point = self.by_point.transpose();
        let cross = self.by_pose * covariance.fixed_view::<3, 2>(0, self.at) * by_point;
        let of_pose = self.by_pose * covariance.fixed_view::<3, 3>(0, 0) * self.by_pose.transpose();
        let of_point = self.by_point * covariance.fixed_view::<2, 2>(self.at, self.at) * by_point;
        (residual, of_pose + of_point + cross + cross.transpose() + self.noise)
    }

    /// Logarithm of the density of seeing the landmark where it was seen, in 1/m²; `None` beyond so
    /// many squared deviations.
    fn log_density(&self, known: &Known, squares_max: f64) -> Option<f64> {
        let (residual, spread) = self.off(known);
        let squares = residual.dot(&(spread.try_inverse()? * residual));
        let log_density = -squares / 2.0 - spread.determinant().ln() / 2.0 - TAU.ln();
        (squares < squares_max).then_some(log_density)
    }

    /// What is known after it, by a Kalman filter's step.
    fn learnt(&self, known: &Known) -> Option<Known> {
        let (residual, spread) = self.off(known);
        let gain_by_residual = spread.try_inverse()?;
        let shared = known.covariance.fixed_columns::<3>(0) * self.by_pose.transpose()
            + known.covariance.fixed_columns::<2>(self.at) * self.by_point.transpose();
        let gain = &shared * gain_by_residual;
        let offset = &known.offset - &gain * residual;
        let covariance = &known.covariance - &gain * shared.transpose();
        Some(Known { offset, covariance })
    }
}

/// Logarithm of the probability that a landmark of a kind looks like another; `None` if it cannot
/// be it.
fn log_same(known: LandmarkKind, seen: LandmarkKind, params: &SearchParams) -> Option<f64> {
    match (known, seen) {
        (LandmarkKind::Identity(_), _) | (_, LandmarkKind::Identity(_)) => {
            (known == seen).then_some(0.0)
        }
        _ if known == seen => Some((1.0 - params.mistaken_share).ln()),
        _ => Some(params.mistaken_share.ln()),
    }
}
