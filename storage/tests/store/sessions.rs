//! Sessions: opening, opening again, fencing, closing.

use meetpoint_storage::{
    Error, JournalEvent, JournalSeq, MapId, RobotId, SessionFilter, SessionId, SessionState,
};
use uuid::Uuid;

use crate::fixture::{Fixture, batch, hall, new_map, new_session};

#[tokio::test]
async fn the_same_key_finds_the_same_session() {
    let fixture = Fixture::new().await;
    let new = new_session("ann", "monday");
    let first = fixture.store.open_session(&new).await.expect("it opens");
    assert!(!first.resumed, "it was not there before");
    assert_eq!(first.session.epoch, 1, "the service counts from 1");
    assert_eq!(first.session.map_from_session, Some([1.0, -2.0, 0.5]), "the start is kept");

    let mut other_id = new.clone();
    other_id.id = SessionId(Uuid::from_u128(77));
    let again = fixture.store.open_session(&other_id).await.expect("it is found");
    assert!(again.resumed, "it was there before");
    assert_eq!(again.session, first.session, "the same session, with its first id");

    let mut other_sensors = new.clone();
    other_sensors.declaration = b"two lasers".to_vec();
    let taken = fixture.store.open_session(&other_sensors).await;
    assert!(matches!(taken, Err(Error::SessionKeyTaken { .. })), "other content, same key");
}

#[tokio::test]
async fn a_session_needs_a_map() {
    let fixture = Fixture::new().await;
    let mut new = new_session("ann", "monday");
    new.map = MapId("attic".to_owned());
    let opened = fixture.store.open_session(&new).await;
    assert!(matches!(opened, Err(Error::NoSuchMap(map)) if map.as_str() == "attic"), "no attic");
    let robot = fixture.store.robot(&new.robot).await.expect("reading works");
    assert_eq!(robot, None, "a refused session does not register its robot");
}

#[tokio::test]
async fn a_newer_epoch_fences_the_older_on_every_map() {
    let fixture = Fixture::new().await;
    fixture.store.create_map(&new_map("lab")).await.expect("the id is free");
    let old = fixture.open("ann", "monday").await;
    let bystander = fixture.open("bob", "monday").await;
    let mut new = new_session("ann", "tuesday");
    new.map = MapId("lab".to_owned());
    new.epoch = Some(7);
    let opened = fixture.store.open_session(&new).await.expect("7 is above 1");
    assert_eq!(opened.fenced, [old.id], "the robot's open session on the other map");

    let sessions =
        fixture.store.sessions(&SessionFilter::default(), None, 10).await.expect("reading works");
    let states: Vec<SessionState> = sessions.iter().map(|session| session.state).collect();
    let expected = [SessionState::Fenced, SessionState::Open, SessionState::Open];
    assert_eq!(states, expected, "only the older session of the same robot");
    assert_eq!(sessions[1], bystander, "the bystander is as it was");

    let journal =
        fixture.store.journal(&hall(), JournalSeq::START, 10, 1000).await.expect("reading works");
    let last = journal.last().expect("the journal has entries");
    assert_eq!(last.event, JournalEvent::SessionFenced { session: old.id }, "on the old map");
    assert_eq!(sessions[0].end_seq, Some(last.seq), "the session names that entry");
}

#[tokio::test]
async fn an_epoch_must_rise() {
    let fixture = Fixture::new().await;
    let mut new = new_session("ann", "monday");
    new.epoch = Some(5);
    fixture.store.open_session(&new).await.expect("5 is above 0");
    for epoch in [0, 4, 5] {
        let mut late = new_session("ann", "sunday");
        late.epoch = Some(epoch);
        let opened = fixture.store.open_session(&late).await;
        assert!(
            matches!(opened, Err(Error::SessionFenced { newest: 5 })),
            "{epoch} is not above 5"
        );
    }
    let resumed = fixture.store.open_session(&new).await.expect("found by its key");
    assert!(resumed.resumed, "an old epoch still finds its own session");
    let mut absurd = new_session("ann", "later");
    absurd.epoch = Some(u64::MAX);
    let opened = fixture.store.open_session(&absurd).await;
    assert!(matches!(opened, Err(Error::EpochTooLarge { .. })), "nothing could follow it");
}

