//! What changed between two grids of one place: cells that were decided to be free and are decided to be
//! occupied, or the other way around.
//!
//! ```text
//! decided free: p < 0.3      decided occupied: 0.7 < p
//! ```
//!
//! Cells that are undecided or were never observed in either have not changed: they are news, and no change.
//! Changed cells of one kind that touch, by edges or corners, are one change. Time O(n log n) for n changed
//! cells, and O(cells of the tiles that are given): the caller leaves out those that are equal.

use std::sync::Arc;

use meetpoint_geometry::Cell;

use crate::grid::{Grid, around};
use crate::scan_marks::tile_place;
use crate::tile::{TILE_CELLS, Tile, TileIndex};

/// Log-odds of 0.7 (T98: what is below 0.3 or above 0.7 is decided).
pub(crate) const DECIDED: f32 = 0.847_297_9;

/// What became of cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ChangeKind {
    /// Free before, occupied now.
    Appeared,
    /// Occupied before, free now.
    Vanished,
}

/// Cells that touch and of which the same became.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Change {
    /// What became of them.
    pub kind: ChangeKind,
    /// Lower-left corner of the rectangle around them.
    pub low: Cell,
    /// Upper-right corner of it; it belongs to the rectangle.
    pub high: Cell,
    /// How many they are.
    pub n_cells: usize,
    /// One of them: the first by rows.
    pub first: Cell,
}

/// A cell, row before column, and what became of it.
type Changed = (i32, i32, ChangeKind);

/// The changes of a grid, those of most cells first, and among equals by rows. Of each tile that differs its
/// index, what it was, and what it is; `None` where there was none, or is none.
pub fn changes<'a>(
    tiles: impl IntoIterator<Item = (TileIndex, Option<&'a Tile>, Option<&'a Tile>)>,
) -> Vec<Change> {
    let mut cells = Vec::new();
    for (index, before, now) in tiles {
        if let (Some(before), Some(now)) = (before, now) {
            add_changed(index, before, now, &mut cells);
        }
    }
    cells.sort_unstable();
    let mut is_taken = vec![false; cells.len()];
    let mut found = Vec::new();
    for start in 0..cells.len() {
        if !is_taken[start] {
            found.push(connected(&cells, start, &mut is_taken));
        }
    }
    // The sort is stable: equals stay in the order of their first cells.
    found.sort_by_key(|change| std::cmp::Reverse(change.n_cells));
    found
}

/// Cells that changed between two grids of one place, as lasers saw, and are no wall's blur: no cell that is occupied
/// in both is within `wall_distance` cells of one along both axes. Tiles that the grids share are not looked at.
pub fn n_moved(before: &Grid, now: &Grid, wall_distance: i32) -> usize {
    let mut cells = Vec::new();
    for (index, tile) in now.tiles() {
        if let Some(was) = before.tile(index).filter(|was| !Arc::ptr_eq(was, tile)) {
            add_changed(index, was, tile, &mut cells);
        }
    }
    let is_occupied = |grid: &Grid, cell| grid.log_odds(cell).is_some_and(|at| DECIDED < at);
    let stays = |cell| is_occupied(before, cell) && is_occupied(now, cell);
    let is_heard = |cell| {
        let (index, place) = tile_place(cell);
        now.tile(index).is_some_and(|tile| tile.is_heard(place))
    };
    let cells = cells.into_iter().map(|(y, x, _)| Cell { x, y });
    cells.filter(|&cell| !is_heard(cell) && !around(cell, wall_distance).any(stays)).count()
}

fn add_changed(index: TileIndex, before: &Tile, now: &Tile, cells: &mut Vec<Changed>) {
    let corner = [index.x, index.y].map(|tiles| tiles.saturating_mul(TILE_CELLS));
    let places = (0..TILE_CELLS).flat_map(|y| (0..TILE_CELLS).map(move |x| (x, y)));
    let pairs = before.log_odds().iter().zip(now.log_odds());
    for ((x, y), (&before, &now)) in places.zip(pairs) {
        // Never observed is NaN, which is on neither side.
        let kind = if before < -DECIDED && DECIDED < now {
            ChangeKind::Appeared
        } else if DECIDED < before && now < -DECIDED {
            ChangeKind::Vanished
        } else {
            continue;
        };
        cells.push((corner[1].saturating_add(y), corner[0].saturating_add(x), kind));
    }
}

/// All that hangs together with the cell at `start`, which is taken.
fn connected(cells: &[Changed], start: usize, is_taken: &mut [bool]) -> Change {
    let (y, x, kind) = cells[start];
    let first = Cell { x, y };
    let mut change = Change { kind, low: first, high: first, n_cells: 0, first };
    let mut ahead = vec![start];
    is_taken[start] = true;
    while let Some(at) = ahead.pop() {
        let (y, x, _) = cells[at];
        change.n_cells += 1;
        change.low = Cell { x: change.low.x.min(x), y: change.low.y.min(y) };
        change.high = Cell { x: change.high.x.max(x), y: change.high.y.max(y) };
        for (beside_y, beside_x) in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dy, dx))) {
            let beside = (y.saturating_add(beside_y), x.saturating_add(beside_x), kind);
            if let Ok(next) = cells.binary_search(&beside)
                && !is_taken[next]
            {
                is_taken[next] = true;
                ahead.push(next);
            }
        }
    }
    change
}
