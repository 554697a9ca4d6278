//! Tiles out of the store, those that are in memory left alone.

use std::collections::HashMap;
use std::sync::Arc;

use meetpoint_occupancy::Tile;
use meetpoint_storage::{ContentHash, Store, TileKey};

use crate::error::Error;

/// Tiles in memory, by content.
pub(crate) type Known = HashMap<ContentHash, Arc<Tile>>;

/// The tiles of a manifest, in its order.
///
/// # Errors
/// The store's; [`Error::StorageDamaged`] if a tile is missing or cannot be read.
pub(crate) async fn load(
    store: &Store,
    manifest: &[(TileKey, ContentHash)],
    known: &Known,
) -> Result<Vec<(TileKey, Arc<Tile>)>, Error> {
    let missing: Vec<ContentHash> =
        manifest.iter().map(|(_, hash)| *hash).filter(|hash| !known.contains_key(hash)).collect();
    let stored = store.tiles(&missing).await?;
    let manifest = manifest.to_vec();
    let known = known.clone();
    tokio::task::spawn_blocking(move || {
        let mut tiles = known;
        for (hash, bytes) in stored {
            let tile = Tile::from_bytes(&bytes).map_err(|error| {
                tracing::error!(?error, "a stored tile cannot be read");
                Error::StorageDamaged
            })?;
            tiles.insert(hash, Arc::new(tile));
        }
        let tile = |(key, hash): &(TileKey, ContentHash)| {
            tiles.get(hash).map(|tile| (*key, tile.clone())).ok_or(Error::StorageDamaged)
        };
        manifest.iter().map(tile).collect()
    })
    .await
    .map_err(Error::internal)?
}
