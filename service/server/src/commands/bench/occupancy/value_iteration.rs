//! Value iteration by the size of the map: from scratch, and after a change.
//!
//! Floors of square rooms of 4.5 m with doors of 0.9 m to their neighbours, cells of 0.15 m as in the
//! paper; a tenth of the rooms is unexplored. The change is a door that closes or opens, far from
//! the unexplored and near it, by turns. Every value is compared with Dijkstra's before anything is timed.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::time::Instant;

use meetpoint_geometry::{Cell, GridFrame, GridInfo};
use meetpoint_planning::{Ground, ValueIteration};

/// Edge of a cell, in metres (T98 2.5).
const CELL_M: f64 = 0.15;
/// Cells from one wall to the next.
const ROOM: usize = 30;
/// Cells that a door is wide.
const DOOR: usize = 6;
/// Rounds from scratch; the median counts.
const N_ROUNDS: usize = 7;
/// Doors closed and opened again.
const N_CHANGES: usize = 40;

/// Prints a table.
pub(super) fn print() -> anyhow::Result<()> {
    println!("| floor | cells | from scratch | sweeps | Dijkstra | a door: median | longest |");
    println!("|---|---|---|---|---|---|---|");
    for n_rooms in [7, 15, 35, 70, 106] {
        measure(n_rooms)?;
    }
    Ok(())
}

fn measure(n_rooms: usize) -> anyhow::Result<()> {
    let floor = Floor::new(n_rooms);
    let mut iteration = floor.iteration();
    let sweeps = iteration.settle(u32::MAX).n_sweeps;
    let began = Instant::now();
    let truth = dijkstra(&floor);
    let dijkstra_ms = began.elapsed().as_secs_f64() * 1e3;
    compare(&iteration, &truth)?;
    let scratch_ms = median((0..N_ROUNDS).map(|_| {
        let mut iteration = floor.iteration();
        let began = Instant::now();
        iteration.settle(u32::MAX);
        began.elapsed().as_secs_f64() * 1e3
    }));
    let mut floor = floor;
    let changes_ms: Vec<f64> = (0..N_CHANGES)
        .flat_map(|turn| [(turn, true), (turn, false)])
        .map(|(turn, is_closed)| floor.change(&mut iteration, turn, is_closed))
        .collect();
    compare(&iteration, &truth)?;
    let longest_ms = changes_ms.iter().copied().fold(0.0, f64::max);
    let change_ms = median(changes_ms.into_iter());
    let side_m = n_rooms as f64 * ROOM as f64 * CELL_M;
    let n_cells = floor.ground.len();
    println!(
        "| {side_m:.0} m square | {n_cells} | {scratch_ms:.1} ms | {sweeps} | {dijkstra_ms:.1} ms | \
         {change_ms:.3} ms | {longest_ms:.3} ms |"
    );
    Ok(())
}

/// Rooms in a square.
struct Floor {
    info: GridInfo,
    ground: Vec<Ground>,
    n_rooms: usize,
}

impl Floor {
    fn new(n_rooms: usize) -> Self {
        let side = n_rooms * ROOM + 1;
        let frame = GridFrame::new(CELL_M).expect("a length");
        let cells = u32::try_from(side).expect("a small floor");
        let info = GridInfo { frame, first: Cell { x: 0, y: 0 }, width: cells, height: cells };
        let ground = (0..side * side).map(|at| Self::ground(at % side, at / side, n_rooms));
        Self { info, ground: ground.collect(), n_rooms }
    }

    fn ground(x: usize, y: usize, n_rooms: usize) -> Ground {
        let side = n_rooms * ROOM;
        let is_door = |along: usize| {
            let from = (ROOM - DOOR) / 2;
            (from..from + DOOR).contains(&(along % ROOM))
        };
        let is_rim = x == 0 || y == 0 || x == side || y == side;
        let is_wall =
            (x.is_multiple_of(ROOM) && !is_door(y)) || (y.is_multiple_of(ROOM) && !is_door(x));
        // By a fixed pattern, every tenth room.
        let (room_x, room_y) = (x / ROOM, y / ROOM);
        let is_unexplored = (room_x * 7 + room_y * 13) % 10 == 3;
        let cost = if is_rim || is_wall { f32::INFINITY } else { 0.05 };
        Ground { cost, is_goal: is_unexplored && cost.is_finite() }
    }

    fn iteration(&self) -> ValueIteration {
        ValueIteration::new(self.info, &self.ground, 1.0).expect("ground for every cell")
    }

    /// Closes or opens a door; how long the values took to follow, in milliseconds.
    fn change(&mut self, iteration: &mut ValueIteration, turn: usize, is_closed: bool) -> f64 {
        let side = self.info.width as usize;
        let room = turn * 31 % (self.n_rooms * (self.n_rooms - 1));
        let (x, y) = (room % (self.n_rooms - 1) + 1, room / (self.n_rooms - 1));
        let from = y * ROOM + (ROOM - DOOR) / 2;
        for along in from..from + DOOR {
            let at = along * side + x * ROOM;
            let ground = Ground {
                cost: if is_closed { f32::INFINITY } else { self.ground[at].cost },
                is_goal: self.ground[at].is_goal && !is_closed,
            };
            iteration.set(at, ground);
        }
        let began = Instant::now();
        iteration.settle(u32::MAX);
        began.elapsed().as_secs_f64() * 1e3
    }
}

/// Values by E. W. Dijkstra's algorithm; sums in the same order, and so the same bits.
fn dijkstra(floor: &Floor) -> Vec<f32> {
    let width = floor.info.width as usize;
    let ground = &floor.ground;
    let mut values = vec![f32::INFINITY; ground.len()];
    let mut queue = BinaryHeap::new();
    for (at, _) in ground.iter().enumerate().filter(|(_, ground)| ground.is_goal) {
        values[at] = 0.0;
        queue.push((Reverse(0.0_f32.to_bits()), at));
    }
    while let Some((Reverse(bits), at)) = queue.pop() {
        let value = f32::from_bits(bits);
        if values[at] < value || ground[at].cost.is_infinite() {
            continue;
        }
        let entered = value + ground[at].cost;
        // The rim is closed: no cell that can be entered lies on it.
        for row in [at - width, at, at + width] {
            for to in [row - 1, row, row + 1] {
                let (beside, above) = (at + to - row, row);
                let is_cut = ground[beside].cost.is_infinite() || ground[above].cost.is_infinite();
                let is_slanted = beside != at && above != at;
                if !(is_slanted && is_cut) && entered < values[to] {
                    values[to] = entered;
                    queue.push((Reverse(entered.to_bits()), to));
                }
            }
        }
    }
    values
}

/// Both agree, bit for bit, wherever a robot can be.
fn compare(iteration: &ValueIteration, truth: &[f32]) -> anyhow::Result<()> {
    for (at, &value) in truth.iter().enumerate() {
        let found = iteration.value(at);
        let is_same = found.to_bits() == value.to_bits();
        anyhow::ensure!(is_same, "cell {at}: {found} is not Dijkstra's {value}");
    }
    Ok(())
}

fn median(figures: impl Iterator<Item = f64>) -> f64 {
    let mut figures: Vec<f64> = figures.collect();
    figures.sort_by(f64::total_cmp);
    figures[figures.len() / 2]
}
