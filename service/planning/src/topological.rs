//! Topological plans: from every part to every other through as few as possible.
//!
//! S. Thrun, Artificial Intelligence 99 (1998), section 3.2 (i): shortest paths in the graph, each
//! arc counted as one, for all pairs beforehand, so that a plan is a look-up. Plans are symmetric,
//! as the paper asks, and consistent: what follows a part in a plan is the plan from there. Both
//! need ties to be broken alike everywhere: every pair of neighbours has a number of its own, drawn
//! from the two indices, and of equally long plans the one with the least sum of numbers is taken.
//! Time O(parts · portals · log parts), space O(parts²).

use std::collections::BTreeSet;

use crate::part_graph::{PartGraph, Transit};
use crate::parts::PartIndex;

/// The way out of every part on the way to every other.
#[derive(Clone, Debug, PartialEq)]
pub struct TopologicalPlans {
    n_parts: usize,
    /// One row a goal: for every part the way out towards it; `None` in the goal itself and where
    /// there is no way.
    exits: Vec<Option<Transit>>,
}

/// Fewer parts first, then the least sum of numbers.
type Rank = (u32, u64);

impl TopologicalPlans {
    /// For all pairs of parts.
    pub fn new(graph: &PartGraph) -> Self {
        let n_parts = graph.parts().n_parts();
        let mut exits = Vec::with_capacity(n_parts * n_parts);
        for goal in graph.parts().indices() {
            exits.extend(towards(graph, goal));
        }
        Self { n_parts, exits }
    }

    /// The transits from one part to another, none if they are the same; `None` if there is no way.
    ///
    /// # Panics
    /// If a part or the graph is not one of those that the plans were made for.
    pub fn plan(&self, graph: &PartGraph, from: PartIndex, to: PartIndex) -> Option<Vec<Transit>> {
        let row = &self.exits[to.place() * self.n_parts..][..self.n_parts];
        let mut plan = vec![];
        let mut at = from;
        while at != to {
            let exit = row[at.place()]?;
            plan.push(exit);
            at = graph.to(exit);
        }
        Some(plan)
    }

    /// Memory, in bytes.
    pub fn n_bytes(&self) -> usize {
        size_of_val(self.exits.as_slice())
    }
}

/// Backups of value iteration as section 4.3 counts them: so many nodes (parts or cells) times the
/// mean length of a path, in nodes.
pub fn backups(n_nodes: usize, mean_path_nodes: f64) -> f64 {
    n_nodes as f64 * mean_path_nodes
}

/// The way out of every part on the way to `goal`: Dijkstra's algorithm.
fn towards(graph: &PartGraph, goal: PartIndex) -> Vec<Option<Transit>> {
    let n_parts = graph.parts().n_parts();
    let mut exits = vec![None; n_parts];
    let mut ranks: Vec<Rank> = vec![(u32::MAX, 0); n_parts];
    let mut open = BTreeSet::from([((0, 0), goal)]);
    ranks[goal.place()] = (0, 0);
    while let Some(((n_hops, sum), part)) = open.pop_first() {
        for &transit in graph.exits(part) {
            let neighbor = graph.to(transit);
            let rank = (n_hops + 1, sum + number(part, neighbor));
            let known = &mut ranks[neighbor.place()];
            if rank < *known {
                open.remove(&(*known, neighbor));
                *known = rank;
                exits[neighbor.place()] = Some(transit.back());
                open.insert((rank, neighbor));
            }
        }
    }
    exits
}

/// A number of 40 bits, the same for both directions: 2²⁴ of them sum up without overflow, and the
/// sums of two plans are equal once in 10¹². G. L. Steele, D. Lea and C. H. Flood, "Fast splittable
/// pseudorandom number generators", OOPSLA (2014).
fn number(a: PartIndex, b: PartIndex) -> u64 {
    let pair = u64::from(a.min(b).0) << 32 | u64::from(a.max(b).0);
    let mut mixed = pair.wrapping_add(0x9e37_79b9_7f4a_7c15);
    mixed = (mixed ^ mixed >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    (mixed ^ mixed >> 31) >> 24
}
