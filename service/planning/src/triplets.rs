//! Triplet plans: from every cell of a part, through the next one, to the nearest point beyond.
//!
//! ```text
//! V(c) = min over paths from c through T_i, by transit e into T_i+1 and through it,
//!        by transit f into T_i+2 of the cost
//! ```
//!
//! S. Thrun, Artificial Intelligence 99 (1998), section 3.2 (ii). A triplet is named by its two
//! transits. With one portal a pair of parts, these are the paper's triplets of regions; the paper
//! lets a path stray from the second part back into the first, which no robot that follows the plans
//! would do, as it has gone on to the next triplet there. With one portal an opening, a triplet also
//! tells two doors apart, and a region that is left and entered again is planned for like any other.
//! No costs are kept, but the step to take from every cell, in four bits. A triplet depends on its
//! first two parts alone. Time and space O(triplets · cells of the first part).

mod motions;

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::cost::{Cost, UNREACHABLE};
use crate::part_graph::{PartGraph, Transit};
use crate::parts::PartIndex;
pub(crate) use motions::Field;
use motions::Motions;

/// The steps of all triplets of a graph.
#[derive(Clone, Debug)]
pub struct TripletPlans {
    graph: Arc<PartGraph>,
    tables: BTreeMap<Triplet, Arc<Motions>>,
}

/// The two transits. Without a second one it is the last triplet of the paper's plans, whose third
/// region is the second again: to the nearest point beyond the first transit.
type Triplet = (Transit, Option<Transit>);

/// What is left to pay beyond every step of a transit, by the cell that the step leads to.
type Beyond = BTreeMap<usize, Cost>;

impl TripletPlans {
    /// All triplets of `graph`.
    pub fn new(graph: Arc<PartGraph>) -> Self {
        let wanted = triplets(&graph).collect();
        let tables = made(&graph, wanted);
        Self { graph, tables }
    }

    /// The plans of another graph: tables of triplets whose parts and transits are the same are
    /// shared with these plans, the others are made. Equal to [`Self::new`].
    pub fn renewed(&self, graph: Arc<PartGraph>) -> Self {
        let old = graph.unchanged(&self.graph);
        let old_of = |(first, second): Triplet| {
            let first = old[first.place()]?;
            let Some(second) = second else { return Some((first, None)) };
            Some((first, Some(old[second.place()]?)))
        };
        let known = |triplet| Some((triplet, self.tables.get(&old_of(triplet)?)?.clone()));
        let mut tables: BTreeMap<_, _> = triplets(&graph).filter_map(known).collect();
        let wanted = triplets(&graph).filter(|triplet| !tables.contains_key(triplet)).collect();
        tables.extend(made(&graph, wanted));
        Self { graph, tables }
    }

    /// The graph that the plans are for.
    pub fn graph(&self) -> &Arc<PartGraph> {
        &self.graph
    }

    /// Number of triplets of three different parts, as the paper counts them.
    pub fn n_triplets(&self) -> usize {
        let is_triple = |&&(first, second): &&Triplet| {
            second.is_some_and(|second| self.graph.to(second) != self.graph.from(first))
        };
        self.tables.keys().filter(is_triple).count()
    }

    /// Number of tables: of triplets told apart by their transits, and of last ones.
    pub fn n_tables(&self) -> usize {
        self.tables.len()
    }

    /// Memory of the tables, in bytes.
    pub fn n_bytes(&self) -> usize {
        self.tables.values().map(|motions| motions.n_bytes()).sum()
    }

    /// Number of tables that these plans share with others.
    pub fn n_shared(&self, others: &Self) -> usize {
        let others: std::collections::BTreeSet<_> =
            others.tables.values().map(Arc::as_ptr).collect();
        self.tables.values().filter(|table| others.contains(&Arc::as_ptr(table))).count()
    }

    /// The step to take from a cell of the part that `first` leaves, if `second` comes next; `None`
    /// for `second` if the goal lies beyond the first. `None` if there is no such triplet, the cell
    /// lies elsewhere, or there is no way.
    pub fn step(&self, first: Transit, second: Option<Transit>, cell: usize) -> Option<usize> {
        self.steps(first, second)?(cell)
    }

    /// [`Self::step`] of one triplet; `None` if there is no such triplet.
    pub(crate) fn steps(
        &self,
        first: Transit,
        second: Option<Transit>,
    ) -> Option<impl Fn(usize) -> Option<usize> + '_> {
        let motions = self.tables.get(&(first, second))?;
        let (parts, part) = (self.graph.parts(), self.graph.from(first));
        Some(move |cell| motions.step(parts.slot(part, cell)?))
    }
}

/// All triplets of a graph.
fn triplets(graph: &PartGraph) -> impl Iterator<Item = Triplet> + '_ {
    graph.transits().flat_map(|first| {
        let longer = graph.onward(first).map(move |second| (first, Some(second)));
        std::iter::once((first, None)).chain(longer)
    })
}

/// The tables of the wanted triplets, each part made ready for waves twice at most.
fn made(graph: &PartGraph, wanted: Vec<Triplet>) -> BTreeMap<Triplet, Arc<Motions>> {
    let mut by_middle: BTreeMap<PartIndex, Vec<Triplet>> = BTreeMap::new();
    let mut by_start: BTreeMap<PartIndex, Vec<Triplet>> = BTreeMap::new();
    for triplet in wanted {
        by_middle.entry(graph.to(triplet.0)).or_default().push(triplet);
        by_start.entry(graph.from(triplet.0)).or_default().push(triplet);
    }
    let mut beyond = BTreeMap::new();
    for (part, triplets) in by_middle {
        costs_beyond(graph, part, &triplets, &mut beyond);
    }
    let mut tables = BTreeMap::new();
    for (part, triplets) in by_start {
        let mut field = Field::new(graph, part);
        for triplet in triplets {
            let beyond = &beyond[&triplet];
            let at = |cell: usize| beyond.get(&cell).copied().unwrap_or(UNREACHABLE);
            let costs = field.towards(triplet.0, at);
            tables.insert(triplet, Arc::new(field.motions(&costs, triplet.0, at)));
        }
    }
    tables
}

/// What triplets with the same middle part leave to pay beyond their first transits.
fn costs_beyond(
    graph: &PartGraph,
    middle: PartIndex,
    triplets: &[Triplet],
    beyond: &mut BTreeMap<Triplet, Beyond>,
) {
    let mut by_second: BTreeMap<Option<Transit>, Vec<Transit>> = BTreeMap::new();
    for &(first, second) in triplets {
        by_second.entry(second).or_default().push(first);
    }
    let mut field = Field::new(graph, middle);
    for (second, firsts) in by_second {
        let costs = second.map(|second| field.towards(second, |_| 0));
        for first in firsts {
            let cost = |to: usize| match (&costs, graph.parts().slot(middle, to)) {
                (Some(costs), Some(slot)) => costs[slot as usize],
                _ => 0,
            };
            let ends = graph.steps(first).map(|(_, _, to)| (to, cost(to)));
            beyond.insert((first, second), ends.collect());
        }
    }
}
