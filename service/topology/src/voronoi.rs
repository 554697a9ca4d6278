//! Voronoi diagram of the walls.
//!
//! The cells with two basis points far apart, thinned to lines one cell wide that hang together as
//! the space does:
//!
//! ```text
//! V ⊇ { p : a neighbour's basis point lies beyond an angle and a length from that of p }
//! ```
//!
//! S. Thrun, Artificial Intelligence 99 (1998), section 3.1 (ii), asks for two *different*
//! equidistant basis points; on a grid every cell of a wall is a basis point of its own, so that
//! "different" needs a measure. How cells are peeled off is in `thinning.rs`: first all that neither
//! lie beside a bisector nor hold the diagram together, then lines a cell wide are made of what is
//! left. Time O(cells log cells), space O(cells).

use meetpoint_geometry::GridInfo;

use crate::bisectors::Bisectors;
use crate::clearance::Clearance;
use crate::free::FreeSpace;
use crate::lattice::Lattice;
use crate::relocation::Relocation;
use crate::thinning::{NEVER, Thinning};

/// Tunables of [`voronoi`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoronoiParams {
    /// Two basis points are different if seen from their cell they lie at least so far apart, in
    /// radians ...
    pub basis_angle_min_rad: f64,
    /// ... and at least so far from each other, in metres.
    pub basis_distance_min_m: f64,
}

/// The diagram's cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Voronoi {
    info: GridInfo,
    is_on: Vec<bool>,
    cells: Vec<usize>,
}

impl Voronoi {
    /// Which cells were asked: those of the free space.
    pub fn info(&self) -> GridInfo {
        self.info
    }

    /// One word a cell of [`Self::info`]: does it lie on the diagram?
    pub fn is_on(&self) -> &[bool] {
        &self.is_on
    }

    /// The cells on the diagram, by index, ascending.
    pub fn cells(&self) -> &[usize] {
        &self.cells
    }

    /// Lines of the diagram that leave a cell: 0 for a point, 1 at an end, 2 along a line, 3 and
    /// more at a junction. Said of cells of the diagram.
    ///
    /// # Panics
    /// If `index` lies outside or on the rim; no cell of the diagram does.
    pub fn degree(&self, index: usize) -> usize {
        let on = Lattice::new(self.info).around(index).map(|neighbor| self.is_on[neighbor]);
        (0..8).filter(|&at| on[at] && !on[(at + 7) % 8]).count()
    }

    /// The same in another rectangle.
    pub(crate) fn relocated(self, relocation: &Relocation) -> Self {
        let cells = self.cells.into_iter().map(|index| relocation.index(index)).collect();
        Self { info: relocation.to(), is_on: relocation.cells(self.is_on, false), cells }
    }

    /// Takes cells off the diagram.
    pub(crate) fn take_off(&mut self, cells: &[usize]) {
        for &index in cells {
            self.is_on[index] = false;
        }
        self.cells.retain(|&index| self.is_on[index]);
    }
}

/// The Voronoi diagram of the walls of `open`.
pub fn voronoi(open: &FreeSpace, clearance: &Clearance, params: &VoronoiParams) -> Voronoi {
    Making::new(open, clearance, params).1
}

/// Where the clearance of more than one cell in so many changed, thinning afresh takes less time
/// than repeating turns, as measured on plans of buildings.
const AFRESH_FACTOR: usize = 25;

/// How a diagram came about: two thinnings. The first leaves the anchors, which lie beside
/// bisectors, and what holds them together; the second makes that one cell wide and keeps its ends.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Making {
    is_anchor: Vec<bool>,
    /// In whose turn every cell was removed, by either thinning.
    removed_by: [Vec<u32>; 2],
    /// Which cells the first one left.
    is_left: Vec<bool>,
}

