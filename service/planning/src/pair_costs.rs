//! Costs between all pairs of gates, ready to look up.
//!
//! For every pair of gates a block with the cost between any two of their nodes, as long as all
//! blocks together fit in memory; the least cost of every block, by which most pairs are ruled out
//! without a look at their nodes. Without blocks the costs come from the common ancestors of the two gates, exact as well, in more time. With n
//! nodes and h nodes in the ancestors of a gate: time O(n² · h), space O(n²).

use std::sync::Arc;

use crate::cost::{Cost, UNREACHABLE};
use crate::exits::Uncovered;
use crate::gate_costs::{GateCosts, NodeName};
use crate::hierarchy::Hierarchy;

/// For all pairs of gates.
#[derive(Clone, Debug)]
pub(crate) struct PairCosts {
    bounds: Vec<PairBound>,
    /// One row a gate, by rank: its blocks with the gates of equal or higher rank. Empty if there
    /// is no room for them.
    blocks: Vec<Arc<Vec<Cost>>>,
    /// Number of nodes of all gates of lower rank.
    n_before: Vec<usize>,
}

/// Pairs of gates whose costs are others than before.
#[derive(Clone, Debug)]
pub(crate) struct ChangedPairs {
    n_gates: usize,
    is_changed: Vec<bool>,
}

impl ChangedPairs {
    pub(crate) fn of(&self, a: usize, b: usize) -> bool {
        self.is_changed[a * self.n_gates + b]
    }
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

/// Costs between the nodes of two gates: a row a node of the first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Block<'a> {
    pub(crate) costs: &'a [Cost],
    /// Whether the rows are those of the other gate.
    pub(crate) is_turned: bool,
}

impl PairCosts {
    /// Blocks are kept if they take no more than `bytes_max`.
    pub(crate) fn new(hierarchy: &Hierarchy, costs: &GateCosts, bytes_max: usize) -> Self {
        let n_gates = hierarchy.order.len();
        let mut n_before = vec![0; n_gates];
        let mut n_total = 0;
        for &gate in &hierarchy.order {
            n_before[gate] = n_total;
            n_total += hierarchy.n_nodes[gate];
        }
        let nothing = PairBound { least: UNREACHABLE, n_common: 0, n_read: 0 };
        let has_blocks = n_total * n_total / 2 * size_of::<Cost>() <= bytes_max;
        let row = |gate: usize| {
            let n_columns = n_total - n_before[gate];
            Arc::new(vec![UNREACHABLE; hierarchy.n_nodes[gate] * n_columns])
        };
        let mut pairs = Self {
            bounds: vec![nothing; n_gates * n_gates],
            blocks: if has_blocks { (0..n_gates).map(row).collect() } else { vec![] },
            n_before,
        };
        pairs.update(hierarchy, costs, &vec![true; n_gates]);
        pairs
    }

    /// The same after some gates' costs changed, and for which pairs they did.
    pub(crate) fn with_changes(
        &self,
        hierarchy: &Hierarchy,
        costs: &GateCosts,
        is_changed: &[bool],
    ) -> (Self, ChangedPairs) {
        let mut pairs = self.clone();
        let is_other = pairs.update(hierarchy, costs, is_changed);
        (pairs, is_other)
    }

    fn update(
        &mut self,
        hierarchy: &Hierarchy,
        costs: &GateCosts,
        is_changed: &[bool],
    ) -> ChangedPairs {
        let n_gates = hierarchy.order.len();
        let mut changed = ChangedPairs { n_gates, is_changed: vec![false; n_gates * n_gates] };
        let least: Vec<Vec<Cost>> = if self.blocks.is_empty() {
            (0..n_gates).map(|gate| least_row(hierarchy, costs, gate)).collect()
        } else {
            vec![]
        };
        for (rank, &low) in hierarchy.order.iter().enumerate() {
            for &high in &hierarchy.order[rank..] {
                if !is_changed[low] && !is_changed[high] {
                    continue;
                }
                let mut bound = bound(hierarchy, low, high);
                let mut is_other = true;
                if self.blocks.is_empty() {
                    bound.least = least_between(&least[low], &least[high], bound);
                } else {
                    (bound.least, is_other) = self.fill(hierarchy, costs, low, high);
                }
                changed.is_changed[low * n_gates + high] = is_other;
                changed.is_changed[high * n_gates + low] = is_other;
                self.bounds[low * n_gates + high] = bound;
                self.bounds[high * n_gates + low] = bound;
            }
        }
        changed
    }

