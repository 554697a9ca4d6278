//! The ledger: every closure that was considered, and what became of it.

use std::collections::BTreeMap;

use meetpoint_geometry::Pose;
use nalgebra::{Matrix3, Vector3};

use crate::closures::closure::{Closure, ClosureKey, Refusal, Verdict};
use crate::closures::evidence::Evidence;
use crate::closures::overlay::Found;
use crate::closures::submap::Submap;
use crate::closures::submap_graph::SubmapPair;
use crate::graph::pose_graph::Edge;

/// What was `found`, in the order of its keys, with residuals by the poses of key scans; what these
/// contradict is refused. What was `known` is told as it was then.
pub(crate) fn ledger(
    (found, known): (&BTreeMap<SubmapPair, Found>, &BTreeMap<SubmapPair, Closure>),
    submaps: &[Submap],
    evidence: Evidence<'_>,
    key_poses: &[Pose],
) -> Vec<Closure> {
    let chi2_max = evidence.params.closures.inconsistent_chi2_min;
    let judged = |(&(from, to), found): (&SubmapPair, &Found)| {
        let pose = |submap: usize| key_poses[submaps[submap].anchor];
        let said = (found.from_to, &found.covariance);
        let residual = residual(said, (from, to), (pose(from), pose(to)));
        let mut verdict = found.verdict;
        if verdict == Verdict::Accepted && chi2_max < residual.1 {
            verdict = Verdict::Refused(Refusal::Inconsistent);
        }
        let moment = |submap: usize| evidence.moment(submaps[submap].anchor);
        let key = ClosureKey { from: moment(from), to: moment(to) };
        match known.get(&(from, to)) {
            Some(closure) => closure.clone().judged(residual, verdict),
            None => told(key, found, residual, verdict),
        }
    };
    let mut closures: Vec<Closure> = found.iter().map(judged).collect();
    closures.sort_by_key(|closure| closure.key);
    closures
}

/// Difference between a closure and two poses, and its square in units of the covariance.
pub(crate) fn residual(
    (from_to, covariance): (Pose, &Matrix3<f64>),
    (from, to): SubmapPair,
    (a, b): (Pose, Pose),
) -> (Vector3<f64>, f64) {
    let information = covariance.try_inverse().unwrap_or_else(Matrix3::zeros);
    let edge = Edge { from, to, from_to, information, chi2_turn: f64::INFINITY };
    (edge.error(a, b), edge.chi2(a, b))
}

fn told(
    key: ClosureKey,
    found: &Found,
    residual: (Vector3<f64>, f64),
    verdict: Verdict,
) -> Closure {
    let covariance = &found.covariance;
    let closure = Closure {
        key,
        from_to: found.from_to,
        covariance: std::array::from_fn(|row| std::array::from_fn(|at| covariance[(row, at)])),
        score: found.score,
        alternatives: found.alternatives.clone(),
        residual_m: 0.0,
        residual_rad: 0.0,
        chi2: 0.0,
        verdict,
    };
    closure.judged(residual, verdict)
}
