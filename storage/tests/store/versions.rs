//! Map versions: saving, publishing, rolling back, tiles, checkpoints, fences.

use meetpoint_storage::{
    ContentHash, Error, JournalEvent, JournalSeq, MapId, MapLease, NewSnapshot, NewTile, SessionId,
    Store, TileKey,
};
use uuid::Uuid;

use crate::fixture::{Fixture, hall};

pub(crate) async fn lease(store: &Store) -> MapLease {
    let lease = store.acquire_map_lease(&hall(), Uuid::from_u128(1), 0, 1_000).await;
    lease.expect("the map exists").expect("nobody else holds it")
}

pub(crate) fn snapshot(lease: &MapLease) -> NewSnapshot {
    NewSnapshot {
        map: hall(),
        lease: lease.clone(),
        journal_seq: JournalSeq(1),
        origin: "tracking".to_owned(),
        sonar_weights: "3c0a".to_owned(),
        mapping_parameters: String::new(),
        n_scans: 3,
        bounds_m: Some([-1.0, -2.0, 3.0, 4.5]),
        state: b"state".to_vec(),
        tiles: Vec::new(),
        topology: None,
        landmarks: None,
        poses: Vec::new(),
        time_ns: 500,
    }
}

pub(crate) fn tile(frame: Option<SessionId>, x: i32, content: &[u8]) -> NewTile {
    NewTile {
        key: TileKey { frame, x, y: -7 },
        hash: ContentHash::of(content),
        bytes: Some(content.to_vec()),
    }
}

async fn pointer(store: &Store) -> (u64, u64, bool) {
    let map = store.map(&hall()).await.expect("reading works").expect("`hall` is there");
    (map.published_version, map.latest_version, map.publishes_automatically)
}

#[tokio::test]
async fn a_snapshot_is_the_next_version_and_is_published() {
    let Fixture { store, .. } = &Fixture::new().await;
    let lease = lease(store).await;
    let first = store.save_snapshot(&snapshot(&lease)).await.expect("the lease is in force");
    assert_eq!((first.number, first.published), (1, true), "versions count from 1");
    assert_eq!(first.bounds_m, Some([-1.0, -2.0, 3.0, 4.5]), "in the order given");
    let unobserved = NewSnapshot { bounds_m: None, ..snapshot(&lease) };
    let second = store.save_snapshot(&unobserved).await.expect("the lease is in force");
    assert_eq!((second.number, second.bounds_m), (2, None), "nothing observed");
    assert_eq!(pointer(store).await, (2, 2, true), "the pointer follows");
    let found = store.version(&hall(), 1).await.expect("reading works").expect("it is kept");
    assert_eq!((found.published, found.origin.as_str()), (false, "tracking"), "not any more");
    let missing = store.version(&hall(), u64::MAX).await.expect("reading works");
    assert_eq!(found.sonar_weights, "3c0a", "what it was drawn by is kept");
    assert_eq!(missing, None, "no such version");
}

#[tokio::test]
async fn a_person_moves_the_pointer_back_and_forth() {
    let Fixture { store, .. } = &Fixture::new().await;
    let lease = lease(store).await;
    for _ in 0..2 {
        store.save_snapshot(&snapshot(&lease)).await.expect("the lease is in force");
    }
    let map = store.publish_version(&hall(), 1, 600).await.expect("1 exists");
    assert!(!map.publishes_automatically, "the person's choice stays");
    let third = store.save_snapshot(&snapshot(&lease)).await.expect("the lease is in force");
    assert!(!third.published, "made but not published");
    assert_eq!(pointer(store).await, (1, 3, false), "the pointer stays");
    store.publish_version(&hall(), 3, 700).await.expect("3 exists");
    assert_eq!(pointer(store).await, (3, 3, true), "the newest follows again");

    let unknown = store.publish_version(&hall(), 9, 800).await;
    assert!(matches!(unknown, Err(Error::NoSuchVersion { number: 9, .. })), "no such version");
    let attic = store.publish_version(&MapId("attic".to_owned()), 1, 800).await;
    assert!(matches!(attic, Err(Error::NoSuchMap(_))), "no such map");
    let journal = store.journal(&hall(), JournalSeq::START, 10, 10).await.expect("reading works");
    let events: Vec<JournalEvent> = journal.into_iter().map(|entry| entry.event).collect();
    let expected = [
        JournalEvent::MapCreated,
        JournalEvent::VersionPublished { number: 1 },
        JournalEvent::VersionPublished { number: 3 },
    ];
    assert_eq!(events, expected, "the journal keeps what people decided, not what follows alone");
}

#[tokio::test]
async fn versions_are_listed_newest_first() {
    let Fixture { store, .. } = &Fixture::new().await;
    let lease = lease(store).await;
    for _ in 0..3 {
        store.save_snapshot(&snapshot(&lease)).await.expect("the lease is in force");
    }
    let numbers = async |before, limit| {
        let page = store.versions(&hall(), before, limit).await.expect("reading works");
        page.into_iter().map(|version| version.number).collect::<Vec<_>>()
    };
    assert_eq!(numbers(None, 2).await, [3, 2], "the first page");
    assert_eq!(numbers(Some(2), 2).await, [1], "the page behind it");
}

