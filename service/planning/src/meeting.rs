//! Where the best path from one cell to another goes through gates.
//!
//! The look-up itself: least bounds first, so that of all pairs of gates only one or two are looked
//! at node by node. Nothing is allocated.

use crate::cost::{Cost, UNREACHABLE};
use crate::gate_costs::NodeName;
use crate::gates::GATE_NODES_MAX;
use crate::plans::Plans;
use crate::region_table::Door;

/// A shortest path through gates: from a cell to the first node, to the last, to a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Meeting {
    pub(crate) cost: Cost,
    pub(crate) first: NodeName,
    pub(crate) last: NodeName,
    /// A node of a common ancestor on the way between the two.
    pub(crate) middle: NodeName,
}

/// Costs from a cell to the nodes of one gate.
struct Approach {
    gate: usize,
    costs: [Cost; GATE_NODES_MAX],
    n_nodes: usize,
}

impl Plans {
    /// Cost of the best path from one cell to another that passes a gate.
    pub(crate) fn cost_by_gates(&self, from: (usize, usize), to: (usize, usize)) -> Cost {
        let mut best = UNREACHABLE;
        self.each_pair(from, to, |plans, from, to| {
            best = best.min(plans.cost_between(from, to));
            best
        });
        best
    }

    /// The pairs of gates of two places whose bounds are below the best, least first, then in
    /// order. `visit` tells the best cost so far.
    fn each_pair(
        &self,
        (from_region, from_slot): (usize, usize),
        (to_region, to_slot): (usize, usize),
        mut visit: impl FnMut(&Self, &Approach, &Approach) -> Cost,
    ) {
        let (from_table, to_table) = (&self.tables[from_region], &self.tables[to_region]);
        let (from_doors, to_doors) =
            (&self.layout.doors[from_region], &self.layout.doors[to_region]);
        let (from_least, to_least) = (from_table.least(from_slot), to_table.least(to_slot));
        let bound = |from: usize, to: usize| {
            let (from_door, to_door) = (&from_doors[from], &to_doors[to]);
            let ends = from_least[from] + self.door_cost(from_door);
            let ends = ends.min(UNREACHABLE) + (to_least[to] + self.door_cost(to_door)).min(UNREACHABLE);
            ends + self.bounds.of(from_door.gate, to_door.gate).least
        };
        let mut nearest = (UNREACHABLE, 0, 0);
        for from in 0..from_doors.len() {
            for to in 0..to_doors.len() {
                let least = bound(from, to);
                if least < nearest.0 {
                    nearest = (least, from, to);
                }
            }
        }
        if UNREACHABLE <= nearest.0 {
            return;
        }
        let approach = |table: &crate::region_table::RegionTable, slot, at, doors: &[Door]| {
            let door: &Door = &doors[at];
            let mut costs = [UNREACHABLE; GATE_NODES_MAX];
            table.costs(slot, at, door, self.door_cost(door), &mut costs[..door.n_nodes]);
            Approach { gate: door.gate, costs, n_nodes: door.n_nodes }
        };
        let from = approach(from_table, from_slot, nearest.1, from_doors);
        let to = approach(to_table, to_slot, nearest.2, to_doors);
        let mut best = visit(self, &from, &to);
        for from_at in 0..from_doors.len() {
            let mut from = None;
            for to_at in 0..to_doors.len() {
                let is_done = (from_at, to_at) == (nearest.1, nearest.2);
                if is_done || best <= bound(from_at, to_at) {
                    continue;
                }
                let from =
                    from.get_or_insert_with(|| approach(from_table, from_slot, from_at, from_doors));
                let to = approach(to_table, to_slot, to_at, to_doors);
                best = visit(self, from, &to);
            }
        }
    }

