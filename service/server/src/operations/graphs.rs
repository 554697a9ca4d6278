//! Regions and graphs of map versions.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use meetpoint_proto::v1;
use meetpoint_storage::{EndedRegion, MapId};
use meetpoint_topology::{FreeSpace, RegionId, RegionIndex, Topology};

use super::grids::VersionGrid;
use crate::convert::graph;
use crate::mapping::free_space;
use crate::{error::Error, service::Service};

/// Versions whose topology stays in memory, as of grids.
const N_VERSIONS_CACHED: usize = 4;

/// What a version knows of places, with the cells that it was read off.
#[derive(Clone)]
pub(crate) struct VersionTopology {
    pub(crate) map: MapId,
    pub(crate) version: u64,
    pub(crate) cost_revision: u64,
    /// The free cells. Their rectangle is that of the topology's partition.
    pub(crate) space: Arc<FreeSpace>,
    pub(crate) topology: Arc<Topology>,
}

/// Topologies asked for lately, newest last.
#[derive(Default)]
pub(crate) struct TopologyCache(Mutex<VecDeque<VersionTopology>>);

impl TopologyCache {
    fn get(&self, map: &MapId, version: u64) -> Option<VersionTopology> {
        let mut cached = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let place = cached.iter().position(|one| one.map == *map && one.version == version)?;
        let found = cached.remove(place)?;
        cached.push_back(found.clone());
        Some(found)
    }

    fn put(&self, topology: VersionTopology) {
        let mut cached = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        cached.push_back(topology);
        while cached.len() > N_VERSIONS_CACHED {
            cached.pop_front();
        }
    }
}

impl VersionTopology {
    /// A region that ended with a version, for the wire.
    fn ended_to_wire(&self, version: u64, ended: EndedRegion) -> v1::EndedRegion {
        graph::ended_to_wire(ended, version, self.space.info().frame)
    }
}

impl Service {
    /// The graph of a version.
    pub(crate) async fn get_graph(
        &self,
        request: v1::GetGraphRequest,
    ) -> Result<v1::GetGraphResponse, Error> {
        let v1::GetGraphRequest { map, version, pruning, outlines, hypothesis, tree } = request;
        if !hypothesis.is_empty() {
            if version != 0 {
                return Err(Error::field("version", "a hypothesis has no versions"));
            }
            let tree = v1::TreeName { map, ..tree.unwrap_or_default() };
            let graph = self.hypothesis_graph(tree, hypothesis).await?;
            return Ok(v1::GetGraphResponse { graph: Some(graph) });
        }
        let pruning = v1::GraphPruning::try_from(pruning)
            .map_err(|_| Error::field("pruning", format!("{pruning} is no pruning")))?;
        let found = self.version_topology(&map, version).await?;
        let ended = self.store.regions_ended_in(&found.map, found.version).await?;
        let topology = found.topology.clone();
        let drawn =
            tokio::task::spawn_blocking(move || graph::to_wire(&topology, pruning, outlines));
        let graph = v1::Graph {
            map,
            map_version: found.version,
            cost_revision: found.cost_revision,
            ended: ended
                .into_iter()
                .map(|ended| found.ended_to_wire(found.version, ended))
                .collect(),
            ..drawn.await.map_err(Error::internal)?
        };
        Ok(v1::GetGraphResponse { graph: Some(graph) })
    }

    /// A region of a version, or what became of it.
    pub(crate) async fn get_region(
        &self,
        request: v1::GetRegionRequest,
    ) -> Result<v1::GetRegionResponse, Error> {
        use v1::get_region_response::State;
        let v1::GetRegionRequest { map, region, version } = request;
        let found = self.version_topology(&map, version).await?;
        let (map_version, cost_revision) = (found.version, found.cost_revision);
        let state = match region_index(&found.topology, region) {
            Some(index) => {
                let topology = found.topology;
                let drawn = tokio::task::spawn_blocking(move || graph::region(&topology, index));
                State::Region(drawn.await.map_err(Error::internal)?)
            }
            None => State::Ended(self.ended_region(&found, region).await?),
        };
        Ok(v1::GetRegionResponse { map, map_version, cost_revision, state: Some(state) })
    }

    /// What became of a region that a version does not have.
    async fn ended_region(
        &self,
        found: &VersionTopology,
        region: u64,
    ) -> Result<v1::EndedRegion, Error> {
        let ended = self.store.ended_region(&found.map, region).await?;
        let ended = ended.filter(|(version, _)| *version <= found.version);
        let (version, ended) = ended.ok_or_else(|| Error::NoSuchRegion {
            map: found.map.0.clone(),
            region,
            version: found.version,
        })?;
        Ok(found.ended_to_wire(version, ended))
    }

    /// Regions, graph and ids of a version, with its free cells; 0 is the published one.
    pub(crate) async fn version_topology(
        &self,
        map: &str,
        number: u64,
    ) -> Result<VersionTopology, Error> {
        let record = self.map_record(map).await?;
        let version = self.version_record(map, number).await?;
        if let Some(found) = self.topologies.get(&record.id, version.number) {
            return Ok(VersionTopology { cost_revision: record.cost_revision, ..found });
        }
        let stored = self.store.topology(&record.id, version.number).await?;
        let grid = self.version_grid(map, version.number).await?;
        let Some((_, bytes)) = stored else { return Err(self.no_topology(&grid)) };
        let n_cells_max = self.settings.mapping.topology_cells_max;
        let read = tokio::task::spawn_blocking(move || {
            let topology = Topology::from_bytes(&bytes).map_err(|error| {
                tracing::error!(%error, "a stored topology cannot be read");
                Error::StorageDamaged
            })?;
            // The limit may have been lowered since.
            let n_cells_max = n_cells_max.max(topology.partition().info().n_cells() as u64);
            let space = free_space(&grid.grid, n_cells_max).ok_or(Error::StorageDamaged)?;
            if space.info() != topology.partition().info() {
                tracing::error!("a stored topology is not that of its grid");
                return Err(Error::StorageDamaged);
            }
            Ok::<_, Error>((space, topology))
        });
        let (space, topology) = read.await.map_err(Error::internal)??;
        let found = VersionTopology {
            map: record.id,
            version: version.number,
            cost_revision: record.cost_revision,
            space: Arc::new(space),
            topology: Arc::new(topology),
        };
        self.topologies.put(found.clone());
        Ok(found)
    }

    /// Why a version has no topology.
    fn no_topology(&self, grid: &VersionGrid) -> Error {
        let limit_cells = self.settings.mapping.topology_cells_max;
        match grid.grid.bounds().map(|bounds| bounds.n_cells() as u64) {
            None => Error::NothingObserved,
            Some(n_cells) if limit_cells < n_cells => Error::MapTooLarge { n_cells, limit_cells },
            Some(_) => Error::NoGraph { map: grid.map.0.clone(), version: grid.version },
        }
    }
}

fn region_index(topology: &Topology, region: u64) -> Option<RegionIndex> {
    let place = topology.ids().regions.iter().position(|&id| id == RegionId(region))?;
    u32::try_from(place).ok().map(RegionIndex)
}
