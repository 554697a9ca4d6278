//! Appending: numbers, duplicates, gaps, skips, closed and fenced sessions, groups.

use meetpoint_storage::{Appended, JournalSeq, Refusal, SessionId};
use uuid::Uuid;

use crate::fixture::{Fixture, batch, batch_rejecting, hall, rejection, skip};

#[tokio::test]
async fn numbers_count_from_one_without_gaps() {
    let fixture = Fixture::new().await;
    let session = fixture.open("ann", "monday").await;
    let gap = fixture.append_one(batch(&session, 2, "b")).await;
    assert_eq!(gap, Err(Refusal::SequenceGap { expected: 1 }), "1 is missing");
    let zero = fixture.append_one(batch(&session, 0, "z")).await;
    assert_eq!(zero, Err(Refusal::SequenceGap { expected: 1 }), "0 is no number");
    let first = fixture.append_one(batch(&session, 1, "a")).await.expect("1 is expected");
    let second = fixture.append_one(batch(&session, 2, "b")).await.expect("2 is expected");
    assert!(first.seq < second.seq, "the journal has them in order");
    assert_eq!(second.acked_through, 2, "both are durable");
    let absurd = fixture.append_one(batch(&session, u64::MAX, "z")).await;
    assert_eq!(absurd, Err(Refusal::SequenceGap { expected: 3 }), "far too large");
}

#[tokio::test]
async fn a_duplicate_is_acknowledged_with_what_was_rejected_at_first() {
    let fixture = Fixture::new().await;
    let session = fixture.open("ann", "monday").await;
    let request = batch_rejecting(&session, 1, "a", vec![rejection(0), rejection(3)]);
    let first = fixture.append_one(request).await.expect("1 is expected");
    assert!(first.seq.is_some(), "it is new");
    let again = fixture.append_one(batch(&session, 1, "a")).await.expect("it is a duplicate");
    let expected =
        Appended { seq: None, acked_through: 1, rejections: vec![rejection(0), rejection(3)] };
    assert_eq!(again, expected, "the verdict of the first time stands");
    let other = fixture.append_one(batch(&session, 1, "x")).await;
    assert_eq!(other, Err(Refusal::ContentMismatch { number: 1 }), "other content");
    let record = fixture.store.session(session.id).await.expect("reading works");
    let record = record.expect("the session exists");
    assert_eq!((record.n_scans, record.n_rejected), (1, 2), "counted once");
}

#[tokio::test]
async fn a_skip_makes_a_hole() {
    let fixture = Fixture::new().await;
    let session = fixture.open("ann", "monday").await;
    fixture.append_one(batch(&session, 1, "a")).await.expect("1 is expected");
    let early = fixture.append_one(skip(&session, 3, 4)).await;
    assert_eq!(early, Err(Refusal::SequenceGap { expected: 2 }), "2 is missing");
    let hole = fixture.append_one(skip(&session, 2, 5)).await.expect("2 is expected");
    assert_eq!(hole.acked_through, 5, "skipped numbers are acknowledged");
    let again = fixture.append_one(skip(&session, 2, 5)).await.expect("it is a duplicate");
    assert_eq!(again, Appended { seq: None, acked_through: 5, rejections: vec![] }, "same skip");
    let other = fixture.append_one(skip(&session, 2, 4)).await;
    let refusal = Refusal::InvalidSkip { from: 2, through: 4, expected: 6 };
    assert_eq!(other, Err(refusal), "another skip at the same place");
    for number in [2, 3, 5] {
        let late = fixture.append_one(batch(&session, number, "b")).await;
        assert_eq!(late, Err(Refusal::ContentMismatch { number }), "{number} was given up");
    }
    fixture.append_one(batch(&session, 6, "f")).await.expect("6 is expected");
}

#[tokio::test]
async fn a_skip_of_nothing_or_of_everything_is_refused() {
    let fixture = Fixture::new().await;
    let session = fixture.open("ann", "monday").await;
    for through in [0, u64::MAX, (1 << 53) + 1] {
        let answer = fixture.append_one(skip(&session, 1, through)).await;
        let refusal = Refusal::InvalidSkip { from: 1, through, expected: 1 };
        assert_eq!(answer, Err(refusal), "through {through}");
    }
    let over_a_batch = {
        fixture.append_one(batch(&session, 1, "a")).await.expect("1 is expected");
        fixture.append_one(skip(&session, 1, 1)).await
    };
    let refusal = Refusal::InvalidSkip { from: 1, through: 1, expected: 2 };
    assert_eq!(over_a_batch, Err(refusal), "a batch is there");
}

