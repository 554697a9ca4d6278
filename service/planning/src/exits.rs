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
    /// By region, door and gate: why the door need or need not be left by on the way to the gate.
    uses: Vec<Vec<Use>>,
    /// By pair of regions: the end of its list in `doors`; the list before ends where it begins.
    ends: Vec<u32>,
    /// Places of doors among those of their region.
    doors: Vec<u16>,
}

/// Whether a door may have to be left by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Use {
    /// It may.
    Needed,
    /// No way leads to the gate by it.
    Closed,
    /// Another door does as well, by its place.
    CoveredBy(u16),
    /// Several others do together: bit k for the door at k, the last for all beyond.
    CoveredBySeveral(u64),
}

/// What exits are made from.
pub(crate) struct Sources<'a> {
    pub(crate) hierarchy: &'a Hierarchy,
    pub(crate) pairs: &'a PairCosts,
    /// By region.
    pub(crate) cliques: &'a [Arc<Clique>],
}

impl Exits {
    /// For all pairs of regions; nothing is known where no costs between gates are kept ready.
    pub(crate) fn new(sources: &Sources<'_>) -> Self {
        let n_gates = sources.hierarchy.order.len();
        if !sources.pairs.has_blocks() {
            return Self {
                n_regions: sources.cliques.len(),
                uses: vec![],
                ends: vec![],
                doors: vec![],
            };
        }
        let of_region = |region: usize| {
            let clique = &*sources.cliques[region];
            let pairs =
                (0..clique.gates.len()).flat_map(|door| (0..n_gates).map(move |g| (door, g)));
            pairs.map(|(door, gate)| found(sources, clique, door, gate)).collect()
        };
        Self::listed(sources, (0..sources.cliques.len()).map(of_region).collect())
    }

    /// The same after costs changed. What the doors of a region are needed for is found anew where
    /// the reason for it may no longer hold; a door that came to be needed by a change may stay so
    /// when it is taken back, at no cost but time.
    pub(crate) fn with_changes(
        &self,
        sources: &Sources<'_>,
        before: &[Arc<Clique>],
        is_changed: impl Fn(usize, usize) -> bool,
    ) -> Self {
        let n_gates = sources.hierarchy.order.len();
        if self.uses.is_empty() {
            return self.clone();
        }
        let mut uses = self.uses.clone();
        for (region, uses) in uses.iter_mut().enumerate() {
            let (clique, before) = (&sources.cliques[region], &before[region]);
            let is_same = Arc::ptr_eq(clique, before);
            let is_inside_changed = |door: usize, other: usize| {
                !is_same && differs(sources, clique, before, door, other)
            };
            for (door, &(own, _)) in clique.gates.iter().enumerate() {
                let is_row_changed =
                    (0..clique.gates.len()).any(|other| is_inside_changed(door, other));
                for gate in 0..n_gates {
                    let place = &mut uses[door * n_gates + gate];
                    let is_stale = is_changed(own, gate)
                        || match *place {
                            Use::Needed | Use::Closed => false,
                            Use::CoveredBy(other) => {
                                let other = usize::from(other);
                                is_changed(clique.gates[other].0, gate)
                                    || is_row_changed && is_inside_changed(door, other)
                            }
                            Use::CoveredBySeveral(doors) => {
                                let mut covering = (0..clique.gates.len())
                                    .filter(|&other| doors & bit(other) != 0);
                                covering.any(|other| {
                                    is_changed(clique.gates[other].0, gate)
                                        || is_row_changed && is_inside_changed(door, other)
                                })
                            }
                        };
                    if is_stale {
                        *place = found(sources, clique, door, gate);
                    }
                }
            }
        }
        Self::listed(sources, uses)
    }

    fn listed(sources: &Sources<'_>, uses: Vec<Vec<Use>>) -> Self {
        let n_regions = sources.cliques.len();
        let n_gates = sources.hierarchy.order.len();
        let (mut ends, mut doors) = (vec![], vec![]);
        for (from, uses) in uses.iter().enumerate() {
            let n_doors = sources.cliques[from].gates.len();
            for to in sources.cliques {
                for door in 0..n_doors {
                    let leads =
                        |&(gate, _): &(usize, usize)| uses[door * n_gates + gate] == Use::Needed;
                    if to.gates.iter().any(leads) {
                        doors.push(u16::try_from(door).unwrap_or(u16::MAX));
                    }
                }
                ends.push(u32::try_from(doors.len()).unwrap_or(u32::MAX));
            }
        }
        Self { n_regions, uses, ends, doors }
    }

    /// Doors of a region to leave by on the way to another; `None` if that is not known.
    pub(crate) fn of(&self, from: usize, to: usize) -> Option<&[u16]> {
        let at = from * self.n_regions + to;
        let end = *self.ends.get(at)?;
        let first = if at == 0 { 0 } else { self.ends[at - 1] };
        self.doors.get(first as usize..end as usize)
    }

    /// Memory, in bytes.
    pub(crate) fn n_bytes(&self) -> usize {
        let uses = self.uses.iter().map(|uses| size_of_val(uses.as_slice())).sum::<usize>();
        uses + size_of_val(self.ends.as_slice()) + size_of_val(self.doors.as_slice())
    }
}

/// Whether the costs inside a region between two of its doors are others than before.
fn differs(
    sources: &Sources<'_>,
    clique: &Clique,
    before: &Clique,
    door: usize,
    other: usize,
) -> bool {
    let n_nodes = &sources.hierarchy.n_nodes;
    let [(own, first), (other, other_first)] = [clique.gates[door], clique.gates[other]];
    (first..first + n_nodes[own]).any(|row| {
        let at = row * clique.n_nodes + other_first;
        let columns = at..at + n_nodes[other];
        clique.costs[columns.clone()] != before.costs[columns]
    })
}

/// Whether a door may have to be left by on the way to a gate.
fn found(sources: &Sources<'_>, clique: &Clique, door: usize, gate: usize) -> Use {
    let (own, _) = clique.gates[door];
    // A cell that is a node of both is there already.
    let direct = sources.pairs.full_block(sources.hierarchy, own, gate);
    let Some(mut left) = direct.filter(|direct| own != gate && !direct.costs.contains(&0)) else {
        return Use::Needed;
    };
    left.forget_unreachable();
    if left.is_covered() {
        return Use::Closed;
    }
    // One other gate mostly takes all of the traffic; which, the middle nodes tell.
    let others = (0..clique.gates.len()).filter(|&candidate| candidate != door);
    let by = |candidate: usize| least_by(sources, clique, door, gate, candidate);
    let Some(best) = others.clone().min_by_key(|&candidate| by(candidate)) else {
        return Use::Needed;
    };
    let mut covering = 0;
    let mut is_covered = |candidate: usize| {
        let n_left = left.n_left();
        cover(sources, clique, [door, candidate], gate, &mut left);
        if left.n_left() < n_left {
            covering |= bit(candidate);
        }
        left.is_covered()
    };
    if is_covered(best) {
        return Use::CoveredBy(u16::try_from(best).unwrap_or(u16::MAX));
    }
    let mut others = others.filter(|&candidate| candidate != best);
    if others.any(is_covered) { Use::CoveredBySeveral(covering) } else { Use::Needed }
}

/// The bit that stands for a door.
fn bit(door: usize) -> u64 {
    1 << door.min(63)
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

    fn n_left(&self) -> usize {
        self.costs.iter().filter(|&&cost| cost != COVERED).count()
    }

    fn is_covered(&self) -> bool {
        self.n_left() == 0
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
