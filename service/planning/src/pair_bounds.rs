//! What a path between two gates costs at least.
//!
//! For every pair of gates the least cost between any nodes, from below, and where their distances
//! meet in the hierarchy. By it most pairs of gates are ruled out without a look at their nodes.
//! Time O(gates² · h) with h nodes in the ancestors of a gate, space O(gates²).

use crate::cost::{Cost, UNREACHABLE};
use crate::gate_costs::{GateCosts, NodeName};
use crate::hierarchy::Hierarchy;

/// Bounds for all pairs of gates.
#[derive(Clone, Debug)]
pub(crate) struct PairBounds {
    n_gates: usize,
    bounds: Vec<PairBound>,
}

/// Of one pair.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PairBound {
    /// No path between the two costs less.
    pub(crate) least: Cost,
    /// Columns that both gates' rows end with: nodes of the common ancestors.
    pub(crate) n_common: u32,
    /// How many of them, from the first, every path has one of.
    pub(crate) n_read: u32,
}

impl PairBounds {
    pub(crate) fn new(hierarchy: &Hierarchy, costs: &GateCosts) -> Self {
        let n_gates = hierarchy.order.len();
        let least: Vec<Vec<Cost>> = (0..n_gates).map(|g| least_row(hierarchy, costs, g)).collect();
        let mut bounds = vec![PairBound { least: UNREACHABLE, n_common: 0, n_read: 0 }; n_gates * n_gates];
        for a in 0..n_gates {
            for b in 0..=a {
                let Some(common) = hierarchy.common(a, b) else { continue };
                let n_common = hierarchy.n_columns(common);
                let [row_a, row_b] = [&least[a], &least[b]].map(|row| &row[row.len() - n_common..]);
                let both = row_a.iter().zip(row_b).map(|(a, b)| a + b);
                let least = if a == b { 0 } else { both.min().unwrap_or(UNREACHABLE) };
                // Costs to an ancestor itself are there: no need to go over its ancestors.
                let is_direct = common == a || common == b;
                let n_read = if is_direct { hierarchy.n_nodes[common] } else { n_common };
                let [n_common, n_read] =
                    [n_common, n_read].map(|n| u32::try_from(n).unwrap_or(u32::MAX));
                let bound = PairBound { least: least.min(UNREACHABLE), n_common, n_read };
                bounds[a * n_gates + b] = bound;
                bounds[b * n_gates + a] = bound;
            }
        }
        Self { n_gates, bounds }
    }

    pub(crate) fn of(&self, a: usize, b: usize) -> PairBound {
        self.bounds[a * self.n_gates + b]
    }

    /// Memory, in bytes.
    pub(crate) fn n_bytes(&self) -> usize {
        size_of_val(self.bounds.as_slice())
    }
}

/// Least costs from any node of a gate, by column.
fn least_row(hierarchy: &Hierarchy, costs: &GateCosts, gate: usize) -> Vec<Cost> {
    let mut least = vec![UNREACHABLE; hierarchy.n_columns(gate)];
    for node in 0..hierarchy.n_nodes[gate] {
        for (least, &cost) in least.iter_mut().zip(costs.row(NodeName { gate, node })) {
            *least = (*least).min(cost);
        }
    }
    least
}
