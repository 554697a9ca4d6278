//! Parts: the regions as a robot finds them.
//!
//! A part is all cells of one region that the robot can go between without leaving the region.
//! Where it fits everywhere, a region is one part; where a wide robot does not get through a
//! bottleneck, or furniture cuts off a corner, it is several. No step leads from one part of a
//! region to another, so that plans over parts exist exactly where paths do: S. Thrun, Artificial
//! Intelligence 99 (1998), section 4.1, "consistency". Time and space O(cells).

use meetpoint_topology::{Partition, RegionIndex};

use crate::space::Space;

/// A part, counted from 0 in the order of their first cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PartIndex(pub u32);

impl PartIndex {
    pub(crate) fn place(self) -> usize {
        self.0 as usize
    }
}

/// Which part every cell belongs to.
#[derive(Clone, Debug, PartialEq)]
pub struct Parts {
    /// Part of every cell; [`NONE`] where the robot cannot be.
    of_cell: Vec<u32>,
    /// Place of every cell among those of its part.
    slot_of_cell: Vec<u32>,
    parts: Vec<Part>,
}

#[derive(Clone, Debug, PartialEq)]
struct Part {
    region: RegionIndex,
    /// Ascending; not empty.
    cells: Vec<u32>,
}

const NONE: u32 = u32::MAX;

impl Parts {
    /// The parts of a partition's regions, for a robot that goes about in `space`.
    ///
    /// # Panics
    /// If the two differ in their number of cells, or it is 2³² or more.
    pub fn new(space: &Space, partition: &Partition) -> Self {
        let n_cells = space.info().n_cells();
        assert_eq!(n_cells, partition.info().n_cells(), "cells of the space, and of the partition");
        assert!(u32::try_from(n_cells).is_ok(), "{n_cells} cells, at most 2^32 - 1");
        let mut found =
            Self { of_cell: vec![NONE; n_cells], slot_of_cell: vec![NONE; n_cells], parts: vec![] };
        for start in 0..n_cells {
            let region = partition.region_at(start).filter(|_| space.is_enterable(start));
            if let Some(region) = region
                && found.of_cell[start] == NONE
            {
                found.fill(space, partition, region, start);
            }
        }
        found
    }

    /// A new part of everything that can be reached from `start` within its region.
    #[expect(clippy::cast_possible_truncation, reason = "fewer than 2^32 cells, checked in `new`")]
    fn fill(&mut self, space: &Space, partition: &Partition, region: RegionIndex, start: usize) {
        let part = self.parts.len() as u32;
        let mut cells = vec![start as u32];
        self.of_cell[start] = part;
        let mut n_done = 0;
        while let Some(&cell) = cells.get(n_done) {
            n_done += 1;
            for (_, to) in space.steps(cell as usize) {
                if self.of_cell[to] == NONE && partition.region_at(to) == Some(region) {
                    self.of_cell[to] = part;
                    cells.push(to as u32);
                }
            }
        }
        cells.sort_unstable();
        for (slot, &cell) in cells.iter().enumerate() {
            self.slot_of_cell[cell as usize] = slot as u32;
        }
        self.parts.push(Part { region, cells });
    }

    /// Number of parts.
    pub fn n_parts(&self) -> usize {
        self.parts.len()
    }

    /// All parts.
    pub fn indices(&self) -> impl Iterator<Item = PartIndex> + use<> {
        let n_parts = u32::try_from(self.parts.len()).unwrap_or(NONE);
        (0..n_parts).map(PartIndex)
    }

    /// The part of a cell, by the cell's place in row-major data; `None` if it has none, or lies
    /// outside.
    pub fn at(&self, cell: usize) -> Option<PartIndex> {
        let part = *self.of_cell.get(cell)?;
        (part != NONE).then_some(PartIndex(part))
    }

    /// The region that a part is of.
    ///
    /// # Panics
    /// If `part` is not below [`Self::n_parts`]; true of all functions here that take one.
    pub fn region(&self, part: PartIndex) -> RegionIndex {
        self.parts[part.place()].region
    }

    /// The cells of a part, ascending; at least one.
    pub fn cells(&self, part: PartIndex) -> &[u32] {
        &self.parts[part.place()].cells
    }

    /// Place of a cell among the cells of its part, if that is `part`.
    pub(crate) fn slot(&self, part: PartIndex, cell: usize) -> Option<u32> {
        (self.of_cell.get(cell) == Some(&part.0)).then(|| self.slot_of_cell[cell])
    }

    /// For every part the one of `old` with the same cells and steps, if there is one: what was
    /// computed within that holds within this.
    pub(crate) fn unchanged(
        &self,
        space: &Space,
        old: &Self,
        old_space: &Space,
    ) -> Vec<Option<PartIndex>> {
        if old_space.info() != space.info() {
            return vec![None; self.parts.len()];
        }
        let is_same_cell = |&cell: &u32| {
            let cell = cell as usize;
            old_space.moves(cell) == space.moves(cell)
                && old_space.weight(cell) == space.weight(cell)
        };
        let old_of = |part: &Part| {
            let index = old.at(*part.cells.first()? as usize)?;
            let is_same = old.cells(index) == part.cells && part.cells.iter().all(is_same_cell);
            is_same.then_some(index)
        };
        self.parts.iter().map(old_of).collect()
    }
}
