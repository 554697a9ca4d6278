//! Snapshots: what a map's state becomes in the store, as one map version.

use std::collections::BTreeMap;
use std::sync::Arc;

use meetpoint_occupancy::{Grid, Tile};
use meetpoint_storage::{
    ContentHash, JournalSeq, MapLease, NewPoses, NewSnapshot, NewTile, NewTopology, SessionId,
    TileKey,
};

use super::{checkpoint, map_state::MapState};

/// The tiles of the last snapshot, by which unchanged ones are recognised without reading them.
#[derive(Debug, Default)]
pub(super) struct SavedTiles(BTreeMap<TileKey, (Arc<Tile>, ContentHash)>);

/// A snapshot on its way: all but the topology of its grid and what only the store's caller knows.
pub(super) struct Draft {
    journal_seq: JournalSeq,
    n_scans: u64,
    bounds_m: Option<[f64; 4]>,
    state: Vec<u8>,
    tiles: Vec<NewTile>,
    grid: Grid,
    landmarks: Option<Vec<u8>>,
    poses: Vec<NewPoses>,
    sonar_weights: String,
}

impl SavedTiles {
    /// The tiles that a state was restored from.
    pub(super) fn restored(tiles: &[(TileKey, Arc<Tile>)], hashes: &[ContentHash]) -> Self {
        let saved = tiles.iter().zip(hashes);
        Self(saved.map(|((key, tile), hash)| (*key, (tile.clone(), *hash))).collect())
    }

    /// Takes a snapshot of `state`, whose poses since the last one go with it.
    pub(super) fn draft(&mut self, state: &mut MapState) -> Draft {
        let mut tiles = Vec::new();
        let mut saved = BTreeMap::new();
        let frames = std::iter::once((None, &state.site))
            .chain(state.unplaced.iter().map(|(&id, map)| (Some(id), map)));
        for (frame, map) in frames {
            self.tiles_of(frame, map.grid(), &mut tiles, &mut saved);
        }
        self.0 = saved;
        let poses = std::mem::take(&mut state.poses).into_iter();
        let poses = poses.filter(|(_, new)| !new.poses.is_empty()).map(|(session, new)| NewPoses {
            session,
            origin: new.origin,
            first_index: new.first_index,
            poses: new.poses,
        });
        state.n_scans_since_snapshot = 0;
        Draft {
            journal_seq: state.position,
            n_scans: state.site.n_drawn(),
            bounds_m: bounds_m(state.site.grid()),
            state: checkpoint::to_bytes(state),
            tiles,
            grid: state.grid().clone(),
            landmarks: state.decisions.relaxations().landmark_set(),
            poses: poses.collect(),
            sonar_weights: state.sensing.sonar_weights().to_owned(),
        }
    }

    fn tiles_of(
        &self,
        frame: Option<SessionId>,
        grid: &Grid,
        tiles: &mut Vec<NewTile>,
        saved: &mut BTreeMap<TileKey, (Arc<Tile>, ContentHash)>,
    ) {
        for (index, tile) in grid.tiles() {
            let key = TileKey { frame, x: index.x, y: index.y };
            let known = self.0.get(&key).filter(|(before, _)| Arc::ptr_eq(before, tile));
            let (hash, bytes) = match known {
                Some((_, hash)) => (*hash, None),
                None => {
                    let bytes = tile.to_bytes();
                    (ContentHash(*blake3::hash(&bytes).as_bytes()), Some(bytes))
                }
            };
            saved.insert(key, (tile.clone(), hash));
            tiles.push(NewTile { key, hash, bytes });
        }
    }
}

impl Draft {
    /// The grid that is to be saved.
    pub(super) fn grid(&self) -> &Grid {
        &self.grid
    }

    /// The snapshot, to be saved under a lease.
    pub(super) fn into_snapshot(
        self,
        topology: Option<NewTopology>,
        lease: MapLease,
        origin: &str,
        time_ns: i64,
    ) -> NewSnapshot {
        let Self {
            journal_seq,
            n_scans,
            bounds_m,
            state,
            tiles,
            grid: _,
            landmarks,
            poses,
            sonar_weights,
        } = self;
        NewSnapshot {
            sonar_weights,
            map: lease.map.clone(),
            lease,
            journal_seq,
            origin: origin.to_owned(),
            n_scans,
            bounds_m,
            state,
            tiles,
            topology,
            landmarks,
            poses,
            time_ns,
        }
    }
}

/// Minimum and maximum of the observed cells: x, y, x, y in metres.
fn bounds_m(grid: &Grid) -> Option<[f64; 4]> {
    let info = grid.bounds()?;
    let least = info.origin();
    let side_m = info.frame.resolution_m();
    Some([
        least.x,
        least.y,
        least.x + f64::from(info.width) * side_m,
        least.y + f64::from(info.height) * side_m,
    ])
}
