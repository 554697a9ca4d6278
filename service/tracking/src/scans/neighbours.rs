//! Which key scans are matched with which: those just before and after, and those that were taken near
//! on other passes that closures, landmarks or a short way join.

use std::collections::BTreeMap;

use meetpoint_geometry::Pose;

use crate::closures::joined::Joined;
use crate::scans::key_scan::KeyScan;
use crate::scans::sweep::Pair;

/// Tunables of [`pairs_across`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NeighbourParams {
    /// Key scans of other passes are matched up to this distance, in metres.
    pub radius_m: f64,
    /// Other passes that one is matched with, at most.
    pub n_passes_max: usize,
    /// Key scans with less way between them than this are near without a closure, in metres.
    pub way_max_m: f64,
}

/// Differences of index at which a key scan is matched with later ones of the same pass.
const STEPS: [usize; 4] = [1, 2, 4, 8];
/// Key scans farther apart than this along the way belong to another pass.
const N_OWN_PASS: usize = 20;
/// Squares farther off than this count as one.
const FAR: f64 = 1e9;
/// Key scans no farther apart than this belong to one pass.
const N_ONE_PASS: usize = 10;

/// Each key scan with those that follow it on its travel.
pub(crate) fn pairs_along(keys: &[KeyScan]) -> Vec<Pair> {
    let later = |index: usize| STEPS.into_iter().map(move |step| (index, index + step));
    let follows = |&(index, later): &Pair| {
        keys.get(later).is_some_and(|later| later.travel == keys[index].travel)
    };
    (0..keys.len()).flat_map(later).filter(follows).collect()
}

/// Each key scan with the nearest of every earlier pass, the nearest passes first. `submap_of` says
/// which submap each belongs to, and `joined` which submaps may be matched (the earlier first).
pub(crate) fn pairs_across(
    keys: &[KeyScan],
    poses: &[Pose],
    (submap_of, joined): (&[usize], &Joined),
    params: &NeighbourParams,
) -> Vec<Pair> {
    let square = |pose: &Pose| {
        #[expect(clippy::cast_possible_truncation, reason = "clamped")]
        let along = |x_m: f64| (x_m / params.radius_m).floor().clamp(-FAR, FAR) as i32;
        (along(pose.x_m), along(pose.y_m))
    };
    let mut squares: BTreeMap<(i32, i32), Vec<usize>> = BTreeMap::new();
    let mut pairs = Vec::new();
    for (index, pose) in poses.iter().enumerate() {
        let (x, y) = square(pose);
        let near = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (x + dx, y + dy)));
        let mut near: Vec<usize> =
            near.filter_map(|at| squares.get(&at)).flatten().copied().collect();
        near.retain(|&other| {
            let way_m = keys[index].way_since_m(&keys[other]);
            (N_OWN_PASS < index - other || keys[index].travel != keys[other].travel)
                && pose.step_to(poses[other]).distance_m() <= params.radius_m
                && (way_m <= params.way_max_m
                    || joined.contains((submap_of[other], submap_of[index])))
        });
        near.sort_unstable();
        let mut nearest = nearest_of_passes(&near, *pose, (keys, poses));
        nearest.truncate(params.n_passes_max);
        pairs.extend(nearest.into_iter().map(|other| (other, index)));
        squares.entry((x, y)).or_default().push(index);
    }
    pairs
}

/// Of each run of key scans the one taken nearest to `pose`, the nearest first.
fn nearest_of_passes(
    near: &[usize],
    pose: Pose,
    (keys, poses): (&[KeyScan], &[Pose]),
) -> Vec<usize> {
    let distance = |other: usize| {
        let step = pose.step_to(poses[other]);
        step.distance_m() + step.theta_rad.abs()
    };
    let mut found: Vec<(f64, usize)> = near
        .chunk_by(|&a, &b| b - a <= N_ONE_PASS && keys[a].travel == keys[b].travel)
        .filter_map(|pass| {
            let rank = |&other: &usize| (distance(other), other);
            pass.iter().map(rank).min_by(|a, b| a.0.total_cmp(&b.0))
        })
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    found.into_iter().map(|(_, other)| other).collect()
}
