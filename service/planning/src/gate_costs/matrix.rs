//! Rows of costs from the nodes of a gate, and what each cost came from.

use wide::i32x8;

use crate::cost::{Cost, UNREACHABLE};
use crate::hierarchy::Hierarchy;

/// A node of a gate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct NodeName {
    pub(crate) gate: usize,
    pub(crate) node: usize,
}

/// Costs from the nodes of one gate: a row a node, row-major.
///
/// Columns of `up`: the gate's own nodes, then those of its higher gates by rank. Columns of `all`:
/// the gate's own, then those of all ancestors, the parent's first.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Matrix {
    pub(super) n_columns: usize,
    pub(super) costs: Vec<Cost>,
    pub(super) via: Vec<Via>,
}

/// What a cost came from.
///
/// In `up`: a region, or a node on the way. In `all`: the first node on the way that is later.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Via(u32);

impl Via {
    const NOTHING: Self = Self(u32::MAX);
    const REGION: u32 = 1 << 31;

    pub(super) fn region(region: u32) -> Self {
        Self(Self::REGION | region)
    }

    pub(super) fn node(gate: usize, node: usize) -> Self {
        // Gates are below 2^25, nodes of a gate below 2^6.
        Self(u32::try_from(gate << 6 | node).unwrap_or(u32::MAX))
    }

    /// Whether this is a node of that gate.
    pub(super) fn is_of(self, gate: usize) -> bool {
        self.0 & Self::REGION == 0 && (self.0 >> 6) as usize == gate
    }

    pub(super) fn as_region(self) -> Option<u32> {
        (self.0 & Self::REGION != 0).then_some(self.0 & !Self::REGION)
    }

    pub(super) fn as_node(self) -> NodeName {
        NodeName { gate: (self.0 >> 6) as usize, node: (self.0 & 63) as usize }
    }
}

impl Matrix {
    pub(super) fn new(n_rows: usize, n_columns: usize) -> Self {
        let n = n_rows * n_columns;
        Self { n_columns, costs: vec![UNREACHABLE; n], via: vec![Via::NOTHING; n] }
    }

    pub(super) fn row(&self, row: usize) -> &[Cost] {
        &self.costs[row * self.n_columns..][..self.n_columns]
    }

    pub(super) fn improve(&mut self, row: usize, column: usize, cost: Cost, via: Via) {
        let at = row * self.n_columns + column;
        if cost < self.costs[at] {
            self.costs[at] = cost;
            self.via[at] = via;
        }
    }

    /// Row `row`, columns from `first`: at most `extra` more than `costs`.
    pub(super) fn improve_row(
        &mut self,
        row: usize,
        first: usize,
        extra: Cost,
        costs: &[Cost],
        via: Via,
    ) {
        let at = row * self.n_columns + first;
        let known = &mut self.costs[at..][..costs.len()];
        let known_via = &mut self.via[at..][..costs.len()];
        let words = known.chunks_mut(LANES).zip(known_via.chunks_mut(LANES));
        for ((known, known_via), costs) in words.zip(costs.chunks(LANES)) {
            if !is_any_less(extra, costs, known) {
                continue;
            }
            for ((known, known_via), &cost) in known.iter_mut().zip(known_via).zip(costs) {
                let through = extra + cost;
                let is_better = through < *known;
                *known = if is_better { through } else { *known };
                *known_via = if is_better { via } else { *known_via };
            }
        }
    }
}

/// Costs that are looked at together: few of them improve as a rule.
const LANES: usize = 8;

/// Whether one of the costs and `extra` make less than what is known; all are [`UNREACHABLE`] at
/// most, and `extra` is less.
fn is_any_less(extra: Cost, costs: &[Cost], known: &[Cost]) -> bool {
    let (Some(costs), Some(known)) = (costs.as_array::<LANES>(), known.as_array::<LANES>()) else {
        return true;
    };
    // Sums stay below 2^31; the oldest processors compare signed words only.
    let [costs, known] = [costs, known].map(|costs| i32x8::new(costs.map(Cost::cast_signed)));
    (costs + i32x8::splat(extra.cast_signed())).simd_lt(known).any()
}

/// Column of a node of the gate or of a higher one in its `up`.
pub(super) fn column_of_higher(hierarchy: &Hierarchy, gate: usize, to: NodeName) -> usize {
    if to.gate == gate {
        return to.node;
    }
    let before = hierarchy.higher[gate].iter().take_while(|&&other| other != to.gate);
    hierarchy.n_nodes[gate] + before.map(|&other| hierarchy.n_nodes[other]).sum::<usize>() + to.node
}

/// Columns of `all` end with those of the root: an ancestor's are as many from the end everywhere.
pub(super) fn column_of_ancestor(hierarchy: &Hierarchy, from: NodeName, to: NodeName) -> usize {
    hierarchy.n_columns(from.gate) - hierarchy.n_columns(to.gate) + to.node
}