impl Making {
    /// All afresh, with the diagram.
    pub(crate) fn new(
        open: &FreeSpace,
        clearance: &Clearance,
        params: &VoronoiParams,
    ) -> (Self, Voronoi) {
        let is_anchor = Bisectors::new(open, clearance, params).all();
        let n_cells = is_anchor.len();
        let removed_by = [vec![NEVER; n_cells], vec![NEVER; n_cells]];
        let mut making = Self { is_anchor, removed_by, is_left: open.is_free().to_vec() };
        let cells_on = |is_on: &[bool]| (0..n_cells).filter(|&at| is_on[at]).collect::<Vec<_>>();
        making.first(open, clearance).peel(cells_on(open.is_free()).into_iter());
        for (is_left, &by) in making.is_left.iter_mut().zip(&making.removed_by[0]) {
            *is_left &= by == NEVER;
        }
        let left = cells_on(&making.is_left);
        making.second(open, clearance).peel(left.iter().copied());
        let mut is_on = making.is_left.clone();
        for (is_on, &by) in is_on.iter_mut().zip(&making.removed_by[1]) {
            *is_on &= by == NEVER;
        }
        let cells = left.into_iter().filter(|&index| is_on[index]).collect();
        (making, Voronoi { info: open.info(), is_on, cells })
    }

    /// Brings it and the diagram to what they are now, given the cells, ascending, that opened or
    /// closed, and those whose clearance or basis point changed; returns the cells, ascending, that
    /// came onto the diagram or left it.
    pub(crate) fn update(
        &mut self,
        voronoi: &mut Voronoi,
        (open, clearance): (&FreeSpace, &Clearance),
        params: &VoronoiParams,
        [flipped, moved]: [&[usize]; 2],
    ) -> Vec<usize> {
        if moved.len() * AFRESH_FACTOR <= open.is_free().len() {
            return self.repeat(voronoi, (open, clearance), params, [flipped, moved]);
        }
        let (making, now) = Self::new(open, clearance, params);
        *self = making;
        let before = std::mem::replace(voronoi, now);
        let mut changed = [before.cells.as_slice(), &voronoi.cells].concat();
        changed.retain(|&index| before.is_on[index] != voronoi.is_on[index]);
        changed.sort_unstable();
        changed
    }

    /// The same by repeating turns, however many they are.
    fn repeat(
        &mut self,
        voronoi: &mut Voronoi,
        (open, clearance): (&FreeSpace, &Clearance),
        params: &VoronoiParams,
        [flipped, moved]: [&[usize]; 2],
    ) -> Vec<usize> {
        let mut changed = [flipped, moved].concat();
        changed.extend(self.update_anchors(open, clearance, params, &changed));
        let affected = self.first(open, clearance).repeat(&changed);
        for &index in affected.iter().chain(flipped) {
            let is_left = open.is_free()[index] && self.removed_by[0][index] == NEVER;
            if self.is_left[index] != is_left {
                self.is_left[index] = is_left;
                changed.push(index);
            }
        }
        let mut affected = self.second(open, clearance).repeat(&changed);
        affected.extend(changed);
        affected.sort_unstable();
        affected.dedup();
        affected.retain(|&index| {
            let is_on = self.is_left[index] && self.removed_by[1][index] == NEVER;
            let is_news = voronoi.is_on[index] != is_on;
            voronoi.is_on[index] = is_on;
            is_news
        });
        voronoi.cells.extend(&affected);
        voronoi.cells.retain(|&index| voronoi.is_on[index]);
        voronoi.cells.sort_unstable();
        affected
    }

    /// Cells that became anchors or ceased to be, given all that changed.
    fn update_anchors(
        &mut self,
        open: &FreeSpace,
        clearance: &Clearance,
        params: &VoronoiParams,
        changed: &[usize],
    ) -> Vec<usize> {
        let lattice = Lattice::new(open.info());
        let bisectors = Bisectors::new(open, clearance, params);
        let near = changed.iter().flat_map(|&index| lattice.beside(index));
        let mut asked: Vec<usize> = near.chain(changed.iter().copied()).collect();
        asked.sort_unstable();
        asked.dedup();
        asked.retain(|&index| {
            let is_anchor = bisectors.pass_by(index);
            let is_news = self.is_anchor[index] != is_anchor;
            self.is_anchor[index] = is_anchor;
            is_news
        });
        asked
    }

