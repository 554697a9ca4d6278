//! Placing the scans between key scans: each matched with the key scans around it.
//!
//! Its pose begins where the steps from the key scans before and after it meet, and is held there the
//! less the more the two disagree. Time O(scans * neighbours * facets).

use meetpoint_geometry::{Pose, angle_between};
use nalgebra::{Matrix3, Vector3};

use crate::scans::calibration::Calibration;
use crate::scans::key_scan::{KeyScan, step};
use crate::scans::laser_travel::{DrivenScan, LaserTravel};
use crate::scans::scan_pair::{PairParams, moved, pair_form};
use crate::scans::surface::{Facet, Surface, some_facets};
use crate::scans::travels::Travels;

/// Key scans and where they are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Keys<'a> {
    pub(crate) keys: &'a [KeyScan],
    pub(crate) poses: &'a [Pose],
    /// For each, those on other passes that it is matched with.
    pub(crate) across: &'a [Vec<usize>],
}

/// Steps between scans err by this much, in metres and radians.
const STEP_STD_M: f64 = 0.01;
const STEP_STD_RAD: f64 = 0.005;
/// Smaller steps than this, in metres and radians, are none.
const STANDING_MAX: f64 = 1e-3;
/// Key scans of other passes that a scan is matched with, at most.
const N_ACROSS_MAX: usize = 4;
/// Facets of a scan that a match looks at, at most.
const N_FACETS_MAX: usize = 60;
/// Gauss-Newton steps.
const N_STEPS: u32 = 2;
/// Matches with fewer facets say nothing.
const N_MET_MIN: u32 = 12;

/// The robot's pose at a scan; as live mapping had it if its travel has no key scan.
pub(crate) fn placed(
    travels: &Travels,
    scan: usize,
    around: Keys<'_>,
    calibrations: &[Calibration],
    (params, range_max_m): (&PairParams, f64),
) -> Pose {
    let Keys { keys, poses, across } = around;
    let (travel, of) = (&travels.all, travels.travel_of(scan));
    let Some((before, after)) = about(keys, scan, of) else {
        return travel.scans[scan].map_from_robot;
    };
    if keys[before].scan == scan {
        return poses[before];
    }
    let (first, last) = (keys[before].scan as f64, keys[after].scan as f64);
    let share = if before == after { 0.0 } else { (scan as f64 - first) / (last - first) };
    let (from_before, from_after) =
        guesses(travel, (before, scan, after), around, &calibrations[of]);
    let start = from_before.interpolate(from_after, share);
    let apart = from_before.step_to(from_after);
    let std_m = STEP_STD_M + 0.5 * apart.distance_m();
    let std_rad = STEP_STD_RAD + 0.5 * apart.theta_rad.abs();
    let Some(laser) = travel.lasers.get(travel.scans[scan].laser) else { return start };
    let ranges_m = &travel.scans[scan].ranges_m;
    let facets = some_facets(laser, ranges_m, (range_max_m, N_FACETS_MAX));
    let mut near = vec![before, after, before.saturating_sub(1), after + 1];
    near.retain(|&key| keys.get(key).is_some_and(|key| key.travel == of));
    let nearest = if share < 0.5 { before } else { after };
    near.extend(across[nearest].iter().take(N_ACROSS_MAX));
    near.sort_unstable();
    near.dedup();
    let information = Vector3::new(std_m.powi(-2), std_m.powi(-2), std_rad.powi(-2));
    let near: Vec<(&Surface, Pose)> =
        near.into_iter().map(|key| (&keys[key].surface, poses[key])).collect();
    refined(&facets, start, &Matrix3::from_diagonal(&information), &near, params)
}

/// The key scans before and after a scan of a travel, as far as it has them; `None` if it has none.
fn about(keys: &[KeyScan], scan: usize, travel: usize) -> Option<(usize, usize)> {
    let is_own = |key: &usize| keys.get(*key).is_some_and(|key| key.travel == travel);
    let after = keys.partition_point(|key| key.scan <= scan);
    let (before, after) = (after.checked_sub(1).filter(is_own), Some(after).filter(is_own));
    before.or(after).zip(after.or(before))
}