#[tokio::test]
async fn a_closed_session_still_acknowledges_what_it_has() {
    let fixture = Fixture::new().await;
    let session = fixture.open("ann", "monday").await;
    fixture.append_one(batch(&session, 1, "a")).await.expect("1 is expected");
    fixture.store.close_session(session.id, 1, 400).await.expect("it is open");
    let again = fixture.append_one(batch(&session, 1, "a")).await.expect("it is durable");
    assert_eq!(again.acked_through, 1, "the robot may forget it");
    let more = fixture.append_one(batch(&session, 2, "b")).await;
    assert_eq!(more, Err(Refusal::SessionClosed), "nothing more was to come");
    let hole = fixture.append_one(skip(&session, 2, 3)).await;
    assert_eq!(hole, Err(Refusal::SessionClosed), "not even a hole");
}

#[tokio::test]
async fn a_fenced_session_takes_nothing() {
    let fixture = Fixture::new().await;
    let old = fixture.open("ann", "monday").await;
    fixture.append_one(batch(&old, 1, "a")).await.expect("1 is expected");
    let new = fixture.open("ann", "tuesday").await;
    for number in [1, 2] {
        let answer = fixture.append_one(batch(&old, number, "a")).await;
        assert_eq!(answer, Err(Refusal::SessionFenced), "number {number}");
    }
    let mut stranger = batch(&new, 1, "a");
    stranger.epoch = 1;
    let answer = fixture.append_one(stranger).await;
    assert_eq!(answer, Err(Refusal::SessionFenced), "the older process in the new session");
}

#[tokio::test]
async fn one_refusal_does_not_disturb_the_group() {
    let fixture = Fixture::new().await;
    let ann = fixture.open("ann", "monday").await;
    let bob = fixture.open("bob", "monday").await;
    let mut nobody = batch(&ann, 1, "n");
    nobody.session = SessionId(Uuid::nil());
    let group = [
        batch(&ann, 1, "a1"),
        batch(&bob, 2, "b2"),
        nobody,
        batch(&ann, 2, "a2"),
        batch(&ann, 1, "a1"),
        batch(&ann, 2, "other"),
        skip(&ann, 3, 9),
        batch(&ann, 4, "a4"),
        batch(&bob, 1, "b1"),
    ];
    let answers = fixture.store.append(&group).await.expect("the group commits");
    let base = answers[0].as_ref().expect("the first is fine").seq.expect("it is new").0;
    let new = |place, acked_through| {
        let seq = Some(JournalSeq(base + place));
        Ok(Appended { seq, acked_through, rejections: vec![] })
    };
    let expected = [
        new(0, 1),
        Err(Refusal::SequenceGap { expected: 1 }),
        Err(Refusal::NoSuchSession),
        new(1, 2),
        Ok(Appended { seq: None, acked_through: 2, rejections: vec![] }),
        Err(Refusal::ContentMismatch { number: 2 }),
        new(2, 9),
        Err(Refusal::ContentMismatch { number: 4 }),
        new(3, 1),
    ];
    assert_eq!(answers, expected, "each on its own, in order, later ones seeing the earlier");
    let fixture = fixture.reopened().await;
    let end = fixture.store.journal_end(&hall()).await.expect("reading works");
    assert_eq!(end, JournalSeq(base + 3), "the four accepted ones are durable");
}

#[tokio::test]
async fn a_group_of_many_sessions_and_rows_keeps_its_order() {
    let fixture = Fixture::new().await;
    let mut sessions = Vec::new();
    for robot in 0..40 {
        sessions.push(fixture.open(&format!("robot-{robot}"), "monday").await);
    }
    let group: Vec<_> = (1..=5)
        .flat_map(|number| sessions.iter().map(move |session| batch(session, number, "x")))
        .collect();
    let answers = fixture.store.append(&group).await.expect("the group commits");
    let seqs: Vec<i64> =
        answers.iter().flatten().filter_map(|answer| answer.seq).map(|seq| seq.0).collect();
    assert_eq!(seqs.len(), group.len(), "every batch is new");
    assert!(seqs.is_sorted_by(|a, b| a + 1 == *b), "the journal has the order of the requests");
    for session in &sessions {
        let record = fixture.store.session(session.id).await.expect("reading works");
        let acked = record.map(|record| (record.acked_through, record.last_time_ns));
        assert_eq!(acked, Some((5, Some(5))), "each session got its five");
    }
}

#[tokio::test]
async fn an_empty_group_is_fine() {
    let fixture = Fixture::new().await;
    let answers = fixture.store.append(&[]).await.expect("nothing can go wrong");
    assert_eq!(answers, [], "no request, no answer");
}
