//! Regions, arcs and graphs for the wire.

use meetpoint_geometry::{Cell, GridFrame, GridInfo, Point2};
use meetpoint_proto::v1;
use meetpoint_storage::EndedRegion;
use meetpoint_topology::{Arc, ArcId, Partition, Pruning, Region, RegionIndex, Topology, pruned};

use super::outline::{CornerRing, outlines};

/// A graph, without the map and version that it belongs to.
pub(crate) fn to_wire(
    topology: &Topology,
    pruning: v1::GraphPruning,
    has_outlines: bool,
) -> v1::Graph {
    let groups = Groups::new(topology, pruning);
    let mut rings = if has_outlines {
        let n_regions = topology.partition().n_regions() as usize;
        let head = |region: RegionIndex| Some(groups.head_of(region).0 as usize);
        outlines(topology.partition(), n_regions, head)
    } else {
        Vec::new()
    };
    let info = topology.partition().info();
    let regions = groups.heads().map(|head| {
        let rings = rings.get_mut(head.0 as usize).map(std::mem::take).unwrap_or_default();
        v1::Region { outline: rings_to_wire(rings, info), ..groups.region(head) }
    });
    let regions = regions.collect();
    let arcs = topology.graph().arcs.iter().zip(&topology.ids().arcs);
    let arcs = arcs.filter_map(|(arc, id)| groups.arc(arc, *id));
    v1::Graph {
        map: String::new(),
        map_version: 0,
        cost_revision: 0,
        pruning: pruning.into(),
        regions,
        arcs: arcs.collect(),
        ended: Vec::new(),
        hypothesis: String::new(),
    }
}

/// A region with its outline.
pub(crate) fn region(topology: &Topology, index: RegionIndex) -> v1::Region {
    let partition: &Partition = topology.partition();
    let mut rings = outlines(partition, 1, |region| (region == index).then_some(0));
    let outline = rings_to_wire(rings.pop().unwrap_or_default(), partition.info());
    let groups = Groups::new(topology, v1::GraphPruning::Unspecified);
    v1::Region { outline, ..groups.region(index) }
}

/// A region that ended with a version.
pub(crate) fn ended_to_wire(ended: EndedRegion, version: u64, frame: GridFrame) -> v1::EndedRegion {
    let EndedRegion { region, heirs } = ended;
    let cell_m2 = frame.resolution_m().powi(2);
    let heir = |(region, n_cells)| v1::Heir { region, area_m2: n_cells as f64 * cell_m2 };
    v1::EndedRegion { region, map_version: version, heirs: heirs.into_iter().map(heir).collect() }
}

/// Regions that are joined, each group with one that stands for it.
struct Groups<'a> {
    topology: &'a Topology,
    /// For every region the largest of its group.
    heads: Vec<RegionIndex>,
    /// For every region that stands for a group all of that; empty for others.
    members: Vec<Vec<RegionIndex>>,
}

impl<'a> Groups<'a> {
    fn new(topology: &'a Topology, pruning: v1::GraphPruning) -> Self {
        let graph = topology.graph();
        let groups = match pruning {
            v1::GraphPruning::Unspecified => {
                (0..topology.partition().n_regions()).map(RegionIndex).collect()
            }
            v1::GraphPruning::Pairs => pruned(graph, Pruning::Pairs),
            v1::GraphPruning::Ends => pruned(graph, Pruning::EndNodes),
        };
        // Under the name of its first region each group finds its largest, the first of several.
        let mut largest = groups.clone();
        let area_m2 = |region: RegionIndex| graph.regions[region.0 as usize].area_m2;
        for (index, group) in (0..).map(RegionIndex).zip(&groups) {
            let head = &mut largest[group.0 as usize];
            if area_m2(*head) < area_m2(index) {
                *head = index;
            }
        }
        let heads: Vec<RegionIndex> =
            groups.iter().map(|group| largest[group.0 as usize]).collect();
        let mut members = vec![Vec::new(); heads.len()];
        for (index, head) in (0..).map(RegionIndex).zip(&heads) {
            members[head.0 as usize].push(index);
        }
        Self { topology, heads, members }
    }

    fn head_of(&self, region: RegionIndex) -> RegionIndex {
        self.heads[region.0 as usize]
    }

    /// Regions that stand for a group, in their order.
    fn heads(&self) -> impl Iterator<Item = RegionIndex> + '_ {
        (0..)
            .map(RegionIndex)
            .take(self.heads.len())
            .filter(|&region| self.head_of(region) == region)
    }

    fn id(&self, region: RegionIndex) -> u64 {
        self.topology.ids().regions[region.0 as usize].0
    }

    /// A group, without its outline.
    fn region(&self, head: RegionIndex) -> v1::Region {
        let region = |index: RegionIndex| &self.topology.graph().regions[index.0 as usize];
        let group = &self.members[head.0 as usize];
        // The first of those with the most room.
        let widest = group.iter().rev().map(|&index| region(index));
        let widest = widest.max_by(|a, b| a.clearance_m.total_cmp(&b.clearance_m));
        let widest = widest.unwrap_or(region(head));
        let area_m2 = group.iter().map(|&index| region(index).area_m2).sum();
        let mut members: Vec<u64> = group.iter().map(|&index| self.id(index)).collect();
        members.sort_unstable();
        if members.len() < 2 {
            members.clear();
        }
        v1::Region {
            id: self.id(head),
            area_m2,
            center: Some(point(widest.center)),
            clearance_m: widest.clearance_m,
            is_speck: area_m2 < Region::SPECK_AREA_MAX_M2,
            members,
            outline: Vec::new(),
        }
    }

    /// An arc between two groups; `None` within one.
    fn arc(&self, arc: &Arc, id: ArcId) -> Option<v1::Arc> {
        let Arc { regions, position, line, length_m, width_m, portal: _ } = arc;
        let [region_a, region_b] = regions.map(|region| self.head_of(region));
        (region_a != region_b).then(|| v1::Arc {
            id: id.0,
            region_a: self.id(region_a),
            region_b: self.id(region_b),
            position: Some(point(*position)),
            line_from: Some(point(line[0])),
            line_to: Some(point(line[1])),
            width_m: *width_m,
            length_m: *length_m,
        })
    }
}

fn point(point: Point2<f64>) -> v1::Point {
    v1::Point { x_m: point.x, y_m: point.y }
}

fn rings_to_wire(rings: Vec<CornerRing>, info: GridInfo) -> Vec<v1::Ring> {
    let corner = |[column, row]: [u32; 2]| {
        let along = |first: i32, n: u32| first.saturating_add_unsigned(n);
        let cell = Cell { x: along(info.first.x, column), y: along(info.first.y, row) };
        point(info.frame.corner_of(cell))
    };
    let ring = |ring: CornerRing| v1::Ring { points: ring.into_iter().map(corner).collect() };
    rings.into_iter().map(ring).collect()
}