    fn first<'a>(
        &'a mut self,
        open: &'a FreeSpace,
        clearance: &'a Clearance,
    ) -> Thinning<'a, impl Fn(usize, usize) -> bool> {
        let is_anchor = &self.is_anchor;
        Thinning {
            lattice: Lattice::new(open.info()),
            is_open: open.is_free(),
            squared: clearance.squared(),
            removed_by: &mut self.removed_by[0],
            is_kept: |index, _| is_anchor[index],
        }
    }

    fn second<'a>(
        &'a mut self,
        open: &FreeSpace,
        clearance: &'a Clearance,
    ) -> Thinning<'a, impl Fn(usize, usize) -> bool> {
        let is_anchor = &self.is_anchor;
        Thinning {
            lattice: Lattice::new(open.info()),
            is_open: &self.is_left,
            squared: clearance.squared(),
            removed_by: &mut self.removed_by[1],
            is_kept: |index, n_neighbors| n_neighbors < 2 && is_anchor[index],
        }
    }

    /// The same in another rectangle.
    pub(crate) fn relocated(self, relocation: &Relocation) -> Self {
        if relocation.is_nothing() {
            return self;
        }
        let removed_by = self.removed_by.map(|removed_by| {
            let moved = removed_by.into_iter().map(|by| relocation.index_u32(by)).collect();
            relocation.cells(moved, NEVER)
        });
        Self {
            is_anchor: relocation.cells(self.is_anchor, false),
            removed_by,
            is_left: relocation.cells(self.is_left, false),
        }
    }
}

#[cfg(test)]
mod tests {
    use meetpoint_geometry::{Cell, GridFrame, GridInfo};
    use proptest::prelude::*;

    use super::*;
    use crate::clearance::clearance;
    use crate::clearance_update::update_clearance;
    use crate::segmentation::TopologyParams;

    const SIDE: usize = 40;

    /// A hall with blocks in it, each free or not.
    fn hall(blocks: &[([usize; 2], [usize; 2], bool)]) -> FreeSpace {
        let mut cells = vec![true; SIDE * SIDE];
        for &([left, bottom], [width, height], is_free) in blocks {
            for y in bottom..(bottom + height).min(SIDE) {
                cells[y * SIDE + left..y * SIDE + (left + width).min(SIDE)].fill(is_free);
            }
        }
        let frame = GridFrame::new(0.1).expect("a length");
        let first = Cell { x: 0, y: 0 };
        FreeSpace::from_cells(GridInfo { frame, first, width: 40, height: 40 }, &cells)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(96))]

        #[test]
        fn repeated_turns_leave_what_thinning_afresh_leaves(
            blocks in prop::collection::vec(
                ([0..SIDE, 0..SIDE], [1_usize..14, 1_usize..14], any::<bool>()), 1..24),
            n_before in any::<prop::sample::Index>(),
        ) {
            let params = TopologyParams::INDOOR.voronoi;
            let [before, now] = [n_before.index(blocks.len()), blocks.len()].map(|n| hall(&blocks[..n]));
            let mut distances = clearance(&before);
            let (mut making, mut voronoi) = Making::new(&before, &distances, &params);
            let was_on = voronoi.is_on.clone();
            let flipped = before.differences(&now);
            let moved = update_clearance(&mut distances, &now, &flipped);
            let news = making.repeat(&mut voronoi, (&now, &distances), &params, [&flipped, &moved]);
            let (afresh, diagram) = Making::new(&now, &distances, &params);
            prop_assert!(making == afresh, "the record");
            prop_assert!(voronoi == diagram, "the diagram");
            let differ = (0..was_on.len()).filter(|&index| was_on[index] != diagram.is_on[index]);
            prop_assert_eq!(news, differ.collect::<Vec<_>>());
        }
    }
}
