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

/// Bisectors of different basis points. W. Hesselink and J. Roerdink, "Euclidean skeletons of
/// digital image and volume data in linear time by the integer medial axis transform", IEEE
/// Transactions on Pattern Analysis and Machine Intelligence 30 (2008).
struct Bisectors<'a> {
    lattice: Lattice,
    open: &'a FreeSpace,
    clearance: &'a Clearance,
    distance_squared_min: f64,
    cosine_max: f64,
}

impl<'a> Bisectors<'a> {
    fn new(open: &'a FreeSpace, clearance: &'a Clearance, params: &VoronoiParams) -> Self {
        let resolution_m = open.info().frame.resolution_m();
        Self {
            lattice: Lattice::new(open.info()),
            open,
            clearance,
            distance_squared_min: (params.basis_distance_min_m / resolution_m).powi(2),
            cosine_max: params.basis_angle_min_rad.cos(),
        }
    }

    /// For every cell whether it lies beside a bisector, on its nearer side: lines about one cell
    /// wide, with gaps.
    fn all(&self) -> Vec<bool> {
        let is_free = self.open.is_free();
        let mut are_beside = vec![false; is_free.len()];
        for index in (0..is_free.len()).filter(|&index| is_free[index]) {
            let [right, above, ..] = self.lattice.beside(index);
            for neighbor in [right, above].into_iter().filter(|&index| is_free[index]) {
                if let Some(nearer) = self.nearer(index, neighbor) {
                    are_beside[nearer] = true;
                }
            }
        }
        are_beside
    }

    /// The same of one cell.
    fn pass_by(&self, index: usize) -> bool {
        let is_free = self.open.is_free();
        if !is_free[index] {
            return false;
        }
        let [right, above, left, below] = self.lattice.beside(index);
        [right, above]
            .into_iter()
            .any(|other| is_free[other] && self.nearer(index, other) == Some(index))
            || [left, below]
                .into_iter()
                .any(|other| is_free[other] && self.nearer(other, index) == Some(index))
    }

    /// Which of two neighbours, the left or lower one first, is nearer to the bisector between
    /// them; `None` if none is there, or it is one of two basis points on the same wall.
    fn nearer(&self, index: usize, neighbor: usize) -> Option<usize> {
        let [own, other] = [index, neighbor].map(|cell| self.clearance.basis()[cell] as usize);
        if own == other && 0.0 < self.distance_squared_min {
            return None;
        }
        let lattice = self.lattice;
        let apart = lattice.distance_squared(own, other) as f64;
        let [a, b] = [own, other].map(|to| lattice.offset(index, to));
        if apart < self.distance_squared_min || self.cosine_max < cosine(a, b) {
            return None;
        }
        // Twice the middle of the step against twice the middle of the basis points.
        let step = lattice.offset(index, neighbor);
        let beyond =
            (0..2).map(|axis| (b[axis] - a[axis]) * (step[axis] - a[axis] - b[axis])).sum::<i64>();
        Some(if 0 <= beyond { index } else { neighbor })
    }
}

/// Cosine of the angle between two directions; 1 if one has no length.
pub(crate) fn cosine(a: [i64; 2], b: [i64; 2]) -> f64 {
    let dot = |a: [i64; 2], b: [i64; 2]| (a[0] * b[0] + a[1] * b[1]) as f64;
    let lengths = (dot(a, a) * dot(b, b)).sqrt();
    if lengths == 0.0 { 1.0 } else { dot(a, b) / lengths }
}
