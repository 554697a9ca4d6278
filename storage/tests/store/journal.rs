//! Reading the journal.

use meetpoint_storage::{JournalEntry, JournalEvent, JournalSeq, MapId};

use crate::fixture::{
    Fixture, batch, batch_rejecting, hall, new_map, new_session, rejection, skip,
};

async fn whole_journal(fixture: &Fixture) -> Vec<JournalEntry> {
    let journal = fixture.store.journal(&hall(), JournalSeq::START, 1000, 1 << 20).await;
    journal.expect("reading works")
}

#[tokio::test]
async fn the_journal_tells_everything_in_order() {
    let fixture = Fixture::new().await;
    let session = fixture.open("ann", "monday").await;
    let request = batch_rejecting(&session, 1, "one", vec![rejection(4)]);
    fixture.append_one(request).await.expect("1 is expected");
    fixture.append_one(skip(&session, 2, 3)).await.expect("2 is expected");
    fixture.store.close_session(session.id, 1, 400).await.expect("it is open");
    let events: Vec<JournalEvent> =
        whole_journal(&fixture).await.into_iter().map(|entry| entry.event).collect();
    let id = session.id;
    let expected = [
        JournalEvent::MapCreated,
        JournalEvent::SessionOpened {
            session: id,
            declaration: b"one laser".to_vec(),
            map_from_session: Some([1.0, -2.0, 0.5]),
        },
        JournalEvent::Batch { session: id, number: 1, payload: b"one".to_vec(), rejected: vec![4] },
        JournalEvent::Skipped { session: id, from: 2, through: 3 },
        JournalEvent::SessionClosed { session: id },
    ];
    assert_eq!(events, expected, "what happened, as it happened");
}

#[tokio::test]
async fn a_page_ends_by_entries_or_bytes_but_has_one_at_least() {
    let fixture = Fixture::new().await;
    let session = fixture.open("ann", "monday").await;
    for number in 1..=4 {
        fixture.append_one(batch(&session, number, "0123456789")).await.expect("in order");
    }
    let entries = whole_journal(&fixture).await;
    let opened = entries[1].seq;
    let page = |after, n_entries_max, n_bytes_max| {
        let store = fixture.store.clone();
        async move {
            let page = store.journal(&hall(), after, n_entries_max, n_bytes_max).await;
            page.expect("reading works").len()
        }
    };
    assert_eq!(page(opened, 3, 1000).await, 3, "as many as asked for");
    assert_eq!(page(opened, 9, 1000).await, 4, "as many as there are");
    assert_eq!(page(opened, 9, 29).await, 2, "as many as fit");
    assert_eq!(page(opened, 9, 30).await, 3, "to the byte");
    assert_eq!(page(opened, 0, 0).await, 1, "one in any case");
    assert_eq!(page(entries[5].seq, 9, 1000).await, 0, "nothing behind the end");
}

#[tokio::test]
async fn maps_have_journals_of_their_own() {
    let fixture = Fixture::new().await;
    fixture.store.create_map(&new_map("lab")).await.expect("the id is free");
    let lab = MapId("lab".to_owned());
    let mut new = new_session("bob", "monday");
    new.map = lab.clone();
    let here = fixture.open("ann", "monday").await;
    let there = fixture.store.open_session(&new).await.expect("it opens").session;
    for (session, content) in [(&here, "here"), (&there, "there")] {
        fixture.append_one(batch(session, 1, content)).await.expect("1 is expected");
    }
    let journal = fixture.store.journal(&lab, JournalSeq::START, 10, 1000).await;
    let journal = journal.expect("reading works");
    assert_eq!(journal.len(), 3, "made, opened, one batch");
    let is_there =
        matches!(&journal[2].event, JournalEvent::Batch { payload, .. } if payload == b"there");
    assert!(is_there, "the lab's own batch");
    let end = fixture.store.journal_end(&lab).await.expect("reading works");
    assert_eq!(end, journal[2].seq, "the newest of this map");
    let nowhere = fixture.store.journal_end(&MapId("attic".to_owned())).await;
    assert_eq!(nowhere.expect("reading works"), JournalSeq::START, "no map, no entry");
}

#[tokio::test]
async fn batches_of_a_session_are_read_from_a_number_on() {
    let fixture = Fixture::new().await;
    let session = fixture.open("ann", "monday").await;
    let group = [
        batch(&session, 1, "a"),
        skip(&session, 2, 3),
        batch_rejecting(&session, 4, "d", vec![rejection(1)]),
        batch(&session, 5, "e"),
    ];
    fixture.store.append(&group).await.expect("the group commits");
    let numbers = |from_number, limit| {
        let store = fixture.store.clone();
        async move {
            let batches = store.session_batches(session.id, from_number, limit).await;
            batches
                .expect("reading works")
                .into_iter()
                .map(|batch| batch.number)
                .collect::<Vec<_>>()
        }
    };
    assert_eq!(numbers(1, 9).await, [1, 4, 5], "skipped ones are left out");
    assert_eq!(numbers(2, 1).await, [4], "one, from 2 on");
    assert!(numbers(u64::MAX, 9).await.is_empty(), "far behind the end");
    let batches = fixture.store.session_batches(session.id, 4, 1).await.expect("reading works");
    assert_eq!(
        (batches[0].payload.as_slice(), &batches[0].rejected),
        (&b"d"[..], &vec![1]),
        "whole"
    );
}

#[tokio::test]
async fn equal_runs_have_equal_digests() {
    let run = async |session_id: u128, contents: [&str; 2]| {
        let fixture = Fixture::new().await;
        let mut new = new_session("ann", "monday");
        new.id = meetpoint_storage::SessionId(uuid::Uuid::from_u128(session_id));
        new.time_ns += i64::try_from(session_id).expect("a small number");
        let session = fixture.store.open_session(&new).await.expect("it opens").session;
        for (number, content) in (1..).zip(contents) {
            fixture.append_one(batch(&session, number, content)).await.expect("in order");
        }
        fixture.store.journal_digest(&hall()).await.expect("reading works")
    };
    let first = run(1, ["a", "b"]).await;
    assert_eq!(first, run(2, ["a", "b"]).await, "ids and times do not count");
    assert_ne!(first, run(1, ["a", "c"]).await, "contents do");
    assert_ne!(first, run(1, ["b", "a"]).await, "and their order");
}
