//! Doors: places whose occupancy keeps changing, told from noise and from what changed for good.
//!
//! A cell belongs to a door if it changed often enough between clearly free and clearly occupied (once is a wall
//! that was moved, twice is a cart that stood there), if looks found it occupied and free in turn (variance), and
//! for stretches (autocorrelation): edges of walls and people who walk by have the first and not the second. What
//! stands beside a wall that stays is that wall's blur: poses are a cell or two off. Such cells near one another,
//! as large as a door, are one.
//!
//! T98, section 2.4, on Schneider (1994); the statistics are in `history.rs`. Time O(n g²) for n cells that changed
//! and a gap of g cells.

use std::collections::{BTreeMap, BTreeSet};

use meetpoint_geometry::{Cell, Point2};

use crate::changes::DECIDED;
use crate::grid::{Grid, around, cell_of};
use crate::history::{History, PAIR_NS};

/// What a door is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DoorParams {
    /// Its cells changed at least so often.
    pub n_changes_min: u32,
    /// What looks found of a cell varies at least so much, in 0..=0.25.
    pub variance_min: f64,
    /// What looks found of a cell has at least this autocorrelation, at most 1.
    pub autocorrelation_min: f64,
    /// What is nearer to a wall that stays is its blur, in metres along either axis.
    pub wall_distance_m: f64,
    /// Cells of a door are no farther from one another along either axis, in metres.
    pub gap_m: f64,
    /// A door is at least as large along an axis, in metres, and has as many cells as are so long in a row: legs
    /// of chairs are few.
    pub extent_min_m: f64,
}

impl DoorParams {
    /// For doors of buildings, from 0.6 m on, of which the frame hides some. A share of 5 % of looks, open or
    /// closed, has a variance of 0.05.
    pub const INDOOR: Self = Self {
        n_changes_min: 3,
        variance_min: 0.05,
        autocorrelation_min: 0.5,
        wall_distance_m: 0.1,
        gap_m: 0.3,
        extent_min_m: 0.4,
    };
}

/// A place whose occupancy keeps changing: a door, or where something is put and taken away again and again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Door {
    /// The cell of it that is remembered for longest, of several the first by rows: it stays while the door
    /// grows.
    pub oldest: Cell,
    /// Since when, by the robots' clocks, nanoseconds.
    pub since_ns: i64,
    /// Middle of its cells, in metres.
    pub position: Point2<f64>,
    /// Lower-left corner of the rectangle around its cells.
    pub low: Cell,
    /// Upper-right corner of it; it belongs to the rectangle.
    pub high: Cell,
    /// How many cells it has.
    pub n_cells: usize,
    /// How often it was closed or opened: a quarter of its cells changed so often.
    pub n_changes: u32,
    /// When it last was, nanoseconds.
    pub changed_ns: i64,
    /// True if most of the cells that were seen last are occupied.
    pub is_closed: bool,
    /// Share of looks that found it closed, in 0..=1: a quarter of its cells were occupied so often.
    pub closed_share: f64,
    /// Mean variance of what looks found of its cells, in 0..=0.25.
    pub variance: f64,
    /// Mean autocorrelation of what looks found of its cells, at most 1.
    pub autocorrelation: f64,
}

/// A cell of a door: what it remembers, and its autocorrelation.
type Member<'a> = (&'a History, f64);

/// The doors of a grid, those that changed most often first, and among equals by their oldest cells, by rows.
pub fn doors(grid: &Grid, params: &DoorParams) -> Vec<Door> {
    let members = members(grid, params);
    let n_cells = |length_m: f64| cells_in(length_m, grid);
    let gap = n_cells(params.gap_m);
    let mut left: BTreeSet<(i32, i32)> = members.keys().copied().collect();
    let mut found = Vec::new();
    while let Some(&start) = left.first() {
        let cells = connected(start, gap, &mut left);
        let door = door(grid, &cells, &members);
        let extent = (door.high.x - door.low.x).max(door.high.y - door.low.y) + 1;
        let n_cells_min = n_cells(params.extent_min_m);
        if n_cells_min <= extent && n_cells_min.unsigned_abs() as usize <= door.n_cells {
            found.push(door);
        }
    }
    found.sort_by_key(|door| (std::cmp::Reverse(door.n_changes), door.oldest.y, door.oldest.x));
    found
}

