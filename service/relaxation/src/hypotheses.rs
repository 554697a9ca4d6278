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

use nalgebra::{DMatrix, Matrix2};

use crate::chain::Chains;
use crate::error_model::ErrorModel;
use crate::least_squares::{Bearing, Estimate, Fit, sighting_residual};
use crate::missed::Missed;
use crate::travel::{Sighting, Travel};

/// How far the search goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchParams {
    /// Hypotheses kept from one sighting to the next.
    pub n_kept_max: usize,
    /// Hypotheses whose log-evidence is this far below the best are dropped.
    pub log_odds_max: f64,
    /// A landmark further from where it should be than this many standard deviations is not it.
    pub deviations_max: f64,
    /// Landmarks in a square metre of what the robot drives over or sees, before anything is seen.
    pub density_per_m2: f64,
    /// Share of the sightings that are of no landmark at all.
    pub false_share: f64,
    /// Share of landmarks driven over that are not reported.
    pub missed_share: f64,
    /// Share of sightings whose type is mistaken.
    pub mistaken_share: f64,
}

impl SearchParams {
    /// Landmarks marked by a person with a button, in corridors.
    pub const BUTTON: Self = Self {
        n_kept_max: 200,
        log_odds_max: 20.0,
        deviations_max: 5.0,
        density_per_m2: 0.005,
        false_share: 1e-4,
        missed_share: 0.1,
        mistaken_share: 0.02,
    };
}

/// One way to tell which landmark was seen when.
#[derive(Clone, Debug)]
pub struct Hypothesis {
    /// By sighting, in the order of the travel: index of the landmark, `None` for false ones.
    pub association: Vec<Option<u32>>,
    /// Logarithm of its probability, up to a constant that all hypotheses share.
    pub log_evidence: f64,
    pub(crate) kinds: Vec<Kind>,
    pub(crate) fit: Fit,
    /// Of landmarks new, false, mistaken and missed.
    log_prior: f64,
    /// Which of the chains the next fit uses.
    chain: usize,
    /// Whether nothing has been seen again yet: the chain's own drift is then taken for granted.
    is_open: bool,
}

/// What is known of a landmark beside its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Kind {
    pub(crate) identity: Option<u32>,
    pub(crate) landmark_type: u32,
}

/// A hypothesis with one more sighting.
struct Child {
    parent: usize,
    landmark: Option<u32>,
    log_prior: f64,
    log_evidence: f64,
}

/// The hypotheses that explain a travel best, best first.
pub fn hypotheses(travel: &Travel, model: &ErrorModel, params: &SearchParams) -> Vec<Hypothesis> {
    let chains = Chains::new(travel, model);
    let kept = (0..chains.n_roots()).map(|root| Hypothesis::root(travel, &chains, root)).collect();
    let mut search = Search { travel, params, chains, kept };
    for node in 0..search.chains.n_nodes() {
        for hypothesis in &mut search.kept {
            let chain = search.chains.chain(hypothesis.chain, hypothesis.is_open);
            chain.extend(&mut hypothesis.fit.estimate, node);
        }
        for bearing in 0..search.chains.bearings(node).len() {
            search.branch(node, bearing);
        }
    }
    search.kept
}

struct Search<'a> {
    travel: &'a Travel,
    params: &'a SearchParams,
    chains: Chains,
    kept: Vec<Hypothesis>,
}

