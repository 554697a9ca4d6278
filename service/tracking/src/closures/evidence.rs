//! What the search for closures reads and does not change.

use meetpoint_geometry::{GridFrame, Pose};

use crate::closures::closure::ClosureMoment;
use crate::closures::submap_match::Placed;
use crate::relaxation_params::LaserRelaxationParams;
use crate::scans::chain::Chain;
use crate::scans::key_scan::KeyScan;
use crate::scans::travels::Travels;

/// Travels, their key scans, and the chains that they make.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Evidence<'a> {
    pub(crate) travels: &'a Travels,
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

    /// The moment of a key scan.
    pub(crate) fn moment(&self, key: usize) -> ClosureMoment {
        let KeyScan { travel, scan, .. } = self.keys[key];
        ClosureMoment { travel, stamp_ns: self.travels.all.scans[scan].stamp_ns }
    }

    /// Pose of a key scan by the chain seen from another, without the scan.
    pub(crate) fn seen(&self, key: usize, origin: usize) -> Pose {
        self.placed(key, origin).1
    }
}
