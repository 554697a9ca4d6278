//! Where the best path from one cell to another goes through gates.
//!
//! The look-up itself: least bounds first, so that of all pairs of gates only one or two are looked
//! at node by node. Nothing is allocated.

use crate::cost::{Cost, UNREACHABLE};
use crate::gate_costs::NodeName;
use crate::gates::GATE_NODES_MAX;
use crate::plans::{Place, Plans};
use crate::region_table::{Door, RegionTable};

/// A shortest path through gates: from a cell to the first node, to the last, to a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Meeting {
    pub(crate) cost: Cost,
    pub(crate) first: NodeName,
    pub(crate) last: NodeName,
}

/// A cell, and the ways out of its region.
struct End<'a> {
    place: Place,
    table: &'a RegionTable,
    doors: &'a [Door],
    /// Least cost to each door but for its toll.
    least: &'a [Cost],
    tolls: &'a [Cost],
}

/// Costs from a cell to the nodes of one gate.
struct Approach {
    gate: usize,
    costs: [Cost; GATE_NODES_MAX],
    n_nodes: usize,
}

impl<'a> End<'a> {
    fn new(plans: &'a Plans, place: Place) -> Self {
        let table = &*plans.tables[place.region()];
        let doors = plans.layout.doors[place.region()].as_slice();
        let tolls = plans.door_tolls[place.region()].as_slice();
        Self { place, table, doors, least: table.least(place.slot()), tolls }
    }

    fn least(&self, door: usize) -> Cost {
        self.least[door].saturating_add(self.tolls[door])
    }

    fn approach(&self, at: usize) -> Approach {
        let door = &self.doors[at];
        let mut costs = [UNREACHABLE; GATE_NODES_MAX];
        if self.tolls[at] < UNREACHABLE {
            let to = &mut costs[..door.n_nodes];
            self.table.costs(self.place.slot(), at, door, self.tolls[at], to);
        }
        Approach { gate: door.gate, costs, n_nodes: door.n_nodes }
    }
}

impl Approach {
    fn costs(&self) -> &[Cost] {
        &self.costs[..self.n_nodes]
    }
}

impl Plans {
    /// Cost of the best path from one cell to another that passes a gate.
    pub(crate) fn cost_by_gates(&self, from: Place, to: Place) -> Cost {
        let mut best = UNREACHABLE;
        self.each_pair(from, to, |from, to| {
            best = best.min(self.cost_between(from, to));
            best
        });
        best
    }

    /// The best path from one cell to another that passes a gate.
    pub(crate) fn meeting(&self, from: Place, to: Place) -> Option<Meeting> {
        let mut best: Option<Meeting> = None;
        self.each_pair(from, to, |from, to| {
            let least = best.map_or(UNREACHABLE, |meeting| meeting.cost);
            let cost = self.cost_between(from, to);
            if cost < least {
                best = self.meeting_between(from, to, cost);
            }
            best.map_or(UNREACHABLE, |meeting| meeting.cost)
        });
        best
    }

    /// The pairs of gates of two places whose bounds are below the best; the most promising first,
    /// then in order. `visit` tells the best cost so far.
    fn each_pair(
        &self,
        from: Place,
        to: Place,
        mut visit: impl FnMut(&Approach, &Approach) -> Cost,
    ) {
        let exits = [(from, to), (to, from)]
            .map(|(here, there)| self.exits.of(here.region(), there.region()));
        let is_round = from.region() == to.region();
        let (from, to) = (End::new(self, from), End::new(self, to));
        let ([Some(exits), Some(entries)], false) = (exits, is_round) else {
            // Out of a region and back in, any door may be the best.
            let doors = |end: &End| 0..end.doors.len();
            return self.each_bounded(&from, &to, [doors(&from), doors(&to)], visit);
        };
        if let ([first], [last]) = (exits, entries) {
            visit(&from.approach(usize::from(*first)), &to.approach(usize::from(*last)));
            return;
        }
        let doors = [exits, entries].map(|doors| doors.iter().map(|&door| usize::from(door)));
        self.each_bounded(&from, &to, doors, visit);
    }

    /// The pairs among these doors of which the bound is below the best.
    fn each_bounded(
        &self,
        from: &End<'_>,
        to: &End<'_>,
        [from_doors, to_doors]: [impl Iterator<Item = usize> + Clone; 2],
        mut visit: impl FnMut(&Approach, &Approach) -> Cost,
    ) {
        // Every sum is of at most three costs, and fits.
        let bound = |from_door: usize, to_door: usize| {
            let between = self.pairs.of(from.doors[from_door].gate, to.doors[to_door].gate).least;
            from.least(from_door).min(UNREACHABLE) + between + to.least(to_door).min(UNREACHABLE)
        };
        let pairs = || {
            let to_doors = to_doors.clone();
            let with_each = move |from_door| to_doors.clone().map(move |door| (from_door, door));
            from_doors.clone().flat_map(with_each)
        };
        let Some((first, last)) = pairs().min_by_key(|&(from, to)| bound(from, to)) else { return };
        if UNREACHABLE <= bound(first, last) {
            return;
        }
        let mut best = visit(&from.approach(first), &to.approach(last));
        let mut approach: Option<(usize, Approach)> = None;
        for (from_door, to_door) in pairs() {
            if (from_door, to_door) == (first, last) || best <= bound(from_door, to_door) {
                continue;
            }
            if approach.as_ref().is_none_or(|(door, _)| *door != from_door) {
                approach = Some((from_door, from.approach(from_door)));
            }
            if let Some((_, approach)) = &approach {
                best = visit(approach, &to.approach(to_door));
            }
        }
    }