#[tokio::test]
async fn closing_twice_is_closing_once() {
    let fixture = Fixture::new().await;
    let session = fixture.open("ann", "monday").await;
    let wrong = fixture.store.close_session(session.id, 9, 400).await;
    assert!(matches!(wrong, Err(Error::SessionFenced { newest: 1 })), "another epoch");
    let closed = fixture.store.close_session(session.id, 1, 400).await.expect("it is open");
    assert_eq!(closed.state, SessionState::Closed, "it is closed now");
    let end = fixture.store.journal_end(&hall()).await.expect("reading works");
    assert_eq!(closed.end_seq, Some(end), "by the newest entry");
    let again = fixture.store.close_session(session.id, 1, 500).await.expect("it is closed");
    assert_eq!(again, closed, "nothing changed");
    assert_eq!(fixture.store.journal_end(&hall()).await.expect("reading works"), end, "no entry");

    let nobody = SessionId(Uuid::nil());
    let unknown = fixture.store.close_session(nobody, 1, 400).await;
    assert!(matches!(unknown, Err(Error::NoSuchSession(id)) if id == nobody), "it never opened");
    fixture.open("ann", "tuesday").await;
    let still = fixture.store.close_session(session.id, 1, 600).await.expect("closed before");
    assert_eq!(still.state, SessionState::Closed, "a closed session is not fenced afterwards");
}

#[tokio::test]
async fn a_fenced_session_cannot_be_closed() {
    let fixture = Fixture::new().await;
    let old = fixture.open("ann", "monday").await;
    fixture.open("ann", "tuesday").await;
    let closed = fixture.store.close_session(old.id, old.epoch, 400).await;
    assert!(matches!(closed, Err(Error::SessionFenced { newest: 2 })), "it was ended already");
}

#[tokio::test]
async fn sessions_are_listed_in_the_order_of_opening() {
    let fixture = Fixture::new().await;
    let mut ids = Vec::new();
    for robot in ["dan", "ann", "bob"] {
        ids.push(fixture.open(robot, "monday").await.id);
    }
    let all = SessionFilter::default();
    let list = |filter: SessionFilter, after, limit| {
        let store = fixture.store.clone();
        async move {
            let page = store.sessions(&filter, after, limit).await.expect("reading works");
            page.into_iter().map(|session| session.id).collect::<Vec<_>>()
        }
    };
    assert_eq!(list(all.clone(), None, 2).await, ids[..2], "the first page");
    assert_eq!(list(all.clone(), Some(ids[1]), 2).await, ids[2..], "the page behind it");
    let of_ann = SessionFilter { map: None, robot: Some(RobotId("ann".to_owned())) };
    assert_eq!(list(of_ann, None, 9).await, ids[1..2], "one robot's");
    let of_lab = SessionFilter { map: Some(MapId("lab".to_owned())), robot: None };
    assert_eq!(list(of_lab, None, 9).await, [], "another map's");
    let nobody = Some(SessionId(Uuid::nil()));
    assert_eq!(list(all, nobody, 9).await, [], "nothing is behind what is not there");
}

#[tokio::test]
async fn open_sessions_are_told_from_others() {
    let fixture = Fixture::new().await;
    let store = fixture.store.clone();
    let dan = fixture.open("dan", "monday").await;
    let ann = fixture.open("ann", "monday").await;
    let open = async |robot: Option<&RobotId>, limit| {
        let found = store.open_sessions(&dan.map, robot, limit).await.expect("reading works");
        found.into_iter().map(|session| session.id).collect::<Vec<_>>()
    };
    assert_eq!(open(None, 9).await, [dan.id, ann.id], "in the order of opening");
    assert_eq!(open(None, 1).await, [dan.id], "no more than asked for");
    assert_eq!(open(Some(&ann.robot), 9).await, [ann.id], "one robot's");
    store.close_session(dan.id, dan.epoch, 5).await.expect("it is open");
    assert_eq!(open(None, 9).await, [ann.id], "one is closed");
    assert_eq!(open(Some(&dan.robot), 9).await, [], "it has none any more");
    let lab = MapId("lab".to_owned());
    let other = store.open_sessions(&lab, None, 9).await.expect("reading works");
    assert_eq!(other, [], "another map's");
}

#[tokio::test]
async fn a_session_survives_reopening_the_database() {
    let fixture = Fixture::new().await;
    let session = fixture.open("ann", "monday").await;
    fixture.append_one(batch(&session, 1, "a")).await.expect("1 is expected");
    let fixture = fixture.reopened().await;
    let found = fixture.store.session(session.id).await.expect("reading works");
    let found = found.expect("it is still there");
    assert_eq!(found.acked_through, 1, "with its batch");
    let stamps = (found.first_time_ns, found.last_time_ns, found.n_scans);
    assert_eq!(stamps, (Some(1), Some(1), 1), "and its figures");
}
