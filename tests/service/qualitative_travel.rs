//! The travel of a robot that is told step by step, as maps of places: with a compass and without, and where home is
//! marked.

use meetpoint_client::v1;
use meetpoint_places::{World, is_isomorphic};
use meetpoint_sim::{NxWorld, nx_worlds};

use crate::door::Door;
use crate::place_door::PlaceDoor;
use crate::qualitative_door::{QualitativeDoor, QualitativeGrpc};
use crate::rover::{Eyes, Rover, Senses};
use crate::running::{Launch, Running, empty_folder};

const MAP: &str = "floor";
/// Robots that are not done after so many firings never will be.
const N_FIRINGS_MAX: u64 = 6000;

fn world(name: &str) -> NxWorld {
    nx_worlds().into_iter().find(|world| world.name == name).expect("an environment")
}

/// Explores all of it, step by step over gRPC.
async fn explored<'a>(service: &Running, world: &'a NxWorld, senses: Senses) -> Rover<'a> {
    let (door, nx) = (service.grpc(), QualitativeGrpc::new(service.channel()));
    door.create_map(MAP, 0.1).await.expect("a new map");
    let mut rover = Rover::with(&door, MAP, world, senses).await;
    let begin = v1::BeginQualitativeExplorationRequest {
        session: rover.session.id.clone(),
        compass: senses.has_compass,
        ..Default::default()
    };
    nx.begin(begin).await.expect("a good request");
    loop {
        rover.fire(&door).await;
        let step = nx.step(&rover.session.id).await.expect("it fired");
        if !rover.carry_out(&step) {
            return rover;
        }
        assert!(step.firings < N_FIRINGS_MAX, "an end: {step:?}");
    }
}

/// Its arrivals are visits: the true map fits them, over both protocols, and can be planned on.
#[tokio::test(flavor = "multi_thread")]
async fn its_arrivals_are_visits_with_a_compass_and_without() {
    for has_compass in [true, false] {
        let world = world("block");
        let data = empty_folder();
        let service = Launch::at(data.path()).start();
        let senses = Senses { has_compass, ..Senses::of(Eyes::Ring) };
        let rover = explored(&service, &world, senses).await;
        let session = rover.session.id.clone();
        let tree = v1::TreeName { map: MAP.into(), session, planar: true, ..Default::default() };
        let (door, rest) = (service.grpc(), service.rest());
        let request = v1::ListHypothesesRequest { tree: Some(tree.clone()), ..Default::default() };
        let told = door.hypotheses(request.clone()).await.expect("it arrived somewhere");
        assert_eq!(rest.hypotheses(request).await, Ok(told.clone()), "the same over REST");
        let known = told.tree.expect("the tree");
        assert!(known.by_steps && !known.truncated && known.visits_left_out == 0, "{known:?}");
        let truth = World::from_drawing(world.graph).expect("a graph");
        let size = (truth.map().n_places(), truth.map().n_edges());
        let is_whole = |map: &&v1::Hypothesis| {
            (map.places as usize, map.edges as usize, map.unexplored) == (size.0, size.1, 0)
        };
        let whole = told.hypotheses.iter().find(is_whole).expect("the true map fits");
        assert!(size.0 < whole.visits.len(), "it came to places again: {whole:?}");
        let schemas = door.schemas(MAP, &tree.session).await.expect("it arrived somewhere");
        assert!(schemas.by_steps && schemas.visits == known.visits, "{schemas:?}");
        let path = v1::PlanPathRequest {
            map: MAP.into(),
            hypothesis: whole.id.clone(),
            tree: Some(tree.clone()),
            from_place: Some(0),
            to_place: Some(1),
            ..Default::default()
        };
        let path = door.plan(path).await.expect("places of it").path.expect("a way");
        assert!(1.0 < path.path_length_m && !path.points.is_empty(), "in metres: {path:?}");
    }
}

/// A laser draws what it saw of the places where it arrived.
#[tokio::test(flavor = "multi_thread")]
async fn its_places_have_maps() {
    let world = world("tee and ends");
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    let rover = explored(&service, &world, Senses::of(Eyes::Laser)).await;
    let session = rover.session.id.clone();
    let tree = v1::TreeName { map: MAP.into(), session, planar: true, ..Default::default() };
    let (door, rest) = (service.grpc(), service.rest());
    let map = door.hypothesis(&tree, "").await.expect("the simplest");
    for place in map.places {
        let seen = door.seen(&tree, (place.number, None)).await.expect("it was scanned");
        assert!(3 < seen.scans && seen.png.starts_with(b"\x89PNG"), "place {}", place.number);
        assert_eq!(seen.star_told.len(), place.gateways.len(), "place {}", place.number);
        assert_eq!(rest.seen(&tree, (place.number, None)).await, Ok(seen), "the same over REST");
    }
}

/// Where home is marked the robot tells that it sees it, and one place is home.
#[tokio::test(flavor = "multi_thread")]
async fn home_is_known_where_it_is_marked() {
    let world = world("block");
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    let senses = Senses { has_home: true, ..Senses::of(Eyes::Ring) };
    let rover = explored(&service, &world, senses).await;
    let (nx, rest) = (QualitativeGrpc::new(service.channel()), service.rest());
    let told = nx.known(&rover.session.id).await.expect("it fired");
    assert_eq!(rest.known(&rover.session.id).await, Ok(told.clone()), "the same over REST");
    let n_home = told.places.iter().filter(|place| place.home).count();
    assert_eq!(n_home, 1, "{told:?}");
    let truth = World::from_drawing(world.graph).expect("a graph");
    let found = rover.guide.explorer().graph();
    assert!(is_isomorphic(found.map(), truth.map()), "the true graph");
    let size = (truth.map().n_places(), truth.map().n_edges());
    assert_eq!((told.places.len(), told.edges.len()), size, "{told:?}");
}
