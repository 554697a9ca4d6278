//! Regions, graph and ids of a map from one version to the next.
//!
//! Ids are carried on from the newest version that has any, whatever is published, and their
//! counters belong to the map: so they are never used again, however far anybody rolls back.

use std::collections::HashSet;
use std::sync::Arc;

use meetpoint_occupancy::Grid;
use meetpoint_storage::{ContentHash, EndedRegion, MapId, NewTopology, NextIds, Store};
use meetpoint_topology::{
    Becoming, Counters, FreeSpace, RegionId, Segmentation, Topology, TopologyParams,
    resegmentation, segmentation,
};

use crate::error::Error;

/// The first id. 0 stands for none on the wire.
const ID_FIRST: u64 = 1;

/// What is kept of a map to make the topology of its next version.
pub(super) struct Topologies {
    n_cells_max: u64,
    counters: Counters,
    /// The newest one, as it is stored.
    newest: Option<(Arc<Topology>, ContentHash)>,
    /// What led to it, where this process has made it: only what changed is computed again.
    segmentation: Option<Segmentation>,
}

impl Topologies {
    /// Goes on from what the store has. A topology that cannot be read is not followed: its regions
    /// end, and new ones have new ids.
    ///
    /// # Errors
    /// The store's, but damage.
    pub(super) async fn restored(
        store: &Store,
        map: &MapId,
        n_cells_max: u64,
    ) -> Result<Self, Error> {
        let NextIds { region, arc } = store.next_ids(map).await?;
        let counters = Counters { next_region: region.max(ID_FIRST), next_arc: arc.max(ID_FIRST) };
        let newest = match store.newest_topology(map).await {
            Ok(Some((hash, bytes))) => read(map, hash, &bytes),
            Ok(None) => None,
            Err(meetpoint_storage::Error::Damaged(what)) => {
                tracing::error!(map = map.as_str(), what, "the last topology is damaged");
                None
            }
            Err(error) => return Err(error.into()),
        };
        Ok(Self { n_cells_max, counters, newest, segmentation: None })
    }

    /// The topology of the next version; `None` if nothing was observed or too much.
    pub(super) fn next(&mut self, grid: &Grid) -> Option<NewTopology> {
        let space = free_space(grid, self.n_cells_max)?;
        let found = match self.segmentation.take() {
            Some(before) => resegmentation(before, &space),
            None => segmentation(&space, &TopologyParams::INDOOR),
        };
        let (topology, becoming) = match &self.newest {
            Some((before, _)) => before.next(&found, &mut self.counters),
            None => (Topology::first(&found, &mut self.counters), Vec::new()),
        };
        self.segmentation = Some(found);
        let bytes = topology.to_bytes();
        let hash = ContentHash(*blake3::hash(&bytes).as_bytes());
        let is_stored = self.newest.as_ref().is_some_and(|(_, before)| *before == hash);
        let ended = ended(&topology, becoming);
        self.newest = Some((Arc::new(topology), hash));
        let Counters { next_region, next_arc } = self.counters;
        Some(NewTopology {
            hash,
            bytes: (!is_stored).then_some(bytes),
            next_ids: NextIds { region: next_region, arc: next_arc },
            ended,
        })
    }
}

/// The free cells of a grid's observed rectangle, if it has at most `n_cells_max` cells.
pub(crate) fn free_space(grid: &Grid, n_cells_max: u64) -> Option<FreeSpace> {
    let bounds = grid.bounds()?;
    let n_cells = bounds.n_cells() as u64;
    if n_cells_max < n_cells {
        tracing::warn!(n_cells, n_cells_max, "the map is too large for regions and a graph");
        return None;
    }
    let raster = grid.raster(Some(bounds));
    Some(FreeSpace::from_raster(&raster, FreeSpace::PROBABILITY_MAX))
}

fn read(map: &MapId, hash: ContentHash, bytes: &[u8]) -> Option<(Arc<Topology>, ContentHash)> {
    match Topology::from_bytes(bytes) {
        Ok(topology) => Some((Arc::new(topology), hash)),
        Err(error) => {
            let map = map.as_str();
            tracing::error!(map, %hash, %error, "the last topology cannot be read");
            None
        }
    }
}

/// Regions of the version before that a topology does not have.
fn ended(topology: &Topology, becoming: Vec<Becoming>) -> Vec<EndedRegion> {
    let living: HashSet<RegionId> = topology.ids().regions.iter().copied().collect();
    let is_gone = |becoming: &Becoming| !living.contains(&becoming.region);
    let record = |Becoming { region, now }: Becoming| EndedRegion {
        region: region.0,
        heirs: now.into_iter().map(|(heir, n_cells)| (heir.0, n_cells)).collect(),
    };
    becoming.into_iter().filter(is_gone).map(record).collect()
}
