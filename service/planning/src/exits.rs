//! Which gates of a region a best path to another region may have to leave by.
//!
//! A gate `a` of region R is of no use on the way to gate `b` if from each of its nodes a way
//! inside R to a node of another gate is as good as any,
//!
//! ```text
//! all(m, n) = min over nodes k of R's other gates of inside(m, k) + all(k, n)   for m in a, n in b
//! ```
//!
//! because who comes from inside R reaches `k` inside R as cheaply, and every exchange of `m` for
//! `k` leaves less of the way. (Where a cell is a node of two gates nothing is left less: then only
//! the gate with the smaller index counts.) The door of a room without another one is of no use to
//! who passes by; in a corridor with twenty doors one or two remain. Time O(doors · gates) blocks.

use std::sync::Arc;

use crate::cost::{Cost, UNREACHABLE};
use crate::gate_costs::Clique;
use crate::hierarchy::Hierarchy;
use crate::pair_costs::PairCosts;

/// Doors by pair of regions.
#[derive(Clone, Debug)]
pub(crate) struct Exits {
    n_regions: usize,
    /// By region, door and gate: whether the door may be left by on the way to the gate.
    is_needed: Vec<Vec<bool>>,
    /// By pair of regions: the end of its list in `doors`; the list before ends where it begins.
    ends: Vec<u32>,
    /// Places of doors among those of their region.
    doors: Vec<u16>,
}

/// What exits are made from.
pub(crate) struct Sources<'a> {
    pub(crate) hierarchy: &'a Hierarchy,
    pub(crate) pairs: &'a PairCosts,
    /// By region.
    pub(crate) cliques: &'a [Arc<Clique>],
}

impl Exits {
    /// For all pairs of regions.
    pub(crate) fn new(sources: &Sources<'_>) -> Self {
        let rows = (0..sources.cliques.len()).map(|region| row(sources, region, |_| true, None));
        Self::listed(sources, rows.collect())
    }

    /// The same after costs changed: in regions whose clique did, and to gates whose costs to a
    /// gate of the region did.
    pub(crate) fn with_changes(
        &self,
        sources: &Sources<'_>,
        is_new: impl Fn(usize) -> bool,
        is_changed: impl Fn(usize, usize) -> bool,
    ) -> Self {
        let of_region = |region: usize| {
            let gates = &sources.cliques[region].gates;
            let is_stale = |gate: usize| {
                is_new(region) || gates.iter().any(|&(door, _)| is_changed(door, gate))
            };
            row(sources, region, is_stale, Some(&self.is_needed[region]))
        };
        let rows = (0..sources.cliques.len()).map(of_region).collect();
        Self::listed(sources, rows)
    }

    fn listed(sources: &Sources<'_>, is_needed: Vec<Vec<bool>>) -> Self {
        let n_regions = sources.cliques.len();
        let n_gates = sources.hierarchy.order.len();
        let (mut ends, mut doors) = (vec![], vec![]);
        for (from, is_needed) in is_needed.iter().enumerate() {
            let n_doors = sources.cliques[from].gates.len();
            for to in sources.cliques {
                for door in 0..n_doors {
                    let leads = |&(gate, _): &(usize, usize)| is_needed[door * n_gates + gate];
                    if to.gates.iter().any(leads) {
                        doors.push(u16::try_from(door).unwrap_or(u16::MAX));
                    }
                }
                ends.push(u32::try_from(doors.len()).unwrap_or(u32::MAX));
            }
        }
        Self { n_regions, is_needed, ends, doors }
    }

    /// Doors of a region to leave by on the way to another.
    pub(crate) fn of(&self, from: usize, to: usize) -> &[u16] {
        let at = from * self.n_regions + to;
        let first = if at == 0 { 0 } else { self.ends[at - 1] };
        &self.doors[first as usize..self.ends[at] as usize]
    }

    /// Memory, in bytes.
    pub(crate) fn n_bytes(&self) -> usize {
        let rows = self.is_needed.iter().map(Vec::len).sum::<usize>();
        rows + size_of_val(self.ends.as_slice()) + size_of_val(self.doors.as_slice())
    }
}

