//! Decisions about explorations are kept in order.

use meetpoint_storage::{JournalEvent, JournalSeq, MapId, NewExplorationDecision};

use crate::fixture::{Fixture, hall};

#[tokio::test]
async fn decisions_are_kept_in_order() {
    let fixture = Fixture::new().await;
    let decision = |payload: &str| NewExplorationDecision {
        map: hall(),
        payload: payload.as_bytes().to_vec(),
        time_ns: 7,
    };
    for payload in ["begun", "marked"] {
        fixture.store.decide_exploration(&decision(payload)).await.expect("it is recorded");
    }
    let fixture = fixture.reopened().await;
    let kept = fixture.store.exploration_decisions(&hall()).await.expect("reading works");
    assert_eq!(kept, [b"begun".to_vec(), b"marked".to_vec()], "in order, after a restart");
    let hypotheses = fixture.store.hypothesis_decisions(&hall()).await.expect("reading works");
    assert!(hypotheses.is_empty(), "decisions of another kind: {hypotheses:?}");
    let journal = fixture.store.journal(&hall(), JournalSeq::START, 9, 999).await;
    let last = journal.expect("reading works").last().map(|entry| entry.event.clone());
    let expected = JournalEvent::ExplorationDecided { payload: b"marked".to_vec() };
    assert_eq!(last, Some(expected), "an entry of the journal");
    let elsewhere = NewExplorationDecision { map: MapId("attic".into()), ..decision("begun") };
    fixture.store.decide_exploration(&elsewhere).await.expect_err("there is no such map");
}
