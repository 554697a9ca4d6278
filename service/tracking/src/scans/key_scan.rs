//! Key scans: those of a travel that its pose graph is made of.

use meetpoint_geometry::Pose;

use crate::scans::laser_travel::{DrivenScan, LaserTravel};
use crate::scans::surface::Surface;
use crate::scans::travels::Travels;

/// When a scan becomes a key scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeyScanParams {
    /// Once the robot moved this far since the last, in metres...
    pub distance_m: f64,
    /// ...or turned this far, in radians.
    pub turn_rad: f64,
    /// Hits farther than this are not used, in metres.
    pub range_max_m: f64,
}

/// A key scan.
#[derive(Clone, Debug)]
pub(crate) struct KeyScan {
    /// Which travel it is of.
    pub(crate) travel: usize,
    /// Which scan of all travels.
    pub(crate) scan: usize,
    /// Way driven on its travel until here, in metres.
    pub(crate) driven_m: f64,
    /// Whether its pose is known from an earlier relaxation.
    pub(crate) is_known: bool,
    /// What it saw.
    pub(crate) surface: Surface,
}

/// What a scan saw; nothing if its laser is not listed.
fn surface(travel: &LaserTravel, scan: &DrivenScan, range_max_m: f64) -> Option<Surface> {
    let laser = travel.lasers.get(scan.laser)?;
    Some(Surface::new(laser, &scan.ranges_m, range_max_m))
}

impl KeyScan {
    /// The way from an earlier key scan to this one, in metres; infinite from one of another travel.
    pub(crate) fn way_since_m(&self, earlier: &Self) -> f64 {
        if self.travel == earlier.travel { self.driven_m - earlier.driven_m } else { f64::INFINITY }
    }
}

/// The key scans of travels, in order: of each the first that saw walls or a landmark, and from there on
/// each such one that the robot moved far enough for.
pub(crate) fn key_scans(travels: &Travels, params: &KeyScanParams) -> Vec<KeyScan> {
    let sighted = travels.sighted();
    let of = |travel| key_scans_of(travels, (travel, &sighted), params);
    (0..travels.len()).flat_map(of).collect()
}

fn key_scans_of(
    travels: &Travels,
    (of, sighted): (usize, &[bool]),
    params: &KeyScanParams,
) -> Vec<KeyScan> {
    let travel = &travels.all;
    let mut keys: Vec<KeyScan> = Vec::new();
    let (mut driven_m, mut before) = (0.0, None);
    for index in travels.scans(of) {
        let scan = &travel.scans[index];
        driven_m += before.map_or(0.0, |before| way_m(before, scan));
        before = Some(scan);
        let far = keys.last().is_none_or(|last| {
            let last = &travel.scans[last.scan];
            let steps = [Some(step(last, scan)), odometry_step(last, scan)];
            steps.into_iter().flatten().any(|step| {
                params.distance_m <= step.distance_m() || params.turn_rad <= step.theta_rad.abs()
            })
        });
        if !far {
            continue;
        }
        if let Some(surface) = surface(travel, scan, params.range_max_m)
            && (N_FACETS_MIN <= surface.facets().len() || sighted[index])
        {
            let is_known = travels.is_known(index);
            keys.push(KeyScan { travel: of, scan: index, driven_m, is_known, surface });
        }
    }
    keys
}

/// Fewer facets than this say nothing of a pose.
const N_FACETS_MIN: usize = 10;

/// The step from one scan to another by live mapping.
pub(crate) fn step(from: &DrivenScan, to: &DrivenScan) -> Pose {
    from.map_from_robot.step_to(to.map_from_robot)
}

/// The step from one scan to another by odometry, if both have it.
pub(crate) fn odometry_step(from: &DrivenScan, to: &DrivenScan) -> Option<Pose> {
    Some(from.odometry_from_robot?.step_to(to.odometry_from_robot?))
}

/// Way from one scan to the next, in metres: the longer of what live mapping and odometry say.
fn way_m(from: &DrivenScan, to: &DrivenScan) -> f64 {
    let by_odometry_m = odometry_step(from, to).map_or(0.0, Pose::distance_m);
    step(from, to).distance_m().max(by_odometry_m.min(WAY_MAX_M))
}

/// Odometry does not jump farther than this from one scan to the next, in metres.
const WAY_MAX_M: f64 = 1.0;
