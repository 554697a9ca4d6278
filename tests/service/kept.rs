//! What a stopped service leaves in its folder, read through the storage crate: the bits that two
//! runs have to share.

use std::path::Path;

use meetpoint_storage::{ContentHash, MapId, PoseRecord, SessionId, Store, StoreSettings};

/// More poses than any session of the scenarios has.
const N_POSES_MAX: u32 = 100_000;

/// What was kept of a map and one of its sessions, in its newest version.
#[derive(Debug, PartialEq)]
pub(crate) struct Kept {
    /// Of the journal: kinds, numbers and contents in order.
    pub(crate) journal: ContentHash,
    pub(crate) poses: Vec<PoseRecord>,
    /// Every tile: whether it is in a session's own frame, its place, its bytes.
    pub(crate) tiles: Vec<(bool, i32, i32, Vec<u8>)>,
}

/// Opens the database of a service that runs no more.
pub(crate) async fn store(data: &Path) -> Store {
    let path = data.join("meetpoint.db");
    let settings = StoreSettings { path, n_readers: 1, busy_timeout_ms: 1000 };
    Store::open(&settings).await.expect("the database opens")
}

/// Reads the folder of a service that runs no more.
pub(crate) async fn kept(data: &Path, map: &str, session: &str) -> Kept {
    let store = store(data).await;
    let map = MapId(map.to_owned());
    let versions = store.versions(&map, None, 1).await.expect("versions can be read");
    let newest = versions.first().expect("there is a version").number;
    kept_of(&store, &map, newest, session).await
}

/// The same of one version.
pub(crate) async fn kept_of(store: &Store, map: &MapId, version: u64, session: &str) -> Kept {
    let session = SessionId(session.parse().expect("a session's id"));
    let page = store.trajectory(session, version, 0, N_POSES_MAX).await;
    let manifest = store.manifest(map, version).await.expect("the version can be read");
    let hashes: Vec<ContentHash> = manifest.iter().map(|(_, hash)| *hash).collect();
    let contents = store.tiles(&hashes).await.expect("every tile is there and whole");
    let tile = |((key, _), (_, bytes)): (&(meetpoint_storage::TileKey, _), (_, Vec<u8>))| {
        (key.frame.is_some(), key.x, key.y, bytes)
    };
    Kept {
        journal: store.journal_digest(map).await.expect("the journal can be read"),
        poses: page.expect("poses can be read").expect("the version has the session").poses,
        tiles: manifest.iter().zip(contents).map(tile).collect(),
    }
}
