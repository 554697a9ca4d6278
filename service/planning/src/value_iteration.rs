//! Value iteration towards the nearest goal, with selective reset and bounding box.
//!
//! The value of a cell is the least sum of the costs of the cells that are entered on a way from it
//! to a goal,
//!
//! ```text
//! V(p) = 0                                        at goals
//! V(p) = min over neighbours q of V(q) + c(q)     elsewhere
//! ```
//!
//! S. Thrun, "Learning metric-topological maps for indoor mobile robot navigation", Artificial
//! Intelligence 99 (1998), section 2.5, steps i to v: goals are unexplored cells, c is their
//! probability of being occupied. With other goals it is a planner from anywhere to there. Beyond the
//! paper, cells may be closed (their cost is infinite; no corner of theirs is cut) and a diagonal step
//! may cost more than a straight one.
//!
//! A sweep goes through the rows that may change, upward and downward by turns; within a row, first
//! what the two rows beside it offer, then along it to the right and to the left. A change is carried
//! as far as it reaches in the direction of the sweep. Time O(cells of the box) a sweep; sweeps as many
//! as the turns of the longest best way, up and down.

mod rectangle;
mod sweep;

use meetpoint_geometry::{Cell, GridInfo};

use rectangle::Rectangle;

/// What is known of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ground {
    /// Cost of entering it; infinite if that cannot be done. Less than [`Ground::COST_MIN`] counts as
    /// that, what is no number as infinite.
    pub cost: f32,
    /// Whether it is where ways may end.
    pub is_goal: bool,
}

impl Ground {
    /// The least cost: sums of a hundred thousand steps still tell it from nothing in 32-bit floats.
    pub const COST_MIN: f32 = 1.0 / 64.0;
}

/// How far values are from the equation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settled {
    /// Sweeps that reset values that were too small.
    pub n_resets: u32,
    /// Sweeps that lowered values.
    pub n_sweeps: u32,
    /// Whether all values fulfil the equation; else they are bounds from above, good enough to go by.
    pub is_settled: bool,
}

/// Why cells make no problem of value iteration.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum InvalidGround {
    /// Not one piece of ground a cell.
    #[error("{n_given} pieces of ground for {n_cells} cells")]
    WrongLength {
        /// Given.
        n_given: usize,
        /// Wanted.
        n_cells: usize,
    },
    /// Diagonal steps would be cheaper than straight ones, or no number.
    #[error("a diagonal step costs {0} straight ones; needed is at least 1")]
    Diagonal(f32),
}

/// Values of the cells of a rectangle, on their way to fulfil the equation.
#[derive(Clone, Debug)]
pub struct ValueIteration {
    info: GridInfo,
    /// Cost of a diagonal step as a multiple of a straight one.
    diagonal: f32,
    /// Cells and a ring of closed ones about them, row-major: `(x, y)` is at `(y + 1) * stride + x + 1`.
    stride: usize,
    cost: Vec<f32>,
    is_goal: Vec<bool>,
    /// Invariant: 0 at goals; never below the equation's once reset, never above what it was.
    value: Vec<f32>,
    /// Invariant: `value + cost`: what a straight step to the cell makes of the way.
    straight: Vec<f32>,
    /// Invariant: `value + diagonal * cost`.
    slanted: Vec<f32>,
    /// Invariant: infinite where `cost` is, 0 elsewhere.
    closed: Vec<f32>,
    /// Where values may be too small (step iv)...
    too_small: Option<Rectangle>,
    /// ...and where they may be too large (step v).
    too_large: Option<Rectangle>,
    n_sweeps: u32,
    /// What the two rows beside offer, cell by cell of a row.
    offered: Vec<f32>,
}

impl ValueIteration {
    /// A problem whose values are all still infinite, but for goals. With `diagonal` 1, a diagonal step
    /// costs as much as a straight one, as in the paper.
    ///
    /// # Errors
    /// [`InvalidGround`] if there is not one piece of ground a cell, or diagonal steps cost too little.
    pub fn new(info: GridInfo, ground: &[Ground], diagonal: f32) -> Result<Self, InvalidGround> {
        let n_cells = info.n_cells();
        if ground.len() != n_cells {
            return Err(InvalidGround::WrongLength { n_given: ground.len(), n_cells });
        }
        if !(1.0..f32::INFINITY).contains(&diagonal) {
            return Err(InvalidGround::Diagonal(diagonal));
        }
        let stride = info.width as usize + 2;
        let n = stride * (info.height as usize + 2);
        let all = Rectangle::all(info.width as usize, info.height as usize);
        let infinite = vec![f32::INFINITY; n];
        let mut values = Self {
            info,
            diagonal,
            stride,
            cost: infinite.clone(),
            is_goal: vec![false; n],
            value: infinite.clone(),
            straight: infinite.clone(),
            slanted: infinite.clone(),
            closed: infinite,
            too_small: None,
            too_large: all,
            n_sweeps: 0,
            offered: vec![f32::INFINITY; stride],
        };
        for (index, &ground) in ground.iter().enumerate() {
            let at = values.place(index);
            values.put(at, ground);
        }
        Ok(values)
    }

    /// Which cells.
    pub fn info(&self) -> GridInfo {
        self.info
    }

