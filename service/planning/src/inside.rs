//! Shortest paths within one region.
//!
//! Where nothing stands between two cells, the cost is that of the straight and diagonal steps, and
//! no path costs less. Else A* (P. E. Hart, N. J. Nilsson and B. Raphael, IEEE Transactions on
//! Systems Science and Cybernetics 4 (1968)), bounded from below by the region's own table: for
//! every node n of a gate, `|table(c, n) - table(t, n)|` (A. V. Goldberg and C. Harrelson,
//! "Computing the shortest path: A* search meets graph theory", SODA 2005).

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::cost::{Cost, DIAGONAL, STRAIGHT, UNREACHABLE};
use crate::plans::Plans;

/// Nodes whose costs bound the search, at most: each costs a look-up a cell.
const N_BOUNDS_MAX: usize = 4;

/// Memory of searches, kept from one to the next.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    /// By cell of the space: cost from the start, and the step that led there.
    reached: Vec<(Cost, u8)>,
    /// Cells to be forgotten before the next search.
    touched: Vec<u32>,
    waiting: BinaryHeap<Reverse<(Cost, Reverse<Cost>, u32)>>,
}

const NEW: (Cost, u8) = (UNREACHABLE, u8::MAX);

/// Steps that a straight and diagonal path would take, if nothing stood in the way.
pub(crate) fn octile([dx, dy]: [usize; 2]) -> Cost {
    let (least, most) = (dx.min(dy), dx.max(dy));
    let cost = |n: usize| Cost::try_from(n).unwrap_or(UNREACHABLE);
    cost(least) * DIAGONAL + cost(most - least) * STRAIGHT
}

impl Scratch {
    /// Cost of the best path from one cell to another of the same region within it, below
    /// `limit`; [`UNREACHABLE`] if there is none. Afterwards [`Self::path`] tells the cells.
    pub(crate) fn search(&mut self, plans: &Plans, from: usize, to: usize, limit: Cost) -> Cost {
        self.forget(plans.space.info().n_cells());
        let Some(place) = plans.place(from) else { return UNREACHABLE };
        let bounds = Bounds::new(plans, from, to);
        self.reach(from, 0, u8::MAX, bounds.of(plans, from));
        while let Some(Reverse((through, Reverse(cost), cell))) = self.waiting.pop() {
            if limit <= through {
                return UNREACHABLE;
            }
            let cell = cell as usize;
            if cell == to {
                return cost;
            }
            if self.reached[cell].0 < cost {
                continue;
            }
            for (step, next) in plans.space.steps(cell) {
                let next_cost = cost + plans.space.step_cost(cell, step);
                let is_better = next_cost < self.reached[next].0;
                let is_here = plans.is_in(place.region(), next);
                if is_better && is_here {
                    let step = u8::try_from(step).unwrap_or(u8::MAX);
                    self.reach(next, next_cost, step, bounds.of(plans, next));
                }
            }
        }
        UNREACHABLE
    }

    /// The cells of the path to `to` that the last search found, from its start, appended.
    pub(crate) fn path(&self, plans: &Plans, to: usize, cells: &mut Vec<u32>) {
        let first = cells.len();
        let mut cell = to;
        loop {
            cells.push(u32::try_from(cell).unwrap_or(u32::MAX));
            let (_, step) = self.reached[cell];
            if step == u8::MAX {
                break;
            }
            cell = plans.space.neighbor(cell, (usize::from(step) + 4) % 8);
        }
        cells[first..].reverse();
    }

    fn reach(&mut self, cell: usize, cost: Cost, step: u8, bound: Cost) {
        let name = u32::try_from(cell).unwrap_or(u32::MAX);
        if self.reached[cell] == NEW {
            self.touched.push(name);
        }
        self.reached[cell] = (cost, step);
        if bound < UNREACHABLE {
            self.waiting.push(Reverse((cost + bound, Reverse(cost), name)));
        }
    }

    fn forget(&mut self, n_cells: usize) {
        for cell in self.touched.drain(..) {
            self.reached[cell as usize] = NEW;
        }
        self.waiting.clear();
        self.reached.resize(n_cells, NEW);
    }
}

/// Lower bounds of what is left to the goal.
struct Bounds {
    to: usize,
    width: usize,
    /// Doors, places in the rows, and what they cost from the goal.
    nodes: [(usize, usize, Cost); N_BOUNDS_MAX],
    n_nodes: usize,
}

impl Bounds {
    fn new(plans: &Plans, from: usize, to: usize) -> Self {
        let width = plans.space.info().width as usize;
        let mut bounds = Self { to, width, nodes: [(0, 0, 0); N_BOUNDS_MAX], n_nodes: 0 };
        let (Some(start), Some(goal)) = (plans.place(from), plans.place(to)) else {
            return bounds;
        };
        let region = start.region();
        let table = &plans.tables[region];
        let octile = bounds.octile(from);
        // The best bound at the start is a good one on the way.
        let mut best: Vec<(Cost, (usize, usize, Cost))> = vec![];
        for (at, door) in plans.layout.doors[region].iter().enumerate() {
            for node in [door.first, door.first + door.n_nodes - 1] {
                let [a, b] = [start, goal].map(|place| table.cost(place.slot(), at, node));
                if octile < a.abs_diff(b) && a < UNREACHABLE && b < UNREACHABLE {
                    best.push((a.abs_diff(b), (at, node, b)));
                }
            }
        }
        best.sort_unstable_by(|a, b| b.cmp(a));
        for (place, (_, node)) in bounds.nodes.iter_mut().zip(best) {
            *place = node;
            bounds.n_nodes += 1;
        }
        bounds
    }

    fn of(&self, plans: &Plans, cell: usize) -> Cost {
        let mut bound = self.octile(cell);
        if 0 < self.n_nodes
            && let Some(place) = plans.place(cell)
        {
            let table = &plans.tables[place.region()];
            for &(at, node, goal) in &self.nodes[..self.n_nodes] {
                let cost = table.cost(place.slot(), at, node);
                if UNREACHABLE <= cost {
                    // The goal reaches that node, so that this cell does not reach the goal.
                    return UNREACHABLE;
                }
                bound = bound.max(cost.abs_diff(goal));
            }
        }
        bound
    }

    fn octile(&self, cell: usize) -> Cost {
        let place = |cell: usize| [cell % self.width, cell / self.width];
        let (a, b) = (place(cell), place(self.to));
        octile([a[0].abs_diff(b[0]), a[1].abs_diff(b[1])])
    }
}
