//! Search over associations: which landmark every sighting saw, when that cannot be told from the
//! sighting itself.
//!
//! Hypotheses are kept side by side as the travel goes on. A sighting may be of any landmark known
//! that fits, of a new one, or false; what fits is judged with the covariance of the hypothesis,
//! and each that is kept is fitted anew, with all poses back to the first, so that the past is
//! revised by what is seen later. Poses alone would not do where odometry drifts steadily: the
//! drift is unknown and bends all ways alike. It is estimated with them, and as a loop can bend too
//! far for one linear model, the search starts with several drifts side by side.
//!
//! After D. B. Reid, "An algorithm for tracking multiple targets", IEEE Transactions on Automatic
//! Control 24 (1979), with the evidence of equation (11) of TBF98 by Laplace's method
//! ([`crate::least_squares`]) instead of a filter's. Time
//! O(sightings kept (steps landmarks² + landmarks³)).

use std::collections::HashSet;
use std::f64::consts::TAU;
use std::sync::Arc;

use nalgebra::{DMatrix, Matrix2};

use crate::chain::Chains;
use crate::consolidation::renumber;
use crate::error_model::ErrorModel;
use crate::hypothesis::Hypothesis;
use crate::landmark::LandmarkKind;
use crate::least_squares::{Bearing, Estimate, Fit, sighting_residual};
use crate::missed::Missed;
use crate::past::Past;
use crate::travel::Travel;

/// How far the search goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchParams {
    /// Hypotheses kept from one sighting to the next.
    pub n_kept_max: usize,
    /// Hypotheses that agree on the last so many sightings, on the number of landmarks and about on
    /// where the robot is are taken for one: the better stays.
    pub n_compared: usize,
    /// The last so many steps with sightings, and up to twice as many, are fitted with every new
    /// one; what is older moves no more.
    pub n_fitted: usize,
    /// Landmarks of a hypothesis: covariances take memory with its square. What is seen beyond counts
    /// as false.
    pub n_landmarks_max: u32,
    /// Hypotheses whose log-evidence is this far below the best are dropped.
    pub log_odds_max: f64,
    /// A landmark further from where it should be than this many standard deviations is not it.
    pub deviations_max: f64,
    /// Landmarks in a square metre of what the robot drives over or sees, before anything is seen.
    pub density_per_m2: f64,
    /// Share of the sightings that are of no landmark at all.
    pub false_share: f64,
    /// Share of landmarks driven over, or in view of a step, that are not reported.
    pub missed_share: f64,
    /// Share of sightings whose type is mistaken.
    pub mistaken_share: f64,
}

impl SearchParams {
    /// Landmarks marked by a person with a button, in corridors.
    pub const BUTTON: Self = Self {
        n_kept_max: 200,
        n_compared: usize::MAX,
        n_fitted: 100,
        log_odds_max: 20.0,
        n_landmarks_max: 500,
        deviations_max: 5.0,
        density_per_m2: 0.003,
        false_share: 1e-4,
        missed_share: 0.1,
        mistaken_share: 0.02,
    };

    /// Landmarks seen by a camera, several at a time, in a room.
    pub const CAMERA: Self = Self {
        n_kept_max: 20,
        n_compared: 12,
        n_fitted: 20,
        log_odds_max: 10.0,
        n_landmarks_max: 500,
        deviations_max: 4.0,
        density_per_m2: 0.05,
        false_share: 1e-2,
        missed_share: 0.85,
        mistaken_share: 0.02,
    };
}

/// A hypothesis under way.
#[derive(Clone, Debug)]
pub(crate) struct Branch {
    pub(crate) association: Vec<Option<u32>>,
    log_evidence: f64,
    kinds: Vec<LandmarkKind>,
    pub(crate) fit: Fit,
    /// What is not fitted any more.
    past: Option<Arc<Past>>,
    /// Of landmarks new, false, mistaken and missed.
    log_prior: f64,
    /// Which of the chains the next fit uses.
    chain: usize,
    /// Whether nothing has been seen again yet: the chain's own drift is then taken for granted.
    is_open: bool,
}