    /// Computes a block, and tells its least cost and whether it is another than before.
    fn fill(
        &mut self,
        hierarchy: &Hierarchy,
        costs: &GateCosts,
        low: usize,
        high: usize,
    ) -> (Cost, bool) {
        let [n_low, n_high] = [low, high].map(|gate| hierarchy.n_nodes[gate]);
        let PairBound { n_common, n_read, .. } = bound(hierarchy, low, high);
        let columns = |row: &'_ [Cost]| {
            let first = row.len() - n_common as usize;
            first..first + n_read as usize
        };
        let first = (self.n_before[high] - self.n_before[low]) * n_low;
        let block = &mut Arc::make_mut(&mut self.blocks[low])[first..first + n_low * n_high];
        let (mut least, mut is_other) = (UNREACHABLE, false);
        for (node, to) in block.chunks_exact_mut(n_high).enumerate() {
            let row = costs.row(NodeName { gate: low, node });
            let row = &row[columns(row)];
            for (node, to) in to.iter_mut().enumerate() {
                let other = costs.row(NodeName { gate: high, node });
                let sums = row.iter().zip(&other[columns(other)]).map(|(a, b)| a + b);
                let cost = sums.min().unwrap_or(UNREACHABLE).min(UNREACHABLE);
                is_other |= cost != *to;
                *to = cost;
                least = least.min(cost);
            }
        }
        (least, is_other)
    }

    /// Whether costs between all nodes are kept.
    pub(crate) fn has_blocks(&self) -> bool {
        !self.blocks.is_empty()
    }

    pub(crate) fn of(&self, a: usize, b: usize) -> PairBound {
        self.bounds[a * self.n_before.len() + b]
    }

    /// Costs between the nodes of two gates, if blocks are kept.
    pub(crate) fn block(&self, hierarchy: &Hierarchy, a: usize, b: usize) -> Option<Block<'_>> {
        let is_turned = self.n_before[b] < self.n_before[a];
        let (low, high) = if is_turned { (b, a) } else { (a, b) };
        let row = self.blocks.get(low)?;
        let n_low = hierarchy.n_nodes[low];
        let first = (self.n_before[high] - self.n_before[low]) * n_low;
        Some(Block { costs: &row[first..first + n_low * hierarchy.n_nodes[high]], is_turned })
    }

    /// Costs between the nodes of two gates, a row a node of the first, if blocks are kept.
    pub(crate) fn full_block(
        &self,
        hierarchy: &Hierarchy,
        a: usize,
        b: usize,
    ) -> Option<Uncovered> {
        let block = self.block(hierarchy, a, b)?;
        let n_columns = hierarchy.n_nodes[b];
        let mut costs = block.costs.to_vec();
        if block.is_turned {
            let n_rows = hierarchy.n_nodes[a];
            let turned = (0..n_rows).flat_map(|row| {
                (0..n_columns).map(move |column| block.costs[column * n_rows + row])
            });
            costs = turned.collect();
        }
        Some(Uncovered { costs, n_columns })
    }

    /// Memory, in bytes.
    pub(crate) fn n_bytes(&self) -> usize {
        let blocks = self.blocks.iter().map(|row| size_of_val(row.as_slice())).sum::<usize>();
        size_of_val(self.bounds.as_slice()) + blocks
    }
}

/// Where the rows of two gates meet.
fn bound(hierarchy: &Hierarchy, a: usize, b: usize) -> PairBound {
    let Some(common) = hierarchy.common(a, b) else {
        return PairBound { least: UNREACHABLE, n_common: 0, n_read: 0 };
    };
    let n_common = hierarchy.n_columns(common);
    // Costs to an ancestor itself are there: no need to go over its ancestors.
    let is_direct = common == a || common == b;
    let n_read = if is_direct { hierarchy.n_nodes[common] } else { n_common };
    let [n_common, n_read] = [n_common, n_read].map(|n| u32::try_from(n).unwrap_or(u32::MAX));
    PairBound { least: UNREACHABLE, n_common, n_read }
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

/// A bound from below, of the least costs to the common ancestors.
fn least_between(a: &[Cost], b: &[Cost], bound: PairBound) -> Cost {
    let n_common = bound.n_common as usize;
    let [a, b] = [a, b].map(|row| &row[row.len() - n_common..][..bound.n_read as usize]);
    let least = a.iter().zip(b).map(|(a, b)| a + b).min().unwrap_or(UNREACHABLE);
    least.min(UNREACHABLE)
}