    /// Least cost from one approach's cell over its gate and the other's to the other's cell.
    fn cost_between(&self, from: &Approach, to: &Approach) -> Cost {
        match self.pairs.block(&self.layout.hierarchy, from.gate, to.gate) {
            Some(block) => {
                let (rows, columns) = if block.is_turned { (to, from) } else { (from, to) };
                least_sum(rows.costs(), block.costs, columns.costs())
            }
            None => self.cost_by_ancestors(from, to),
        }
    }

    /// The same over the common ancestors of the two gates.
    fn cost_by_ancestors(&self, from: &Approach, to: &Approach) -> Cost {
        let bound = self.pairs.of(from.gate, to.gate);
        let (n_common, n_read) = (bound.n_common as usize, bound.n_read as usize);
        let mut best = UNREACHABLE;
        let mut sums = [[UNREACHABLE; CHUNK]; 2];
        for first in (0..n_read).step_by(CHUNK) {
            let n = CHUNK.min(n_read - first);
            for (approach, sums) in [from, to].into_iter().zip(&mut sums) {
                self.sums(approach, n_common - first, &mut sums[..n]);
            }
            for (&a, &b) in sums[0][..n].iter().zip(&sums[1][..n]) {
                best = best.min(a + b);
            }
        }
        best
    }

    /// Least costs over a gate's nodes to ancestor nodes, of which the first is `from_end` columns
    /// before the end of the rows.
    fn sums(&self, approach: &Approach, from_end: usize, sums: &mut [Cost]) {
        sums.fill(UNREACHABLE);
        for (node, &cost) in approach.costs().iter().enumerate() {
            let row = self.gate_costs.row(NodeName { gate: approach.gate, node });
            for (sum, &onward) in sums.iter_mut().zip(&row[row.len() - from_end..]) {
                *sum = (*sum).min(cost + onward);
            }
        }
    }

    /// Which nodes a cost came from: the first pair of nodes with it.
    fn meeting_between(&self, from: &Approach, to: &Approach, cost: Cost) -> Option<Meeting> {
        let name = |gate: usize, node: usize| NodeName { gate, node };
        from.costs().iter().enumerate().find_map(|(first, &before)| {
            let first = name(from.gate, first);
            let last = to.costs().iter().enumerate().find(|&(last, &after)| {
                before + after < UNREACHABLE
                    && before + self.cost_of_nodes(first, name(to.gate, last)) + after == cost
            });
            last.map(|(last, _)| Meeting { cost, first, last: name(to.gate, last) })
        })
    }

    /// Cost between two nodes.
    fn cost_of_nodes(&self, from: NodeName, to: NodeName) -> Cost {
        let hierarchy = &self.layout.hierarchy;
        if let Some(block) = self.pairs.block(hierarchy, from.gate, to.gate) {
            let (low, high) = if block.is_turned { (to, from) } else { (from, to) };
            return block.costs[low.node * hierarchy.n_nodes[high.gate] + high.node];
        }
        let sums = self.over_ancestors(from, to);
        sums.min().unwrap_or(UNREACHABLE).min(UNREACHABLE)
    }

    /// Costs between two nodes over every common ancestor node that a path may go over.
    fn over_ancestors(&self, from: NodeName, to: NodeName) -> impl Iterator<Item = Cost> + '_ {
        let bound = self.pairs.of(from.gate, to.gate);
        let [a, b] = [from, to].map(|node| {
            let row = self.gate_costs.row(node);
            &row[row.len() - bound.n_common as usize..][..bound.n_read as usize]
        });
        a.iter().zip(b).map(|(a, b)| a + b)
    }

    /// A node of a common ancestor on a best path between two nodes.
    pub(crate) fn middle(&self, from: NodeName, to: NodeName) -> Option<NodeName> {
        let best = self.over_ancestors(from, to).min()?;
        let place = self.over_ancestors(from, to).position(|cost| cost == best)?;
        let from_end = self.pairs.of(from.gate, to.gate).n_common as usize - place;
        let hierarchy = &self.layout.hierarchy;
        let gate = std::iter::once(from.gate)
            .chain(hierarchy.ancestors(from.gate))
            .find(|&gate| hierarchy.n_above[gate] < from_end)?;
        Some(NodeName { gate, node: hierarchy.n_columns(gate) - from_end })
    }
}

/// `min over i, j of rows[i] + between[i][j] + columns[j]`.
fn least_sum(rows: &[Cost], between: &[Cost], columns: &[Cost]) -> Cost {
    let mut best = UNREACHABLE;
    for (&row, between) in rows.iter().zip(between.chunks_exact(columns.len())) {
        if row < best {
            let sums = between.iter().zip(columns).map(|(between, column)| between + column);
            best = best.min(row + sums.min().unwrap_or(UNREACHABLE));
        }
    }
    best
}

/// Ancestor nodes looked at together: what fits in the processor's nearest memory.
const CHUNK: usize = 64;
