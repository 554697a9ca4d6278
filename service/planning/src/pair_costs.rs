//! Costs between all pairs of gates, ready to look up.
//!
//! For every pair of gates a block with the cost between any two of their nodes, as long as all
//! blocks together fit in memory; the least cost of every block, by which most pairs are ruled out
//! without a look at their nodes; and the least from a gate to any gate of a region. Without blocks
//! the costs come from the common ancestors of the two gates, exact as well, in more time. With n
//! nodes and h nodes in the ancestors of a gate: time O(n² · h), space O(n²).

use std::sync::Arc;

use crate::cost::{Cost, UNREACHABLE};
use crate::gate_costs::{GateCosts, NodeName};
use crate::hierarchy::Hierarchy;

/// For all pairs of gates.
#[derive(Clone, Debug)]
pub(crate) struct PairCosts {
    n_regions: usize,
    bounds: Vec<PairBound>,
    /// Least cost from a gate to any of a region's.
    to_region: Vec<Cost>,
    /// One row a gate, by rank: its blocks with the gates of equal or higher rank. Empty if there
    /// is no room for them.
    blocks: Vec<Arc<Vec<Cost>>>,
    /// Number of nodes of all gates of lower rank.
    n_before: Vec<usize>,
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
    /// `doors` are the gates of every region; blocks are kept if they take no more than
    /// `bytes_max`.
    pub(crate) fn new(
        hierarchy: &Hierarchy,
        costs: &GateCosts,
        doors: &[Vec<usize>],
        bytes_max: usize,
    ) -> Self {
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
            n_regions: doors.len(),
            bounds: vec![nothing; n_gates * n_gates],
            to_region: vec![],
            blocks: if has_blocks { (0..n_gates).map(row).collect() } else { vec![] },
            n_before,
        };
        pairs.update(hierarchy, costs, doors, &vec![true; n_gates]);
        pairs
    }

    /// The same after some gates' costs changed.
    pub(crate) fn with_changes(
        &self,
        hierarchy: &Hierarchy,
        costs: &GateCosts,
        doors: &[Vec<usize>],
        is_changed: &[bool],
    ) -> Self {
        let mut pairs = self.clone();
        pairs.update(hierarchy, costs, doors, is_changed);
        pairs
    }

    fn update(
        &mut self,
        hierarchy: &Hierarchy,
        costs: &GateCosts,
        doors: &[Vec<usize>],
        is_changed: &[bool],
    ) {
        let n_gates = hierarchy.order.len();
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
                bound.least = if low == high {
                    0
                } else if self.blocks.is_empty() {
                    least_between(&least[low], &least[high], bound)
                } else {
                    self.fill(hierarchy, costs, low, high)
                };
                if !self.blocks.is_empty() && low == high {
                    self.fill(hierarchy, costs, low, high);
                }
                self.bounds[low * n_gates + high] = bound;
                self.bounds[high * n_gates + low] = bound;
            }
        }
        let least = |gate: usize, doors: &Vec<usize>| {
            let costs = doors.iter().map(|&door| self.bounds[gate * n_gates + door].least);
            costs.min().unwrap_or(UNREACHABLE)
        };
        let to_region = (0..n_gates).flat_map(|gate| doors.iter().map(move |doors| (gate, doors)));
        self.to_region = to_region.map(|(gate, doors)| least(gate, doors)).collect();
    }

    /// Computes a block, and tells its least cost.
    fn fill(&mut self, hierarchy: &Hierarchy, costs: &GateCosts, low: usize, high: usize) -> Cost {
        let [n_low, n_high] = [low, high].map(|gate| hierarchy.n_nodes[gate]);
        let PairBound { n_common, n_read, .. } = bound(hierarchy, low, high);
        let columns = |row: &'_ [Cost]| {
            let first = row.len() - n_common as usize;
            first..first + n_read as usize
        };
        let first = (self.n_before[high] - self.n_before[low]) * n_low;
        let block = &mut Arc::make_mut(&mut self.blocks[low])[first..first + n_low * n_high];
        let mut least = UNREACHABLE;
        for (node, to) in block.chunks_exact_mut(n_high).enumerate() {
            let row = costs.row(NodeName { gate: low, node });
            let row = &row[columns(row)];
            for (node, to) in to.iter_mut().enumerate() {
                let other = costs.row(NodeName { gate: high, node });
                let sums = row.iter().zip(&other[columns(other)]).map(|(a, b)| a + b);
                *to = sums.min().unwrap_or(UNREACHABLE).min(UNREACHABLE);
                least = least.min(*to);
            }
        }
        least
    }

    pub(crate) fn of(&self, a: usize, b: usize) -> PairBound {
        self.bounds[a * self.n_before.len() + b]
    }

    /// Least cost from a gate to any of a region's.
    pub(crate) fn to_region(&self, gate: usize, region: usize) -> Cost {
        self.to_region[gate * self.n_regions + region]
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

    /// Memory, in bytes.
    pub(crate) fn n_bytes(&self) -> usize {
        let blocks = self.blocks.iter().map(|row| size_of_val(row.as_slice())).sum::<usize>();
        size_of_val(self.bounds.as_slice()) + size_of_val(self.to_region.as_slice()) + blocks
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
