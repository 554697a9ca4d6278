//! Where the best path from one cell to another goes through gates.
//!
//! The look-up itself: least bounds first, so that of all pairs of gates only one or two are looked
//! at node by node. Nothing is allocated.

use crate::approach::{Approach, BlockSums, End};
use crate::cost::{Cost, UNREACHABLE};
use crate::gate_costs::NodeName;
use crate::plans::{Place, Plans};

/// A shortest path through gates: from a cell to the first node, to the last, to a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Meeting {
    pub(crate) cost: Cost,
    pub(crate) first: NodeName,
    pub(crate) last: NodeName,
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
            best = self.meeting_below(from, to, least).or(best);
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
        mut visit: impl FnMut(&Approach<'_>, &Approach<'_>) -> Cost,
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
        mut visit: impl FnMut(&Approach<'_>, &Approach<'_>) -> Cost,
    ) {
        // Every sum is of at most three costs, and fits.
        let bound = |from_door: usize, to_door: usize| {
            let between = self.pairs.of(from.doors[from_door].gate, to.doors[to_door].gate).least;
            from.least(from_door) + between + to.least(to_door)
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
        let mut approach: Option<(usize, Approach<'_>)> = None;
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
    fn cost_between(&self, from: &Approach<'_>, to: &Approach<'_>) -> Cost {
        match self.pairs.block(&self.layout.hierarchy, from.gate, to.gate) {
            Some(block) => BlockSums { from: *from, to: *to, block }.cost(),
            None => self.cost_by_ancestors(from, to),
        }
    }

    /// The same over the common ancestors of the two gates.
    fn cost_by_ancestors(&self, from: &Approach<'_>, to: &Approach<'_>) -> Cost {
        let bound = self.pairs.of(from.gate, to.gate);
        let (n_common, n_read) = (bound.n_common as usize, bound.n_read as usize);
        let mut best = UNREACHABLE;
        let mut sums = [[UNREACHABLE; CHUNK]; 2];
        let ends = [(from.gate, from.costs()), (to.gate, to.costs())];
        for first in (0..n_read).step_by(CHUNK) {
            let n = CHUNK.min(n_read - first);
            for (&(gate, ref costs), sums) in ends.iter().zip(&mut sums) {
                let costs = &costs[..self.layout.hierarchy.n_nodes[gate]];
                self.sums(gate, costs, n_common - first, &mut sums[..n]);
            }
            for (&a, &b) in sums[0][..n].iter().zip(&sums[1][..n]) {
                best = best.min(a + b);
            }
        }
        best
    }

    /// Least costs over a gate's nodes to ancestor nodes, of which the first is `from_end` columns
    /// before the end of the rows.
    fn sums(&self, gate: usize, costs: &[Cost], from_end: usize, sums: &mut [Cost]) {
        sums.fill(UNREACHABLE);
        for (node, &cost) in costs.iter().enumerate() {
            let row = self.gate_costs.row(NodeName { gate, node });
            for (sum, &onward) in sums.iter_mut().zip(&row[row.len() - from_end..]) {
                *sum = (*sum).min(cost + onward);
            }
        }
    }

    /// The best path by those two gates if it costs less than `limit`: the first pair of nodes with
    /// its cost, by the nodes of `from`.
    fn meeting_below(
        &self,
        from: &Approach<'_>,
        to: &Approach<'_>,
        limit: Cost,
    ) -> Option<Meeting> {
        let (cost, nodes) = match self.pairs.block(&self.layout.hierarchy, from.gate, to.gate) {
            Some(block) => {
                let sums = BlockSums { from: *from, to: *to, block };
                let cost = sums.cost();
                (cost, if cost < limit { sums.first(cost) } else { None })
            }
            None => {
                let cost = self.cost_by_ancestors(from, to);
                (cost, if cost < limit { self.first_by_ancestors(from, to, cost) } else { None })
            }
        };
        let (first, last) = nodes?;
        let [first, last] =
            [(from.gate, first), (to.gate, last)].map(|(gate, node)| NodeName { gate, node });
        Some(Meeting { cost, first, last })
    }

    /// The first pair of nodes with that cost.
    fn first_by_ancestors(
        &self,
        from: &Approach<'_>,
        to: &Approach<'_>,
        cost: Cost,
    ) -> Option<(usize, usize)> {
        let name = |gate: usize, node: usize| NodeName { gate, node };
        let [before, after] = [from, to].map(Approach::costs);
        (0..from.n_nodes).find_map(|first| {
            let sum = |&last: &usize| {
                let ways = self.over_ancestors(name(from.gate, first), name(to.gate, last));
                before[first] + ways.min().unwrap_or(UNREACHABLE).min(UNREACHABLE) + after[last]
            };
            (0..to.n_nodes).find(|last| sum(last) == cost).map(|last| (first, last))
        })
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

/// Ancestor nodes looked at together: what fits in the processor's nearest memory.
const CHUNK: usize = 64;