#[tokio::test]
async fn tiles_are_stored_once_and_found_by_their_content() {
    let Fixture { store, .. } = &Fixture::new().await;
    let lease = lease(store).await;
    let session = Some(SessionId(Uuid::from_u128(9)));
    let flat = vec![0_u8; 5000];
    let rough: Vec<u8> = ContentHash::of(b"noise").0.to_vec();
    let mut new = snapshot(&lease);
    new.tiles = vec![tile(session, 2, &rough), tile(None, 5, &flat), tile(None, -5, &flat)];
    store.save_snapshot(&new).await.expect("the lease is in force");
    new.tiles.iter_mut().for_each(|tile| tile.bytes = None);
    store.save_snapshot(&new).await.expect("its tiles are there already");

    let manifest = store.manifest(&hall(), 2).await.expect("2 exists");
    let (flat_hash, rough_hash) = (ContentHash::of(&flat), ContentHash::of(&rough));
    let key = |frame, x| TileKey { frame, x, y: -7 };
    let expected =
        [(key(None, -5), flat_hash), (key(None, 5), flat_hash), (key(session, 2), rough_hash)];
    assert_eq!(manifest, expected, "complete, by key");
    let tiles = store.tiles(&[rough_hash, flat_hash, rough_hash]).await.expect("both are there");
    let expected = [(rough_hash, rough.clone()), (flat_hash, flat), (rough_hash, rough)];
    assert_eq!(tiles, expected, "as asked for, whether it was worth compressing or not");

    let unknown = store.tiles(&[ContentHash::of(b"nothing")]).await;
    assert!(matches!(unknown, Err(Error::Damaged(_))), "a tile that a manifest names is missing");
    let missing = store.manifest(&hall(), 3).await;
    assert!(matches!(missing, Err(Error::NoSuchVersion { number: 3, .. })), "no such version");
}

#[tokio::test]
async fn the_checkpoint_is_of_the_newest_version() {
    let Fixture { store, .. } = &Fixture::new().await;
    assert_eq!(store.checkpoint(&hall()).await.expect("reading works"), None, "no version yet");
    let lease = lease(store).await;
    store.save_snapshot(&snapshot(&lease)).await.expect("the lease is in force");
    let mut new = snapshot(&lease);
    new.journal_seq = JournalSeq(8);
    new.state = b"later".to_vec();
    new.tiles = vec![tile(None, 0, b"t")];
    store.save_snapshot(&new).await.expect("the lease is in force");
    store.publish_version(&hall(), 1, 600).await.expect("1 exists");
    let checkpoint = store.checkpoint(&hall()).await.expect("reading works");
    let checkpoint = checkpoint.expect("there are versions");
    let place = (checkpoint.version, checkpoint.journal_seq, checkpoint.state.as_slice());
    assert_eq!(place, (2, JournalSeq(8), &b"later"[..]), "whatever is published");
    assert_eq!(checkpoint.tiles.len(), 1, "with its tiles");
}

#[tokio::test]
async fn a_lost_lease_saves_nothing() {
    let Fixture { store, .. } = &Fixture::new().await;
    let old = lease(store).await;
    let new = lease(store).await;
    let mut late = snapshot(&old);
    late.tiles = vec![tile(None, 0, b"t")];
    let saved = store.save_snapshot(&late).await;
    assert!(matches!(saved, Err(Error::LeaseLost)), "its holder asked again");
    let tiles = store.tiles(&[ContentHash::of(b"t")]).await;
    assert!(matches!(tiles, Err(Error::Damaged(_))), "not even the tiles");
    store.save_snapshot(&snapshot(&new)).await.expect("the lease is in force");
    store.release_all_leases().await.expect("writing works");
    let saved = store.save_snapshot(&snapshot(&new)).await;
    assert!(matches!(saved, Err(Error::LeaseLost)), "all leases are void");
}

#[tokio::test]
async fn landmarks_belong_to_versions() {
    let Fixture { store, .. } = &Fixture::new().await;
    let lease = lease(store).await;
    for landmarks in [None, Some(b"two doors".to_vec()), Some(b"two doors".to_vec())] {
        let new = NewSnapshot { landmarks, ..snapshot(&lease) };
        store.save_snapshot(&new).await.expect("the lease is in force");
    }
    let of = async |number| store.landmarks(&hall(), number).await;
    assert_eq!(of(1).await.expect("reading works"), None, "none");
    for number in [2, 3] {
        let found = of(number).await.expect("reading works");
        assert_eq!(found.as_deref(), Some(&b"two doors"[..]), "as they were saved");
    }
    assert!(matches!(of(4).await, Err(Error::NoSuchVersion { number: 4, .. })), "no such version");
}
