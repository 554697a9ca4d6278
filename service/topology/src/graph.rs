//! The topological graph: regions, and the arcs that join them across critical lines.
//!
//! "Each region corresponds to a node in the topological graph, and each critical line to an arc":
//! S. Thrun, Artificial Intelligence 99 (1998), section 3.1 (v). A line that furniture breaks into
//! pieces between different regions is as many arcs. Two regions may share several arcs. Time
//! O(cells + crossings).

use std::collections::BTreeSet;

use meetpoint_geometry::{GridFrame, Point2, Vector2};

use crate::clearance::Clearance;
use crate::critical_line::CriticalLine;
use crate::cut::Crossing;
use crate::lattice::Lattice;
use crate::regions::{Partition, RegionIndex, pairs};

/// Regions and arcs of one partition.
#[derive(Clone, Debug, PartialEq)]
pub struct TopologicalGraph {
    /// One a region, by [`RegionIndex`].
    pub regions: Vec<Region>,
    /// In the order of their lines.
    pub arcs: Vec<Arc>,
}

/// A node of the graph.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// Area of its cells, in square metres.
    pub area_m2: f64,
    /// The middle of its cell farthest from the walls, in the map's frame, in metres.
    pub center: Point2<f64>,
    /// How far that is, in metres.
    pub clearance_m: f64,
}

impl Region {
    /// What is smaller holds nobody, in square metres: the least area of a place of its own.
    pub const SPECK_AREA_MAX_M2: f64 = 2.0;

    pub(crate) fn new(
        frame: GridFrame,
        n_cells: u32,
        center: Point2<f64>,
        clearance_m: f64,
    ) -> Self {
        let area_m2 = f64::from(n_cells) * frame.resolution_m().powi(2);
        Self { area_m2, center, clearance_m }
    }
}

impl TopologicalGraph {
    /// Regions that are no places: smaller than [`Region::SPECK_AREA_MAX_M2`], and no arc leads to
    /// them. They are speckle behind walls, shafts, what was seen through a window, and regions
    /// only lest a free cell be without one. In the order of regions.
    pub fn specks(&self) -> Vec<RegionIndex> {
        let reached: BTreeSet<u32> =
            self.arcs.iter().flat_map(|arc| arc.regions).map(|region| region.0).collect();
        let regions = self.regions.iter().zip(0..);
        let is_speck = |(region, at): &(&Region, u32)| {
            region.area_m2 < Region::SPECK_AREA_MAX_M2 && !reached.contains(at)
        };
        regions.filter(is_speck).map(|(_, at)| RegionIndex(at)).collect()
    }
}

/// A way from one region to another.
#[derive(Clone, Debug, PartialEq)]
pub struct Arc {
    /// The two regions, the smaller index first; never the same.
    pub regions: [RegionIndex; 2],
    /// The middle of the portal, in the map's frame, in metres.
    pub position: Point2<f64>,
    /// Ends of the line: the centres of two obstacle cells, in the map's frame, in metres.
    pub line: [Point2<f64>; 2],
    /// Between those ends, in metres.
    pub length_m: f64,
    /// Widest gap for whatever passes between the two regions: the longest run of the portal's
    /// cells along the line, in metres.
    pub width_m: f64,
    /// The portal: steps between neighbouring free cells that lead across the line.
    /// Invariant: not empty.
    pub portal: Vec<Crossing>,
}

/// The graph of a partition between the given lines.
pub fn topological_graph(
    partition: &Partition,
    lines: &[CriticalLine],
    clearance: &Clearance,
) -> TopologicalGraph {
    let lattice = Lattice::new(partition.info());
    let arcs = lines.iter().flat_map(|line| {
        pairs(partition, &line.crossings)
            .into_iter()
            .map(move |(regions, portal)| Arc::new(lattice, line.point.basis, regions, portal))
    });
    TopologicalGraph { regions: regions(partition, clearance), arcs: arcs.collect() }
}

fn regions(partition: &Partition, clearance: &Clearance) -> Vec<Region> {
    let lattice = Lattice::new(partition.info());
    let frame = partition.info().frame;
    // Number of cells, and the first of those farthest from the walls.
    let mut found = vec![(0_u32, None::<usize>); partition.n_regions() as usize];
    let squared = clearance.squared();
    for index in 0..partition.info().n_cells() {
        let Some(RegionIndex(region)) = partition.region_at(index) else { continue };
        let (n_cells, center) = &mut found[region as usize];
        *n_cells += 1;
        if center.is_none_or(|center| squared[center] < squared[index]) {
            *center = Some(index);
        }
    }
    let region = |(n_cells, center): (u32, Option<usize>)| {
        let place = center.map_or_else(Point2::origin, |at| frame.center_of(lattice.cell(at)));
        Region::new(frame, n_cells, place, center.map_or(0.0, |at| clearance.at_m(at)))
    };
    found.into_iter().map(region).collect()
}

impl Arc {
    /// The arc between two regions, the smaller index first, across the line between two different
    /// cells.
    pub(crate) fn new(
        lattice: Lattice,
        basis: [usize; 2],
        regions: [RegionIndex; 2],
        portal: Vec<Crossing>,
    ) -> Self {
        let frame = lattice.info().frame;
        let line = basis.map(|index| frame.center_of(lattice.cell(index)));
        Self {
            regions,
            position: middle(lattice, &portal),
            line,
            length_m: (line[1] - line[0]).norm(),
            width_m: widest_gap(lattice, basis, &portal) * frame.resolution_m(),
            portal,
        }
    }
}

/// The mean of all steps' middles, in the map's frame, in metres.
fn middle(lattice: Lattice, portal: &[Crossing]) -> Point2<f64> {
    let centers = portal
        .iter()
        .flat_map(|crossing| [crossing.left, crossing.right])
        .map(|index| lattice.info().frame.center_of(lattice.cell(index)).coords);
    let n_centers = 2.0 * portal.len() as f64;
    Point2::from(centers.sum::<Vector2<f64>>() / n_centers)
}

/// The longest run of a portal's cells along the line, in cells.
fn widest_gap(lattice: Lattice, basis: [usize; 2], portal: &[Crossing]) -> f64 {
    let [dx, dy] = lattice.offset(basis[0], basis[1]);
    let length = ((dx * dx + dy * dy) as f64).sqrt();
    let along = |index: usize| {
        let [x, y] = lattice.offset(basis[0], index);
        (x * dx + y * dy) as f64 / length
    };
    let mut places: Vec<f64> = portal.iter().flat_map(|c| [c.left, c.right]).map(along).collect();
    places.sort_unstable_by(f64::total_cmp);
    // Neighbours along the line are one cell apart, across a corner at most its diagonal.
    let (mut widest, mut start) = (0.0_f64, 0);
    for at in 0..places.len() {
        if 0 < at && std::f64::consts::SQRT_2 < places[at] - places[at - 1] {
            start = at;
        }
        widest = widest.max(places[at] - places[start]);
    }
    // From the outer edges of the first and the last cell.
    (widest + 1.0).min(length)
}
