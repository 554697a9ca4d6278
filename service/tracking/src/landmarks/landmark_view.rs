//! What a submap saw of a landmark: all of its sightings as one.
//!
//! Sightings from one place are not independent of one another: whatever is wrong with how the camera
//! sits, how it measures ranges, or where within its outline a landmark is seen, is wrong with all of
//! them. So the many that are made while a robot passes are worth no more than one: their median, which
//! a single misreading does not move, with the mean of their variances. A name that was read now and then
//! where another was read many times is that one misread.

use std::collections::BTreeMap;

use meetpoint_geometry::{Point2, Pose};

use crate::closures::evidence::Evidence;
use crate::closures::submap::Submap;
use crate::scans::key_scan::{KeyScan, odometry_step, step};
use crate::scans::landmark_sighting::LandmarkSighting;

/// A landmark seen from a submap.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LandmarkView {
    pub(crate) submap: usize,
    /// What sightings call it.
    pub(crate) name: usize,
    /// Where, seen from the submap's anchor, in metres.
    pub(crate) seen: Point2<f64>,
    /// Variance along each axis, in square metres.
    pub(crate) variance_m2: f64,
    /// Sightings that it is made of.
    pub(crate) n_sightings: usize,
}

/// A sighting seen from a submap's anchor, in metres, and its variance along each axis in square metres.
type Placed = (Point2<f64>, f64);

/// What the way from a key scan to a sighting is off, as a share of its length: odometry that slips.
const STEP_SHARE_STD: f64 = 0.05;

/// A name that was read so much less often than another one at the same place is that one misread...
const MISREAD_SHARE: f64 = 0.2;
/// ...where the same place is one within so many deviations.
const SAME_PLACE_STD: f64 = 3.0;

/// Landmarks that a submap sees, at most: of several a metre more says nothing more.
const N_VIEWS_MAX: usize = 64;

/// What each submap saw of each landmark, submap by submap. A landmark that only one submap saw says
/// nothing and is left out.
pub(crate) fn landmark_views(submaps: &[Submap], evidence: Evidence<'_>) -> Vec<LandmarkView> {
    let mut sightings: BTreeMap<(usize, usize), Vec<Placed>> = BTreeMap::new();
    for seen in &evidence.travels.sightings {
        if let Some((submap, point, variance_m2)) = from_submap(seen, submaps, evidence) {
            sightings.entry((submap, seen.landmark)).or_default().push((point, variance_m2));
        }
    }
    let view = |((submap, name), seen): ((usize, usize), Vec<Placed>)| LandmarkView {
        submap,
        name,
        seen: median(&seen),
        variance_m2: seen.iter().map(|(_, variance_m2)| variance_m2).sum::<f64>()
            / seen.len() as f64,
        n_sightings: seen.len(),
    };
    let all: Vec<LandmarkView> = sightings.into_iter().map(view).collect();
    let of_submaps = all.chunk_by(|a, b| a.submap == b.submap);
    let mut views: Vec<LandmarkView> = of_submaps.flat_map(well_read).collect();
    let mut n_submaps: BTreeMap<usize, usize> = BTreeMap::new();
    for view in &views {
        *n_submaps.entry(view.name).or_default() += 1;
    }
    views.retain(|view| 1 < n_submaps[&view.name]);
    views
}

/// The views of a submap without those that are others misread; of more than anybody sees, those that
/// were read most often.
fn well_read(of_submap: &[LandmarkView]) -> Vec<LandmarkView> {
    let mut often: Vec<&LandmarkView> = of_submap.iter().collect();
    often.sort_by_key(|view| std::cmp::Reverse(view.n_sightings));
    often.truncate(N_VIEWS_MAX);
    let is_misread = |view: &LandmarkView, as_it_is: &LandmarkView| {
        let apart_m2 = (view.seen - as_it_is.seen).norm_squared();
        let variance_m2 = view.variance_m2 + as_it_is.variance_m2;
        (view.n_sightings as f64) < MISREAD_SHARE * as_it_is.n_sightings as f64
            && apart_m2 < SAME_PLACE_STD * SAME_PLACE_STD * variance_m2
    };
    let is_right = |view: &&LandmarkView| !often.iter().any(|other| is_misread(view, other));
    let mut kept: Vec<LandmarkView> = often.iter().copied().filter(is_right).cloned().collect();
    kept.sort_by_key(|view| view.name);
    kept
}

