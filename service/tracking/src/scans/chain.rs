//! The way driven as a chain: each key scan seen from the one before, by odometry and by what both saw.

use meetpoint_geometry::{Pose, angle_between};
use nalgebra::{Matrix3, Vector3};

use crate::graph::pose_graph::Edge;
use crate::scans::calibration::Calibration;
use crate::scans::key_scan::{KeyScan, step};
use crate::scans::laser_travel::LaserTravel;
use crate::scans::scan_pair::{PairForm, PairParams, fitted, moved, pair_form};

/// How odometry errs from one key scan to the next. Deviations, of a step of `d` metres and `a` radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OdometryParams {
    /// Of x and y at a step of no length, in metres.
    pub std_m: f64,
    /// What they grow by for each metre, in metres.
    pub std_per_m: f64,
    /// Of the heading at a step of up to half a metre without a turn, in radians.
    pub std_rad: f64,
    /// What it grows by for each radian turned, in radians.
    pub std_per_rad: f64,
    /// Square, in units of the deviations, at which a step is half doubted: odometry stalls and jumps.
    pub chi2_turn: f64,
}

/// A step as two scans have it, whatever odometry says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ScannedStep {
    /// The later seen from the earlier. Where the scans say nothing, as the start that was believed.
    pub(crate) by_scans: Pose,
    /// Information about its three numbers.
    pub(crate) information: Matrix3<f64>,
    /// What is to be added to its covariance, because another step was nearly as likely.
    pub(crate) doubt: Matrix3<f64>,
}

/// The chain of key scans, travel by travel.
#[derive(Clone, Debug, Default)]
pub(crate) struct Chain {
    /// Poses of the key scans, the first of each travel where live mapping had it.
    pub(crate) poses: Vec<Pose>,
    /// Covariance of each seen from the one before; of the first of a travel, 0.
    pub(crate) covariances: Vec<Matrix3<f64>>,
}

/// A step as long as this has the deviation of its heading that parameters say, in metres, or a shorter one;
/// a longer one, where the laser saw nothing for a while, is several.
const STEP_M: f64 = 0.5;
/// Steps that scans have little to say about are matched this wide, in metres.
const WIDE_GATE_M: f64 = 0.3;
/// Gauss-Newton steps of a match.
const N_STEPS: u32 = 8;
/// Facets that a match looks at, at most.
const N_FACETS_MAX: usize = 90;
/// One start of a match is better than another if so much more of the scan agrees.
const GAIN_MIN: f64 = 0.05;
/// What the odds against another step grow by a factor e with, as a share of the scan.
const GAIN_SURE: f64 = 0.1;
/// Steps nearer to one another than this are the same, in metres...
const APART_MIN_M: f64 = 0.15;
/// ...and radians.
const APART_MIN_RAD: f64 = 0.1;
/// Odometry that moved by less than this share of what live mapping did has stalled.
const STALLED_SHARE: f64 = 0.3;
/// No step is surer than this, whatever scans say: 2 mm and 0.05 degrees, what laser and ground leave.
const STD_MIN: Vector3<f64> = Vector3::new(0.002, 0.002, 0.0009);
/// A step about which nothing is known: half a metre and 30 degrees, where live mapping goes astray.
const STD_MAX: Vector3<f64> = Vector3::new(0.5, 0.5, 0.5);

/// The step of the odometry from the key scan before, if both have it and it is chained.
pub(crate) fn odometry_step(travel: &LaserTravel, keys: &[KeyScan], to: usize) -> Option<Pose> {
    let from = to.checked_sub(1).filter(|&from| keys[from].travel == keys[to].travel)?;
    let (before, after) = (&travel.scans[keys[from].scan], &travel.scans[keys[to].scan]);
    let step = before.odometry_from_robot?.step_to(after.odometry_from_robot?);
    step.is_finite().then_some(step)
}

/// The edge of an odometry step to a key scan.
pub(crate) fn odometry_edge(step: Pose, to: usize, params: &OdometryParams) -> Edge {
    let std_m = params.std_m + params.std_per_m * step.distance_m();
    let n_steps = (step.distance_m() / STEP_M).max(1.0);
    let std_rad = params.std_rad * n_steps.sqrt() + params.std_per_rad * step.theta_rad.abs();
    let information = Vector3::new(std_m, std_m, std_rad).map(|std| 1.0 / (std * std));
    Edge {
        from: to - 1,
        to,
        from_to: step,
        information: Matrix3::from_diagonal(&information),
        chi2_turn: params.chi2_turn,
    }
}

