//! Shortest paths within one region.
//!
//! Tables tell costs to the gates of a region, not between any two of its cells; these are searched
//! for ([`hunt`]) in the region as a small grid of its own ([`patch`]).

mod bounds;
mod halts;
mod hunt;
mod patch;

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::cost::{Cost, UNREACHABLE};
use crate::plans::Plans;
use bounds::Bounds;
use hunt::{Hunt, name};
pub(crate) use patch::Patch;
use patch::Spot;

/// Memory of searches, kept from one to the next: it grows to the largest region met, and is reset
/// in the time of what the last search touched.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    /// By cell of the patch.
    reached: Vec<Reached>,
    /// Cells to be forgotten before the next search.
    touched: Vec<u32>,
    waiting: BinaryHeap<Reverse<Waiting>>,
}

/// What is known of a cell.
#[derive(Clone, Copy, Debug)]
struct Reached {
    /// From the start; [`UNREACHABLE`] if the cell is new.
    cost: Cost,
    /// The cell before a straight or diagonal run, the start's own for the start.
    parent: u32,
    /// By which steps it is left.
    steps: u8,
}

const NEW: Reached = Reached { cost: UNREACHABLE, parent: u32::MAX, steps: 0 };

/// A cell to be left.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Waiting {
    /// Least cost of a path through the cell, then of two the one that has come farther.
    key: u64,
    at: u32,
    steps: u8,
}

impl Waiting {
    fn new(through: Cost, cost: Cost, at: u32, steps: u8) -> Self {
        Self { key: u64::from(through) << 32 | u64::from(Cost::MAX - cost), at, steps }
    }

    fn through(self) -> Cost {
        Cost::try_from(self.key >> 32).unwrap_or(UNREACHABLE)
    }

    fn cost(self) -> Cost {
        Cost::MAX - Cost::try_from(self.key & u64::from(Cost::MAX)).unwrap_or(Cost::MAX)
    }
}

impl Scratch {
    /// Cost of the best path from one cell to another of the same region within it, below
    /// `limit`; [`UNREACHABLE`] if there is none. Afterwards [`Self::corners`] tells
    /// where the path turns.
    pub(crate) fn search(&mut self, plans: &Plans, from: usize, to: usize, limit: Cost) -> Cost {
        let (Some(start), Some(goal)) = (plans.place(from), plans.place(to)) else {
            return UNREACHABLE;
        };
        let patch = &plans.patches[start.region()];
        self.forget(patch.n_cells());
        let bounds = Bounds::new(plans, start, goal);
        Hunt::new(patch, bounds, limit.min(UNREACHABLE), self).run(patch.spot(from))
    }

    /// The cells where the path that the last search found to `to` turns, from its start, the
    /// start and `to` included, appended. From one to the next it goes straight along an axis or a
    /// diagonal.
    pub(crate) fn corners(&self, plans: &Plans, to: usize, cells: &mut Vec<u32>) {
        let Some(place) = plans.place(to) else { return };
        let patch = &plans.patches[place.region()];
        let first = cells.len();
        let mut heading = None;
        let mut at = patch.at(patch.spot(to));
        loop {
            let cell = name(patch.cell(patch.spot_at(at)));
            let parent = self.reached[at].parent as usize;
            if parent == at || self.reached.len() <= parent {
                cells.push(cell);
                break;
            }
            let next = direction(patch.spot_at(at), patch.spot_at(parent));
            if heading != Some(next) {
                cells.push(cell);
            }
            heading = Some(next);
            at = parent;
        }
        cells[first..].reverse();
    }

    fn cost(&self, at: usize) -> Cost {
        self.reached[at].cost
    }

    /// Notes that a cell was reached, to be left by `steps`. Those of them that are new at that
    /// cost, if no less is known.
    fn note(&mut self, at: usize, parent: u32, cost: Cost, steps: u8) -> u8 {
        let known = &mut self.reached[at];
        if known.cost < cost || UNREACHABLE <= cost {
            return 0;
        }
        if known.cost == cost {
            let fresh = steps & !known.steps;
            known.steps |= fresh;
            return fresh;
        }
        if known.cost == UNREACHABLE {
            self.touched.push(name(at));
        }
        *known = Reached { cost, parent, steps };
        steps
    }

