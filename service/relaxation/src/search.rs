//! Search over associations: which landmark every sighting saw, when that cannot be told from the
//! sighting itself.
//!
//! Hypotheses are kept side by side as the travel goes on. A sighting may be of any landmark known
//! that fits, of a new one, or false; the sightings of a step are told together ([`crate::frame`]),
//! and each hypothesis that is kept is fitted anew, with all poses back to the first, so that the
//! past is revised by what is seen later. Poses alone would not do where odometry drifts steadily:
//! the drift is unknown and bends all ways alike. It is estimated with them, and as a loop can bend
//! too far for one linear model, the search starts with several drifts side by side.
//!
//! After D. B. Reid, "An algorithm for tracking multiple targets", IEEE Transactions on Automatic
//! Control 24 (1979), with the evidence of equation (11) of TBF98 by Laplace's method
//! ([`crate::least_squares`]) instead of a filter's. Time
//! O(steps kept (steps fitted landmarks² + landmarks³)).

use std::collections::HashSet;
use std::num::NonZero;

use meetpoint_geometry::{Point2, Pose};

use crate::branch::Branch;
use crate::calibration::Calibration;
use crate::chain::Chains;
use crate::consolidation::renumber;
use crate::error_model::ErrorModel;
use crate::frame::{Frame, Reading};
use crate::hypothesis::Hypothesis;
use crate::landmark::LandmarkKind;
use crate::least_squares::Bearing;
use crate::missed::Missed;
use crate::side_by_side::side_by_side;
use crate::travel::{Detector, Travel};

/// How far the search goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchParams {
    /// The search looks at the first step with sightings, and again once the robot has driven so many
    /// metres...
    pub key_way_m: f64,
    /// ...or turned by so many radians; at least at every step that it is told of if one is 0.
    pub key_turn_rad: f64,
    /// How often the travel is searched: forward; then backward as well; then once more with the map
    /// that was found.
    pub n_ways: u32,
    /// Hypotheses kept from one step to the next.
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
        key_way_m: 0.0,
        key_turn_rad: 0.0,
        n_ways: 2,
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
        key_way_m: 0.1,
        key_turn_rad: 0.15,
        n_ways: 3,
        n_kept_max: 30,
        n_compared: 12,
        n_fitted: 4,
        log_odds_max: 20.0,
        n_landmarks_max: 500,
        deviations_max: 4.0,
        density_per_m2: 0.05,
        false_share: 1e-2,
        missed_share: 0.7,
        mistaken_share: 0.02,
    };

    /// The same where each says which it is: what is left to find out is which sightings are false.
    pub const TAGS: Self =
        Self { n_ways: 1, n_kept_max: 5, n_fitted: 8, log_odds_max: 15.0, ..Self::CAMERA };
}

/// A map to begin a search with, and where the robot starts in it.
#[derive(Clone, Debug)]
pub(crate) struct KnownMap {
    pub(crate) start: Pose,
    pub(crate) landmarks: Vec<Point2<f64>>,
    kinds: Vec<LandmarkKind>,
    calibration: Calibration,
}

impl KnownMap {
    /// A hypothesis' map, from its end if the travel goes backward. `travel` is the one forward.
    pub(crate) fn of(hypothesis: &Hypothesis, travel: &Travel, is_backward: bool) -> Self {
        let Hypothesis { association, poses, landmarks, calibration, .. } = hypothesis;
        let mut kinds = vec![LandmarkKind::Type(0); landmarks.len()];
        let sightings = travel.steps.iter().flat_map(|step| &step.sightings);
        for (seen, landmark) in sightings.zip(association) {
            if let Some(landmark) = landmark {
                kinds[*landmark as usize] = LandmarkKind::of(seen);
            }
        }
        // Backward what drifted to the left drifts to the right.
        let turn_per_m = calibration.turn_per_m * if is_backward { -1.0 } else { 1.0 };
        let start = if is_backward { poses.last() } else { poses.first() };
        Self {
            start: start.copied().unwrap_or(Pose::IDENTITY),
            landmarks: landmarks.clone(),
            kinds,
            calibration: Calibration { turn_per_m, ..*calibration },
        }
    }
}

/// A branch with the sightings of one more step.
struct Child {
    parent: usize,
    reading: Reading,
    log_evidence: f64,
}

/// The search under way, from step to step.
#[derive(Clone, Debug)]
pub struct Search {
    detector: Detector,
    /// What each sighting looks like.
    kinds: Vec<LandmarkKind>,
    params: SearchParams,
    chains: Chains,
    /// The only association that is looked at, if one is asked about.
    only: Option<Vec<Option<u32>>>,
    kept: Vec<Branch>,
    n_nodes_done: usize,
    n_threads: NonZero<usize>,
}

impl Search {
    /// Before the first step.
    pub fn new(travel: &Travel, model: &ErrorModel, params: SearchParams) -> Self {
        Self::with(travel, params, Chains::new(travel, model))
    }