/// The step to a key scan as the scans have it, from where odometry or live mapping leads: whichever more
/// of the scan agrees with. In a corridor it agrees with both, and live mapping may lag: then odometry,
/// unless it stalled or the match left it. To the first of a travel no step leads: of it nothing is said.
/// Between two that are known the step is known too.
pub(crate) fn scanned_step(
    travel: &LaserTravel,
    keys: &[KeyScan],
    to: usize,
    pair: &PairParams,
) -> ScannedStep {
    let live = step(&travel.scans[keys[to - 1].scan], &travel.scans[keys[to].scan]);
    if keys[to - 1].travel != keys[to].travel {
        let nothing = Matrix3::zeros();
        return ScannedStep { by_scans: live, information: nothing, doubt: nothing };
    }
    let (a, b) = (&keys[to - 1].surface, &keys[to].surface);
    let stride = b.facets().len().div_ceil(N_FACETS_MAX).max(1);
    if keys[to - 1].is_known && keys[to].is_known {
        let form = pair_form(a, b.facets(), live, pair, stride);
        return ScannedStep { by_scans: live, information: form.hessian, doubt: Matrix3::zeros() };
    }
    let wide = PairParams { gate_m: WIDE_GATE_M, turn_m: WIDE_GATE_M / 2.0, ..*pair };
    let matched = |start: Pose| {
        let (pose, _) = fitted(a, b, start, &wide, (stride, N_STEPS));
        fitted(a, b, pose, pair, (stride, N_STEPS))
    };
    let told = |(by_scans, form): (Pose, PairForm), doubt: Matrix3<f64>| ScannedStep {
        by_scans,
        information: form.hessian,
        doubt,
    };
    let by_live = matched(live);
    let Some(odometry) = odometry_step(travel, keys, to) else {
        return told(by_live, Matrix3::zeros());
    };
    let by_odometry = matched(odometry);
    let gain = by_live.1.met_share() - by_odometry.1.met_share();
    let has_stalled = odometry.distance_m() < STALLED_SHARE * live.distance_m();
    let drift = odometry.step_to(by_odometry.0);
    let has_drifted = APART_MIN_M < drift.distance_m() || APART_MIN_RAD < drift.theta_rad.abs();
    let is_lost = [to - 1, to].into_iter().any(|key| travel.scans[keys[key].scan].is_lost);
    let is_live =
        if gain.abs() <= GAIN_MIN { !is_lost && (has_stalled || has_drifted) } else { 0.0 < gain };
    let (taken, other) = if is_live { (by_live, by_odometry) } else { (by_odometry, by_live) };
    told(taken, doubt(taken.0, other.0, gain.abs()))
}

/// Covariance of a step that may as well have been another, given how much more of the scan agrees with
/// it: that of a mixture of two.
fn doubt(taken: Pose, other: Pose, gain: f64) -> Matrix3<f64> {
    let away = Vector3::new(
        other.x_m - taken.x_m,
        other.y_m - taken.y_m,
        angle_between(taken.theta_rad, other.theta_rad),
    );
    if away.xy().norm() < APART_MIN_M && away.z.abs() < APART_MIN_RAD {
        return Matrix3::zeros();
    }
    away * away.transpose() * (0.5 * (-gain / GAIN_SURE).exp())
}

impl Chain {
    /// The chain of steps as scans have them and odometry as calibrated, travel by travel.
    pub(crate) fn new(
        travel: &LaserTravel,
        keys: &[KeyScan],
        steps: &[ScannedStep],
        (calibrations, params): (&[Calibration], &OdometryParams),
    ) -> Self {
        let mut chain = Self::default();
        for (to, key) in keys.iter().enumerate() {
            let before = to.checked_sub(1).filter(|&from| keys[from].travel == key.travel);
            let Some(from) = before else {
                chain.poses.push(travel.scans[key.scan].map_from_robot);
                chain.covariances.push(Matrix3::zeros());
                continue;
            };
            let step = odometry_step(travel, keys, to);
            let odometry = step.map(|step| calibrations[key.travel].applied(step));
            let edge = odometry.map(|step| odometry_edge(step, to, params));
            let (step, covariance) = joined(&steps[from], edge.as_ref());
            let is_known = keys[from].is_known && key.is_known;
            let step = if is_known { steps[from].by_scans } else { step };
            chain.poses.push(chain.poses[from] * step);
            chain.covariances.push(covariance);
        }
        chain
    }
}

/// A step by scans and odometry, each as far as it is sure, and its covariance.
fn joined(step: &ScannedStep, edge: Option<&Edge>) -> (Pose, Matrix3<f64>) {
    let mut information =
        step.information + Matrix3::from_diagonal(&STD_MAX.map(|std| 1.0 / (std * std)));
    let mut pull = Vector3::zeros();
    if let Some(edge) = edge {
        let away = edge.error(Pose::IDENTITY, step.by_scans);
        // Where scans say nothing, being away from the odometry says nothing against it either.
        let by_both = edge.information.try_inverse().zip(information.try_inverse());
        let chi2 = by_both
            .and_then(|(a, b)| (a + b).try_inverse())
            .map_or(0.0, |information| away.dot(&(information * away)));
        let believed = edge.information * edge.weight(chi2);
        information += believed;
        pull = -believed * away;
    }
    let covariance = information.try_inverse().unwrap_or_else(Matrix3::identity);
    let std_min = Matrix3::from_diagonal(&STD_MIN.map(|std| std * std));
    (moved(step.by_scans, covariance * pull), covariance + std_min + step.doubt)
}
