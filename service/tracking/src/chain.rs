//! The way driven as a chain: each key scan seen from the one before, by odometry and by what both saw.

use meetpoint_geometry::Pose;
use nalgebra::{Matrix3, Vector3};

use crate::key_scan::{KeyScan, step};
use crate::laser_travel::LaserTravel;
use crate::pose_graph::Edge;
use crate::scan_pair::{PairParams, fitted};

/// How odometry errs from one key scan to the next. Deviations, of a step of `d` metres and `a` radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OdometryParams {
    /// Of x and y at a step of no length, in metres.
    pub std_m: f64,
    /// What they grow by for each metre, in metres.
    pub std_per_m: f64,
    /// Of the heading at a step without a turn, in radians.
    pub std_rad: f64,
    /// What it grows by for each radian turned, in radians.
    pub std_per_rad: f64,
    /// Square, in units of the deviations, at which a step is half doubted: odometry stalls and jumps.
    pub chi2_turn: f64,
}

/// The chain of a travel's key scans.
#[derive(Clone, Debug, Default)]
pub(crate) struct Chain {
    /// Poses of the key scans, the first where live mapping had it.
    pub(crate) poses: Vec<Pose>,
    /// Covariance of each seen from the one before; of the first, 0.
    pub(crate) covariances: Vec<Matrix3<f64>>,
}

/// Steps that scans have little to say about are matched this wide, in metres.
const WIDE_GATE_M: f64 = 0.3;
/// Gauss-Newton steps of a match.
const N_STEPS: u32 = 8;
/// Facets that a match looks at, at most.
const N_FACETS_MAX: usize = 90;
/// The step by odometry is better than the live one only if so much more of a scan agrees: live
/// mapping has seen more.
const GAIN_MIN: f64 = 0.1;
/// No step is surer than this, whatever scans say: 2 mm and 0.05 degrees, what laser and ground leave.
const STD_MIN: Vector3<f64> = Vector3::new(0.002, 0.002, 0.0009);
/// A step about which nothing is known: half a metre and 30 degrees, where live mapping goes astray.
const STD_MAX: Vector3<f64> = Vector3::new(0.5, 0.5, 0.5);

/// The edge of the odometry between two key scans, if both have it and it is chained.
pub(crate) fn odometry_edge(
    travel: &LaserTravel,
    keys: &[KeyScan],
    to: usize,
    params: &OdometryParams,
) -> Option<Edge> {
    let from = to.checked_sub(1)?;
    let (before, after) = (&travel.scans[keys[from].scan], &travel.scans[keys[to].scan]);
    let step = before.odometry_from_robot?.step_to(after.odometry_from_robot?);
    let std_m = params.std_m + params.std_per_m * step.distance_m();
    let std_rad = params.std_rad + params.std_per_rad * step.theta_rad.abs();
    let std = Vector3::new(std_m, std_m, std_rad);
    let information = Matrix3::from_diagonal(&std.map(|std| 1.0 / (std * std)));
    let edge = Edge { from, to, from_to: step, information, chi2_turn: params.chi2_turn };
    step.is_finite().then_some(edge)
}

impl Chain {
    /// Adds the next key scan.
    pub(crate) fn push(
        &mut self,
        travel: &LaserTravel,
        keys: &[KeyScan],
        (odometry, pair): (&OdometryParams, &PairParams),
    ) {
        let to = self.poses.len();
        let Some(from) = to.checked_sub(1) else {
            self.poses.push(travel.scans[keys[0].scan].map_from_robot);
            self.covariances.push(Matrix3::zeros());
            return;
        };
        let edge = odometry_edge(travel, keys, to, odometry);
        let live = step(&travel.scans[keys[from].scan], &travel.scans[keys[to].scan]);
        let (a, b) = (&keys[from].surface, &keys[to].surface);
        let stride = b.facets().len().div_ceil(N_FACETS_MAX).max(1);
        let wide = PairParams { gate_m: WIDE_GATE_M, turn_m: WIDE_GATE_M / 2.0, ..*pair };
        let matched = |start: Pose| {
            let (pose, _) = fitted(a, b, start, &wide, (stride, N_STEPS));
            fitted(a, b, pose, pair, (stride, N_STEPS))
        };
        let (mut best, mut form) = matched(live);
        if let Some(edge) = &edge {
            let (pose, other) = matched(edge.from_to);
            if form.met_share() + GAIN_MIN < other.met_share() {
                (best, form) = (pose, other);
            }
        }
        let mut information =
            form.hessian + Matrix3::from_diagonal(&STD_MAX.map(|std| 1.0 / (std * std)));
        if let Some(edge) = edge {
            let error = edge.error(Pose::IDENTITY, best);
            let weight = edge.weight(error.dot(&(edge.information * error)));
            information += edge.information * weight;
        }
        let covariance = information.try_inverse().unwrap_or_else(Matrix3::identity);
        self.poses.push(self.poses[from] * best);
        self.covariances.push(covariance + Matrix3::from_diagonal(&STD_MIN.map(|std| std * std)));
    }
}
