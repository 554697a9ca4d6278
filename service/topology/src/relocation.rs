//! From a rectangle of cells to a larger one that holds it: grids grow in every direction, and with
//! them the indices of cells.

use meetpoint_geometry::GridInfo;

use crate::lattice::Lattice;

/// How a rectangle lies within another of the same frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Relocation {
    from: GridInfo,
    to: GridInfo,
    /// Index in `to` of the first cell of `from`.
    first: usize,
}

impl Relocation {
    /// `None` if `to` does not hold all cells of `from`.
    pub(crate) fn new(from: GridInfo, to: GridInfo) -> Option<Self> {
        if from.frame != to.frame || from.n_cells() == 0 {
            return None;
        }
        let first = to.index_of(from.first)?;
        to.index_of(Lattice::new(from).cell(from.n_cells() - 1))?;
        Some(Self { from, to, first })
    }

    /// Whether every cell keeps its index.
    pub(crate) fn is_nothing(&self) -> bool {
        self.from == self.to
    }

    /// The larger rectangle.
    pub(crate) fn to(&self) -> GridInfo {
        self.to
    }

    /// Where a cell of the smaller rectangle is in the larger one.
    pub(crate) fn index(&self, index: usize) -> usize {
        let (width, to_width) = (self.from.width as usize, self.to.width as usize);
        self.first + index / width * to_width + index % width
    }

    /// The same, of a number that may be [`u32::MAX`], which stays.
    pub(crate) fn index_u32(&self, index: u32) -> u32 {
        if index == u32::MAX {
            return index;
        }
        u32::try_from(self.index(index as usize)).unwrap_or(u32::MAX)
    }

    /// Row-major data of the larger rectangle: `cells`, and `fill` around them.
    pub(crate) fn cells<T: Copy>(&self, cells: Vec<T>, fill: T) -> Vec<T> {
        if self.is_nothing() {
            return cells;
        }
        let (width, to_width) = (self.from.width as usize, self.to.width as usize);
        let mut moved = vec![fill; self.to.n_cells()];
        let rows = moved[self.first..].chunks_mut(to_width);
        for (to, from) in rows.zip(cells.chunks_exact(width)) {
            to[..width].copy_from_slice(from);
        }
        moved
    }
}
