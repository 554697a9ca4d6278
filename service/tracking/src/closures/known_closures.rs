//! Closures that an earlier relaxation judged, as they lie among the submaps of this one.
//!
//! The poses differ from those that were cut then, so that submaps may begin elsewhere: a closure is
//! that of the two submaps in which its moments lie.

use meetpoint_geometry::Pose;
use nalgebra::Matrix3;

use crate::closures::closure::{Closure, ClosureKey, ClosureMoment};
use crate::closures::evidence::Evidence;
use crate::closures::overlay::Found;
use crate::closures::submap::Submap;
use crate::closures::submap_graph::SubmapPair;
use crate::graph::uncertainty::{composed, inverted};

/// The submaps in which the moments of a closure lie, in that order; `None` if one is of no travel, or
/// both are of one submap.
pub(crate) fn submaps_of(
    key: &ClosureKey,
    submaps: &[Submap],
    evidence: Evidence<'_>,
) -> Option<SubmapPair> {
    let submap = |moment: ClosureMoment| {
        let (keys, scan) = (evidence.keys, evidence.travels.scan_at(moment)?);
        let after = keys.partition_point(|key| key.scan <= scan);
        let key = after.checked_sub(1).filter(|&key| keys[key].travel == moment.travel)?;
        submaps.partition_point(|submap| submap.keys.start <= key).checked_sub(1)
    };
    let (from, to) = (submap(key.from)?, submap(key.to)?);
    (from != to).then_some((from, to))
}

/// A closure as one of the two submaps' anchors, the earlier first.
pub(crate) fn known(
    closure: &Closure,
    submaps: &[Submap],
    evidence: Evidence<'_>,
) -> Option<(SubmapPair, Found)> {
    let (from, to) = submaps_of(&closure.key, submaps, evidence)?;
    let scans = &evidence.travels.all.scans;
    let moment = |moment| Some(scans[evidence.travels.scan_at(moment)?].map_from_robot);
    let anchor = |submap: usize| scans[evidence.keys[submaps[submap].anchor].scan].map_from_robot;
    let before = anchor(from).step_to(moment(closure.key.from)?);
    let after = moment(closure.key.to)?.step_to(anchor(to));
    let own = Matrix3::from_fn(|row, column| closure.covariance[row][column]);
    let nothing = Matrix3::zeros();
    let covariance = composed((before, &nothing), (closure.from_to, &own));
    let there = before * closure.from_to;
    let covariance = composed((there, &covariance), (after, &nothing));
    let found = |from_to: Pose, covariance: Matrix3<f64>| Found {
        from_to,
        covariance,
        score: closure.score,
        alternatives: closure.alternatives.clone(),
        slide: None,
        verdict: closure.verdict,
    };
    let from_to = there * after;
    Some(if from < to {
        ((from, to), found(from_to, covariance))
    } else {
        ((to, from), found(from_to.inverse(), inverted(from_to, &covariance)))
    })
}