/// A hypothesis with one more sighting.
struct Child {
    parent: usize,
    landmark: Option<u32>,
    log_prior: f64,
    log_evidence: f64,
}

/// The search under way, from step to step.
#[derive(Clone, Debug)]
pub struct Search<'a> {
    travel: &'a Travel,
    params: SearchParams,
    chains: Chains,
    /// The only association that is looked at, if one is asked about.
    only: Option<&'a [Option<u32>]>,
    kept: Vec<Branch>,
    n_nodes_done: usize,
}

impl<'a> Search<'a> {
    /// Before the first step.
    pub fn new(travel: &'a Travel, model: &ErrorModel, params: SearchParams) -> Self {
        let chains = Chains::new(travel, model);
        let kept = (0..chains.n_roots()).map(|root| Branch::root(travel, &chains, root)).collect();
        Self { travel, params, chains, only: None, kept, n_nodes_done: 0 }
    }

    /// The same for one association alone: what the data say of it.
    pub fn along(mut self, association: &'a [Option<u32>]) -> Self {
        self.only = Some(association);
        self
    }

    /// Takes all hypotheses to the next step with sightings. False if there is none.
    pub fn advance(&mut self) -> bool {
        let node = self.n_nodes_done;
        if node == self.chains.n_nodes() {
            return false;
        }
        for branch in &mut self.kept {
            let chain = self.chains.chain(branch.chain, branch.is_open);
            chain.extend(&mut branch.fit.estimate, node);
        }
        for bearing in 0..self.chains.bearings(node).len() {
            self.branch(node, bearing);
        }
        self.n_nodes_done += 1;
        for branch in &mut self.kept {
            branch.forget(&self.chains, self.params.n_fitted);
        }
        true
    }

    /// Share of the steps done, 0 to 1.
    pub fn share(&self) -> f64 {
        self.n_nodes_done as f64 / self.chains.n_nodes().max(1) as f64
    }

    /// What explains the steps so far best, best first.
    pub fn hypotheses(&self) -> Vec<Hypothesis> {
        let mut known = HashSet::new();
        let distinct = self.kept.iter().filter(|branch| known.insert(&branch.association));
        distinct
            .map(|branch| Hypothesis {
                association: branch.association.clone(),
                log_evidence: branch.log_evidence,
                poses: branch.fit.estimate.poses.clone(),
                landmarks: branch.fit.estimate.landmarks.clone(),
                calibration: branch.fit.estimate.calibration,
            })
            .collect()
    }

    /// Logarithm of the best hypothesis' probability so far; `None` if nothing explains the steps.
    pub fn log_evidence(&self) -> Option<f64> {
        self.kept.iter().map(|branch| branch.log_evidence).max_by(f64::total_cmp)
    }

    /// Tells the next sighting's landmark, in every way that fits.
    fn branch(&mut self, node: usize, bearing: usize) {
        let mut children = Vec::new();
        for parent in 0..self.kept.len() {
            self.bear(parent, (node, bearing), &mut children);
        }
        children.sort_by(|a, b| b.log_evidence.total_cmp(&a.log_evidence));
        // Without children nothing explains the sighting, and nothing is kept.
        let best = children.first().map_or(0.0, |child| child.log_evidence);
        children.retain(|child| best - self.params.log_odds_max < child.log_evidence);
        self.merge(&mut children, self.chains.bearings(node)[bearing].sighting);
        children.truncate(self.params.n_kept_max);
        let seen = &self.chains.bearings(node)[bearing];
        let mut grown: Vec<Branch> =
            children.iter().filter_map(|child| self.grown(child, seen)).collect();
        grown.sort_by(|a, b| b.log_evidence.total_cmp(&a.log_evidence));
        let best = grown.first().map_or(0.0, |grown| grown.log_evidence);
        let mut known = HashSet::new();
        grown.retain(|grown| {
            let root = grown.is_open.then_some(grown.chain);
            best - self.params.log_odds_max < grown.log_evidence
                && known.insert((grown.association.clone(), root))
        });
        self.kept = grown;
    }

