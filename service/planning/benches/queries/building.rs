//! Tables of a map, with the time that they take.

use std::error::Error;
use std::sync::Arc;
use std::time::{Duration, Instant};

use meetpoint_planning::{ArcCost, Plans, Space, enterable};
use meetpoint_topology::{
    FreeSpace, TopologicalGraph, TopologyParams, segmentation, topological_graph,
};

/// Memory for costs between gates, in bytes: what the other tables of a map of a million cells take.
pub(crate) const PAIR_BYTES_MAX: usize = 256 << 20;

/// Tables, and what they were made from.
pub(crate) struct Building {
    pub(crate) free: FreeSpace,
    pub(crate) space: Arc<Space>,
    graph: TopologicalGraph,
    pub(crate) arcs: Vec<ArcCost>,
    pub(crate) plans: Plans,
    /// For the regions.
    pub(crate) segmenting: Duration,
    /// For the tables.
    pub(crate) tabulating: Duration,
}

impl Building {
    pub(crate) fn new(free: FreeSpace, radius_m: f64) -> Result<Self, Box<dyn Error>> {
        let start = Instant::now();
        let found = segmentation(&free, &TopologyParams::INDOOR);
        let graph = topological_graph(&found.partition, &found.lines, &found.clearance);
        let segmenting = start.elapsed();
        let start = Instant::now();
        let space = Arc::new(Space::uniform(free.info(), &enterable(&free, radius_m))?);
        let arcs = vec![ArcCost::Open(0); graph.arcs.len()];
        let partition = Arc::new(found.partition);
        let plans = Plans::new(space.clone(), partition, &graph, &arcs, PAIR_BYTES_MAX);
        let tabulating = start.elapsed();
        Ok(Self { free, space, graph, arcs, plans, segmenting, tabulating })
    }

    /// Tables of the same regions made afresh.
    pub(crate) fn tables(&self, arcs: &[ArcCost]) -> Plans {
        let partition = self.plans.partition().clone();
        Plans::new(self.space.clone(), partition, &self.graph, arcs, PAIR_BYTES_MAX)
    }

    /// What the tables weigh, in bytes a cell.
    pub(crate) fn bytes_a_cell(&self) -> f64 {
        let size = self.plans.size();
        (size.region_bytes + size.gate_bytes) as f64 / size.n_cells.max(1) as f64
    }
}
