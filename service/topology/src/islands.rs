//! Which obstacles are walls.
//!
//! Legs of tables, pillars and speckle do not bound rooms: obstacles that stand alone and are
//! small are no walls. Where S. Thrun, Artificial Intelligence 99 (1998), section 3.1 (ii), takes
//! the Voronoi diagram of all obstacles, ours is that of the walls; regions are cut out of the cells
//! that are truly free. Obstacles hang together with eight neighbours. Time and space O(cells); where
//! cells changed, O(those · cells of an island).

use std::collections::{BTreeMap, BTreeSet};

use crate::free::FreeSpace;
use crate::lattice::Lattice;

impl FreeSpace {
    /// The same space as if every obstacle that stands alone and is smaller than `extent_max_m`
    /// (diagonal of its bounding box) were not there.
    #[must_use]
    pub fn without_islands(&self, extent_max_m: f64) -> Self {
        let lattice = Lattice::new(self.info());
        let mut open = self.clone();
        let mut seen = self.is_free().to_vec();
        for start in 0..seen.len() {
            if seen[start] || !lattice.is_inside(start) {
                continue;
            }
            let obstacle = obstacle(lattice, start, &mut seen);
            if obstacle.is_alone && obstacle.extent_m(lattice) < extent_max_m {
                for cell in obstacle.cells {
                    open.set(cell, true);
                }
            }
        }
        open
    }
}

/// Brings `open`, which is `before` without islands, to what it is of `after`, given the cells
/// where the two differ; returns the cells where `open` changed, ascending.
pub(crate) fn update_walls(
    open: &mut FreeSpace,
    [before, after]: [&FreeSpace; 2],
    differences: &[usize],
    extent_max_m: f64,
) -> Vec<usize> {
    let lattice = Lattice::new(after.info());
    // An obstacle that is not as it was has a cell that differs, or one beside such a cell.
    let near = differences.iter().flat_map(|&index| {
        let around = lattice.around(index).into_iter().chain([index]);
        around.filter(|&index| lattice.is_inside(index))
    });
    let near: BTreeSet<usize> = near.collect();
    let [was, is] = [before, after].map(|space| islands(space, &near, extent_max_m));
    let touched: BTreeSet<usize> =
        differences.iter().chain(was.keys()).chain(is.keys()).copied().collect();
    let mut changed = vec![];
    for index in touched {
        let is_open = after.is_free()[index] || is.get(&index).is_some_and(|&is_island| is_island);
        if open.is_free()[index] != is_open {
            open.set(index, is_open);
            changed.push(index);
        }
    }
    changed
}

/// For the cells of obstacles that one of `near` belongs to, whether they are islands: all cells
/// of those that are, some of the others.
fn islands(space: &FreeSpace, near: &BTreeSet<usize>, extent_max_m: f64) -> BTreeMap<usize, bool> {
    let lattice = Lattice::new(space.info());
    let mut known = BTreeMap::new();
    for &start in near.iter().filter(|&&index| !space.is_free()[index]) {
        if known.contains_key(&start) {
            continue;
        }
        let mut obstacle = Obstacle::new(lattice, start);
        let mut seen = BTreeSet::from([start]);
        let mut is_island = obstacle.extent_m(lattice) < extent_max_m;
        let mut next = 0;
        // What is too large is a wall, however it goes on.
        while is_island && let Some(&cell) = obstacle.cells.get(next) {
            next += 1;
            for neighbor in lattice.around(cell) {
                if !space.is_free()[neighbor] && seen.insert(neighbor) {
                    obstacle.put(lattice, neighbor);
                    is_island &= obstacle.is_alone && known.get(&neighbor) != Some(&false);
                }
            }
            is_island &= obstacle.extent_m(lattice) < extent_max_m;
        }
        known.extend(obstacle.cells.into_iter().map(|cell| (cell, is_island)));
    }
    known
}

/// Obstacle cells that hang together, rim excluded.
struct Obstacle {
    cells: Vec<usize>,
    /// None of them lies at the rim.
    is_alone: bool,
    /// First and last column and row.
    bounds: [[i64; 2]; 2],
}

impl Obstacle {
    fn new(lattice: Lattice, start: usize) -> Self {
        Self { cells: vec![start], is_alone: true, bounds: [lattice.column_row(start); 2] }
    }

    /// Takes in a cell; of the rim it is only noted.
    fn put(&mut self, lattice: Lattice, cell: usize) {
        if !lattice.is_inside(cell) {
            self.is_alone = false;
            return;
        }
        self.cells.push(cell);
        let [low, high] = &mut self.bounds;
        for (axis, place) in lattice.column_row(cell).into_iter().enumerate() {
            low[axis] = low[axis].min(place);
            high[axis] = high[axis].max(place);
        }
    }

    /// Diagonal of the bounding box, in metres.
    fn extent_m(&self, lattice: Lattice) -> f64 {
        let [low, high] = self.bounds;
        let resolution_m = lattice.info().frame.resolution_m();
        let [x, y] = [0, 1].map(|axis| (high[axis] - low[axis] + 1) as f64 * resolution_m);
        x.hypot(y)
    }
}

/// The obstacle that `start` belongs to, none of whose cells has been seen.
fn obstacle(lattice: Lattice, start: usize, seen: &mut [bool]) -> Obstacle {
    seen[start] = true;
    let mut obstacle = Obstacle::new(lattice, start);
    let mut next = 0;
    while let Some(&cell) = obstacle.cells.get(next) {
        next += 1;
        for neighbor in lattice.around(cell) {
            if !seen[neighbor] {
                seen[neighbor] = lattice.is_inside(neighbor);
                obstacle.put(lattice, neighbor);
            }
        }
    }
    obstacle
}

#[cfg(test)]
mod tests {
    use meetpoint_geometry::{Cell, GridFrame, GridInfo};

    use super::*;

    #[test]
    fn islands_go_and_walls_stay() {
        // A pillar of two cells in a room; an obstacle in the corner touches the rim.
        let mut cells = vec![true; 25];
        for index in [6, 7, 24] {
            cells[index] = false;
        }
        let frame = GridFrame::new(0.05).expect("a length");
        let info = GridInfo { frame, first: Cell { x: -3, y: 7 }, width: 5, height: 5 };
        let space = FreeSpace::from_cells(info, &cells);
        let n_free = |space: &FreeSpace| space.is_free().iter().filter(|&&free| free).count();
        assert_eq!(n_free(&space), 22, "as drawn");
        assert_eq!(n_free(&space.without_islands(0.12)), 24, "0.1 m by 0.05 m");
        assert_eq!(n_free(&space.without_islands(0.11)), 22, "its diagonal is 0.112 m");
    }
}
