//! A travel as a chain of steps with sightings, linearised about several drifts of the odometry.

use std::f64::consts::TAU;
use std::sync::Arc;

use meetpoint_geometry::{Point2, Pose};
use nalgebra::{Matrix3, Vector3};

use crate::calibration::Calibration;
use crate::error_model::{ErrorModel, Way};
use crate::least_squares::{Bearing, Chain, Estimate, FIRST_POSE_PRECISION, Node};
use crate::motion::Motion;
use crate::travel::{Step, Travel};

/// Over the longest part of a travel that one linear model of the drift has to bear, the drift may
/// bend the way by this much either side, in radians.
const BEND_MAX_RAD: f64 = 0.25;
/// How long that part is, in metres: a loop of a large building. Longer ones are fitted in several
/// steps, which then start nearby.
const LOOP_M: f64 = 100.0;
/// Drifts within this many standard deviations are tried.
const DEVIATIONS: f64 = 2.5;

/// More drifts are not tried: no robot's wheels are so bad.
const N_DRIFTS_MAX: usize = 101;

/// The same travel, linearised about each of several drifts.
#[derive(Clone, Debug)]
pub(crate) struct Chains {
    roots: Vec<Root>,
    n_nodes: usize,
}

#[derive(Clone, Debug)]
struct Root {
    /// Takes the root's drift for granted, within what is between roots.
    open: Chain,
    /// Takes any drift for possible.
    closed: Chain,
    /// Logarithm of the share of all drifts that are nearest to this root's.
    log_share: f64,
}

impl Chains {
    /// Steps without sightings become part of the way to the next that has some.
    pub(crate) fn new(travel: &Travel, model: &ErrorModel) -> Self {
        let spacing = 2.0 * BEND_MAX_RAD / LOOP_M;
        let drifts = drifts(model.turn_per_m_std, spacing);
        let share_sum: f64 = drifts.iter().map(|drift| share(*drift, model)).sum();
        let roots = drifts
            .iter()
            .map(|&turn_per_m| {
                let calibration = Calibration { turn_per_m, ..Calibration::NONE };
                let closed = Chain::new(travel, calibration, model, is_node);
                let mut open = closed.clone();
                open.prior = calibration;
                let std = spacing / 12.0_f64.sqrt();
                open.calibration_precision.y = open.calibration_precision.y.max(1.0 / (std * std));
                let log_share = (share(turn_per_m, model) / share_sum).ln();
                Root { open, closed, log_share }
            })
            .collect();
        let n_nodes = travel.steps.iter().filter(|step| is_node(step)).count();
        Self { roots, n_nodes }
    }

    /// About one drift alone, in a map that is about known.
    pub(crate) fn on_map(
        travel: &Travel,
        model: &ErrorModel,
        calibration: Calibration,
        (start, landmarks): (Pose, Vec<Point2<f64>>),
    ) -> Self {
        let mut closed = Chain::new(travel, calibration, model, is_node);
        closed.start = start;
        closed.map = Arc::new(landmarks);
        let n_nodes = closed.nodes.len();
        Self { roots: vec![Root { open: closed.clone(), closed, log_share: 0.0 }], n_nodes }
    }

    pub(crate) fn n_roots(&self) -> usize {
        self.roots.len()
    }

    pub(crate) fn n_nodes(&self) -> usize {
        self.n_nodes
    }

    /// The chain about a root's drift.
    pub(crate) fn chain(&self, root: usize, is_open: bool) -> &Chain {
        let Root { open, closed, .. } = &self.roots[root];
        if is_open { open } else { closed }
    }

    pub(crate) fn log_share(&self, root: usize) -> f64 {
        self.roots[root].log_share
    }

    /// The root whose drift is nearest.
    pub(crate) fn nearest(&self, calibration: &Calibration) -> usize {
        let off = |root: &Root| (root.closed.calibration.turn_per_m - calibration.turn_per_m).abs();
        (0..self.roots.len())
            .min_by(|&a, &b| off(&self.roots[a]).total_cmp(&off(&self.roots[b])))
            .unwrap_or_default()
    }

    pub(crate) fn bearings(&self, node: usize) -> &[Bearing] {
        &self.roots[0].closed.nodes[node].bearings
    }
}

impl Chain {
    /// The steps that `is_node`, with the ways between them linearised about `calibration`.
    pub(crate) fn new(
        travel: &Travel,
        calibration: Calibration,
        model: &ErrorModel,
        is_node: impl Fn(&Step) -> bool,
    ) -> Self {
        let mut nodes = Vec::new();
        let mut legs = Vec::new();
        let mut n_sightings = 0;
        for step in &travel.steps {
            legs.extend_from_slice(step.motion.legs());
            if !is_node(step) {
                continue;
            }
            let bearings = step
                .sightings
                .iter()
                .enumerate()
                .map(|(within, seen)| Bearing::new(n_sightings + within, seen, model))
                .collect();
            n_sightings += step.sightings.len();
            let motion = Motion::new(std::mem::take(&mut legs));
            nodes.push(Node::new(&motion, &calibration, model, bearings));
        }
        Self {
            calibration,
            prior: Calibration::NONE,
            calibration_precision: model.calibration_precision(),
            deviations_max: f64::INFINITY,
            start: Pose::IDENTITY,
            start_precision: FIRST_POSE_PRECISION,
            map: Arc::new(Vec::new()),
            nodes: Arc::new(nodes),
        }
    }

    /// Takes an estimate of the nodes before `node` to it, by odometry.
    pub(crate) fn extend(&self, estimate: &mut Estimate, node: usize) {
        let pose = match estimate.poses.last() {
            None => self.start,
            Some(&before) => {
                let told = self.displacement(&self.nodes[node], &estimate.calibration);
                before * Pose::new(told.x, told.y, told.z)
            }
        };
        estimate.poses.push(pose);
    }
}

impl Node {
    /// A step that `motion` led to.
    pub(crate) fn new(
        motion: &Motion,
        calibration: &Calibration,
        model: &ErrorModel,
        bearings: Vec<Bearing>,
    ) -> Self {
        let way = Way::new(motion, calibration, model);
        let way_precision = way.covariance.try_inverse().unwrap_or_else(Matrix3::identity);
        let log_way_precision = way_precision.determinant().ln();
        let mut path = vec![Point2::origin()];
        let mut pose = Pose::IDENTITY;
        for &leg in motion.legs() {
            pose = pose * calibration.corrected(leg);
            path.push(pose.position());
        }
        Self { way, way_precision, log_way_precision, path, bearings }
    }
}

pub(crate) fn is_node(step: &Step) -> bool {
    !step.sightings.is_empty()
}

/// Drifts `spacing` apart, in radians a metre, the least first.
fn drifts(std: f64, spacing: f64) -> Vec<f64> {
    let farthest = DEVIATIONS * std;
    let mut drifts = vec![0.0];
    let mut drift = spacing;
    while drift < farthest + spacing && drifts.len() < N_DRIFTS_MAX {
        drifts.extend([drift, -drift]);
        drift += spacing;
    }
    drifts
}

/// Density of a drift, up to a factor.
fn share(turn_per_m: f64, model: &ErrorModel) -> f64 {
    if model.turn_per_m_std == 0.0 {
        return 1.0;
    }
    (-0.5 * (turn_per_m / model.turn_per_m_std).powi(2)).exp() / TAU.sqrt()
}

/// How far a calibration is from another.
pub(crate) fn difference(a: &Calibration, b: &Calibration) -> Vector3<f64> {
    Vector3::new(a.scale - b.scale, a.turn_per_m - b.turn_per_m, a.turn_per_rad - b.turn_per_rad)
}
