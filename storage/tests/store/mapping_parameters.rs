//! Parameters of maps: decisions in the journal, of which the newest counts.

use meetpoint_storage::{Error, JournalEvent, JournalSeq, MapId, NewMappingParameters};

use crate::fixture::{Fixture, hall};

fn decision(what: &str) -> NewMappingParameters {
    NewMappingParameters { map: hall(), payload: what.as_bytes().to_vec(), time_ns: 7 }
}

#[tokio::test]
async fn the_newest_up_to_a_place_counts() {
    let fixture = Fixture::new().await;
    let none = fixture.store.mapping_parameters(&hall(), JournalSeq::END).await;
    assert_eq!(none.expect("reading works"), None, "nobody decided");
    let mut ends = Vec::new();
    for what in ["unsure", "sure", ""] {
        fixture.store.decide_mapping_parameters(&decision(what)).await.expect("a map");
        ends.push(fixture.store.journal_end(&hall()).await.expect("reading works"));
    }
    let fixture = fixture.reopened().await;
    for (what, &end) in ["unsure", "sure", ""].iter().zip(&ends) {
        let found = fixture.store.mapping_parameters(&hall(), end).await.expect("reading works");
        assert_eq!(found, Some(what.as_bytes().to_vec()), "as it was then");
    }
    let journal = fixture.store.journal(&hall(), ends[0], 9, 99).await.expect("reading works");
    let expected = JournalEvent::MappingParametersDecided { payload: b"sure".to_vec() };
    assert_eq!(journal[0].event, expected, "the journal has them");
}

#[tokio::test]
async fn only_of_maps() {
    let fixture = Fixture::new().await;
    let elsewhere = NewMappingParameters { map: MapId("nowhere".to_owned()), ..decision("sure") };
    let refused = fixture.store.decide_mapping_parameters(&elsewhere).await;
    assert!(matches!(refused, Err(Error::NoSuchMap(_))), "no map");
}