    /// Says what is known of a cell now, by its place in row-major data. The values follow with
    /// [`ValueIteration::settle`].
    ///
    /// # Panics
    /// If `index` is not below the number of cells; true of all functions here that take one.
    pub fn set(&mut self, index: usize, ground: Ground) {
        let at = self.place(index);
        let before = (self.cost[at], self.is_goal[at]);
        self.put(at, ground);
        if before == (self.cost[at], self.is_goal[at]) {
            return;
        }
        let about = Rectangle::about(at % self.stride, at / self.stride).within(self.inner());
        self.too_small = Rectangle::union(self.too_small, about);
        self.too_large = Rectangle::union(self.too_large, about);
    }

    /// Resets what is too small (step iv), then sweeps (steps ii and v) until nothing changes or so many
    /// sweeps are done. Goes on where it left off.
    pub fn settle(&mut self, n_sweeps_max: u32) -> Settled {
        let mut settled = Settled { n_resets: 0, n_sweeps: 0, is_settled: false };
        while let Some(box_now) = self.too_small.take() {
            let reset = self.sweep_reset(box_now);
            settled.n_resets += 1;
            self.too_small = reset.and_then(|cells| cells.grown().within(self.inner()));
            self.too_large = Rectangle::union(self.too_large, self.too_small);
        }
        while let Some(box_now) = self.too_large {
            if settled.n_sweeps == n_sweeps_max {
                return settled;
            }
            let lowered = self.sweep_lower(box_now);
            settled.n_sweeps += 1;
            self.too_large = lowered.and_then(|cells| cells.grown().within(self.inner()));
        }
        Settled { is_settled: true, ..settled }
    }

    /// The value of a cell: what the way to the nearest goal costs, infinite where none is known.
    pub fn value(&self, index: usize) -> f32 {
        self.value[self.place(index)]
    }

    /// Where steepest descent leads from a cell (step iii): the neighbour that the best way goes to,
    /// the first of equals counter-clockwise from +x, straight before diagonal. `None` at goals and
    /// where no way is known.
    pub fn next(&self, index: usize) -> Option<usize> {
        let at = self.place(index);
        if self.is_goal[at] {
            return None;
        }
        let stride = self.stride;
        let steps = [(1, 0), (0, 1), (-1, 0), (0, -1), (1, 1), (-1, 1), (-1, -1), (1, -1)];
        let mut best = (f32::INFINITY, None);
        for (dx, dy) in steps {
            let beside =
                |dx: isize, dy: isize| at.wrapping_add_signed(dy * stride.cast_signed() + dx);
            let to = beside(dx, dy);
            let sum = if dx == 0 || dy == 0 {
                self.straight[to]
            } else {
                self.slanted[to] + self.closed[beside(dx, 0)] + self.closed[beside(0, dy)]
            };
            if sum < best.0 {
                best = (sum, Some(to));
            }
        }
        best.1.map(|to| (to / stride - 1) * (stride - 2) + to % stride - 1)
    }

    /// The cells of the best way from a cell to a goal, both included; empty where none is known.
    pub fn path(&self, index: usize) -> Vec<usize> {
        let mut path = vec![index];
        while let Some(next) = path.last().and_then(|&here| self.next(here)) {
            // Values fall along a best way once they are settled; before, a way may run in circles.
            if self.value(path[path.len() - 1]) <= self.value(next) {
                return vec![];
            }
            path.push(next);
        }
        let ends_at_goal = path.last().is_some_and(|&last| self.is_goal[self.place(last)]);
        if ends_at_goal { path } else { vec![] }
    }

    /// The cell of a place in row-major data.
    pub fn cell(&self, index: usize) -> Cell {
        let width = self.info.width as usize;
        let offset = |n: usize| i32::try_from(n).unwrap_or(i32::MAX);
        Cell {
            x: self.info.first.x.saturating_add(offset(index % width)),
            y: self.info.first.y.saturating_add(offset(index / width)),
        }
    }

    /// A cell's place among the ringed ones.
    fn place(&self, index: usize) -> usize {
        let width = self.stride - 2;
        assert!(index < self.info.n_cells(), "cell {index} of {}", self.info.n_cells());
        (index / width + 1) * self.stride + index % width + 1
    }

    /// All cells without the ring, in places among the ringed ones.
    fn inner(&self) -> Rectangle {
        let (width, height) = (self.info.width as usize, self.info.height as usize);
        Rectangle { x: (1, width), y: (1, height) }
    }

    fn put(&mut self, at: usize, ground: Ground) {
        let Ground { cost, is_goal } = ground;
        let cost = if cost.is_nan() { f32::INFINITY } else { cost.max(Ground::COST_MIN) };
        if is_goal {
            self.value[at] = 0.0;
        } else if self.is_goal[at] {
            self.value[at] = f32::INFINITY;
        }
        (self.cost[at], self.is_goal[at]) = (cost, is_goal);
        self.closed[at] = if cost.is_finite() { 0.0 } else { f32::INFINITY };
        self.offer(at);
    }

    /// Keeps what steps to a cell make of a way.
    fn offer(&mut self, at: usize) {
        self.straight[at] = self.value[at] + self.cost[at];
        self.slanted[at] = self.value[at] + self.diagonal * self.cost[at];
    }
}
