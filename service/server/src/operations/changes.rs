//! What changed between two versions of a map.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::sync::Arc;

use meetpoint_geometry::{Cell, GridFrame, GridInfo};
use meetpoint_occupancy::{Change, ChangeKind, TILE_CELLS, Tile, TileIndex, changes};
use meetpoint_proto::v1;
use meetpoint_storage::{ContentHash, MapRecord, TileKey};

use super::page;
use super::tiles;
use crate::convert::{change, grid};
use crate::{error::Error, service::Service};

/// Cells of a tile.
const CELLS_PER_TILE: u64 = 64 * 64;

/// A tile that is not the same in both versions: what it was, and what it is.
type Pair = [Option<ContentHash>; 2];

impl Service {
    /// A page of the changes between two versions.
    pub(crate) async fn list_changes(
        &self,
        request: v1::ListChangesRequest,
    ) -> Result<v1::ListChangesResponse, Error> {
        let v1::ListChangesRequest {
            map,
            since,
            version,
            bounding_box,
            cells_min,
            page_size,
            page_token,
        } = request;
        if since == 0 {
            return Err(Error::field("since", "0; versions are counted from 1 on"));
        }
        let size = page::size(page_size, &self.settings.limits) as usize;
        let begin = page::after(&page_token, |token| token.parse::<usize>().ok())?.unwrap_or(0);
        let record = self.map_record(&map).await?;
        let frame = GridFrame::new(record.resolution_m)
            .map_err(|error| Error::internal(format!("a stored resolution: {error:?}")))?;
        let within = bounding_box.map(|wire| grid::cells_in(frame, wire)).transpose()?;
        let before = self.version_record(&map, since).await?.number;
        let now = self.version_record(&map, version).await?.number;
        let unequal = self.unequal_tiles(&record, [before, now], within).await?;
        let mut found = self.changed_cells(unequal).await?;
        found.retain(|change| cells_min as usize <= change.n_cells);
        let n_cells = |kind: ChangeKind| {
            let of_kind = found.iter().filter(|change| change.kind == kind);
            of_kind.map(|change| change.n_cells as u64).sum::<u64>()
        };
        let end = begin.saturating_add(size);
        let is_last = found.len() <= end;
        Ok(v1::ListChangesResponse {
            changes: found
                .iter()
                .skip(begin)
                .take(size)
                .map(|one| change::to_wire(one, frame))
                .collect(),
            next_page_token: if is_last { String::new() } else { end.to_string() },
            since: before,
            map_version: now,
            cells_appeared: n_cells(ChangeKind::Appeared),
            cells_vanished: n_cells(ChangeKind::Vanished),
        })
    }

    /// The tiles of the map's frame that are in both versions and not the same.
    async fn unequal_tiles(
        &self,
        record: &MapRecord,
        [before, now]: [u64; 2],
        within: Option<GridInfo>,
    ) -> Result<BTreeMap<TileKey, [ContentHash; 2]>, Error> {
        let mut pairs: BTreeMap<TileKey, Pair> = BTreeMap::new();
        for (side, number) in [before, now].into_iter().enumerate() {
            for (key, hash) in self.store.manifest(&record.id, number).await? {
                if key.frame.is_none() && within.is_none_or(|info| touches(info, &key)) {
                    pairs.entry(key).or_default()[side] = Some(hash);
                }
            }
        }
        let unequal = pairs.into_iter().filter_map(|(key, [before, now])| {
            before.zip(now).filter(|(before, now)| before != now).map(|(a, b)| (key, [a, b]))
        });
        let unequal: BTreeMap<_, _> = unequal.collect();
        let n_cells = unequal.len() as u64 * CELLS_PER_TILE;
        let limit_cells = self.settings.limits.grid_cells_max;
        if limit_cells < n_cells {
            return Err(Error::GridTooLarge { n_cells, limit_cells });
        }
        Ok(unequal)
    }

    async fn changed_cells(
        &self,
        unequal: BTreeMap<TileKey, [ContentHash; 2]>,
    ) -> Result<Vec<Change>, Error> {
        let known = self.grids.known_tiles();
        let mut sides = Vec::new();
        for side in 0..2 {
            let manifest: Vec<_> = unequal.iter().map(|(key, pair)| (*key, pair[side])).collect();
            sides.push(tiles::load(&self.store, &manifest, &known).await?);
        }
        tokio::task::spawn_blocking(move || {
            let pairs = sides[0].iter().zip(&sides[1]);
            let tile = |tile: &Arc<Tile>| Arc::clone(tile);
            let pairs: Vec<_> = pairs
                .map(|((key, before), (_, now))| {
                    (TileIndex { x: key.x, y: key.y }, tile(before), tile(now))
                })
                .collect();
            changes(
                pairs.iter().map(|(index, before, now)| (*index, Some(&**before), Some(&**now))),
            )
        })
        .await
        .map_err(Error::internal)
    }
}

/// True if a rectangle of cells and a tile have cells in common.
fn touches(info: GridInfo, key: &TileKey) -> bool {
    let Cell { x, y } = info.first;
    let is_among = |tile: i32, first: i32, n_cells: u32| {
        let last = first.saturating_add_unsigned(n_cells.saturating_sub(1));
        let tiles: RangeInclusive<i32> = first.div_euclid(TILE_CELLS)..=last.div_euclid(TILE_CELLS);
        tiles.contains(&tile)
    };
    is_among(key.x, x, info.width) && is_among(key.y, y, info.height)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_touch_tiles() {
        let frame = GridFrame::new(0.05).expect("a length");
        let info = GridInfo { frame, first: Cell { x: -1, y: 63 }, width: 2, height: 2 };
        let touching = |x: i32, y: i32| touches(info, &TileKey { frame: None, x, y });
        assert!(touching(-1, 0) && touching(0, 1) && touching(-1, 1), "four tiles meet in it");
        assert!(!touching(1, 0) && !touching(-2, 1) && !touching(0, 2), "beside it");
    }
}
