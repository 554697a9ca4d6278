//! What a version offers for planning, whatever the robot and the costs.

use std::sync::Arc;

use meetpoint_geometry::GridInfo;
use meetpoint_occupancy::Raster;
use meetpoint_planning::Obstacles;
use meetpoint_storage::MapId;
use meetpoint_topology::{FreeSpace, Partition, Topology};

/// Cells and places of one version.
pub(crate) struct Ground {
    pub(crate) map: MapId,
    pub(crate) version: u64,
    pub(crate) free: Arc<FreeSpace>,
    pub(crate) topology: Arc<Topology>,
    pub(crate) partition: Arc<Partition>,
    /// Probability of "occupied" in percent, 255 where never observed; same cells as `free`.
    percent: Vec<u8>,
}

impl Ground {
    /// Of a version; `raster` holds the cells of `free` but its rim.
    pub(crate) fn new(
        map: MapId,
        version: u64,
        free: Arc<FreeSpace>,
        topology: Arc<Topology>,
        raster: &Raster,
    ) -> Self {
        let partition = Arc::new(topology.partition().clone());
        let percent = rimmed(raster, free.info());
        Self { map, version, free, topology, partition, percent }
    }

    pub(crate) fn info(&self) -> GridInfo {
        self.free.info()
    }

    /// Edge of a cell, in metres.
    pub(crate) fn side_m(&self) -> f64 {
        self.info().frame.resolution_m()
    }

    /// Whether a cell was never observed.
    pub(crate) fn is_unknown(&self, cell: usize) -> bool {
        self.percent.get(cell).is_none_or(|&percent| percent == Raster::PERCENT_UNKNOWN)
    }

    /// Probability of "occupied"; 0 where never observed.
    pub(crate) fn probability(&self, cell: usize) -> f64 {
        match self.percent.get(cell) {
            None | Some(&Raster::PERCENT_UNKNOWN) => 0.0,
            Some(&percent) => f64::from(percent) / 100.0,
        }
    }

    /// Id of an arc, by its place in the graph.
    pub(crate) fn arc_id(&self, place: usize) -> u64 {
        self.topology.ids().arcs.get(place).map_or(0, |id| id.0)
    }

    /// Id of the region of a cell; 0 if it lies in none.
    pub(crate) fn region_id_at(&self, cell: usize) -> u64 {
        self.partition.region_at(cell).map_or(0, |region| self.region_id(region))
    }

    /// Id of a region.
    pub(crate) fn region_id(&self, region: meetpoint_topology::RegionIndex) -> u64 {
        self.topology.ids().regions.get(region.0 as usize).map_or(0, |id| id.0)
    }

    /// Memory, in bytes, about.
    pub(crate) fn n_bytes(&self) -> usize {
        // A byte of `free`, one of `percent`, four of the partition.
        6 * self.percent.len()
    }

    /// The obstacles as observed.
    pub(crate) fn obstacles(&self) -> Obstacles {
        Obstacles::new(&self.free)
    }
}

/// Percents of a raster in a rectangle that is one cell larger on every side.
fn rimmed(raster: &Raster, info: GridInfo) -> Vec<u8> {
    let mut percent = vec![Raster::PERCENT_UNKNOWN; info.n_cells()];
    let width = raster.info.width as usize;
    let rows = percent.chunks_exact_mut(info.width as usize).skip(1);
    for (to, from) in rows.zip(raster.percent().chunks_exact(width.max(1))) {
        to[1..=width].copy_from_slice(from);
    }
    percent
}
