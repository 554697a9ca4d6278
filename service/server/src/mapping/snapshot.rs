//! Snapshots: what a map's state becomes in the store, as one map version.

use std::collections::BTreeMap;
use std::sync::Arc;

use meetpoint_occupancy::{Grid, Tile, TileIndex, n_moved};
use meetpoint_storage::{
    ContentHash, JournalSeq, MapLease, NewPoses, NewSnapshot, NewTile, NewTopology, SessionId,
    TileKey,
};

use super::{checkpoint, map_state::MapState};

/// Cells of this length have changed when something has moved: half of the narrowest door, in metres.
const MOVED_M: f64 = 0.3;
/// What is no farther from a wall that stays is its blur, in metres.
const BLUR_M: f64 = 0.1;

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
    mapping_parameters: String,
}

impl SavedTiles {
    /// The tiles that a state was restored from.
    pub(super) fn restored(tiles: &[(TileKey, Arc<Tile>)], hashes: &[ContentHash]) -> Self {
        let saved = tiles.iter().zip(hashes);
        Self(saved.map(|((key, tile), hash)| (*key, (tile.clone(), *hash))).collect())
    }

    /// True if cells of the site are occupied that were free in the snapshot, or the other way around, more than walls
    /// are blurred by.
    pub(super) fn has_moved(&self, now: &Grid) -> bool {
        let site = self.0.iter().filter(|(key, _)| key.frame.is_none());
        let tiles = site
            .map(|(key, (tile, _))| (TileIndex { x: key.x, y: key.y }, tile.clone()))
            .collect::<Vec<_>>();
        let n_cells = |length_m: f64| length_m / now.frame().resolution_m();
        #[expect(clippy::cast_possible_truncation, reason = "some cells")]
        let blur = n_cells(BLUR_M).round().clamp(1.0, 64.0) as i32;
        let before = Grid::from_tiles(now.frame(), tiles);
        n_cells(MOVED_M) <= n_moved(&before, now, blur) as f64
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
            mapping_parameters: state.sensing.parameters().to_owned(),
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
            mapping_parameters,
        } = self;
        NewSnapshot {
            sonar_weights,
            mapping_parameters,
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