/// The cells that are as those of doors, by row and column.
fn members<'a>(grid: &'a Grid, params: &DoorParams) -> BTreeMap<(i32, i32), Member<'a>> {
    let wall_distance = cells_in(params.wall_distance_m, grid);
    let mut members = BTreeMap::new();
    for (index, tile) in grid.tiles() {
        for (place, history) in tile.histories() {
            let Some(autocorrelation) = history.autocorrelation() else { continue };
            let is_one = params.n_changes_min <= history.n_changes
                && params.variance_min <= history.variance()
                && params.autocorrelation_min <= autocorrelation;
            let cell = cell_of(index, place);
            if is_one && !is_beside_wall(grid, cell, wall_distance, params) {
                members.insert((cell.y, cell.x), (history, autocorrelation));
            }
        }
    }
    members
}

/// True if a wall that stays is as near as this: occupied, and hardly ever anything else.
fn is_beside_wall(grid: &Grid, cell: Cell, distance: i32, params: &DoorParams) -> bool {
    around(cell, distance).any(|near| {
        let stays = |history: &History| {
            let is_mostly = history.occupied_share().is_some_and(|share| 0.5 < share);
            is_mostly && history.variance() < params.variance_min
        };
        grid.log_odds(near).is_some_and(|log_odds| DECIDED < log_odds)
            && grid.history(near).is_none_or(stays)
    })
}

/// All that is left and hangs together with a cell, taken out.
fn connected(start: (i32, i32), gap: i32, left: &mut BTreeSet<(i32, i32)>) -> Vec<Cell> {
    left.remove(&start);
    let mut cells = vec![Cell { x: start.1, y: start.0 }];
    let mut n_done = 0;
    while let Some(&cell) = cells.get(n_done) {
        cells.extend(around(cell, gap).filter(|near| left.remove(&(near.y, near.x))));
        n_done += 1;
    }
    cells
}

fn door(grid: &Grid, cells: &[Cell], members: &BTreeMap<(i32, i32), Member<'_>>) -> Door {
    let of = |cell: &Cell| members[&(cell.y, cell.x)];
    let histories = || cells.iter().map(|cell| of(cell).0);
    let n = cells.len() as f64;
    let mean = |of_one: &dyn Fn(&Cell) -> f64| cells.iter().map(of_one).sum::<f64>() / n;
    let center = |cell: &Cell| grid.frame().center_of(*cell);
    let oldest = cells.iter().min_by_key(|cell| (of(cell).0.since_ns, cell.y, cell.x));
    let corner = |pick: fn(i32, i32) -> i32| {
        let first = cells[0];
        cells.iter().fold(first, |at, cell| Cell { x: pick(at.x, cell.x), y: pick(at.y, cell.y) })
    };
    let seen_ns = histories().map(|history| history.look_ns).max().unwrap_or_default();
    let is_fresh = |history: &&History| history.look_ns.abs_diff(seen_ns) <= PAIR_NS;
    let n_fresh = histories().filter(is_fresh).count();
    let n_closed = histories().filter(is_fresh).filter(|history| history.is_occupied).count();
    Door {
        oldest: *oldest.unwrap_or(&cells[0]),
        since_ns: histories().map(|history| history.since_ns).min().unwrap_or_default(),
        position: Point2::new(mean(&|cell| center(cell).x), mean(&|cell| center(cell).y)),
        low: corner(i32::min),
        high: corner(i32::max),
        n_cells: cells.len(),
        n_changes: reached_by_quarter(histories().map(|history| history.n_changes)),
        changed_ns: histories().map(|history| history.changed_ns).max().unwrap_or_default(),
        is_closed: n_fresh < 2 * n_closed,
        closed_share: f64::from(reached_by_quarter(histories().map(per_million))) * 1e-6,
        variance: mean(&|cell| of(cell).0.variance()),
        autocorrelation: mean(&|cell| of(cell).1),
    }
}

/// Looks that found a cell occupied, in a million.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share in 0..=1")]
fn per_million(history: &History) -> u32 {
    (history.occupied_share().unwrap_or_default() * 1e6) as u32
}

/// The largest number that a quarter of them reach: each face of a door is seen from one side only.
fn reached_by_quarter(numbers: impl Iterator<Item = u32>) -> u32 {
    let mut numbers: Vec<u32> = numbers.collect();
    numbers.sort_unstable();
    numbers.get(numbers.len() * 3 / 4).copied().unwrap_or_default()
}

/// A length in whole cells, at least 1.
#[expect(clippy::cast_possible_truncation, reason = "a few cells; saturates")]
fn cells_in(length_m: f64, grid: &Grid) -> i32 {
    ((length_m / grid.frame().resolution_m()).round() as i32).clamp(1, 64)
}
