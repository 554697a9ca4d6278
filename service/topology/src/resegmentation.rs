//! The regions of a space that has changed a little.
//!
//! Every step of [`segmentation`] looks at what the step before it changed, and at nothing else:
//! obstacles beside cells that differ, clearance between walls there, turns of the thinning that saw
//! something new, critical points within epsilon along the diagram, lines that look into changed
//! space, fine regions that hold changed cells or cuts. The choice among some hundred lines is made in
//! full: a door that closes can tip it anywhere in the building.
//!
//! Whatever was before, the result is that of [`segmentation`], bit for bit. Time O(what the change
//! reaches + cells), where the second term is reading and writing rows.

use crate::clearance_update::update_clearance;
use crate::critical::{CriticalPoint, points_at, update_minima};
use crate::critical_line::{CriticalLine, updated_lines};
use crate::free::FreeSpace;
use crate::islands::update_walls;
use crate::regions::updated_partition;
use crate::relocation::Relocation;
use crate::segmentation::{Segmentation, Trace, segmentation};

/// Cuts a space into regions, given those of the space as it was, with the same parameters. A
/// space whose rectangle does not hold that of the one before is cut afresh.
pub fn resegmentation(before: Segmentation, space: &FreeSpace) -> Segmentation {
    let Some(relocation) = Relocation::new(before.trace.space.info(), space.info()) else {
        return segmentation(space, &before.trace.params);
    };
    let mut before = before.relocated(&relocation);
    let differences = before.trace.space.differences(space);
    if differences.is_empty() {
        return before;
    }
    let Trace { params, space: old_space, mut open, mut making, mut minima, lines, fine } =
        before.trace;
    let spaces = [&old_space, space];
    let flipped = update_walls(&mut open, spaces, &differences, params.island_extent_max_m);
    let moved = update_clearance(&mut before.clearance, &open, &flipped);
    let Segmentation { clearance, mut voronoi, .. } = before;
    let walls = (&open, &clearance);
    let mut changed = making.update(&mut voronoi, walls, &params.voronoi, [&flipped, &moved]);
    changed.extend(moved.into_iter().filter(|&index| voronoi.is_on()[index]));
    update_minima(&mut minima, &voronoi, &clearance, &params.critical, &changed);
    let points = points_at(&minima, &clearance, &params.critical);
    let depth_m = params.constriction.depth_m;
    let (lines, changed_cuts) = updated_lines(lines, &open, &clearance, &points, depth_m, &flipped);
    let cuts = lines.iter().flat_map(|line| &line.crossings);
    let fine = updated_partition(fine, space, cuts, &differences, &changed_cuts);
    let trace = Trace { params, space: space.clone(), open, making, minima, lines, fine };
    trace.segmentation(clearance, voronoi, points)
}

impl Segmentation {
    /// The same in another rectangle.
    fn relocated(self, relocation: &Relocation) -> Self {
        if relocation.is_nothing() {
            return self;
        }
        let Self { clearance, voronoi, mut points, mut lines, partition, trace } = self;
        let Trace { params, space, open, making, mut minima, lines: mut all_lines, fine } = trace;
        for point in &mut points {
            point.relocate(relocation);
        }
        for line in lines.iter_mut().chain(&mut all_lines) {
            line.relocate(relocation);
        }
        for index in &mut minima {
            *index = relocation.index(*index);
        }
        Self {
            clearance: clearance.relocated(relocation),
            voronoi: voronoi.relocated(relocation),
            points,
            lines,
            partition: partition.relocated(relocation),
            trace: Trace {
                params,
                space: space.relocated(relocation),
                open: open.relocated(relocation),
                making: making.relocated(relocation),
                minima,
                lines: all_lines,
                fine: fine.relocated(relocation),
            },
        }
    }
}

impl CriticalLine {
    fn relocate(&mut self, relocation: &Relocation) {
        self.point.relocate(relocation);
        for crossing in &mut self.crossings {
            crossing.left = relocation.index(crossing.left);
            crossing.right = relocation.index(crossing.right);
        }
    }
}

impl CriticalPoint {
    fn relocate(&mut self, relocation: &Relocation) {
        self.index = relocation.index(self.index);
        self.basis = self.basis.map(|index| relocation.index(index));
    }
}
