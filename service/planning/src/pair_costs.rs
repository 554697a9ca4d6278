//! Costs between all pairs of gates, ready to look up.
//!
//! For every pair of gates a block with the cost between any two of their nodes, as long as all
//! blocks together fit in memory; the least cost of every block, by which most pairs are ruled out
//! without a look at their nodes, and which the others of the block are kept as differences to.
//! Without blocks the costs come from the common ancestors of the two gates, exact as well, in more
//! time. With n nodes and h nodes in the ancestors of a gate: time O(n² · h), space O(n²).

use std::sync::Arc;

use crate::cost::{Cost, UNREACHABLE};
use crate::differences::{DifferenceRow, Differences};
use crate::exits::Uncovered;
use crate::gate_costs::{GateCosts, NodeName};
use crate::hierarchy::Hierarchy;
use crate::least_sums::stride;

/// For all pairs of gates.
#[derive(Clone, Debug)]
pub(crate) struct PairCosts {
    bounds: Vec<PairBound>,
    /// One row a gate, by rank: its blocks with the gates of equal or higher rank. Empty if there
    /// is no room for them.
    blocks: Vec<Arc<Differences>>,
    /// Number of columns of all gates of lower rank.
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

/// Costs between the nodes of two gates: a row of [`stride`] columns a node of the first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Block<'a> {
    /// The least cost.
    pub(crate) least: Cost,
    /// What the others are more.
    pub(crate) more: DifferenceRow<'a>,
    /// Columns a row.
    pub(crate) stride: usize,
    /// Whether the rows are those of the other gate.
    pub(crate) is_turned: bool,
}

impl Block<'_> {
    /// Cost from a node of the first gate to one of the other.
    pub(crate) fn cost(&self, from: usize, to: usize) -> Cost {
        let (row, column) = if self.is_turned { (to, from) } else { (from, to) };
        self.more.cost(row * self.stride + column, self.least)
    }

    /// The costs of a row.
    pub(crate) fn row(&self, row: usize, to: &mut [Cost]) {
        self.more.part(row * self.stride..(row + 1) * self.stride).costs(self.least, to);
    }
}

impl PairCosts {
    /// Blocks are kept if they take no more than `bytes_max`.
    pub(crate) fn new(hierarchy: &Hierarchy, costs: &GateCosts, bytes_max: usize) -> Self {
        let n_gates = hierarchy.order.len();
        let mut n_before = vec![0; n_gates];
        let mut n_total = 0;
        for &gate in &hierarchy.order {
            n_before[gate] = n_total;
            n_total += stride(hierarchy.n_nodes[gate]);
        }
        let nothing = PairBound { least: UNREACHABLE, n_common: 0, n_read: 0 };
        // As if all needed 32 bits: whether they do depends on the costs.
        let has_blocks = n_total * n_total / 2 * size_of::<Cost>() <= bytes_max;
        let row = |gate: usize| {
            let n_columns = n_total - n_before[gate];
            Arc::new(Differences::new(hierarchy.n_nodes[gate] * n_columns))
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
        let mut block = Vec::with_capacity(n_low * n_high);
        for node in 0..n_low {
            let row = costs.row(NodeName { gate: low, node });
            let row = &row[columns(row)];
            block.extend((0..n_high).map(|node| {
                let other = costs.row(NodeName { gate: high, node });
                let sums = row.iter().zip(&other[columns(other)]).map(|(a, b)| a + b);
                sums.min().unwrap_or(UNREACHABLE).min(UNREACHABLE)
            }));
        }
        let least = block.iter().copied().min().unwrap_or(UNREACHABLE);
        let is_other = self.put(hierarchy, low, high, &block, least);
        (least, is_other)
    }

    /// Writes a block, and tells whether it is another than before.
    fn put(
        &mut self,
        hierarchy: &Hierarchy,
        low: usize,
        high: usize,
        block: &[Cost],
        least: Cost,
    ) -> bool {
        let [n_low, n_high] = [low, high].map(|gate| hierarchy.n_nodes[gate]);
        let first = (self.n_before[high] - self.n_before[low]) * n_low;
        let known = Arc::make_mut(&mut self.blocks[low]);
        let mut is_other = self.bounds[low * self.n_before.len() + high].least != least;
        for (row, costs) in block.chunks_exact(n_high).enumerate() {
            for (column, &cost) in costs.iter().enumerate() {
                is_other |= known.put(first + row * stride(n_high) + column, cost, least);
            }
        }
        is_other
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
        let stride = stride(hierarchy.n_nodes[high]);
        let first = (self.n_before[high] - self.n_before[low]) * n_low;
        let more = row.row(first..first + n_low * stride);
        Some(Block { least: self.of(a, b).least, more, stride, is_turned })
    }

    /// Costs between the nodes of two gates, a row a node of the first, if blocks are kept.
    pub(crate) fn full_block(
        &self,
        hierarchy: &Hierarchy,
        a: usize,
        b: usize,
    ) -> Option<Uncovered> {
        let block = self.block(hierarchy, a, b)?;
        let [n_rows, n_columns] = [a, b].map(|gate| hierarchy.n_nodes[gate]);
        let row = |from: usize| (0..n_columns).map(move |to| block.cost(from, to));
        Some(Uncovered { costs: (0..n_rows).flat_map(row).collect(), n_columns })
    }

    /// Memory, in bytes.
    pub(crate) fn n_bytes(&self) -> usize {
        let blocks = self.blocks.iter().map(|row| row.n_bytes()).sum::<usize>();
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