    fn wait(&mut self, through: Cost, cost: Cost, at: u32, steps: u8) {
        self.waiting.push(Reverse(Waiting::new(through, cost, at, steps)));
    }

    fn next(&mut self) -> Option<Waiting> {
        self.waiting.pop().map(|Reverse(waiting)| waiting)
    }

    fn forget(&mut self, n_cells: usize) {
        for cell in self.touched.drain(..) {
            self.reached[cell as usize] = NEW;
        }
        self.waiting.clear();
        if self.reached.len() < n_cells {
            self.reached.resize(n_cells, NEW);
        }
    }
}

/// Signs of the ways along both axes.
fn direction(from: Spot, to: Spot) -> [std::cmp::Ordering; 2] {
    [0, 1].map(|axis| to[axis].cmp(&from[axis]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cost::{DIAGONAL, STRAIGHT};
    use meetpoint_geometry::{Cell, GridFrame, GridInfo, Point2};
    use meetpoint_topology::{FreeSpace, Region, TopologicalGraph, partition};
    use std::sync::Arc;

    /// Plans of a drawing, `#` for walls, and the cells of `s` and `t`.
    fn drawn(drawing: &str) -> (Plans, usize, usize) {
        let rows: Vec<&str> = drawing.lines().map(str::trim).collect();
        let [width, height] = [rows[0].len(), rows.len()].map(name);
        let frame = GridFrame::new(0.05).expect("a length");
        let info = GridInfo { frame, first: Cell { x: 0, y: 0 }, width, height };
        let text: Vec<char> = rows.concat().chars().collect();
        let is_free: Vec<bool> = text.iter().map(|&letter| letter != '#').collect();
        let free = FreeSpace::from_cells(info, &is_free);
        let is_enterable: Vec<bool> = free.is_free().to_vec();
        let space = crate::Space::uniform(free.info(), &is_enterable).expect("a word a cell");
        let partition = partition(&free, &[]);
        let region = Region { area_m2: 0.0, center: Point2::origin(), clearance_m: 0.0 };
        let regions = vec![region; partition.n_regions() as usize];
        let graph = TopologicalGraph { regions, arcs: vec![] };
        let plans = Plans::new(Arc::new(space), Arc::new(partition), &graph, &[], 0);
        let cell = |letter| {
            let at = text.iter().position(|&other| other == letter).expect("drawn");
            let [x, y] = [at % rows[0].len(), at / rows[0].len()];
            (y + 1) * (rows[0].len() + 2) + x + 1
        };
        let (from, to) = (cell('s'), cell('t'));
        (plans, from, to)
    }

    const AROUND_A_WALL: &str = "s........
         .######..
         .......t.";

    #[test]
    fn only_what_costs_less_than_the_limit_is_found() {
        let (plans, from, to) = drawn(AROUND_A_WALL);
        let cost = 9 * STRAIGHT;
        let mut scratch = Scratch::default();
        assert_eq!(scratch.search(&plans, from, to, UNREACHABLE), cost, "no limit");
        assert_eq!(scratch.search(&plans, from, to, cost + 1), cost, "just below the limit");
        assert_eq!(scratch.search(&plans, from, to, cost), UNREACHABLE, "not below the limit");
        assert_eq!(scratch.search(&plans, from, from, 1), 0, "to the start itself");
        assert_eq!(scratch.search(&plans, from, from, 0), UNREACHABLE, "nothing costs less");
    }

    #[test]
    fn corners_are_where_a_path_turns() {
        let (plans, from, to) = drawn(
            "s.......
                                       .......t
                                       ........",
        );
        let mut scratch = Scratch::default();
        let cost = scratch.search(&plans, from, to, UNREACHABLE);
        assert_eq!(cost, DIAGONAL + 6 * STRAIGHT, "one diagonal step");
        let mut corners = vec![];
        scratch.corners(&plans, to, &mut corners);
        assert_eq!(corners, [from, from + 11, to].map(name), "diagonal first");
    }
}
