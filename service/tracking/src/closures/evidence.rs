//! What the search for closures reads and does not change.

use meetpoint_geometry::{GridFrame, Pose};

use crate::closures::submap_match::Placed;
use crate::relaxation_params::LaserRelaxationParams;
use crate::scans::chain::Chain;
use crate::scans::key_scan::KeyScan;
use crate::scans::laser_travel::LaserTravel;

/// A travel, its key scans, and the chain that they make.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Evidence<'a> {
    pub(crate) travel: &'a LaserTravel,
    pub(crate) keys: &'a [KeyScan],
    /// Invariant: of these key scans.
    pub(crate) chain: &'a Chain,
    pub(crate) params: &'a LaserRelaxationParams,
    /// Of charts.
    pub(crate) frame: GridFrame,
}

impl<'a> Evidence<'a> {
    /// A key scan and its pose by the chain, seen from another.
    pub(crate) fn placed(&self, key: usize, origin: usize) -> Placed<'a> {
        let poses = &self.chain.poses;
        (&self.keys[key], poses[origin].step_to(poses[key]))
    }

    /// Stamp of a key scan, in nanoseconds.
    pub(crate) fn stamp_ns(&self, key: usize) -> i64 {
        self.travel.scans[self.keys[key].scan].stamp_ns
    }

    /// Pose of a key scan by the chain seen from another, without the scan.
    pub(crate) fn seen(&self, key: usize, origin: usize) -> Pose {
        self.placed(key, origin).1
    }
}
