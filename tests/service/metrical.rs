//! Maps of places and odometry: what it speaks against is left out where that is asked for, and the others
//! have metres.

use meetpoint_client::v1;
use v1::ingest_batch_request::Kind as Upload;
use v1::observation::Kind;

use crate::door::{Door, refused};
use crate::drive::{START_NS, observation, opened, opening};
use crate::place_door::PlaceDoor;
use crate::running::{Launch, empty_folder};

const MAP: &str = "block";
/// Two rounds of a block of four corners, and one way more.
const N_VISITS: u32 = 10;
/// Rounds may as well be as many corners that look alike: a map for every number of these.
const N_VISITS_TOO_MANY: u32 = 400;
/// Every way is so long, in metres.
const WAY_M: f64 = 8.0;

/// Tells of rounds around a block whose corners look alike, always left; with odometry or without.
async fn driven<D: Door>(
    door: &D,
    robot: &str,
    (n_visits, has_odometry): (u32, bool),
) -> v1::TreeName {
    let session = opened(door, opening(MAP, robot, &[])).await;
    let visit = |number: u32| {
        let way = v1::Pose { x_m: 0.0, y_m: WAY_M, theta_rad: std::f64::consts::FRAC_PI_2 };
        Kind::PlaceVisit(v1::PlaceVisit {
            number,
            turn: 1,
            star: "ab".to_owned(),
            length_m: (0 < number).then_some(WAY_M),
            moved: (has_odometry && 0 < number).then_some(way),
            ..Default::default()
        })
    };
    let told = |number| observation(START_NS + i64::from(number), "", visit(number));
    let batch = v1::Batch { number: 1, observations: (0..n_visits).map(told).collect() };
    let ack = door.upload(&session.id, session.epoch, Upload::Batch(batch)).await;
    assert_eq!(ack.expect("a good batch").rejected, [], "good visits");
    v1::TreeName { map: MAP.to_owned(), session: session.id, ..Default::default() }
}

async fn listed<D: PlaceDoor>(door: &D, tree: &v1::TreeName) -> v1::ListHypothesesResponse {
    let request = v1::ListHypothesesRequest { tree: Some(tree.clone()), ..Default::default() };
    door.hypotheses(request).await.expect("a travel that was told of")
}

/// Looks alone cannot tell a block of four corners from one of two.
async fn odometry_leaves_maps_out<D: PlaceDoor>(door: D) {
    door.create_map(MAP, 0.05).await.expect("a new map");
    let tree = driven(&door, "rover", (N_VISITS, true)).await;
    let all = listed(&door, &tree).await;
    assert!(all.hypotheses[0].places < 4, "the simplest by looks: {all:?}");
    let metrical = v1::TreeName { metrical: true, ..tree.clone() };
    let left = listed(&door, &metrical).await;
    let told = left.tree.clone().expect("the tree");
    assert!(0 < told.contradicted && !told.unmeasured, "{told:?}");
    assert_eq!(left.hypotheses[0].places, 4, "the simplest by odometry: {left:?}");
    let n_all = all.tree.clone().expect("the tree").consistent;
    let n_left = u64::from(told.consistent) + told.contradicted;
    assert_eq!(u64::from(n_all), n_left, "they fit, or are left out");
    let frame = |tree: &v1::TreeName| {
        let (door, tree) = (&door, tree.clone());
        async move { door.hypothesis(&tree, "").await.expect("the first").frame }
    };
    assert!(frame(&tree).await.expect("it was measured").contradicted, "two corners");
    let frame = frame(&metrical).await.expect("it was measured");
    assert!(frame.settled && !frame.contradicted && frame.chi2 < 1e-6, "{frame:?}");
    let graph = door.hypothesis_graph(&metrical, "").await.expect("it has metres");
    assert_eq!((graph.map.as_str(), &graph.hypothesis), (MAP, &left.hypotheses[0].id), "which");
    let regions: Vec<u64> = graph.regions.iter().map(|region| region.id).collect();
    assert_eq!(regions, [1, 2, 3, 4], "its places");
    assert_eq!(graph.arcs.len(), 4, "its edges");
    for arc in &graph.arcs {
        let [from, to] = [arc.line_from, arc.line_to].map(Option::unwrap_or_default);
        let apart_m = (to.x_m - from.x_m).hypot(to.y_m - from.y_m);
        assert!((apart_m - WAY_M).abs() < 1e-3 && (arc.length_m - WAY_M).abs() < 1e-9, "{arc:?}");
    }
    path_is_planned(&door, &metrical, &graph).await;
    let asserted = door.assert_true(&metrical, "").await.expect("the first of those left");
    assert!(asserted.assertions[0].in_force, "{asserted:?}");
    let after = listed(&door, &tree).await;
    assert_eq!(after.hypotheses[0].id, left.hypotheses[0].id, "it holds whatever is assumed");
    blind(&door).await;
    small_and_large(&door).await;
}

