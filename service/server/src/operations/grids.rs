//! Grids of map versions.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use meetpoint_geometry::GridFrame;
use meetpoint_occupancy::{Grid, Raster, TileIndex};
use meetpoint_proto::v1;
use meetpoint_storage::{ContentHash, MapId, SessionId, TileKey};

use super::maps::shortened;
use super::tiles;
use crate::convert::grid::{self, Drawn};
use crate::{error::Error, service::Service};

/// Versions whose grid stays in memory: the published ones of a few maps, and one to compare with.
const N_VERSIONS_CACHED: usize = 4;

/// A version's grid in the map's frame, or in that of a session that is not placed.
#[derive(Clone)]
pub(crate) struct VersionGrid {
    pub(crate) map: MapId,
    pub(crate) version: u64,
    pub(crate) cost_revision: u64,
    pub(crate) frame: Option<SessionId>,
    pub(crate) grid: Arc<Grid>,
    hashes: Arc<[ContentHash]>,
}

impl VersionGrid {
    /// What it is of.
    pub(crate) fn drawn(&self) -> Drawn {
        Drawn {
            map: self.map.0.clone(),
            version: self.version,
            cost_revision: self.cost_revision,
            frame: self.frame,
        }
    }
}

/// Grids asked for lately, newest last.
#[derive(Default)]
pub(crate) struct GridCache(Mutex<VecDeque<VersionGrid>>);

impl GridCache {
    fn get(&self, map: &MapId, version: u64, frame: Option<SessionId>) -> Option<VersionGrid> {
        let mut cached = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let is_meant =
            |grid: &VersionGrid| grid.map == *map && grid.version == version && grid.frame == frame;
        let place = cached.iter().position(is_meant)?;
        let found = cached.remove(place)?;
        cached.push_back(found.clone());
        Some(found)
    }

    fn put(&self, grid: VersionGrid) {
        let mut cached = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        cached.push_back(grid);
        while cached.len() > N_VERSIONS_CACHED {
            cached.pop_front();
        }
    }

    /// The tiles in memory: versions of a map share most of theirs.
    pub(super) fn known_tiles(&self) -> tiles::Known {
        let cached = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let of = |grid: &VersionGrid| {
            let tiles = grid.grid.tiles().map(|(_, tile)| tile.clone());
            grid.hashes.iter().copied().zip(tiles).collect::<Vec<_>>()
        };
        cached.iter().flat_map(of).collect()
    }
}

impl Service {
    /// A rectangle of a version's grid.
    pub(crate) async fn get_grid(
        &self,
        request: v1::GetGridRequest,
    ) -> Result<v1::GetGridResponse, Error> {
        let v1::GetGridRequest { map, version, bounding_box } = request;
        let found = self.version_grid(&map, version).await?;
        let raster = self.raster(&found, bounding_box).await?;
        Ok(v1::GetGridResponse { grid: Some(grid::to_wire(&raster, found.drawn())) })
    }

    /// A rectangle of what a session that is not placed has drawn.
    pub(crate) async fn get_session_grid(
        &self,
        request: v1::GetSessionGridRequest,
    ) -> Result<v1::GetSessionGridResponse, Error> {
        let v1::GetSessionGridRequest { session, version, bounding_box } = request;
        let (map, frame) = self.session_frame(&session).await?;
        let found = self.frame_grid(&map.0, version, Some(frame)).await?;
        let raster = self.raster(&found, bounding_box).await?;
        Ok(v1::GetSessionGridResponse { grid: Some(grid::to_wire(&raster, found.drawn())) })
    }

    /// The map of a session that is not placed, and the session in whose frame it is drawn.
    pub(crate) async fn session_frame(&self, session: &str) -> Result<(MapId, SessionId), Error> {
        let record = self.session_record(session).await?;
        match record.frame {
            Some(frame) => Ok((record.map, frame)),
            None => Err(Error::SessionPlaced(shortened(session))),
        }
    }

    /// A rectangle of a grid, or all that was observed.
    pub(crate) async fn raster(
        &self,
        found: &VersionGrid,
        bounding_box: Option<v1::BoundingBox>,
    ) -> Result<Raster, Error> {
        let info = match bounding_box {
            Some(wire) => grid::cells_in(found.grid.frame(), wire)?,
            None => found.grid.bounds().ok_or(Error::NothingObserved)?,
        };
        let n_cells = info.n_cells() as u64;
        let limit_cells = self.settings.limits.grid_cells_max;
        if n_cells > limit_cells {
            return Err(Error::GridTooLarge { n_cells, limit_cells });
        }
        let grid = found.grid.clone();
        tokio::task::spawn_blocking(move || grid.raster(Some(info))).await.map_err(Error::internal)
    }

    /// The grid of a version; 0 is the published one.
    pub(crate) async fn version_grid(&self, map: &str, number: u64) -> Result<VersionGrid, Error> {
        self.frame_grid(map, number, None).await
    }

    /// The grid of a version in the frame of a session that is not placed, or in the map's; 0 is the
    /// published one.
    pub(crate) async fn frame_grid(
        &self,
        map: &str,
        number: u64,
        drawn_in: Option<SessionId>,
    ) -> Result<VersionGrid, Error> {
        let record = self.map_record(map).await?;
        let version = self.version_record(map, number).await?;
        if let Some(found) = self.grids.get(&record.id, version.number, drawn_in) {
            return Ok(VersionGrid { cost_revision: record.cost_revision, ..found });
        }
        let mut manifest = self.store.manifest(&record.id, version.number).await?;
        manifest.retain(|(key, _)| key.frame == drawn_in);
        manifest.sort_by_key(|(key, _)| tile_index(key));
        let tiles = tiles::load(&self.store, &manifest, &self.grids.known_tiles()).await?;
        let frame = GridFrame::new(record.resolution_m)
            .map_err(|error| Error::internal(format!("a stored resolution: {error:?}")))?;
        let tiles = tiles.into_iter().map(|(key, tile)| (tile_index(&key), tile));
        let found = VersionGrid {
            map: record.id,
            version: version.number,
            cost_revision: record.cost_revision,
            frame: drawn_in,
            grid: Arc::new(Grid::from_tiles(frame, tiles)),
            hashes: manifest.iter().map(|(_, hash)| *hash).collect(),
        };
        self.grids.put(found.clone());
        Ok(found)
    }
}

fn tile_index(key: &TileKey) -> TileIndex {
    TileIndex { x: key.x, y: key.y }
}
