//! Costs of all ways to later nodes, gate by gate downward.

use std::sync::Arc;

use super::GateCosts;
use super::matrix::{Matrix, NodeName, Via, column_of_ancestor};
use crate::cost::Cost;
use crate::hierarchy::Hierarchy;

impl GateCosts {
    /// Costs from a gate to itself and all ancestors, those of which are known.
    pub(super) fn downward(&self, hierarchy: &Hierarchy, gate: usize) -> Matrix {
        let Self { up, all, .. } = self;
        let n_own = hierarchy.n_nodes[gate];
        let n_columns = hierarchy.n_columns(gate);
        let mut costs = Matrix::new(n_own, n_columns);
        // Rows of all later nodes that a way may go to first: higher gates' to this gate's ancestors.
        let mut first = n_own;
        for &high in &hierarchy.higher[gate] {
            let from = NodeName { gate, node: 0 };
            for node in 0..hierarchy.n_nodes[high] {
                let to = NodeName { gate: high, node };
                let column = column_of_ancestor(hierarchy, from, to);
                let extra = |own: usize| up[gate].row(own)[first + node];
                // If another node leads there as cheaply, it does so on all ways from there.
                let leads = |own: &usize| extra(*own) < costs.row(*own)[column];
                let leading: Vec<usize> = (0..n_own).filter(leads).collect();
                if leading.is_empty() {
                    continue;
                }
                let onward = onward(hierarchy, all, gate, to);
                for own in leading {
                    costs.improve_row(own, n_own, extra(own), &onward, Via::node(high, node));
                }
            }
            first += hierarchy.n_nodes[high];
        }
        for own in (0..n_own).rev() {
            costs.improve(own, own, 0, Via::node(gate, own));
            for later in own + 1..n_own {
                let extra = up[gate].row(own)[later];
                if extra < costs.row(own)[later] {
                    let onward = costs.row(later)[own + 1..].to_vec();
                    costs.improve_row(own, own + 1, extra, &onward, Via::node(gate, later));
                }
            }
            back_over_higher(hierarchy, up, gate, own, &mut costs);
            for later in own + 1..n_own {
                let at = own * n_columns + later;
                let mirrored = later * n_columns + own;
                costs.costs[mirrored] = costs.costs[at];
                costs.via[mirrored] = costs.via[at];
            }
        }
        costs
    }
}

/// Ways from a node up to a higher gate and back to a later node of its own gate.
fn back_over_higher(
    hierarchy: &Hierarchy,
    up: &[Arc<Matrix>],
    gate: usize,
    own: usize,
    costs: &mut Matrix,
) {
    let n_own = hierarchy.n_nodes[gate];
    let mut first = n_own;
    for &high in &hierarchy.higher[gate] {
        let column = column_of_ancestor(
            hierarchy,
            NodeName { gate, node: 0 },
            NodeName { gate: high, node: 0 },
        );
        for node in 0..hierarchy.n_nodes[high] {
            let extra = up[gate].row(own)[first + node];
            for later in own + 1..n_own {
                let through = extra + costs.row(later)[column + node];
                costs.improve(own, later, through, Via::node(high, node));
            }
        }
        first += hierarchy.n_nodes[high];
    }
}

/// Costs from a node of a higher gate to the nodes of all ancestors of `gate`, the parent's first.
fn onward(hierarchy: &Hierarchy, all: &[Arc<Matrix>], gate: usize, from: NodeName) -> Vec<Cost> {
    let mut onward = Vec::with_capacity(hierarchy.n_above[gate]);
    for ancestor in hierarchy.ancestors(gate).take_while(|&ancestor| ancestor != from.gate) {
        let column = column_of_ancestor(hierarchy, NodeName { gate: ancestor, node: 0 }, from);
        let rows = 0..hierarchy.n_nodes[ancestor];
        onward.extend(rows.map(|node| all[ancestor].row(node)[column]));
    }
    onward.extend_from_slice(all[from.gate].row(from.node));
    onward
}