/// A path from place to place, in the words of paths on versions.
async fn path_is_planned<D: PlaceDoor>(door: &D, tree: &v1::TreeName, graph: &v1::Graph) {
    let asked = |from_place, to_place| v1::PlanPathRequest {
        map: MAP.to_owned(),
        hypothesis: "simplest".to_owned(),
        tree: Some(tree.clone()),
        from_place,
        to_place,
        ..Default::default()
    };
    let told = door.plan(asked(Some(0), Some(2))).await.expect("places of it");
    let basis = told.basis.clone().expect("what answered");
    let answer = (told.code(), basis.answered_by());
    assert_eq!(answer, (v1::PlanCode::Ok, v1::AnsweredBy::Places), "{told:?}");
    assert_eq!((&basis.hypothesis, told.warnings.len()), (&graph.hypothesis, 0), "{told:?}");
    let path = told.path.expect("a way around the block");
    assert!((path.path_length_m - 2.0 * WAY_M).abs() < 1e-9, "two sides: {path:?}");
    let regions: Vec<u64> = path.route.iter().map(|step| step.region).collect();
    assert_eq!((regions[0], regions[2], regions.len()), (1, 3, 3), "{path:?}");
    for pair in path.route.windows(2) {
        let arc = graph.arcs.iter().find(|arc| arc.id == pair[1].arc).expect("an arc of it");
        let ends = [arc.region_a, arc.region_b];
        assert!(ends.contains(&pair[0].region) && ends.contains(&pair[1].region), "{arc:?}");
    }
    let center = |id: &u64| graph.regions.iter().find(|region| region.id == *id)?.center;
    let centers: Vec<Option<v1::Point>> = regions.iter().map(center).collect();
    assert_eq!(path.points.iter().copied().map(Some).collect::<Vec<_>>(), centers, "in the frame");
    let here = door.plan(asked(None, None)).await.expect("where the robot is");
    assert_eq!(here.path.expect("it is there").route.len(), 1, "no way");
    let nowhere = door.plan(asked(Some(0), Some(9))).await.expect("an answer");
    assert_eq!(nowhere.code(), v1::PlanCode::GoalUnknown, "{nowhere:?}");
    assert!(nowhere.what_to_do.contains("4, from 0 on"), "{nowhere:?}");
    let both = v1::PlanPathRequest { map_version: 1, ..asked(Some(0), Some(1)) };
    refused(door.plan(both).await, "INVALID_FIELD");
    let alone = v1::PlanPathRequest { hypothesis: String::new(), ..asked(Some(0), Some(1)) };
    refused(door.plan(alone).await, "INVALID_FIELD");
    let other =
        v1::PlanPathRequest { hypothesis: "3-0123456789abcdef".to_owned(), ..asked(None, None) };
    refused(door.plan(other).await, "HYPOTHESIS_NOT_FOUND");
}

/// Without odometry there may be lengths; without these there are no metres.
async fn path_of_lengths<D: PlaceDoor>(door: &D, tree: &v1::TreeName) {
    let asked = |tree: &v1::TreeName| v1::PlanPathRequest {
        map: MAP.to_owned(),
        hypothesis: "simplest".to_owned(),
        tree: Some(tree.clone()),
        from_place: Some(0),
        to_place: Some(1),
        ..Default::default()
    };
    let told = door.plan(asked(tree)).await.expect("places of it");
    assert_eq!((told.code(), told.warnings.len()), (v1::PlanCode::Ok, 1), "{told:?}");
    let path = told.path.expect("a way");
    assert!((path.path_length_m - WAY_M).abs() < 1e-9 && path.points.is_empty(), "{path:?}");
    let session = opened(door, opening(MAP, "worm", &[])).await;
    let visit = |number: u32| {
        let star = "ab".to_owned();
        let visit = v1::PlaceVisit { number, turn: 1, star, ..Default::default() };
        observation(START_NS + i64::from(number), "", Kind::PlaceVisit(visit))
    };
    let batch = v1::Batch { number: 1, observations: (0..3).map(visit).collect() };
    door.upload(&session.id, session.epoch, Upload::Batch(batch)).await.expect("a good batch");
    let tree = v1::TreeName { session: session.id, ..tree.clone() };
    refused(door.plan(asked(&tree)).await, "TRAVEL_NOT_MEASURED");
}

/// Without odometry nothing is left out, and there are no metres.
async fn blind<D: PlaceDoor>(door: &D) {
    let tree = driven(door, "mole", (N_VISITS, false)).await;
    let metrical = v1::TreeName { metrical: true, ..tree.clone() };
    let told = listed(door, &metrical).await;
    let known = told.tree.clone().expect("the tree");
    assert!(known.unmeasured && known.contradicted == 0, "{known:?}");
    assert_eq!(told.hypotheses, listed(door, &tree).await.hypotheses, "the same maps");
    assert_eq!(door.hypothesis(&metrical, "").await.expect("the first").frame, None, "no metres");
    refused(door.hypothesis_graph(&metrical, "").await, "TRAVEL_NOT_MEASURED");
    refused(door.hypothesis_graph(&metrical, "3-0123456789abcdef").await, "HYPOTHESIS_NOT_FOUND");
    path_of_lengths(door, &tree).await;
}

/// A place that nobody has left, and more places than are laid out.
async fn small_and_large<D: PlaceDoor>(door: &D) {
    let tree = driven(door, "snail", (1, true)).await;
    let graph = door.hypothesis_graph(&tree, "").await.expect("a place");
    assert_eq!((graph.regions.len(), graph.arcs.len()), (1, 0), "{graph:?}");
    let metrical = v1::TreeName { metrical: true, ..tree };
    let told = listed(door, &metrical).await.tree.expect("the tree");
    assert_eq!((told.consistent, told.contradicted, told.unmeasured), (1, 0, false), "{told:?}");
    let tree = driven(door, "camel", (N_VISITS_TOO_MANY, true)).await;
    let graph = door.hypothesis_graph(&tree, "").await.expect("the simplest is small");
    assert!(graph.regions.len() <= 4, "{graph:?}");
    let metrical = v1::TreeName { metrical: true, ..tree };
    let request = v1::ListHypothesesRequest { tree: Some(metrical), ..Default::default() };
    refused(door.hypotheses(request).await, "TRAVEL_TOO_LARGE");
}

#[tokio::test(flavor = "multi_thread")]
async fn odometry_leaves_maps_out_over_grpc() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    odometry_leaves_maps_out(service.grpc()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn odometry_leaves_maps_out_over_rest() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    odometry_leaves_maps_out(service.rest()).await;
}