impl Search<'_> {
    /// Tells the next sighting's landmark, in every way that fits.
    fn branch(&mut self, node: usize, bearing: usize) {
        let mut children = Vec::new();
        for parent in 0..self.kept.len() {
            self.bear(parent, (node, bearing), &mut children);
        }
        children.sort_by(|a, b| b.log_evidence.total_cmp(&a.log_evidence));
        let Some(best) = children.first().map(|child| child.log_evidence) else { return };
        children.retain(|child| best - self.params.log_odds_max < child.log_evidence);
        children.truncate(self.params.n_kept_max);
        let seen = &self.chains.bearings(node)[bearing];
        let mut grown: Vec<Hypothesis> =
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

    /// All that the sighting may be, after one hypothesis.
    fn bear(&self, parent: usize, (node, bearing): (usize, usize), children: &mut Vec<Child>) {
        let hypothesis = &self.kept[parent];
        let chain = self.chains.chain(hypothesis.chain, hypothesis.is_open);
        let estimate = &hypothesis.fit.estimate;
        let arrow = chain.linearised(estimate, &hypothesis.association);
        let Some(covariance) = arrow.last_and_border_covariance() else { return };
        let Some(&pose) = estimate.poses.last() else { return };
        let (here, seen) =
            (&self.chains.bearings(node)[..bearing], &self.chains.bearings(node)[bearing]);
        let sighting = self.chains.sighting(self.travel, seen);
        let here_too = (node, &self.travel.detector);
        let missed = Missed::new(hypothesis, chain, &covariance, self.params, here_too);
        let on_the_way = if bearing == 0 { missed.known_landmarks() } else { 0.0 };
        let mut add = |landmark, log_prior: f64, log_density: f64| {
            let log_prior = log_prior + on_the_way;
            children.push(Child {
                parent,
                landmark,
                log_prior: hypothesis.log_prior + log_prior,
                log_evidence: hypothesis.log_evidence + log_prior + log_density,
            });
        };
        let log_new = self.params.density_per_m2.ln();
        add(None, self.params.false_share.ln() + log_new, 0.0);
        let new = u32::try_from(estimate.landmarks.len()).ok();
        add(new, log_new + missed.new_landmark(pose * seen.offset_m), 0.0);
        for (landmark, kind) in (0_u32..).zip(&hypothesis.kinds) {
            let is_it = |other: &Bearing| hypothesis.association[other.sighting] == Some(landmark);
            let Some(log_same) = kind.log_same(sighting, self.params) else { continue };
            if here.iter().any(is_it) {
                continue;
            }
            let squares = self.params.deviations_max.powi(2);
            if let Some(log_density) = log_density(estimate, landmark, seen, (&covariance, squares))
            {
                add(Some(landmark), log_same, log_density);
            }
        }
    }

    /// The child, fitted.
    fn grown(&self, child: &Child, seen: &Bearing) -> Option<Hypothesis> {
        let mut hypothesis = self.kept[child.parent].clone();
        hypothesis.log_prior = child.log_prior;
        hypothesis.log_evidence = child.log_evidence;
        hypothesis.association[seen.sighting] = child.landmark;
        let Some(landmark) = child.landmark else { return Some(hypothesis) };
        let estimate = &mut hypothesis.fit.estimate;
        if landmark as usize == estimate.landmarks.len() {
            let pose = *estimate.poses.last()?;
            estimate.landmarks.push(pose * seen.offset_m);
            hypothesis.kinds.push(Kind::of(self.chains.sighting(self.travel, seen)));
            return Some(hypothesis);
        }
        let chain = self.chains.chain(hypothesis.chain, false);
        let fit = chain.fit(estimate.clone(), &hypothesis.association, N_FIT_STEPS)?;
        hypothesis.is_open = false;
        hypothesis.chain = self.chains.nearest(&fit.estimate.calibration);
        hypothesis.log_evidence = fit.log_evidence + hypothesis.log_prior;
        hypothesis.fit = fit;
        Some(hypothesis)
    }
}

/// Steps of a fit after each sighting: the last one's result is near already.
const N_FIT_STEPS: u32 = 4;

impl Hypothesis {
    /// Before anything was seen, with the drift of a root.
    fn root(travel: &Travel, chains: &Chains, root: usize) -> Self {
        let calibration = chains.chain(root, true).calibration;
        let estimate = Estimate { poses: Vec::new(), landmarks: Vec::new(), calibration };
        Self {
            association: vec![None; travel.n_sightings()],
            log_evidence: chains.log_share(root),
            kinds: Vec::new(),
            fit: Fit { estimate, log_evidence: 0.0, cost: 0.0, n_steps: 0 },
            log_prior: 0.0,
            chain: root,
            is_open: true,
        }
    }
}

impl Kind {
    fn of(sighting: &Sighting) -> Self {
        Self { identity: sighting.identity, landmark_type: sighting.landmark_type }
    }

    /// Logarithm of the probability that a landmark of this kind looks like that; `None` if it
    /// cannot be it.
    fn log_same(&self, sighting: &Sighting, params: &SearchParams) -> Option<f64> {
        match (self.identity, sighting.identity) {
            (Some(ours), Some(theirs)) => (ours == theirs).then_some(0.0),
            (None, None) if self.landmark_type == sighting.landmark_type => {
                Some((1.0 - params.mistaken_share).ln())
            }
            (None, None) => Some(params.mistaken_share.ln()),
            _ => None,
        }
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
