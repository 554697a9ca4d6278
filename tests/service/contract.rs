//! The contract of ingest: what is acknowledged, what is refused, and with which number.

use meetpoint_client::v1;
use v1::ingest_batch_request::Kind as Upload;

use crate::door::{Answer, Door, refused};
use crate::drive::{mark, opened, opening};
use crate::running::{Launch, empty_folder};

/// Sends a mark as batch `number`.
async fn send<D: Door>(
    door: &D,
    session: &v1::Session,
    number: u64,
    label: &str,
) -> Answer<v1::Ack> {
    door.upload(&session.id, session.epoch, Upload::Batch(mark(number, label))).await
}

async fn skip<D: Door>(
    door: &D,
    session: &v1::Session,
    from: u64,
    through: u64,
) -> Answer<v1::Ack> {
    let skip = v1::Skip { from, through, reason: "the spool was full".into() };
    door.upload(&session.id, session.epoch, Upload::Skip(skip)).await
}

/// An ack that rejects nothing.
fn ack(acked_through: u64) -> v1::Ack {
    v1::Ack { acked_through, rejected: Vec::new() }
}

async fn numbers_are_contiguous<D: Door>(door: &D, session: &v1::Session) {
    let gap = refused(send(door, session, 2, "early").await, "SEQUENCE_GAP");
    assert_eq!(gap.fact("expected_number"), "1", "{gap:?}");
    assert_eq!(send(door, session, 1, "one").await, Ok(ack(1)), "the first");
    assert_eq!(send(door, session, 2, "two").await, Ok(ack(2)), "the next");
    let gap = refused(send(door, session, 9, "nine").await, "SEQUENCE_GAP");
    assert_eq!(gap.fact("expected_number"), "3", "{gap:?}");
    refused(send(door, session, 0, "none").await, "INVALID_FIELD");
}

async fn duplicates_are_acknowledged_and_not_applied<D: Door>(door: &D, session: &v1::Session) {
    let before = door.session(&session.id).await.expect("it was opened");
    assert_eq!(send(door, session, 2, "two").await, Ok(ack(2)), "the newest again");
    assert_eq!(send(door, session, 1, "one").await, Ok(ack(2)), "an old one: cumulative");
    let after = door.session(&session.id).await.expect("it was opened");
    assert_eq!(before.acked_through, after.acked_through, "nothing was added");
    let other = refused(send(door, session, 2, "too").await, "BATCH_CONTENT_MISMATCH");
    assert_eq!(other.fact("number"), "2", "{other:?}");
}

async fn holes_are_declared<D: Door>(door: &D, session: &v1::Session) {
    let gap = refused(skip(door, session, 4, 6).await, "SEQUENCE_GAP");
    assert_eq!(gap.fact("expected_number"), "3", "{gap:?}");
    assert_eq!(skip(door, session, 3, 6).await, Ok(ack(6)), "3 to 6 will never come");
    assert_eq!(skip(door, session, 3, 6).await, Ok(ack(6)), "the same again");
    refused(send(door, session, 4, "late").await, "BATCH_CONTENT_MISMATCH");
    refused(skip(door, session, 7, 6).await, "INVALID_FIELD");
    assert_eq!(send(door, session, 7, "seven").await, Ok(ack(7)), "after the hole");
    let long = v1::Skip { from: 8, through: 8, reason: "x".repeat(201) };
    let long = door.upload(&session.id, session.epoch, Upload::Skip(long)).await;
    assert_eq!(refused(long, "INVALID_FIELD").fact("field"), "skip.reason", "named");
}

async fn a_newer_epoch_fences<D: Door>(door: &D, session: &v1::Session) {
    let wrong = door.upload(&session.id, 99, Upload::Batch(mark(8, "eight"))).await;
    refused(wrong, "SESSION_FENCED");
    let next = v1::OpenSessionRequest {
        client_key: "after a cold start".into(),
        epoch: 2,
        ..opening("contract", "rover", &[])
    };
    let newer = opened(door, next).await;
    let fenced = refused(send(door, session, 8, "eight").await, "SESSION_FENCED");
    assert!(fenced.retry_after.is_none(), "trying again would not help");
    let state = door.session(&session.id).await.expect("it was opened").state;
    assert_eq!(state, i32::from(v1::SessionState::Fenced), "the older one ended");
    let stale = v1::OpenSessionRequest {
        client_key: "of before".into(),
        ..opening("contract", "rover", &[])
    };
    let stale = refused(door.open(stale).await, "SESSION_FENCED");
    assert_eq!(stale.fact("newest_epoch"), "2", "{stale:?}");
    assert_eq!(send(door, &newer, 1, "one").await, Ok(ack(1)), "the newer one goes on");
    refused(door.close(&newer.id, 1).await, "SESSION_FENCED");
}

async fn closing_twice_is_fine<D: Door>(door: &D) {
    let session = opened(door, opening("contract", "closer", &[])).await;
    assert_eq!(send(door, &session, 1, "one").await, Ok(ack(1)), "open");
    for _ in 0..2 {
        let closed = door.close(&session.id, session.epoch).await.expect("closing is fine");
        assert_eq!(closed.state, i32::from(v1::SessionState::Closed), "closed");
    }
    refused(send(door, &session, 2, "two").await, "SESSION_CLOSED");
    let nobody = v1::Session { id: "0199d3a6-6ac5-7c4e-9d51-2d9a3f1f3c11".into(), ..session };
    refused(send(door, &nobody, 1, "one").await, "SESSION_NOT_FOUND");
    refused(door.close(&nobody.id, 1).await, "SESSION_NOT_FOUND");
}

async fn a_batch_too_many<D: Door>(door: &D) {
    let session = opened(door, opening("contract", "talker", &[])).await;
    let one = mark(1, "x").observations;
    let many = v1::Batch { number: 1, observations: vec![one[0].clone(); 4097] };
    let many = door.upload(&session.id, session.epoch, Upload::Batch(many)).await;
    assert_eq!(refused(many, "INVALID_FIELD").fact("field"), "batch.observations", "named");
    let long = mark(1, &"x".repeat(600)).observations;
    let heavy = v1::Batch { number: 1, observations: vec![long[0].clone(); 2000] };
    let heavy = door.upload(&session.id, session.epoch, Upload::Batch(heavy)).await;
    assert_eq!(refused(heavy, "MESSAGE_TOO_LARGE").fact("limit_bytes"), "1048576", "told");
    assert_eq!(send(door, &session, 1, "one").await, Ok(ack(1)), "nothing was kept of them");
}

async fn the_contract<D: Door>(door: &D) {
    door.create_map("contract", 0.05).await.expect("a new map");
    let session = opened(door, opening("contract", "rover", &[])).await;
    numbers_are_contiguous(door, &session).await;
    duplicates_are_acknowledged_and_not_applied(door, &session).await;
    holes_are_declared(door, &session).await;
    a_newer_epoch_fences(door, &session).await;
    closing_twice_is_fine(door).await;
    a_batch_too_many(door).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn over_grpc() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    the_contract(&service.grpc()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn over_rest() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    the_contract(&service.rest()).await;
}