    /// Of children, the best first, that will fare alike, the best stays.
    fn merge(&self, children: &mut Vec<Child>, sighting: usize) {
        let Some(first) = sighting.checked_sub(self.params.n_compared) else { return };
        let mut known = HashSet::new();
        children.retain(|child| {
            let branch = &self.kept[child.parent];
            let Estimate { poses, landmarks, .. } = &branch.fit.estimate;
            let Some(pose) = poses.last() else { return true };
            let recent = branch.association[first..sighting].iter().copied();
            let mut recent: Vec<Option<u32>> = recent.chain([child.landmark]).collect();
            let is_new = child.landmark.is_some_and(|it| it as usize == landmarks.len());
            renumber(&mut recent);
            let place = [
                cell(pose.x_m / SAME_POSITION_M),
                cell(pose.y_m / SAME_POSITION_M),
                cell(pose.theta_rad / SAME_HEADING_RAD),
            ];
            let root = branch.is_open.then_some(branch.chain);
            known.insert((recent, landmarks.len() + usize::from(is_new), place, root))
        });
    }

    /// All that the sighting may be, after one branch.
    fn bear(&self, parent: usize, (node, bearing): (usize, usize), children: &mut Vec<Child>) {
        let branch = &self.kept[parent];
        let chain = self.chains.chain(branch.chain, branch.is_open);
        let estimate = &branch.fit.estimate;
        let arrow = chain.linearised(estimate, &branch.association, branch.past.as_deref());
        let Some(covariance) = arrow.last_and_border_covariance() else { return };
        let Some(&pose) = estimate.poses.last() else { return };
        let (here, seen) =
            (&self.chains.bearings(node)[..bearing], &self.chains.bearings(node)[bearing]);
        let sighting = LandmarkKind::of(self.chains.sighting(self.travel, seen));
        let here_too = (node, &self.travel.detector);
        let missed = Missed::new(branch, chain, &covariance, &self.params, here_too);
        let on_the_way = if bearing == 0 { missed.known_landmarks() } else { 0.0 };
        let mut add = |landmark, log_prior: f64, log_density: f64| {
            if self.only.is_some_and(|only| only[seen.sighting] != landmark) {
                return;
            }
            let log_prior = log_prior + on_the_way;
            children.push(Child {
                parent,
                landmark,
                log_prior: branch.log_prior + log_prior,
                log_evidence: branch.log_evidence + log_prior + log_density,
            });
        };
        let log_new = self.params.density_per_m2.ln();
        add(None, self.params.false_share.ln() + log_new, 0.0);
        let is_known =
            matches!(sighting, LandmarkKind::Identity(_)) && branch.kinds.contains(&sighting);
        let n_landmarks = u32::try_from(estimate.landmarks.len()).ok();
        let new = n_landmarks.filter(|n| !is_known && *n < self.params.n_landmarks_max);
        if new.is_some() {
            let is_told = matches!(sighting, LandmarkKind::Identity(_));
            let place = pose * seen.offset_m;
            let log_unseen = if is_told { 0.0 } else { missed.new_landmark(place) };
            add(new, log_new + log_unseen, 0.0);
        }
        let squares_max = self.params.deviations_max.powi(2);
        for (landmark, kind) in (0_u32..).zip(&branch.kinds) {
            let is_it = |other: &Bearing| branch.association[other.sighting] == Some(landmark);
            let Some(log_same) = log_same(*kind, sighting, &self.params) else { continue };
            if here.iter().any(is_it) {
                continue;
            }
            let squares = if is_known || self.only.is_some() { f64::INFINITY } else { squares_max };
            if let Some(log_density) = log_density(estimate, landmark, seen, (&covariance, squares))
            {
                add(Some(landmark), log_same, log_density);
            }
        }
    }

