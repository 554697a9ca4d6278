//! Imports: maps made elsewhere, in the journal once.

use meetpoint_storage::{
    ContentHash, Error, ImportRecord, JournalEvent, JournalSeq, MapId, NewImport, NewMap,
};

use crate::fixture::{Fixture, batch, hall, new_map};
use crate::versions::{lease, snapshot};

fn import(map: &str, content: &str) -> NewImport {
    let payload = content.as_bytes().to_vec();
    NewImport { map: new_map(map), content_hash: ContentHash::of(&payload), payload }
}

async fn imported(fixture: &Fixture, new: &NewImport) -> ImportRecord {
    fixture.store.import_map(new).await.expect("the map is empty or new")
}

#[tokio::test]
async fn an_import_makes_the_map_and_is_there_once() {
    let fixture = Fixture::new().await;
    let first = imported(&fixture, &import("attic", "walls")).await;
    assert!(first.is_new, "it was not there");
    assert_eq!(first.map.id, MapId("attic".to_owned()), "made on the way");
    let again = imported(&fixture, &import("attic", "walls")).await;
    assert_eq!(again, ImportRecord { is_new: false, ..first.clone() }, "the same");
    let journal = fixture.store.journal(&first.map.id, JournalSeq::START, 9, 9).await;
    let journal = journal.expect("reading works");
    let events: Vec<JournalEvent> = journal.iter().map(|entry| entry.event.clone()).collect();
    let payload = b"walls".to_vec();
    let expected = [JournalEvent::MapCreated, JournalEvent::MapImported { payload }];
    assert_eq!(events, expected, "two entries");
    assert_eq!(journal[1].seq, first.seq, "at the place told");
}

#[tokio::test]
async fn what_has_content_takes_no_other() {
    let fixture = Fixture::new().await;
    imported(&fixture, &import("hall", "walls")).await;
    let other = fixture.store.import_map(&import("hall", "doors")).await;
    assert!(matches!(other, Err(Error::MapNotEmpty(map)) if map == hall()), "imported before");
    let session = fixture.open("ann", "monday").await;
    fixture.append_one(batch(&session, 1, "a")).await.expect("1 is expected");
    assert!(!imported(&fixture, &import("hall", "walls")).await.is_new, "the same is still told");
}

#[tokio::test]
async fn observations_refuse_an_import_and_an_open_session_does_not() {
    let fixture = Fixture::new().await;
    let session = fixture.open("ann", "monday").await;
    let coarse = NewMap { resolution_m: 0.1, ..new_map("hall") };
    let refused = fixture.store.import_map(&NewImport { map: coarse, ..import("hall", "w") }).await;
    let is_other =
        matches!(refused, Err(Error::OtherResolution { resolution_m, .. }) if resolution_m == 0.05);
    assert!(is_other, "the map's cells are told");
    fixture.append_one(batch(&session, 1, "a")).await.expect("1 is expected");
    let refused = fixture.store.import_map(&import("hall", "walls")).await;
    assert!(matches!(refused, Err(Error::MapNotEmpty(_))), "a batch came first");
    let lab = fixture.open("bob", "monday").await;
    assert_eq!(lab.map, hall(), "the fixture's map");
}

#[tokio::test]
async fn the_first_version_that_tells_of_it_is_found() {
    let Fixture { store, .. } = &Fixture::new().await;
    let lease = lease(store).await;
    for seq in [1, 1, 4, 4] {
        let mut new = snapshot(&lease);
        new.journal_seq = JournalSeq(seq);
        store.save_snapshot(&new).await.expect("the lease is in force");
    }
    let first = async |seq| {
        store.first_version_with(&hall(), JournalSeq(seq)).await.expect("reading works")
    };
    assert_eq!(first(1).await, Some(1), "the first");
    assert_eq!(first(2).await, Some(3), "the first that goes so far");
    assert_eq!(first(5).await, None, "none yet");
}

#[tokio::test]
async fn a_damaged_import_is_noticed() {
    let fixture = Fixture::new().await;
    let mut new = import("attic", "walls");
    new.content_hash = ContentHash::of(b"doors");
    let attic = imported(&fixture, &new).await.map.id;
    let journal = fixture.store.journal(&attic, JournalSeq::START, 9, 9).await;
    assert!(matches!(journal, Err(Error::Damaged(_))), "the payload has another hash");
}
