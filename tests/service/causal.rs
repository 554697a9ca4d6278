//! Causal schemas of a travel, and the regions that paths of its maps bound.

use meetpoint_client::v1;
use v1::ingest_batch_request::Kind as Upload;
use v1::observation::Kind;

use crate::door::{Door, refused};
use crate::drive::{START_NS, observation, opened, opening};
use crate::place_door::PlaceDoor;
use crate::running::{Launch, empty_folder, meetpoint};

const MAP: &str = "floor";
/// Fig. 1 (a) of the paper as one sees it who begins at A from the south: D looks just like A, and E is not B.
const TRAVEL: [(u32, &str); 5] = [(0, "abb"), (1, "abab"), (2, "ab"), (1, "abb"), (1, "ab")];

async fn told<D: Door>(door: &D, robot: &str, travel: &[(u32, &str)]) -> v1::TreeName {
    let session = opened(door, opening(MAP, robot, &[])).await;
    let visit = |(number, &(turn, star)): (u32, &(u32, &str))| {
        let star = star.to_owned();
        let visit = v1::PlaceVisit { number, turn, star, ..Default::default() };
        observation(START_NS + i64::from(number), "", Kind::PlaceVisit(visit))
    };
    let observations = (0_u32..).zip(travel).map(visit).collect();
    let batch = v1::Batch { number: 1, observations };
    let ack = door.upload(&session.id, session.epoch, Upload::Batch(batch)).await;
    assert_eq!(ack.expect("a good batch").rejected, [], "good visits");
    v1::TreeName { map: MAP.to_owned(), session: session.id, ..Default::default() }
}

async fn schemas_are_told<D: PlaceDoor>(door: D, url: &str) {
    door.create_map(MAP, 0.05).await.expect("a new map");
    refused(door.schemas(MAP, "").await, "NOTHING_TRAVELLED");
    refused(door.schemas("nowhere", "").await, "MAP_NOT_FOUND");
    let tree = told(&door, "rover", &TRAVEL).await;
    let known = door.schemas(MAP, "").await.expect("a travel that was told of");
    assert_eq!((known.visits, known.session.as_str()), (5, tree.session.as_str()), "{known:?}");
    assert_eq!(known.views[0].seen, "abb", "{known:?}");
    assert_eq!(known.views[0].facing(), v1::CausalFacing::Inward, "{known:?}");
    let apart: Vec<u32> = known
        .schemas
        .iter()
        .filter(|schema| schema.tells_apart)
        .map(|schema| schema.number)
        .collect();
    assert_eq!(apart, [1], "to B and to E: {known:?}");
    let schema = &known.schemas[1];
    assert_eq!(schema.action(), v1::CausalAction::Travel, "{schema:?}");
    let visits: Vec<&[u32]> = schema.outcomes.iter().map(|outcome| &outcome.visits[..]).collect();
    assert_eq!(visits, [[0], [3]], "from A and from D");
    let pair = v1::ToldApart { visit: 3, earlier: 0, travels: 1 };
    assert_eq!((known.told_apart, known.told_apart_count), (vec![pair], 1), "one travel on");
    let asked = ["hypotheses", "--map", MAP, "--schemas", "--server", url];
    let shown = meetpoint(&asked).output().expect("the binary runs");
    let text = String::from_utf8_lossy(&shown.stdout);
    assert!(text.contains("visits 0 and 3 look alike and are not"), "{text}");
    regions_are_told(&door).await;
}

/// East along a street with a blind alley on either side, and back.
async fn regions_are_told<D: PlaceDoor>(door: &D) {
    // Through a crossing, to the end, back, down south, back and up north.
    let travel = [(0, "a"), (0, "abab"), (2, "a"), (0, "abab"), (3, "a"), (0, "abab"), (2, "a")];
    let tree = told(door, "walker", &travel).await;
    let map = door.hypothesis(&tree, "").await.expect("the simplest");
    assert_eq!(map.regions.len(), map.paths.len(), "one each: {map:?}");
    let along =
        map.paths.iter().position(|path| path.places.len() == 3 && path.places.contains(&0));
    let regions = &map.regions[along.expect("the street through the crossing")];
    let sides = [&regions.right[..], &regions.left[..]].concat();
    assert_eq!((sides.len(), regions.around.len()), (2, 0), "one on each side: {map:?}");
    assert!(regions.right.len() == 1 && regions.left.len() == 1, "one on each side: {map:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn schemas_are_told_over_grpc() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    schemas_are_told(service.grpc(), &service.url()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn schemas_are_told_over_rest() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    schemas_are_told(service.rest(), &service.url()).await;
}
