//! What a map version carries of its places: regions, graph, ids and meet points.

use crate::graph::{TopologicalGraph, topological_graph};
use crate::ids::{Becoming, Counters, Ids, Snapshot, carried_ids, first_ids};
use crate::meet_points::{MeetPoint, meet_points};
use crate::regions::Partition;
use crate::segmentation::Segmentation;

/// Regions of one version, how they hang together, and what they are called. Immutable, and stored
/// with the version ([`Self::to_bytes`]); what was found on the way stays in the [`Segmentation`].
#[derive(Clone, Debug, PartialEq)]
pub struct Topology {
    pub(crate) partition: Partition,
    pub(crate) graph: TopologicalGraph,
    pub(crate) ids: Ids,
    pub(crate) meet_points: Vec<MeetPoint>,
}

impl Topology {
    /// Of a version that follows no other: every region and arc has a new id.
    pub fn first(found: &Segmentation, counters: &mut Counters) -> Self {
        Self::new(found, |_, graph| first_ids(graph, counters))
    }

    /// Of a version that follows `self`: places that last keep their ids. Returned with it is what
    /// became of each region of `self`, in its order. `counters` are the map's, not the version's:
    /// they count up whichever version is followed.
    pub fn next(&self, found: &Segmentation, counters: &mut Counters) -> (Self, Vec<Becoming>) {
        let Self { partition, graph, ids, meet_points: _ } = self;
        let old = Snapshot { partition, graph, ids };
        let mut becoming = vec![];
        let next = Self::new(found, |partition, graph| {
            let (ids, of_old) = carried_ids(old, partition, graph, counters);
            becoming = of_old;
            ids
        });
        (next, becoming)
    }

    fn new(found: &Segmentation, ids: impl FnOnce(&Partition, &TopologicalGraph) -> Ids) -> Self {
        let Segmentation { clearance, voronoi, lines, partition, .. } = found;
        let graph = topological_graph(partition, lines, clearance);
        let meet_points = meet_points(voronoi, clearance, &found.trace.params.meet_points);
        Self { partition: partition.clone(), ids: ids(partition, &graph), graph, meet_points }
    }

    /// Which region every cell belongs to.
    pub fn partition(&self) -> &Partition {
        &self.partition
    }

    /// Regions and arcs.
    pub fn graph(&self) -> &TopologicalGraph {
        &self.graph
    }

    /// The lasting ids of both: one a region and one an arc, in the graph's order.
    pub fn ids(&self) -> &Ids {
        &self.ids
    }

    /// Where lines of the Voronoi diagram meet, turn or end.
    pub fn meet_points(&self) -> &[MeetPoint] {
        &self.meet_points
    }
}