    /// Least cost from one approach's cell over its gate and the other's to the other's cell.
    fn cost_between(&self, from: &Approach, to: &Approach) -> Cost {
        let bound = self.bounds.of(from.gate, to.gate);
        let (n_common, n_read) = (bound.n_common as usize, bound.n_read as usize);
        let mut best = UNREACHABLE;
        let mut at = 0;
        let mut sums = [[UNREACHABLE; CHUNK]; 2];
        while at < n_read {
            let n = CHUNK.min(n_read - at);
            for (approach, sums) in [from, to].into_iter().zip(&mut sums) {
                self.sums(approach, n_common - at, n, &mut sums[..n]);
            }
            for (&a, &b) in sums[0][..n].iter().zip(&sums[1][..n]) {
                best = best.min(a + b);
            }
            at += n;
        }
        best.min(UNREACHABLE)
    }

    /// Least costs over a gate's nodes to `n` ancestor nodes, of which the first is `from_end`
    /// columns before the end of the rows.
    fn sums(&self, approach: &Approach, from_end: usize, n: usize, sums: &mut [Cost]) {
        sums.fill(UNREACHABLE);
        for (node, &cost) in approach.costs[..approach.n_nodes].iter().enumerate() {
            let row = self.gate_costs.row(NodeName { gate: approach.gate, node });
            let first = row.len() - from_end;
            for (sum, &onward) in sums.iter_mut().zip(&row[first..first + n]) {
                *sum = (*sum).min(cost + onward);
            }
        }
    }

    /// The best path from one cell to another that passes a gate.
    pub(crate) fn meeting(&self, from: (usize, usize), to: (usize, usize)) -> Option<Meeting> {
        let mut best: Option<Meeting> = None;
        self.each_pair(from, to, |plans, from, to| {
            let least = best.map_or(UNREACHABLE, |meeting| meeting.cost);
            let cost = plans.cost_between(from, to);
            if cost < least {
                best = plans.meeting_between(from, to, cost);
            }
            best.map_or(UNREACHABLE, |meeting| meeting.cost)
        });
        best
    }

    /// Which nodes a cost came from.
    fn meeting_between(&self, from: &Approach, to: &Approach, cost: Cost) -> Option<Meeting> {
        let bound = self.bounds.of(from.gate, to.gate);
        let (n_common, n_read) = (bound.n_common as usize, bound.n_read as usize);
        let mut at = 0;
        let mut sums = [[UNREACHABLE; CHUNK]; 2];
        while at < n_read {
            let n = CHUNK.min(n_read - at);
            for (approach, sums) in [from, to].into_iter().zip(&mut sums) {
                self.sums(approach, n_common - at, n, &mut sums[..n]);
            }
            let found = (0..n).find(|&place| sums[0][place] + sums[1][place] == cost);
            if let Some(place) = found {
                let from_end = n_common - at - place;
                let ends = [(from, sums[0][place]), (to, sums[1][place])];
                let [first, last] =
                    ends.map(|(approach, sum)| self.node_with(approach, from_end, sum));
                let middle = self.ancestor_at(from.gate, from_end)?;
                return Some(Meeting { cost, first: first?, last: last?, middle });
            }
            at += n;
        }
        None
    }

    fn node_with(&self, approach: &Approach, from_end: usize, sum: Cost) -> Option<NodeName> {
        let gate = approach.gate;
        let node = (0..approach.n_nodes).find(|&node| {
            let row = self.gate_costs.row(NodeName { gate, node });
            approach.costs[node] + row[row.len() - from_end] == sum
        })?;
        Some(NodeName { gate, node })
    }

    /// The node so many columns before the end of a gate's rows.
    fn ancestor_at(&self, gate: usize, from_end: usize) -> Option<NodeName> {
        let hierarchy = &self.layout.hierarchy;
        let gate = std::iter::once(gate)
            .chain(hierarchy.ancestors(gate))
            .find(|&gate| hierarchy.n_above[gate] < from_end)?;
        Some(NodeName { gate, node: hierarchy.n_columns(gate) - from_end })
    }
}

/// Ancestor nodes looked at together: what fits in the processor's nearest memory.
const CHUNK: usize = 64;