    /// The child, fitted.
    fn grown(&self, child: &Child, seen: &Bearing) -> Option<Branch> {
        let mut branch = self.kept[child.parent].clone();
        branch.log_prior = child.log_prior;
        branch.log_evidence = child.log_evidence;
        branch.association[seen.sighting] = child.landmark;
        let Some(landmark) = child.landmark else { return Some(branch) };
        let estimate = &mut branch.fit.estimate;
        if landmark as usize == estimate.landmarks.len() {
            let pose = *estimate.poses.last()?;
            estimate.landmarks.push(pose * seen.offset_m);
            branch.kinds.push(LandmarkKind::of(self.chains.sighting(self.travel, seen)));
            return Some(branch);
        }
        let chain = self.chains.chain(branch.chain, false);
        let past = branch.past.as_deref();
        let fit = chain.fit(estimate.clone(), &branch.association, past, N_FIT_STEPS)?;
        branch.is_open = false;
        branch.chain = self.chains.nearest(&fit.estimate.calibration);
        branch.log_evidence = fit.log_evidence + branch.log_prior;
        branch.fit = fit;
        Some(branch)
    }
}

/// The whole number next to a finite one, as bits that can be compared.
fn cell(number: f64) -> u64 {
    // Adding zero makes -0 into 0.
    (number.round() + 0.0).to_bits()
}

/// Robots this far apart are about where the other is, in metres.
const SAME_POSITION_M: f64 = 0.5;
/// The same of their headings, in radians.
const SAME_HEADING_RAD: f64 = 0.3;

/// Steps of a fit after each sighting: the last one's result is near already.
const N_FIT_STEPS: u32 = 4;

impl Branch {
    /// Makes the older half of the steps past, once there are twice `n_fitted`.
    fn forget(&mut self, chains: &Chains, n_fitted: usize) {
        let estimate = &self.fit.estimate;
        let first = self.past.as_ref().map_or(0, |past| past.node);
        if estimate.poses.len() < first + 2 * n_fitted {
            return;
        }
        let chain = chains.chain(self.chain, self.is_open);
        let until = (self.past.as_deref(), first + n_fitted);
        // Equations that cannot be solved are fitted on as they are.
        if let Some(past) = Past::until(chain, estimate, &self.association, until) {
            self.past = Some(Arc::new(past));
        }
    }

    /// Before anything was seen, with the drift of a root.
    fn root(travel: &Travel, chains: &Chains, root: usize) -> Self {
        let calibration = chains.chain(root, true).calibration;
        let estimate = Estimate { poses: Vec::new(), landmarks: Vec::new(), calibration };
        Self {
            association: vec![None; travel.n_sightings()],
            log_evidence: chains.log_share(root),
            kinds: Vec::new(),
            fit: Fit { estimate, log_evidence: 0.0, cost: 0.0 },
            past: None,
            log_prior: 0.0,
            chain: root,
            is_open: true,
        }
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

/// Logarithm of the density of seeing a landmark where it was seen, in 1/m²; `None` beyond so many
/// squared deviations.
fn log_density(
    estimate: &Estimate,
    landmark: u32,
    seen: &Bearing,
    (covariance, squares_max): (&DMatrix<f64>, f64),
) -> Option<f64> {
    let pose = *estimate.poses.last()?;
    let point = estimate.landmarks[landmark as usize];
    let (residual, by_pose, by_point) = sighting_residual(pose, point, seen);
    let at = 6 + 2 * landmark as usize;
    let cross = by_pose * covariance.fixed_view::<3, 2>(0, at) * by_point.transpose();
    let spread: Matrix2<f64> = by_pose * covariance.fixed_view::<3, 3>(0, 0) * by_pose.transpose()
        + by_point * covariance.fixed_view::<2, 2>(at, at) * by_point.transpose()
        + cross
        + cross.transpose()
        + seen.precision.try_inverse()?;
    let squares = residual.dot(&(spread.try_inverse()? * residual));
    let log_density = -squares / 2.0 - spread.determinant().ln() / 2.0 - TAU.ln();
    (squares < squares_max).then_some(log_density)
}
