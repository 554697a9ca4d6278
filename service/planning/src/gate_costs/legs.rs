//! From costs back to the ways they came from.

use super::GateCosts;
use super::matrix::{NodeName, column_of_ancestor, column_of_higher};
use crate::hierarchy::Hierarchy;

/// A way from one node to another that stays in one region.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Leg {
    pub(crate) from: NodeName,
    pub(crate) to: NodeName,
    pub(crate) region: u32,
}

impl GateCosts {
    /// The legs of a shortest path from a node to one of the same gate or an ancestor, appended in
    /// the order of travel; the node's column among those of [`Self::row`].
    pub(crate) fn legs(
        &self,
        hierarchy: &Hierarchy,
        from: NodeName,
        to: NodeName,
        legs: &mut Vec<Leg>,
    ) {
        let mut at = from;
        while at != to {
            // Costs are symmetric: the lower of two nodes has the row.
            let is_lower = precedes(hierarchy, at, to);
            let (low, high) = if is_lower { (at, to) } else { (to, at) };
            let column = column_of_ancestor(hierarchy, low, high);
            let matrix = &self.all[low.gate];
            let next = matrix.via[low.node * matrix.n_columns + column].as_node();
            if is_lower {
                self.legs_up(hierarchy, at, next, legs);
                at = next;
            } else {
                // The end of the path is known first: low -> next is its last piece.
                self.legs(hierarchy, at, next, legs);
                let first = legs.len();
                self.legs_up(hierarchy, low, next, legs);
                turn(&mut legs[first..]);
                at = to;
            }
        }
    }

    /// The legs of `up` from a node to a later one.
    fn legs_up(&self, hierarchy: &Hierarchy, from: NodeName, to: NodeName, legs: &mut Vec<Leg>) {
        let matrix = &self.up[from.gate];
        let column = column_of_higher(hierarchy, from.gate, to);
        let via = matrix.via[from.node * matrix.n_columns + column];
        if let Some(region) = via.as_region() {
            legs.push(Leg { from, to, region });
            return;
        }
        let middle = via.as_node();
        let first = legs.len();
        self.legs_up(hierarchy, middle, from, legs);
        turn(&mut legs[first..]);
        self.legs_up(hierarchy, middle, to, legs);
    }
}

/// Travels legs the other way round.
fn turn(legs: &mut [Leg]) {
    legs.reverse();
    for leg in legs {
        std::mem::swap(&mut leg.from, &mut leg.to);
    }
}

/// Whether a node is eliminated before another.
fn precedes(hierarchy: &Hierarchy, a: NodeName, b: NodeName) -> bool {
    let place = |name: NodeName| (hierarchy.rank[name.gate], name.node);
    place(a) < place(b)
}
