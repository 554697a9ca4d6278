//! Order of elimination of the gates.
//!
//! Gates that share a region are neighbours. Eliminated one after another, each leaves its
//! neighbours joined to each other; what is eliminated later and joined to a gate when its turn
//! comes are its higher gates. The first of these is its parent: every path from a gate to one
//! that is not its ancestor passes their common ancestors. Order by least number of nodes in
//! higher gates ("minimum degree"): W. F. Tinney and J. W. Walker, Proceedings of the IEEE 55
//! (1967); elimination trees and shortest paths: J. Dibbelt, B. Strasser and D. Wagner,
//! "Customizable contraction hierarchies", ACM Journal of Experimental Algorithmics 21 (2016).
//! The order depends on the regions only, not on costs. Time O(gates² + fill).

use std::collections::BTreeSet;

/// Elimination order and tree over gates, each named by its place among them.
#[derive(Clone, Debug)]
pub(crate) struct Hierarchy {
    /// The gates in the order of their elimination.
    pub(crate) order: Vec<usize>,
    /// A gate's place in that order.
    pub(crate) rank: Vec<usize>,
    /// Higher neighbours by rank, the parent first.
    pub(crate) higher: Vec<Vec<usize>>,
    /// The gates that a gate is a higher one of, by rank.
    pub(crate) lower: Vec<Vec<usize>>,
    /// The regions of a gate.
    pub(crate) regions: Vec<Vec<usize>>,
    /// Number of nodes of all ancestors.
    pub(crate) n_above: Vec<usize>,
    /// Number of nodes of the gate itself.
    pub(crate) n_nodes: Vec<usize>,
}

impl Hierarchy {
    /// `n_nodes` of every gate, and the gates of every region.
    pub(crate) fn new(n_nodes: Vec<usize>, regions: impl Iterator<Item = Vec<usize>>) -> Self {
        let n_gates = n_nodes.len();
        let mut neighbors = vec![BTreeSet::new(); n_gates];
        let mut of_gate = vec![vec![]; n_gates];
        for (region, gates) in regions.enumerate() {
            for &gate in &gates {
                of_gate[gate].push(region);
                neighbors[gate].extend(gates.iter().copied().filter(|&other| other != gate));
            }
        }
        let weight = |gates: &BTreeSet<usize>| gates.iter().map(|&gate| n_nodes[gate]).sum();
        let mut weights: Vec<usize> = neighbors.iter().map(weight).collect();
        let mut waiting: BTreeSet<(usize, usize)> =
            weights.iter().copied().enumerate().map(|(gate, weight)| (weight, gate)).collect();
        let mut order = Vec::with_capacity(n_gates);
        while let Some((_, gate)) = waiting.pop_first() {
            order.push(gate);
            let around = std::mem::take(&mut neighbors[gate]);
            for &other in &around {
                neighbors[other].remove(&gate);
                neighbors[other].extend(around.iter().copied().filter(|&third| third != other));
                waiting.remove(&(weights[other], other));
                weights[other] = weight(&neighbors[other]);
                waiting.insert((weights[other], other));
            }
            neighbors[gate] = around;
        }
        Self::along(order, neighbors, n_nodes, of_gate)
    }

    fn along(
        order: Vec<usize>,
        higher: Vec<BTreeSet<usize>>,
        n_nodes: Vec<usize>,
        regions: Vec<Vec<usize>>,
    ) -> Self {
        let mut rank = vec![0; order.len()];
        for (at, &gate) in order.iter().enumerate() {
            rank[gate] = at;
        }
        let by_rank = |gates: BTreeSet<usize>| {
            let mut gates: Vec<usize> = gates.into_iter().collect();
            gates.sort_unstable_by_key(|&gate| rank[gate]);
            gates
        };
        let higher: Vec<Vec<usize>> = higher.into_iter().map(by_rank).collect();
        let mut lower = vec![vec![]; order.len()];
        for &gate in &order {
            for &high in &higher[gate] {
                lower[high].push(gate);
            }
        }
        let mut n_above = vec![0; order.len()];
        for &gate in order.iter().rev() {
            n_above[gate] = higher[gate].first().map_or(0, |&up| n_above[up] + n_nodes[up]);
        }
        Self { order, rank, higher, lower, regions, n_above, n_nodes }
    }

    /// The next gate up the tree.
    pub(crate) fn parent(&self, gate: usize) -> Option<usize> {
        self.higher[gate].first().copied()
    }

    /// All ancestors, the parent first.
    pub(crate) fn ancestors(&self, gate: usize) -> impl Iterator<Item = usize> + '_ {
        std::iter::successors(self.parent(gate), |&gate| self.parent(gate))
    }

    /// Nodes of the gate and of its ancestors: the columns of its distances.
    pub(crate) fn n_columns(&self, gate: usize) -> usize {
        self.n_nodes[gate] + self.n_above[gate]
    }

    /// The first gate that is an ancestor of both, or one of the two and ancestor of the other.
    pub(crate) fn common(&self, mut a: usize, mut b: usize) -> Option<usize> {
        while a != b {
            let lower = if self.rank[a] < self.rank[b] { &mut a } else { &mut b };
            *lower = self.parent(*lower)?;
        }
        Some(a)
    }
}