/// For a region, by door and gate, whether the one may be left by on the way to the other; taken
/// from `before` for gates that are not stale.
fn row(
    sources: &Sources<'_>,
    region: usize,
    is_stale: impl Fn(usize) -> bool,
    before: Option<&[bool]>,
) -> Vec<bool> {
    let n_gates = sources.hierarchy.order.len();
    let clique = &sources.cliques[region];
    let mut row = before.map_or_else(|| vec![true; clique.gates.len() * n_gates], <[bool]>::to_vec);
    for gate in (0..n_gates).filter(|&gate| is_stale(gate)) {
        for door in 0..clique.gates.len() {
            row[door * n_gates + gate] = is_needed(sources, clique, door, gate);
        }
    }
    row
}

/// Whether a door may have to be left by.
fn is_needed(sources: &Sources<'_>, clique: &Clique, door: usize, gate: usize) -> bool {
    let (own, _) = clique.gates[door];
    let Some(direct) = sources.pairs.full_block(sources.hierarchy, own, gate) else { return true };
    // A cell that is a node of both is there already.
    if own == gate || direct.costs.contains(&0) {
        return true;
    }
    let mut left = direct;
    left.forget_unreachable();
    if left.is_covered() {
        return false;
    }
    // One other gate mostly takes all of the traffic; which, the middle nodes tell.
    let by = |candidate: usize| least_by(sources, clique, door, gate, candidate);
    let others = (0..clique.gates.len()).filter(|&candidate| candidate != door);
    let Some(best) = others.clone().min_by_key(|&candidate| by(candidate)) else {
        return true;
    };
    let mut cover = |candidate: usize| {
        cover(sources, clique, [door, candidate], gate, &mut left);
        left.is_covered()
    };
    if cover(best) {
        return false;
    }
    !others.filter(|&candidate| candidate != best).any(cover)
}

/// Costs from the nodes of one gate to those of another, a row a node; [`COVERED`] where a way over
/// another gate is as good.
pub(crate) struct Uncovered {
    pub(crate) costs: Vec<Cost>,
    pub(crate) n_columns: usize,
}

/// No cost: nothing is less.
const COVERED: Cost = 0;

impl Uncovered {
    fn forget_unreachable(&mut self) {
        for cost in self.costs.iter_mut().filter(|cost| UNREACHABLE <= **cost) {
            *cost = COVERED;
        }
    }

    fn is_covered(&self) -> bool {
        self.costs.iter().all(|&cost| cost == COVERED)
    }
}

/// Cost from a door's middle node over a candidate's middle node to the gate's, roughly.
fn least_by(
    sources: &Sources<'_>,
    clique: &Clique,
    door: usize,
    gate: usize,
    candidate: usize,
) -> Cost {
    let n_nodes = &sources.hierarchy.n_nodes;
    let [(own, first), (other, other_first)] = [clique.gates[door], clique.gates[candidate]];
    let from = first + n_nodes[own] / 2;
    let to = other_first + n_nodes[other] / 2;
    clique.costs[from * clique.n_nodes + to] + sources.pairs.of(other, gate).least
}

/// Marks what a way over another gate covers.
fn cover(
    sources: &Sources<'_>,
    clique: &Clique,
    [door, candidate]: [usize; 2],
    gate: usize,
    left: &mut Uncovered,
) {
    let n_nodes = &sources.hierarchy.n_nodes;
    let [(own, first), (other, other_first)] = [clique.gates[door], clique.gates[candidate]];
    let Some(onward) = sources.pairs.full_block(sources.hierarchy, other, gate) else { return };
    for node in 0..n_nodes[own] {
        let left = &mut left.costs[node * left.n_columns..][..left.n_columns];
        if left.iter().all(|&cost| cost == COVERED) {
            continue;
        }
        let inside = &clique.costs[(first + node) * clique.n_nodes + other_first..];
        let rows = onward.costs.chunks_exact(onward.n_columns);
        for (&inside, onward) in inside.iter().zip(rows) {
            if inside == 0 && own < other {
                continue;
            }
            for (left, &onward) in left.iter_mut().zip(onward) {
                *left = if inside + onward <= *left { COVERED } else { *left };
            }
        }
    }
}
