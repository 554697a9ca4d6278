//! Costs: decisions in the journal, counted by the map, made on top of what the decider knew.

use meetpoint_storage::{Error, JournalEvent, JournalSeq, MapId, NewCostDecision};

use crate::fixture::{Fixture, hall};

fn decision(revision: u64, what: &str) -> NewCostDecision {
    NewCostDecision { map: hall(), revision, payload: what.as_bytes().to_vec(), time_ns: 7 }
}

#[tokio::test]
async fn decisions_are_counted_and_kept_in_order() {
    let fixture = Fixture::new().await;
    for (revision, what) in ["close", "open"].into_iter().enumerate() {
        let new = decision(revision as u64, what);
        let made = fixture.store.decide_cost(&new).await.expect("nobody else decided");
        assert_eq!(made, revision as u64 + 1, "counted up");
    }
    let fixture = fixture.reopened().await;
    let map = fixture.store.map(&hall()).await.expect("reading works").expect("it was made");
    assert_eq!(map.cost_revision, 2, "two decisions");
    let all = fixture.store.cost_decisions(&hall(), JournalSeq::START).await;
    let all = all.expect("reading works");
    let payloads: Vec<&[u8]> = all.iter().map(|record| record.payload.as_slice()).collect();
    assert_eq!(payloads, [b"close".as_slice(), b"open".as_slice()], "in order");
    assert!(all.iter().all(|record| record.time_ns == 7), "when they came");
    let later = fixture.store.cost_decisions(&hall(), all[0].seq).await.expect("reading works");
    assert_eq!(later, all[1..], "those behind the first");
    let journal = fixture.store.journal(&hall(), all[0].seq, 9, 99).await.expect("reading works");
    let expected = JournalEvent::CostDecided { payload: b"open".to_vec() };
    assert_eq!(journal[0].event, expected, "the journal has them");
}

#[tokio::test]
async fn who_knew_less_decides_again() {
    let fixture = Fixture::new().await;
    fixture.store.decide_cost(&decision(0, "close")).await.expect("the first");
    let late = fixture.store.decide_cost(&decision(0, "draw")).await;
    assert!(
        matches!(late, Err(Error::CostsChanged { map, revision: 1 }) if map == hall()),
        "another was first"
    );
    let elsewhere = NewCostDecision { map: MapId("nowhere".to_owned()), ..decision(0, "close") };
    let refused = fixture.store.decide_cost(&elsewhere).await;
    assert!(matches!(refused, Err(Error::NoSuchMap(_))), "no map");
    let all = fixture.store.cost_decisions(&hall(), JournalSeq::START).await;
    assert_eq!(all.expect("reading works").len(), 1, "nothing of what was refused");
}