    /// The same with a map to begin with.
    pub(crate) fn on_map(
        travel: &Travel,
        model: &ErrorModel,
        params: SearchParams,
        map: KnownMap,
    ) -> Self {
        let KnownMap { start, landmarks, kinds, calibration } = map;
        let chains = Chains::on_map(travel, model, calibration, (start, landmarks.clone()));
        let mut search = Self::with(travel, params, chains);
        for branch in &mut search.kept {
            branch.fit.estimate.landmarks.clone_from(&landmarks);
            branch.kinds.clone_from(&kinds);
        }
        search
    }

    fn with(travel: &Travel, params: SearchParams, chains: Chains) -> Self {
        let sightings = travel.steps.iter().flat_map(|step| &step.sightings);
        let kinds: Vec<LandmarkKind> = sightings.map(LandmarkKind::of).collect();
        let root = |root| Branch::root(kinds.len(), &chains, root);
        let kept = (0..chains.n_roots()).map(root).collect();
        Self {
            detector: travel.detector,
            kinds,
            params,
            chains,
            only: None,
            kept,
            n_nodes_done: 0,
            n_threads: NonZero::<usize>::MIN,
        }
    }

    /// The same on at most so many threads; what is found does not depend on it.
    pub fn on_threads(mut self, n_threads: NonZero<usize>) -> Self {
        self.n_threads = n_threads;
        self
    }

    /// The same for one association alone: what the data say of it.
    pub fn along(mut self, association: Vec<Option<u32>>) -> Self {
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
        self.branch(node);
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

    /// Tells the landmarks of the next step's sightings, in every way that fits.
    fn branch(&mut self, node: usize) {
        let bearings = self.chains.bearings(node);
        let all = self.side_by_side(self.kept.len(), |parent| self.readings(parent, node));
        let mut children = Vec::new();
        for (parent, readings) in all.into_iter().enumerate() {
            let before = self.kept[parent].log_evidence;
            children.extend(readings.into_iter().map(|reading| {
                let log_evidence = before + reading.log_prior + reading.log_density;
                Child { parent, reading, log_evidence }
            }));
        }
        children.sort_by(|a, b| b.log_evidence.total_cmp(&a.log_evidence));
        // Without children nothing explains the sightings, and nothing is kept.
        let best = children.first().map_or(0.0, |child| child.log_evidence);
        children.retain(|child| best - self.params.log_odds_max < child.log_evidence);
        self.merge(&mut children, bearings);
        children.truncate(self.params.n_kept_max);
        let grown = self.side_by_side(children.len(), |index| {
            let Child { parent, reading, .. } = &children[index];
            self.kept[*parent].grown(&self.chains, bearings, reading)
        });
        let mut grown: Vec<Branch> = grown.into_iter().flatten().collect();
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

    /// The same work for many hypotheses.
    fn side_by_side<T: Send>(&self, n: usize, work: impl Fn(usize) -> T + Sync) -> Vec<T> {
        let n = u32::try_from(n).unwrap_or(u32::MAX);
        side_by_side(n, self.n_threads, n as usize * N_UNITS, |index| work(index as usize))
    }

    /// Of children, the best first, that will fare alike, the best stays.
    fn merge(&self, children: &mut Vec<Child>, bearings: &[Bearing]) {
        let first = bearings.last().map_or(0, |last| last.sighting);
        let Some(first) = first.checked_sub(self.params.n_compared) else { return };
        let mut known = HashSet::new();
        children.retain(|child| {
            let branch = &self.kept[child.parent];
            let Some(pose) = branch.fit.estimate.poses.last() else { return true };
            let recent = branch.association[first..bearings[0].sighting.max(first)].iter();
            let mut recent: Vec<Option<u32>> =
                recent.chain(&child.reading.landmarks).copied().collect();
            let n_landmarks = branch.kinds.len() + child.reading.new_kinds.len();
            renumber(&mut recent);
            let place = [
                cell(pose.x_m / SAME_POSITION_M),
                cell(pose.y_m / SAME_POSITION_M),
                cell(pose.theta_rad / SAME_HEADING_RAD),
            ];
            let root = branch.is_open.then_some(branch.chain);
            known.insert((recent, n_landmarks, place, root))
        });
    }

    /// All that the sightings of a step may be, after one branch.
    fn readings(&self, parent: usize, node: usize) -> Vec<Reading> {
        let branch = &self.kept[parent];
        let chain = self.chains.chain(branch.chain, branch.is_open);
        let estimate = &branch.fit.estimate;
        let arrow = chain.linearised(estimate, &branch.association, branch.past.as_deref());
        let Some(covariance) = arrow.last_and_border_covariance() else { return Vec::new() };
        let here = (node, &self.detector);
        let missed = Missed::new(branch, chain, &covariance, &self.params, here);
        let bearings = self.chains.bearings(node);
        let kinds = &self.kinds;
        let only = self.only.as_deref();
        let frame = Frame { branch, params: &self.params, bearings, kinds, only };
        frame.readings(covariance.clone(), &missed)
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

/// Steps of work that a hypothesis takes at one step of the travel, at least: equations of some
/// steps and landmarks, solved a few times.
const N_UNITS: usize = 20_000;
