//! Thresholding: which cells are free, and which obstacles are walls.
//!
//! ```text
//! C = cells whose probability of "occupied" is below the threshold
//! ```
//!
//! S. Thrun, "Learning metric-topological maps for indoor mobile robot navigation", Artificial
//! Intelligence 99 (1998), section 3.1 (i). A cell that was never observed is not free.
//!
//! Legs of tables, pillars and speckle do not bound rooms: obstacles that stand alone and are
//! small are no walls. Where the paper takes the Voronoi diagram of all obstacles, ours is that of
//! the walls; regions are cut out of the cells that are truly free. Time and space O(cells).

use meetpoint_geometry::{Cell, GridInfo};
use meetpoint_occupancy::Raster;

use crate::lattice::Lattice;

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

    /// The same space as if every obstacle that stands alone and is smaller than `extent_max_m`
    /// (diagonal of its bounding box) were not there.
    #[must_use]
    pub fn without_islands(&self, extent_max_m: f64) -> Self {
        let lattice = Lattice::new(self.info);
        let mut is_free = self.is_free.clone();
        let mut seen = self.is_free.clone();
        for start in (0..seen.len()).filter(|&index| lattice.is_inside(index)) {
            if seen[start] {
                continue;
            }
            let (cells, is_alone) = obstacle(lattice, start, &mut seen);
            let resolution_m = self.info.frame.resolution_m();
            if is_alone && extent_m(lattice, &cells, resolution_m) < extent_max_m {
                for cell in cells {
                    is_free[cell] = true;
                }
            }
        }
        Self { info: self.info, is_free }
    }
}

/// Cells not yet seen that hang together with `start` (8-connected), and whether none of them lies
/// at the rim.
fn obstacle(lattice: Lattice, start: usize, seen: &mut [bool]) -> (Vec<usize>, bool) {
    seen[start] = true;
    let (mut cells, mut is_alone) = (vec![start], true);
    let mut next = 0;
    while let Some(&cell) = cells.get(next) {
        next += 1;
        for neighbor in lattice.around(cell) {
            if seen[neighbor] {
                continue;
            }
            if lattice.is_inside(neighbor) {
                seen[neighbor] = true;
                cells.push(neighbor);
            } else {
                is_alone = false;
            }
        }
    }
    (cells, is_alone)
}

/// Diagonal of the bounding box of cells, in metres.
fn extent_m(lattice: Lattice, cells: &[usize], resolution_m: f64) -> f64 {
    let (mut low, mut high) = ([i64::MAX; 2], [i64::MIN; 2]);
    for place in cells.iter().map(|&cell| lattice.column_row(cell)) {
        for axis in 0..2 {
            low[axis] = low[axis].min(place[axis]);
            high[axis] = high[axis].max(place[axis]);
        }
    }
    let [x, y] = [0, 1].map(|axis| (high[axis] - low[axis] + 1) as f64 * resolution_m);
    x.hypot(y)
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

    #[test]
    fn islands_go_and_walls_stay() {
        // A pillar of two cells in a room; an obstacle in the corner touches the rim.
        let mut cells = vec![true; 25];
        for index in [6, 7, 24] {
            cells[index] = false;
        }
        let space = FreeSpace::from_cells(info(5, 5), &cells);
        let n_free = |space: &FreeSpace| space.is_free().iter().filter(|&&free| free).count();
        assert_eq!(n_free(&space), 22, "as drawn");
        assert_eq!(n_free(&space.without_islands(0.12)), 24, "0.1 m by 0.05 m");
        assert_eq!(n_free(&space.without_islands(0.11)), 22, "its diagonal is 0.112 m");
    }
}
