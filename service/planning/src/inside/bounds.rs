//! Lower bounds of what is left to a goal within its region.
//!
//! ```text
//! cost(c, t) >= octile(c, t),  cost(c, t) >= |table(c, n) - table(t, n)|
//! ```
//!
//! for every node n of a gate: A. V. Goldberg and C. Harrelson, "Computing the shortest path: A*
//! search meets graph theory", SODA 2005. The nodes that bound best at the start are used.

use crate::cost::{Cost, DIAGONAL, STRAIGHT, UNREACHABLE};
use crate::inside::patch::{Patch, Spot};
use crate::plans::{Place, Plans};

/// Nodes whose costs bound the search, at most: each costs a look-up a cell.
const N_NODES_MAX: usize = 4;

/// What straight and diagonal steps would cost, if nothing stood in the way.
fn octile([dx, dy]: [usize; 2]) -> Cost {
    let (least, most) = (dx.min(dy), dx.max(dy));
    let cost = |n: usize| Cost::try_from(n).unwrap_or(UNREACHABLE);
    cost(least) * DIAGONAL + cost(most - least) * STRAIGHT
}

/// Lower bounds to one goal.
pub(super) struct Bounds<'a> {
    plans: &'a Plans,
    patch: &'a Patch,
    region: usize,
    goal: Spot,
    nodes: [Node; N_NODES_MAX],
    n_nodes: usize,
}

/// A node of a gate.
#[derive(Clone, Copy, Default)]
struct Node {
    /// What it bounds at the start.
    bound: Cost,
    /// Spot of the door among the region's.
    door: usize,
    /// Spot of the node in the table's rows.
    node: usize,
    /// Cost between it and the goal.
    from_goal: Cost,
}

impl<'a> Bounds<'a> {
    /// From one cell to another of the same region.
    pub(super) fn new(plans: &'a Plans, start: Place, goal: Place) -> Self {
        let region = start.region();
        let patch = &plans.patches[region];
        let cells = &plans.layout.cells[region];
        let [from, to] = [start, goal].map(|place| patch.spot(cells[place.slot()] as usize));
        let nodes = [Node::default(); N_NODES_MAX];
        let mut bounds = Self { plans, patch, region, goal: to, nodes, n_nodes: 0 };
        let table = &plans.tables[region];
        let octile = bounds.octile(from);
        for (at, door) in plans.layout.doors[region].iter().enumerate() {
            for node in [door.first, door.first + door.n_nodes - 1] {
                let [a, b] = [start, goal].map(|place| table.cost(place.slot(), at, door, node));
                let bound = if a < UNREACHABLE && b < UNREACHABLE { a.abs_diff(b) } else { 0 };
                if octile < bound {
                    bounds.insert(Node { bound, door: at, node, from_goal: b });
                }
            }
        }
        bounds
    }

    /// Keeps the best, best first.
    fn insert(&mut self, node: Node) {
        let n_better =
            self.nodes[..self.n_nodes].iter().take_while(|known| node.bound <= known.bound).count();
        if n_better < N_NODES_MAX {
            self.n_nodes = (self.n_nodes + 1).min(N_NODES_MAX);
            self.nodes[n_better..self.n_nodes].rotate_right(1);
            self.nodes[n_better] = node;
        }
    }

    /// What is left from a cell to the goal at least; [`UNREACHABLE`] if there is no way.
    pub(super) fn of(&self, spot: Spot) -> Cost {
        let mut bound = self.octile(spot);
        if 0 < self.n_nodes {
            let slot = self.plans.layout.places[self.patch.cell(spot)].slot();
            let table = &self.plans.tables[self.region];
            let doors = &self.plans.layout.doors[self.region];
            for node in &self.nodes[..self.n_nodes] {
                let cost = table.cost(slot, node.door, &doors[node.door], node.node);
                if UNREACHABLE <= cost {
                    // The goal reaches that node, so that this cell does not reach the goal.
                    return UNREACHABLE;
                }
                bound = bound.max(cost.abs_diff(node.from_goal));
            }
        }
        bound
    }

    /// What is left if nothing stood in the way.
    fn octile(&self, [x, y]: Spot) -> Cost {
        octile([x.abs_diff(self.goal[0]), y.abs_diff(self.goal[1])])
    }

    /// Where to.
    pub(super) fn goal(&self) -> Spot {
        self.goal
    }
}
