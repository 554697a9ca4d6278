//! The ledger of closures: replaced by every job, but for what people decided.

use meetpoint_storage::{
    ClosureEnds, ClosureFilter, ClosureId, ClosureRecord, ClosureSwitch, JournalEvent, MapId,
    NewClosure, NewRelaxation, SessionId, Store,
};
use uuid::Uuid;

use crate::fixture::{Fixture, hall};
use crate::relaxations::{claimed, found};

/// A closure from a moment of a session to one of another, or of the same.
fn closure((from, to): (SessionId, SessionId), id: u128, is_accepted: bool) -> NewClosure {
    let at = i64::try_from(id).expect("a small number");
    let payload = vec![u8::from(is_accepted)];
    NewClosure {
        id: ClosureId(Uuid::from_u128(id)),
        ends: ends((from, to), at),
        is_accepted,
        payload,
    }
}

fn ends((from_session, to_session): (SessionId, SessionId), at: i64) -> ClosureEnds {
    ClosureEnds { from_session, from_ns: at, to_session, to_ns: at + 100 }
}

fn switch(id: u128, is_off: bool) -> ClosureSwitch {
    let id = ClosureId(Uuid::from_u128(id));
    ClosureSwitch { map: hall(), id, is_off, payload: b"why".to_vec(), time_ns: 7 }
}

async fn listed(store: &Store, filter: ClosureFilter) -> Vec<ClosureRecord> {
    store.closures(&hall(), filter, None, 99).await.expect("reading works")
}

fn ids(records: &[ClosureRecord]) -> Vec<u128> {
    records.iter().map(|record| record.id.0.as_u128()).collect()
}

/// Two sessions with closures 1 and 2, 3 between the two, and 4; 2 is refused.
async fn two_sessions(fixture: &Fixture) -> (SessionId, SessionId, NewRelaxation) {
    let first = fixture.open("anna", "a").await.id;
    let second = fixture.open("bert", "b").await.id;
    let job = claimed(&fixture.store).await;
    let closures = vec![
        closure((first, first), 1, true),
        closure((first, first), 2, false),
        closure((first, second), 3, true),
        closure((second, second), 4, true),
    ];
    let sessions = vec![first, second];
    let new = NewRelaxation { sessions, closures, ..found(&job, "straight") };
    fixture.store.record_relaxation(&new).await.expect("it is held");
    (first, second, new)
}

#[tokio::test]
async fn listed_by_pages_and_filters() {
    let fixture = Fixture::new().await;
    let (first, second, new) = two_sessions(&fixture).await;
    let store = &fixture.store;
    let all = listed(store, ClosureFilter::default()).await;
    assert_eq!(ids(&all), [1, 2, 3, 4], "session by session");
    assert_eq!((all[1].is_accepted, all[1].is_off, all[1].job), (false, false, new.job), "as told");
    let session = Some(second);
    let of_second = ClosureFilter { session, ..ClosureFilter::default() };
    assert_eq!(ids(&listed(store, of_second).await), [3, 4], "of one session, on either side");
    assert_eq!(all[2].ends, ends((first, second), 3), "what it joins");
    let refused = ClosureFilter { session: Some(first), is_accepted: Some(false) };
    assert_eq!(ids(&listed(store, refused).await), [2], "and of one verdict");
    let page = store.closures(&hall(), ClosureFilter::default(), Some(all[1].position), 1).await;
    assert_eq!(ids(&page.expect("reading works")), [3], "the next page");
    let elsewhere = MapId("attic".to_owned());
    let none = store.closures(&elsewhere, ClosureFilter::default(), None, 9).await;
    assert_eq!(none.expect("reading works"), [], "of another map");
}

#[tokio::test]
async fn what_is_off_stays_in_the_list_until_it_is_on() {
    let fixture = Fixture::new().await;
    let (first, second, new) = two_sessions(&fixture).await;
    let store = &fixture.store;
    let end = store.journal_end(&hall()).await.expect("reading works");
    let off = store.switch_closure(&switch(3, true)).await.expect("writing works");
    assert!(off.is_some_and(|record| record.is_off), "it is off");
    store.switch_closure(&switch(3, true)).await.expect("writing works");
    let entries = store.journal(&hall(), end, 9, 99).await.expect("reading works");
    let entries: Vec<JournalEvent> = entries.into_iter().map(|entry| entry.event).collect();
    let expected = JournalEvent::ClosureSwitched { payload: b"why".to_vec() };
    assert_eq!(entries, [expected], "decided once");
    let off = store.closures_off(&hall()).await.expect("reading works");
    assert_eq!(off, [ends((first, second), 3)], "its moments");
    let nothing = store.switch_closure(&switch(9, true)).await.expect("writing works");
    assert_eq!(nothing, None, "no such closure");

    let closures = vec![closure((first, first), 1, false)];
    let again = NewRelaxation { sessions: vec![first], closures, ..new };
    store.record_relaxation(&again).await.expect("it is held");
    let Fixture { store, .. } = &fixture.reopened().await;
    let now = listed(store, ClosureFilter::default()).await;
    assert_eq!(ids(&now)[..2], [3, 4], "what is off, and what the job did not touch");
    assert_eq!((ids(&now).len(), now[2].is_accepted), (3, false), "1 was judged anew: {now:?}");
    let on = store.switch_closure(&switch(3, false)).await.expect("writing works");
    assert!(on.is_some_and(|record| !record.is_off), "it is on");
    assert_eq!(store.closures_off(&hall()).await.expect("reading works"), [], "none");
    let one = store.closure(&hall(), ClosureId(Uuid::from_u128(3))).await.expect("reading works");
    assert!(one.is_some_and(|record| !record.is_off), "and looked at by itself");
}
