//! A map drawn key scan by key scan, to be measured.

use meetpoint_geometry::{GridFrame, Pose};
use meetpoint_occupancy::{BeamModel, Grid, ScanMarks};

use crate::scans::key_scan::KeyScan;
use crate::scans::laser_travel::LaserTravel;

/// The map so far.
#[derive(Debug)]
pub(crate) struct Drawing {
    pub(crate) grid: Grid,
    marks: ScanMarks,
    n_done: usize,
}

impl Drawing {
    pub(crate) fn new(frame: GridFrame) -> Self {
        Self { grid: Grid::new(frame), marks: ScanMarks::new(), n_done: 0 }
    }

    /// Key scans drawn so far.
    pub(crate) fn n_drawn(&self) -> usize {
        self.n_done
    }

    /// Draws the next key scans, up to `end`.
    pub(crate) fn draw(
        &mut self,
        travel: &LaserTravel,
        keys: &[KeyScan],
        poses: &[Pose],
        (model, end): (&BeamModel, usize),
    ) {
        while self.n_done < end.min(keys.len()) {
            let scan = &travel.scans[keys[self.n_done].scan];
            if let Some(laser) = travel.lasers.get(scan.laser) {
                let pose = poses[self.n_done] * laser.robot_from_sensor;
                let (geometry, ranges_m) = (&laser.geometry, &scan.ranges_m);
                self.grid.insert_scan(pose, geometry, ranges_m, model, &mut self.marks);
            }
            self.n_done += 1;
        }
    }
}
