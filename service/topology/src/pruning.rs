//! Pruning of the topological graph.
//!
//! "Pairs of adjacent regions are combined into a single region, if neither of them has more than
//! two neighbors": S. Thrun, Artificial Intelligence 99 (1998), section 4.2. It makes one region of
//! the pieces of a corridor and takes in some end nodes; the second kind takes in all of them.
//! Time O(regions · pairs), space O(regions + arcs).

use std::collections::BTreeSet;

use crate::graph::TopologicalGraph;
use crate::regions::RegionIndex;
use crate::union::Union;

/// Kinds of pruning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pruning {
    /// Neighbours with at most two neighbours each become one, until there are none.
    Pairs,
    /// A region with a single neighbour becomes one with it: once, not what becomes an end by it.
    EndNodes,
}

/// For every region the one that stands for its group, the smallest of it: what
/// [`Partition::joined`](crate::Partition::joined) wants.
pub fn pruned(graph: &TopologicalGraph, pruning: Pruning) -> Vec<RegionIndex> {
    let mut neighbors = vec![BTreeSet::new(); graph.regions.len()];
    for arc in &graph.arcs {
        let [a, b] = arc.regions.map(|region| region.0);
        neighbors[a as usize].insert(b);
        neighbors[b as usize].insert(a);
    }
    let n_regions = u32::try_from(graph.regions.len()).unwrap_or(u32::MAX);
    let mut union = Union::new(n_regions);
    match pruning {
        Pruning::Pairs => join_pairs(&mut neighbors, &mut union),
        Pruning::EndNodes => join_ends(&neighbors, &mut union),
    }
    (0..n_regions).map(|region| RegionIndex(union.root(region))).collect()
}

fn join_pairs(neighbors: &mut [BTreeSet<u32>], union: &mut Union) {
    let n_regions = u32::try_from(neighbors.len()).unwrap_or(u32::MAX);
    let mut is_done = false;
    // A region that loses a neighbour may come down to two: all are looked at again.
    while !is_done {
        is_done = true;
        for region in 0..n_regions {
            while let Some(other) = slim_neighbor(neighbors, region) {
                is_done = false;
                union.join(region, other);
                for third in std::mem::take(&mut neighbors[other as usize]) {
                    neighbors[third as usize].remove(&other);
                    if third != region {
                        neighbors[third as usize].insert(region);
                        neighbors[region as usize].insert(third);
                    }
                }
            }
        }
    }
}

/// A neighbour to join the region with, if both have at most two.
fn slim_neighbor(neighbors: &[BTreeSet<u32>], region: u32) -> Option<u32> {
    let is_slim = |region: u32| neighbors[region as usize].len() <= 2;
    if !is_slim(region) {
        return None;
    }
    neighbors[region as usize].iter().copied().find(|&other| is_slim(other))
}

fn join_ends(neighbors: &[BTreeSet<u32>], union: &mut Union) {
    for (region, neighbors) in neighbors.iter().enumerate() {
        if let (1, Some(&neighbor)) = (neighbors.len(), neighbors.first()) {
            union.join(u32::try_from(region).unwrap_or(u32::MAX), neighbor);
        }
    }
}
