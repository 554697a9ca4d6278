//! Batches that tell of visits are found among the others, and decisions are kept in order.

use meetpoint_storage::{
    AppendRequest, BatchPayload, JournalEvent, JournalSeq, MapId, NewEntry, NewHypothesisDecision,
    SessionRecord,
};

use crate::fixture::{Fixture, batch, hall};

/// A batch that tells of a visit.
fn visiting(session: &SessionRecord, number: u64) -> AppendRequest {
    let mut request = batch(session, number, &format!("visit {number}"));
    if let NewEntry::Batch { n_visits, .. } = &mut request.entry {
        *n_visits = 1;
    }
    request
}

fn numbers(batches: &[BatchPayload]) -> Vec<u64> {
    batches.iter().map(|batch| batch.number).collect()
}

#[tokio::test]
async fn visits_are_found_among_scans() {
    let fixture = Fixture::new().await;
    let (first, second) = (fixture.open("anna", "a").await, fixture.open("bert", "b").await);
    let store = &fixture.store;
    let travelled = store.travelled_session(&hall()).await.expect("reading works");
    assert_eq!(travelled, None, "nobody told of a visit");
    // More than one statement takes.
    for number in 1..=40 {
        let is_visit = number % 2 == 0;
        let request =
            if is_visit { visiting(&first, number) } else { batch(&first, number, "scan") };
        fixture.append_one(request).await.expect("the next number");
    }
    let again = fixture.append_one(visiting(&first, 2)).await.expect("it is there");
    assert_eq!(again.seq, None, "a batch sent again is applied once");
    let group: Vec<_> = (1..=20).map(|number| visiting(&second, number)).collect();
    let answers = store.append(&group).await.expect("the group commits");
    assert!(answers.iter().all(Result::is_ok), "all in one group: {answers:?}");

    let found = store.visit_batches(first.id, 0, 3).await.expect("reading works");
    assert_eq!(numbers(&found), [2, 4, 6], "a page of them");
    assert_eq!(found[0].payload, b"visit 2", "with what they hold");
    let rest = store.visit_batches(first.id, 36, 99).await.expect("reading works");
    assert_eq!(numbers(&rest), [38, 40], "behind a number");
    let of_second = store.visit_batches(second.id, 0, 99).await.expect("reading works");
    assert_eq!(of_second.len(), 20, "its own");
    let newest = store.travelled_session(&hall()).await.expect("reading works");
    assert_eq!(newest, Some(second.id), "opened last");
}

#[tokio::test]
async fn decisions_are_kept_in_order() {
    let fixture = Fixture::new().await;
    let decision = |payload: &str| NewHypothesisDecision {
        map: hall(),
        payload: payload.as_bytes().to_vec(),
        time_ns: 7,
    };
    for payload in ["asserted", "undone"] {
        fixture.store.decide_hypothesis(&decision(payload)).await.expect("it is recorded");
    }
    let fixture = fixture.reopened().await;
    let kept = fixture.store.hypothesis_decisions(&hall()).await.expect("reading works");
    assert_eq!(kept, [b"asserted".to_vec(), b"undone".to_vec()], "in order, after a restart");
    let journal = fixture.store.journal(&hall(), JournalSeq::START, 9, 999).await;
    let journal = journal.expect("reading works");
    let last = journal.last().map(|entry| entry.event.clone());
    let expected = JournalEvent::HypothesisDecided { payload: b"undone".to_vec() };
    assert_eq!(last, Some(expected), "an entry of the journal");
    let elsewhere = NewHypothesisDecision { map: MapId("attic".into()), ..decision("asserted") };
    let refused = fixture.store.decide_hypothesis(&elsewhere).await;
    refused.expect_err("there is no such map");
}
