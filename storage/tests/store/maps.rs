//! Maps and robots: making, finding, listing.

use meetpoint_storage::{Error, MapId, NewRobot, RobotId};

use crate::fixture::{Fixture, hall, new_map};

#[tokio::test]
async fn a_map_is_made_once() {
    let fixture = Fixture::new().await;
    let map = fixture.store.map(&hall()).await.expect("reading works").expect("`hall` is there");
    assert_eq!(map.resolution_m, 0.05, "the resolution is kept to the bit");
    assert!(map.publishes_automatically, "a new map publishes what is made");
    assert_eq!((map.published_version, map.latest_version), (0, 0), "there is no version yet");
    let again = fixture.store.create_map(&new_map("hall")).await;
    assert!(matches!(again, Err(Error::MapExists(id)) if id == hall()), "the id is taken");
    let unknown = fixture.store.map(&MapId("attic".to_owned())).await.expect("reading works");
    assert_eq!(unknown, None, "there is no attic");
}

#[tokio::test]
async fn maps_are_listed_by_id() {
    let fixture = Fixture::new().await;
    for id in ["lab", "attic"] {
        fixture.store.create_map(&new_map(id)).await.expect("the id is free");
    }
    let first = fixture.store.maps(None, 2).await.expect("reading works");
    let ids: Vec<&str> = first.iter().map(|map| map.id.as_str()).collect();
    assert_eq!(ids, ["attic", "hall"], "in the order of ids, not of making");
    let rest = fixture.store.maps(Some(&hall()), 2).await.expect("reading works");
    let ids: Vec<&str> = rest.iter().map(|map| map.id.as_str()).collect();
    assert_eq!(ids, ["lab"], "the page behind `hall`");
}

#[tokio::test]
async fn a_resolution_that_is_no_length_is_refused() {
    let fixture = Fixture::new().await;
    for resolution_m in [0.0, -0.05, f64::NAN] {
        let mut new = new_map("flat");
        new.resolution_m = resolution_m;
        let made = fixture.store.create_map(&new).await;
        assert!(matches!(made, Err(Error::Internal(_))), "{resolution_m} m is no cell");
    }
    let map = fixture.store.map(&MapId("flat".to_owned())).await.expect("reading works");
    assert_eq!(map, None, "nothing is left of the attempts");
}

#[tokio::test]
async fn a_robot_is_registered_by_hand_or_by_its_first_session() {
    let fixture = Fixture::new().await;
    let new =
        NewRobot { id: RobotId("ann".to_owned()), display_name: "Ann".to_owned(), time_ns: 1 };
    let ann = fixture.store.create_robot(&new).await.expect("the id is free");
    assert_eq!(ann.epoch, 0, "it has not run yet");
    let again = fixture.store.create_robot(&new).await;
    assert!(matches!(again, Err(Error::RobotExists(id)) if id == new.id), "the id is taken");
    fixture.open("bob", "monday").await;
    let robots = fixture.store.robots(None, 10).await.expect("reading works");
    let epochs: Vec<(&str, u64)> =
        robots.iter().map(|robot| (robot.id.as_str(), robot.epoch)).collect();
    assert_eq!(epochs, [("ann", 0), ("bob", 1)], "by id, with their epochs");
    let behind = fixture.store.robots(Some(&new.id), 10).await.expect("reading works");
    assert_eq!(behind.len(), 1, "the page behind `ann`");
    let bob = fixture.store.robot(&RobotId("bob".to_owned())).await.expect("reading works");
    assert_eq!(bob.as_ref(), behind.first(), "alone as in the list");
}
