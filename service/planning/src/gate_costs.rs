//! Costs between the nodes of gates.
//!
//! First upward, gate by gate in the order of elimination: what a path costs from a node to a later
//! one over earlier nodes only,
//!
//! ```text
//! up(m, n) = min( inside a region, min over earlier k of up(k, m) + up(k, n) )
//! ```
//!
//! then downward from the roots: what any path costs from a node to one of an ancestor,
//!
//! ```text
//! all(m, n) = min over later k of up(m, k) + all(k, n)
//! ```
//!
//! J. Dibbelt, B. Strasser and D. Wagner, "Customizable contraction hierarchies", ACM Journal of
//! Experimental Algorithmics 21 (2016); the result is the hierarchical hub labelling of I. Abraham
//! et al., ESA 2012. Exact for whatever costs the regions' tables hold. With h nodes in the
//! ancestors of a gate: space O(nodes · h), time O(nodes · h²).

mod downward;
mod legs;
mod matrix;
mod upward;

use std::sync::Arc;

pub(crate) use self::legs::Leg;
pub(crate) use self::matrix::NodeName;

use self::matrix::Matrix;
use crate::cost::Cost;
use crate::hierarchy::Hierarchy;

/// Costs between nodes, and how they came about.
#[derive(Clone, Debug)]
pub(crate) struct GateCosts {
    cliques: Vec<Arc<Clique>>,
    up: Vec<Arc<Matrix>>,
    all: Vec<Arc<Matrix>>,
}

/// Costs between all nodes of one region's gates by ways inside it.
#[derive(Debug, PartialEq)]
pub(crate) struct Clique {
    pub(crate) region: u32,
    /// Gates, each with its place of the first node in the rows.
    pub(crate) gates: Vec<(usize, usize)>,
    pub(crate) n_nodes: usize,
    /// Symmetric; `n_nodes` rows.
    pub(crate) costs: Vec<Cost>,
}

impl GateCosts {
    /// From the cliques of all regions.
    pub(crate) fn new(hierarchy: &Hierarchy, cliques: Vec<Arc<Clique>>) -> Self {
        let n_gates = hierarchy.order.len();
        let nothing = Arc::new(Matrix::new(0, 0));
        let (up, all) = (vec![nothing.clone(); n_gates], vec![nothing; n_gates]);
        let mut costs = Self { cliques, up, all };
        for &gate in &hierarchy.order {
            costs.up[gate] = Arc::new(costs.upward(hierarchy, gate));
        }
        for &gate in hierarchy.order.iter().rev() {
            costs.all[gate] = Arc::new(costs.downward(hierarchy, gate));
        }
        costs
    }

    /// What they were made from, by region.
    pub(crate) fn cliques(&self) -> &[Arc<Clique>] {
        &self.cliques
    }

    /// With other cliques: equal to costs made afresh, but only what the difference reaches is
    /// computed again. Tells for every gate whether its costs changed.
    pub(crate) fn with_cliques(
        &self,
        hierarchy: &Hierarchy,
        cliques: Vec<Arc<Clique>>,
    ) -> (Self, Vec<bool>) {
        let mut costs = Self { cliques, up: self.up.clone(), all: self.all.clone() };
        let mut is_changed = vec![false; hierarchy.order.len()];
        for &gate in &hierarchy.order {
            if costs.may_differ(self, hierarchy, gate, &is_changed) {
                let up = costs.upward(hierarchy, gate);
                // Where only the way changed, nothing that is made from the costs does.
                is_changed[gate] = up.costs != self.up[gate].costs;
                costs.up[gate] = Arc::new(up);
            }
        }
        for &gate in hierarchy.order.iter().rev() {
            let above = || hierarchy.ancestors(gate).any(|ancestor| is_changed[ancestor]);
            if is_changed[gate] || above() {
                let all = costs.downward(hierarchy, gate);
                is_changed[gate] = all.costs != self.all[gate].costs;
                costs.all[gate] = Arc::new(all);
            }
        }
        (costs, is_changed)
    }

    /// Costs from a node of a gate to the nodes of the gate and of all its ancestors.
    pub(crate) fn row(&self, NodeName { gate, node }: NodeName) -> &[Cost] {
        self.all[gate].row(node)
    }

    /// Memory, in bytes.
    pub(crate) fn n_bytes(&self) -> usize {
        let matrices = self.up.iter().chain(&self.all);
        let matrices: usize = matrices.map(|matrix| size_of_val(matrix.costs.as_slice()) * 2).sum();
        let cliques = self.cliques.iter().map(|clique| size_of_val(clique.costs.as_slice()));
        matrices + cliques.sum::<usize>()
    }
}