/// The pose at a scan that is known from an earlier relaxation, carried along by the key scans about it.
pub(crate) fn carried(travels: &Travels, scan: usize, Keys { keys, poses, .. }: Keys<'_>) -> Pose {
    let (travel, of) = (&travels.all, travels.travel_of(scan));
    let here = &travel.scans[scan];
    let Some((before, after)) = about(keys, scan, of) else { return here.map_from_robot };
    let by = |key: usize| poses[key] * step(&travel.scans[keys[key].scan], here);
    if before == after {
        return by(before);
    }
    let (first, last) = (keys[before].scan as f64, keys[after].scan as f64);
    by(before).interpolate(by(after), (scan as f64 - first) / (last - first))
}

/// True if live mapping and odometry, if there is any, have the robot stand between two scans.
pub(crate) fn stands(travel: &LaserTravel, (before, scan): (usize, usize)) -> bool {
    let (before, here) = (&travel.scans[before], &travel.scans[scan]);
    let odometry = before.odometry_from_robot.zip(here.odometry_from_robot);
    let is_short =
        |step: Pose| step.distance_m() < STANDING_MAX && step.theta_rad.abs() < STANDING_MAX;
    is_short(step(before, here)) && odometry.is_none_or(|(a, b)| is_short(a.step_to(b)))
}

/// The pose at a scan by the step from the key scan before it, and by that from the one after: the steps
/// of live mapping or of odometry, whichever meet better, since the one may jump and the other slip.
fn guesses(
    travel: &LaserTravel,
    (before, scan, after): (usize, usize, usize),
    around: Keys<'_>,
    calibration: &Calibration,
) -> (Pose, Pose) {
    let of = |key: usize| &travel.scans[around.keys[key].scan];
    let (from, here, to) = (of(before), &travel.scans[scan], of(after));
    let (first, last) = (around.poses[before], around.poses[after]);
    let by_live = (first * step(from, here), last * step(to, here));
    let odometry = |from: &DrivenScan| {
        let step = from.odometry_from_robot?.step_to(here.odometry_from_robot?);
        step.is_finite().then(|| calibration.applied(step))
    };
    let back = |to: &DrivenScan| {
        let step = here.odometry_from_robot?.step_to(to.odometry_from_robot?);
        step.is_finite().then(|| calibration.applied(step).inverse())
    };
    let by_odometry =
        odometry(from).zip(back(to)).map(|(there, back)| (first * there, last * back));
    let apart = |(a, b): (Pose, Pose)| {
        let step = a.step_to(b);
        step.distance_m() + step.theta_rad.abs()
    };
    by_odometry.filter(|&guess| apart(guess) < apart(by_live)).unwrap_or(by_live)
}

/// The pose that fits the surfaces near by, held at `start`.
fn refined(
    facets: &[Facet],
    start: Pose,
    information: &Matrix3<f64>,
    near: &[(&Surface, Pose)],
    params: &PairParams,
) -> Pose {
    let mut pose = start;
    for _ in 0..N_STEPS {
        let turn = angle_between(start.theta_rad, pose.theta_rad);
        let away = Vector3::new(pose.x_m - start.x_m, pose.y_m - start.y_m, turn);
        let (mut hessian, mut gradient) = (*information, information * away);
        for &(other, other_pose) in near {
            let form = pair_form(other, facets, other_pose.step_to(pose), params, 1);
            if form.n_met < N_MET_MIN {
                continue;
            }
            let (sin, cos) = other_pose.theta_rad.sin_cos();
            let turned = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
            hessian += turned * form.hessian * turned.transpose();
            gradient += turned * form.gradient;
        }
        let Some(factor) = hessian.cholesky() else { break };
        pose = moved(pose, -factor.solve(&gradient));
    }
    pose
}
