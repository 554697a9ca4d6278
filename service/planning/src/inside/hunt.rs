//! One search within a region.
//!
//! Where all cells weigh the same, jump point search: D. Harabor and A. Grastien, "Online graph
//! pruning for pathfinding on grid maps", AAAI 2011. Only cells where a best path may turn are
//! waited for, see [`turns`]; from one to the next leads a run along an axis or a diagonal. Else
//! A*: P. E. Hart, N. J. Nilsson and B. Raphael, "A formal basis for the heuristic determination of
//! minimum cost paths", IEEE Transactions on Systems Science and Cybernetics 4 (1968). Both bounded
//! as in [`Bounds`], and below a limit. Time O(cells log cells) at worst; nothing is allocated.

use crate::cost::{Cost, DIAGONAL, STRAIGHT, UNREACHABLE};
use crate::inside::Scratch;
use crate::inside::bounds::Bounds;
use crate::inside::halts::{Halts, onward, turns};
use crate::inside::patch::{Ground, Patch, Spot, neighbor, step_cost};
use crate::space::{FORWARD_FIRST, toward};

/// The cell that is being left.
#[derive(Clone, Copy)]
struct Here {
    spot: Spot,
    /// Its index in the patch.
    at: u32,
    /// From the start.
    cost: Cost,
}

/// A search under way.
pub(super) struct Hunt<'a> {
    patch: &'a Patch,
    bounds: Bounds<'a>,
    scratch: &'a mut Scratch,
    /// Only what costs less is looked for: as given, then the best way to the goal so far.
    limit: Cost,
    is_found: bool,
}

impl<'a> Hunt<'a> {
    /// In a patch, towards the goal of `bounds`, for what costs less than `limit`, which is
    /// [`UNREACHABLE`] at most. `scratch` must have room for the patch and know none of its cells.
    pub(super) fn new(
        patch: &'a Patch,
        bounds: Bounds<'a>,
        limit: Cost,
        scratch: &'a mut Scratch,
    ) -> Self {
        Self { patch, bounds, scratch, limit, is_found: false }
    }

    /// Cost of the best path below the limit; [`UNREACHABLE`] if there is none.
    pub(super) fn run(&mut self, from: Spot) -> Cost {
        let toward = toward(from, self.bounds.goal());
        let at = name(self.patch.at(from));
        if from == self.bounds.goal() {
            self.reach_goal(at, 0);
        } else {
            self.reach(from, at, 0, self.patch.moves(from));
        }
        while let Some(waiting) = self.scratch.next() {
            if self.limit <= waiting.through() {
                break;
            }
            let at = waiting.at as usize;
            let cost = self.scratch.cost(at);
            if cost < waiting.cost() {
                continue;
            }
            let here = Here { spot: self.patch.spot_at(at), at: waiting.at, cost };
            for turn in FORWARD_FIRST {
                let step = (toward + turn) % 8;
                if waiting.steps >> step & 1 == 1 {
                    self.leave(here, step);
                }
                if self.limit <= waiting.through() {
                    break;
                }
            }
        }
        if self.is_found { self.limit } else { UNREACHABLE }
    }

    /// By one of the steps that wait.
    fn leave(&mut self, here: Here, step: usize) {
        match self.patch.ground() {
            Ground::Weighted(weights) => self.step(here, step, weights),
            Ground::Even(halts) if step.is_multiple_of(2) => {
                self.run_along(here, step, halts);
            }
            Ground::Even(halts) => self.run_diagonally(here, step, halts),
        }
    }

    /// One step of A*.
    fn step(&mut self, here: Here, step: usize, weights: &[u8]) {
        let next = neighbor(here.spot, step);
        let at = self.patch.at(next);
        let cost = here.cost + step_cost(weights, here.at as usize, step, at);
        if next == self.bounds.goal() {
            self.reach_goal(here.at, cost);
        } else {
            // No step is left out, so that none is ever added.
            self.reach(next, here.at, cost, self.patch.moves(next));
        }
    }

    /// Where a run along an axis leads: to the goal, to a cell where a path may turn, or nowhere.
    fn end_of_run(&self, from: Spot, step: usize, halts: &Halts) -> Option<Spot> {
        let halt = halts.halt(from, step);
        let goal = self.bounds.goal();
        let axis = step / 2 % 2;
        let [a, b, at] = [from, halt, goal].map(|spot| spot[axis]);
        let is_between = if a < b { a < at && at <= b } else { b <= at && at < a };
        if is_between && goal[1 - axis] == from[1 - axis] {
            return Some(goal);
        }
        (self.patch.moves(halt) != 0).then_some(halt)
    }

    fn run_along(&mut self, here: Here, step: usize, halts: &Halts) {
        if let Some(end) = self.end_of_run(here.spot, step, halts) {
            self.arrive(here, step, end);
        }
    }

    /// At the end of a run along an axis.
    fn arrive(&mut self, here: Here, step: usize, end: Spot) {
        let n_steps = end[0].abs_diff(here.spot[0]) + end[1].abs_diff(here.spot[1]);
        let cost = here.cost + name(n_steps) * STRAIGHT;
        if end == self.bounds.goal() {
            return self.reach_goal(here.at, cost);
        }
        let before = self.patch.moves(neighbor(end, (step + 4) % 8));
        self.reach(end, here.at, cost, onward(step, before) & self.patch.moves(end));
    }

    /// Along a diagonal up to the goal, to a cell where a path may turn, or to
    /// the first from which a run along an axis leads somewhere; the runs too.
    fn run_diagonally(&mut self, here: Here, step: usize, halts: &Halts) {
        let sides = [step - 1, (step + 1) % 8];
        let mut spot = here.spot;
        let mut cost = here.cost;
        let mut moves = self.patch.moves(spot);
        while moves >> step & 1 == 1 {
            let before = moves;
            spot = neighbor(spot, step);
            cost += DIAGONAL;
            moves = self.patch.moves(spot);
            if spot == self.bounds.goal() {
                return self.reach_goal(here.at, cost);
            }
            if turns(step, before) & moves != 0 {
                return self.reach(spot, here.at, cost, onward(step, before) & moves);
            }
            let ends = sides.map(|side| self.end_of_run(spot, side, halts));
            if ends == [None; 2] {
                continue;
            }
            // The runs are made at once, so that only the diagonal is left to go on.
            self.reach(spot, here.at, cost, 1 << step & moves);
            let at = self.patch.at(spot);
            if self.scratch.cost(at) < cost {
                return;
            }
            let here = Here { spot, at: name(at), cost };
            for (side, end) in sides.into_iter().zip(ends) {
                if let Some(end) = end {
                    self.arrive(here, side, end);
                }
            }
            return;
        }
    }

    /// A cell to be left by `steps`, if that may lead to a better way to the goal.
    fn reach(&mut self, spot: Spot, parent: u32, cost: Cost, steps: u8) {
        let at = self.patch.at(spot);
        let fresh = self.scratch.note(at, parent, cost, steps);
        if fresh != 0 {
            let through = cost + self.bounds.of(spot);
            if through < self.limit {
                self.scratch.wait(through, cost, name(at), fresh);
            }
        }
    }

    fn reach_goal(&mut self, parent: u32, cost: Cost) {
        if cost < self.limit {
            self.limit = cost;
            self.is_found = true;
            let at = self.patch.at(self.bounds.goal());
            self.scratch.note(at, parent, cost, 0);
        }
    }
}

/// Counts and indices fit: a space has fewer than 2³² cells.
pub(super) fn name(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}
