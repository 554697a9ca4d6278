//! Ids of regions and arcs from one map version to the next.
//!
//! A region keeps its id if it overlaps its old self by half or more,
//!
//! ```text
//! |old ∩ new| / |old ∪ new| >= 1/2
//! ```
//!
//! of a split the largest part keeps the id, of a union the largest part had it. All three are one
//! rule: each is the other's largest overlap, and the overlap is half of one of them or more. An
//! arc keeps its id if its middle lies within half the line's length of the old middle and
//! neither has a nearer match. Ids count up and are never used again, so that whoever holds an old
//! one can be told what became of it. Time O(cells + arcs²), space O(pairs of regions).

use std::collections::BTreeMap;

use crate::graph::{Arc, TopologicalGraph};
use crate::lattice::Lattice;
use crate::regions::{Partition, RegionIndex};

/// Names a region for as long as the place lasts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RegionId(pub u64);

/// Names an arc for as long as the passage lasts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ArcId(pub u64);

/// The next ids that no region or arc of the map ever had, whichever version is current.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// For a region.
    pub next_region: u64,
    /// For an arc.
    pub next_arc: u64,
}

/// Ids of one version.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ids {
    /// One a region, by [`RegionIndex`].
    pub regions: Vec<RegionId>,
    /// One an arc, in the graph's order.
    pub arcs: Vec<ArcId>,
}

/// A version to carry ids from.
#[derive(Clone, Copy, Debug)]
pub struct Snapshot<'a> {
    /// Its regions.
    pub partition: &'a Partition,
    /// Its graph.
    pub graph: &'a TopologicalGraph,
    /// Its ids.
    pub ids: &'a Ids,
}

/// What became of a region of the version before.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Becoming {
    /// The old region.
    pub region: RegionId,
    /// Regions that hold cells of it now, with the number of these, most first; empty if nothing
    /// of it is left.
    pub now: Vec<(RegionId, u64)>,
}

/// Ids for a first version.
pub fn first_ids(graph: &TopologicalGraph, counters: &mut Counters) -> Ids {
    let regions = graph.regions.iter().map(|_| new_region(counters)).collect();
    let arcs = graph.arcs.iter().map(|_| new_arc(counters)).collect();
    Ids { regions, arcs }
}

/// Ids for a version that follows another, and what became of the other's regions, in its order.
/// Cells of another resolution are other cells: then no region is carried on.
pub fn carried_ids(
    old: Snapshot<'_>,
    partition: &Partition,
    graph: &TopologicalGraph,
    counters: &mut Counters,
) -> (Ids, Vec<Becoming>) {
    let overlaps = Overlaps::new(old.partition, partition);
    let forebear_of =
        |new: RegionIndex| overlaps.forebear_of(new).map(|o| old.ids.regions[o.0 as usize]);
    let regions: Vec<RegionId> = (0..partition.n_regions())
        .map(|new| forebear_of(RegionIndex(new)).unwrap_or_else(|| new_region(counters)))
        .collect();
    let becoming = |(index, &region): (usize, &RegionId)| {
        let mut now: Vec<(RegionId, u64)> = overlaps.of_old[index]
            .iter()
            .map(|(new, &n_cells)| (regions[new.0 as usize], n_cells))
            .collect();
        now.sort_by_key(|&(id, n_cells)| (std::cmp::Reverse(n_cells), id));
        Becoming { region, now }
    };
    let becoming = old.ids.regions.iter().enumerate().map(becoming).collect();
    let same = same_arcs(&old.graph.arcs, &graph.arcs);
    let arcs = same
        .into_iter()
        .map(|same| same.map_or_else(|| new_arc(counters), |at| old.ids.arcs[at]))
        .collect();
    (Ids { regions, arcs }, becoming)
}

fn new_region(counters: &mut Counters) -> RegionId {
    let id = RegionId(counters.next_region);
    counters.next_region += 1;
    id
}

fn new_arc(counters: &mut Counters) -> ArcId {
    let id = ArcId(counters.next_arc);
    counters.next_arc += 1;
    id
}

/// Cells in common.
struct Overlaps {
    of_old: Vec<BTreeMap<RegionIndex, u64>>,
    of_new: Vec<BTreeMap<RegionIndex, u64>>,
    old_cells: Vec<u32>,
    new_cells: Vec<u32>,
}

impl Overlaps {
    fn new(old: &Partition, new: &Partition) -> Self {
        let [n_old, n_new] = [old, new].map(|partition| partition.n_regions() as usize);
        let mut overlaps = Self {
            of_old: vec![BTreeMap::new(); n_old],
            of_new: vec![BTreeMap::new(); n_new],
            old_cells: old.sizes(),
            new_cells: new.sizes(),
        };
        if old.info().frame != new.info().frame {
            return overlaps;
        }
        // Runs of cells that two regions have in common: maps of regions are asked once a run.
        let mut run = (None, None, 0);
        for (index, cell) in Lattice::new(new.info()).cells().enumerate() {
            let before = old.info().index_of(cell).and_then(|at| old.region_at(at));
            let now = new.region_at(index);
            if (before, now) != (run.0, run.1) {
                overlaps.add(run);
                run = (before, now, 0);
            }
            run.2 += 1;
        }
        overlaps.add(run);
        overlaps
    }

    fn add(&mut self, (old, new, n_cells): (Option<RegionIndex>, Option<RegionIndex>, u64)) {
        if let (Some(old), Some(new)) = (old, new) {
            *self.of_old[old.0 as usize].entry(new).or_default() += n_cells;
            *self.of_new[new.0 as usize].entry(old).or_default() += n_cells;
        }
    }

    /// The old region whose id the new one carries on.
    fn forebear_of(&self, new: RegionIndex) -> Option<RegionIndex> {
        let (old, n_cells) = largest(&self.of_new[new.0 as usize])?;
        let (heir, _) = largest(&self.of_old[old.0 as usize])?;
        let smaller = self.old_cells[old.0 as usize].min(self.new_cells[new.0 as usize]);
        (heir == new && u64::from(smaller) <= 2 * n_cells).then_some(old)
    }
}

/// The region with the most cells, the first of several.
fn largest(overlaps: &BTreeMap<RegionIndex, u64>) -> Option<(RegionIndex, u64)> {
    let most = |(region, &n_cells): (&RegionIndex, &u64)| (*region, n_cells);
    overlaps.iter().map(most).max_by_key(|&(region, n)| (n, std::cmp::Reverse(region)))
}

/// For every new arc the old one that it is.
fn same_arcs(old: &[Arc], new: &[Arc]) -> Vec<Option<usize>> {
    // Two lines may cut the same steps, so that their arcs have one middle: then the lines decide.
    let nearest = |arc: &Arc, among: &[Arc]| {
        let distances = among.iter().map(|other| {
            let ends = arc.line.iter().zip(&other.line);
            let apart_m: f64 = ends.map(|(a, b)| (a - b).norm()).sum();
            ((other.position - arc.position).norm(), apart_m)
        });
        let nearest = distances
            .enumerate()
            .min_by(|(_, a), (_, b)| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        nearest.map(|(at, (distance_m, _))| (at, distance_m))
    };
    let of_old: Vec<_> = old.iter().map(|arc| nearest(arc, new)).collect();
    new.iter()
        .enumerate()
        .map(|(at, arc)| {
            let (before, distance_m) = nearest(arc, old)?;
            let is_mutual = of_old[before].is_some_and(|(back, _)| back == at);
            (is_mutual && distance_m <= arc.length_m / 2.0).then_some(before)
        })
        .collect()
}