/// A sighting as the submap has it that is nearest along the way: which, where seen from its anchor, and
/// the variance. `None` if its travel has no key scan.
fn from_submap(
    seen: &LandmarkSighting,
    submaps: &[Submap],
    evidence: Evidence<'_>,
) -> Option<(usize, Point2<f64>, f64)> {
    let (key, step) = nearest_key(seen.scan, evidence)?;
    let submap = submaps.partition_point(|submap| submap.keys.start <= key).checked_sub(1)?;
    let point = evidence.seen(key, submaps[submap].anchor) * step * seen.robot_from_landmark;
    let step_std_m = STEP_SHARE_STD * step.distance_m();
    Some((submap, point, seen.std_m * seen.std_m + step_std_m * step_std_m))
}

/// The key scan of its travel that is nearest to a scan along the way, and the step from there.
fn nearest_key(scan: usize, evidence: Evidence<'_>) -> Option<(usize, Pose)> {
    let (keys, travels) = (evidence.keys, evidence.travels);
    let after = keys.partition_point(|key| key.scan <= scan);
    let travel = travels.travel_of(scan);
    let is_own = |key: &usize| keys.get(*key).is_some_and(|key| key.travel == travel);
    let about = [after.checked_sub(1), Some(after)].into_iter().flatten().filter(is_own);
    let steps = about.map(|key| (key, step_from(&keys[key], scan, evidence)));
    steps.min_by(|(_, a), (_, b)| a.distance_m().total_cmp(&b.distance_m()))
}

/// The step from a key scan to another scan: by live mapping; by odometry if that was lost.
fn step_from(key: &KeyScan, scan: usize, evidence: Evidence<'_>) -> Pose {
    let scans = &evidence.travels.all.scans;
    let (from, to) = (&scans[key.scan], &scans[scan]);
    let odometry = odometry_step(from, to).filter(|_| from.is_lost || to.is_lost);
    odometry.unwrap_or_else(|| step(from, to))
}

/// The median along each axis. Invariant: there is a point.
fn median(seen: &[Placed]) -> Point2<f64> {
    let along = |axis: usize| {
        let mut numbers: Vec<f64> = seen.iter().map(|(point, _)| point[axis]).collect();
        numbers.sort_by(f64::total_cmp);
        f64::midpoint(numbers[(numbers.len() - 1) / 2], numbers[numbers.len() / 2])
    };
    Point2::new(along(0), along(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_misreading_moves_nothing() {
        let at = |x_m: f64, y_m: f64| (Point2::new(x_m, y_m), 0.1);
        let seen = [at(1.0, 2.0), at(1.2, 2.1), at(40.0, -3.0), at(1.1, 1.9)];
        let found = median(&seen);
        assert!((found - Point2::new(1.15, 1.95)).norm() < 1e-12, "{found}");
        assert_eq!(median(&seen[..1]), Point2::new(1.0, 2.0), "a single one");
    }

    #[test]
    fn a_name_read_now_and_then_is_another_misread() {
        let view = |name: usize, x_m: f64, n_sightings: usize| LandmarkView {
            submap: 0,
            name,
            seen: Point2::new(x_m, 0.0),
            variance_m2: 0.04,
            n_sightings,
        };
        let views = [view(1, 2.0, 30), view(2, 2.3, 4), view(3, 5.0, 1), view(4, 1.8, 7)];
        let names: Vec<usize> = well_read(&views).iter().map(|view| view.name).collect();
        assert_eq!(names, [1, 3, 4], "the second was read where the first was");
    }
}
