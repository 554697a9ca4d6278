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

#[cfg(test)]
mod tests {
    use meetpoint_geometry::{Cell, GridFrame, GridInfo};
    use meetpoint_occupancy::Raster;

    use super::*;

    /// Two rooms of 3 m by 3 m, with a wall between them or without.
    fn rooms(has_wall: bool) -> Grid {
        let frame = GridFrame::new(0.1).expect("a length");
        let info = GridInfo { frame, first: Cell { x: -5, y: 7 }, width: 63, height: 32 };
        let is_wall = |index: usize| {
            let (x, y) = (index % 63, index / 63);
            x == 0 || y == 0 || x == 62 || y == 31 || (has_wall && x == 31)
        };
        let cells = 0..info.n_cells();
        let log_odds = cells.map(|index| if is_wall(index) { 2.0 } else { -2.0 }).collect();
        Grid::from_raster(&Raster { info, log_odds })
    }

    fn none_yet() -> Topologies {
        let counters = Counters { next_region: ID_FIRST, next_arc: ID_FIRST };
        Topologies { n_cells_max: 63 * 32, counters, newest: None, segmentation: None }
    }

    #[test]
    fn a_wall_goes_and_a_region_ends() {
        let mut topologies = none_yet();
        let first = topologies.next(&rooms(true)).expect("it is small enough");
        assert_eq!((first.next_ids.region, first.ended.len()), (3, 0), "two rooms");
        let same = topologies.next(&rooms(true)).expect("it is small enough");
        assert_eq!((same.hash, same.bytes), (first.hash, None), "stored once");
        let joined = topologies.next(&rooms(false)).expect("it is small enough");
        let [ended] = joined.ended.as_slice() else { panic!("one of two: {joined:?}") };
        let [(heir, n_cells)] = ended.heirs.as_slice() else { panic!("one heir: {ended:?}") };
        assert_eq!((ended.region + heir, *n_cells), (3, 900), "the other has all of it");
    }

    #[test]
    fn what_is_too_large_or_empty_is_left_out_and_ids_go_on() {
        let mut topologies = none_yet();
        topologies.next(&rooms(true)).expect("it is small enough");
        let frame = GridFrame::new(0.1).expect("a length");
        assert!(topologies.next(&Grid::new(frame)).is_none(), "nothing was observed");
        topologies.n_cells_max -= 1;
        assert!(topologies.next(&rooms(true)).is_none(), "a cell too many");
        topologies.n_cells_max += 1;
        let again = topologies.next(&rooms(true)).expect("it is small enough");
        assert_eq!((again.next_ids.region, again.ended.len()), (3, 0), "the same rooms");
    }
}
