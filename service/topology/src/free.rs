//! Thresholding: which cells are free.
//!
//! ```text
//! C = cells whose probability of "occupied" is below the threshold
//! ```
//!
//! S. Thrun, "Learning metric-topological maps for indoor mobile robot navigation", Artificial
//! Intelligence 99 (1998), section 3.1 (i). A cell that was never observed is not free.
//! Time and space O(cells).

use meetpoint_geometry::{Cell, GridInfo};
use meetpoint_occupancy::Raster;

use crate::relocation::Relocation;

/// Free cells of a grid, with a rim of cells that are not.
#[derive(Clone, Debug, PartialEq)]
pub struct FreeSpace {
    info: GridInfo,
    is_free: Vec<bool>,
}

impl FreeSpace {
    /// Probability of "occupied" from which on a cell is not free: even odds, the middle between
    /// the 0.25 and the 0.65 up to and from which `map_server` writes free and occupied.
    pub const PROBABILITY_MAX: f64 = 0.5;

    /// Cells of `raster` that are less likely occupied than `probability_max`; never those that
    /// were never observed. One cell larger than the raster on every side.
    pub fn from_raster(raster: &Raster, probability_max: f64) -> Self {
        let log_odds_max = (probability_max / (1.0 - probability_max)).ln();
        let is_free = |&log_odds: &f32| f64::from(log_odds) < log_odds_max;
        let cells: Vec<bool> = raster.log_odds.iter().map(is_free).collect();
        Self::from_cells(raster.info, &cells)
    }

    /// The cells of `info` for which `cells` says so, row-major along +x, the lowest row first;
    /// cells without a word are not free.
    pub fn from_cells(info: GridInfo, cells: &[bool]) -> Self {
        let first = Cell { x: info.first.x.saturating_sub(1), y: info.first.y.saturating_sub(1) };
        let rimmed = GridInfo { first, width: info.width + 2, height: info.height + 2, ..info };
        let mut is_free = vec![false; rimmed.n_cells()];
        let rows = is_free.chunks_exact_mut(rimmed.width as usize).skip(1);
        let width = info.width as usize;
        let cells = cells.chunks_exact(width.max(1)).take(info.height as usize);
        for (to, from) in rows.zip(cells) {
            to[1..=width].copy_from_slice(&from[..width]);
        }
        Self { info: rimmed, is_free }
    }

    /// Which cells, the rim included.
    pub fn info(&self) -> GridInfo {
        self.info
    }

    /// One word a cell of [`Self::info`]. Invariant: false on the outermost ring.
    pub fn is_free(&self) -> &[bool] {
        &self.is_free
    }

    /// The same cells in another rectangle, where no others are free.
    pub(crate) fn relocated(self, relocation: &Relocation) -> Self {
        Self { info: relocation.to(), is_free: relocation.cells(self.is_free, false) }
    }

    /// Cells, ascending, that are free in one of two spaces of the same rectangle only.
    pub(crate) fn differences(&self, other: &Self) -> Vec<usize> {
        let width = self.info.width as usize;
        let mut differences = vec![];
        let rows = self.is_free.chunks(width.max(1)).zip(other.is_free.chunks(width.max(1)));
        for (y, (row, other)) in rows.enumerate() {
            if row != other {
                let cells = (0..row.len()).filter(|&x| row[x] != other[x]);
                differences.extend(cells.map(|x| y * width + x));
            }
        }
        differences
    }

    /// Says that a cell is free, or that it is not. Not for the outermost ring.
    pub(crate) fn set(&mut self, index: usize, is_free: bool) {
        self.is_free[index] = is_free;
    }
}

#[cfg(test)]
mod tests {
    use meetpoint_geometry::GridFrame;

    use super::*;

    fn info(width: u32, height: u32) -> GridInfo {
        let frame = GridFrame::new(0.05).expect("a length");
        GridInfo { frame, first: Cell { x: -3, y: 7 }, width, height }
    }

    #[test]
    fn unknown_is_not_free() {
        let log_odds = vec![-2.0, f32::NAN, 0.0, 2.0];
        let raster = Raster { info: info(4, 1), log_odds };
        let space = FreeSpace::from_raster(&raster, FreeSpace::PROBABILITY_MAX);
        assert_eq!(space.info().first, Cell { x: -4, y: 6 }, "a rim of one cell");
        assert_eq!(&space.is_free()[6..12], [false, true, false, false, false, false], "middle");
    }

    #[test]
    fn too_few_and_too_many_words() {
        for (width, height) in [(0, 0), (0, 3), (3, 0), (2, 2)] {
            for n_cells in [0, 1, 3, 4, 9] {
                let space = FreeSpace::from_cells(info(width, height), &vec![true; n_cells]);
                let n_free = space.is_free().iter().filter(|&&is_free| is_free).count();
                let n_cells_max = (width * height) as usize;
                assert!(n_free <= n_cells_max, "{n_free} of {n_cells_max} cells are free");
                assert!(!space.is_free()[0], "the rim is not");
            }
        }
    }
}
