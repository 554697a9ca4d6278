//! NX explores as the service tells it, step by step; restarts and decisions in between.

use meetpoint_client::v1;
use meetpoint_places::{Gateway, PlaceMap, World, is_isomorphic};
use meetpoint_sim::{NxWorld, nx_worlds};

use crate::door::{Door, refused};
use crate::drive::{SimulatedDrive, mark, opened, opening, send};
use crate::qualitative_door::{QualitativeDoor, QualitativeGrpc};
use crate::rover::{Eyes, Rover};
use crate::running::{Launch, Running, empty_folder, meetpoint};

const MAP: &str = "floor";
/// Robots that are not done after so many firings never will be.
const N_FIRINGS_MAX: u64 = 6000;
/// Firings after which the service is killed.
const KILLS: [u64; 3] = [90, 200, 330];

fn world(name: &str) -> NxWorld {
    nx_worlds().into_iter().find(|world| world.name == name).expect("an environment")
}

fn beginning(session: &str) -> v1::BeginQualitativeExplorationRequest {
    v1::BeginQualitativeExplorationRequest {
        session: session.to_owned(),
        compass: true,
        ..Default::default()
    }
}

/// Whether the places and edges that were told are those of a map, by their numbers.
fn is_told(told: &v1::GetQualitativeExplorationResponse, map: &PlaceMap) -> bool {
    let leads_to = |place: &v1::DistinctivePlace| {
        (0..).zip(&place.directions).all(|(index, direction)| {
            let gateway = Gateway { place: meetpoint_places::PlaceId(place.number), index };
            let known = map.leads_to(gateway).map(|to| (to.place.0, u32::from(to.index)));
            known == direction.leads_to.map(|to| (to.place, to.direction))
        })
    };
    told.places.len() == map.n_places()
        && told.edges.len() == map.n_edges()
        && told.places.iter().all(leads_to)
}

/// Closed loop over gRPC until nothing is left to be explored, killed in between.
#[tokio::test(flavor = "multi_thread")]
async fn a_robot_is_told_until_nothing_is_left() {
    for name in ["tee and ends", "block"] {
        let world = world(name);
        let data = empty_folder();
        let mut service = Launch::at(data.path()).start();
        let mut door = service.grpc();
        door.create_map(MAP, 0.1).await.expect("a new map");
        let mut rover = Rover::new(&door, MAP, &world, Eyes::Ring).await;
        let id = rover.session.id.clone();
        let mut nx = QualitativeGrpc::new(service.channel());
        refused(nx.step(&id).await, "NOTHING_FIRED");
        let begun = nx.begin(beginning(&id)).await.expect("a good request");
        assert_eq!((begun.cones, begun.folded, begun.compass), (16, false, true), "{begun:?}");
        let mut n_firings = 0;
        loop {
            rover.fire(&door).await;
            n_firings += 1;
            let step = nx.step(&id).await.expect("it fired");
            assert_eq!(step.firings, n_firings, "all of them are in it: {step:?}");
            assert!(rover.is_as_guided(&step), "{:?}: {step:?}", rover.guide.next());
            if !rover.carry_out(&step) {
                break;
            }
            assert!(n_firings < N_FIRINGS_MAX, "an end: {step:?}");
            if KILLS.contains(&n_firings) {
                let before = nx.known(&id).await.expect("it fired");
                service.kill();
                service = Launch::at(data.path()).start();
                door = service.grpc();
                nx = QualitativeGrpc::new(service.channel());
                assert_eq!(nx.known(&id).await.expect("it fired"), before, "from the journal");
            }
        }
        assert!(KILLS[2] < n_firings, "{name}: it was killed three times in {n_firings} firings");
        told_at_the_end(&service, &world, &rover).await;
    }
}

/// The true graph, over both protocols, on the command line and as a drawing.
async fn told_at_the_end(service: &Running, world: &NxWorld, rover: &Rover<'_>) {
    let (nx, rest, id) =
        (QualitativeGrpc::new(service.channel()), service.rest(), &rover.session.id);
    let told = nx.known(id).await.expect("it fired");
    assert_eq!(rest.known(id).await, Ok(told.clone()), "the same over REST");
    let step = told.step.expect("a step");
    assert_eq!(step.state(), v1::QualitativeState::Complete, "{step:?}");
    assert_eq!(rest.step(id).await, Ok(step), "the same over REST");
    let truth = World::from_drawing(world.graph).expect("a graph");
    let found = rover.guide.explorer().graph();
    assert!(is_isomorphic(found.map(), truth.map()), "{}: the true graph", world.name);
    assert!(is_told(&told, found.map()), "all of it: {told:?}");
    assert_eq!(told.agenda, [], "nothing is left");
    let lengths = told.edges.iter().map(|edge| edge.length_m.unwrap_or_default());
    assert!(lengths.clone().all(|length_m| 1.0 < length_m.mean.unwrap_or(0.0)), "{told:?}");
    let outlook = told.outlook.clone().expect("it fired");
    assert!(outlook.open_directions as usize == outlook.directions.len(), "{outlook:?}");
    let at = told.whereabouts.expect("somewhere");
    assert_eq!(at.kind(), v1::TopologicalWhereaboutsKind::AtPlace, "{at:?}");
    for drawing in [nx.graph_drawing(id).await, rest.graph_drawing(id).await] {
        assert!(drawing.expect("a drawing").starts_with(b"\x89PNG"), "a PNG");
    }
    let (url, folder) = (service.url(), empty_folder());
    let drawing = folder.path().join("graph.png");
    let path = drawing.to_str().expect("a plain path");
    let asked = ["places", "--session", id, "--server", &url];
    let shown = meetpoint(&asked).args(["--png", path]).output().expect("the binary runs");
    let text = String::from_utf8_lossy(&shown.stdout);
    assert!(shown.status.success(), "{}", String::from_utf8_lossy(&shown.stderr));
    assert!(text.contains("nothing is left to be explored"), "{text}");
    assert!(std::fs::read(&drawing).expect("it was saved").starts_with(b"\x89PNG"), "a PNG");
}

/// Beams are folded into cones, which is told.
#[tokio::test(flavor = "multi_thread")]
async fn a_laser_that_looks_all_around_will_do() {
    let world = world("tee and ends");
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    let (door, nx) = (service.grpc(), QualitativeGrpc::new(service.channel()));
    door.create_map(MAP, 0.1).await.expect("a new map");
    let mut rover = Rover::new(&door, MAP, &world, Eyes::Laser).await;
    let id = rover.session.id.clone();
    let begun = nx.begin(beginning(&id)).await.expect("a good request");
    assert_eq!((begun.cones, begun.folded, &begun.sensor[..]), (16, true, "eyes"), "{begun:?}");
    loop {
        rover.fire(&door).await;
        let step = nx.step(&id).await.expect("it fired");
        if !rover.carry_out(&step) {
            break;
        }
        assert!(step.firings < N_FIRINGS_MAX, "an end: {step:?}");
    }
    let told = nx.known(&id).await.expect("it fired");
    let truth = World::from_drawing(world.graph).expect("a graph");
    let found = (told.places.len(), told.edges.len());
    assert_eq!(found, (truth.map().n_places(), truth.map().n_edges()), "{told:?}");
    assert_eq!(told.step.expect("a step").state(), v1::QualitativeState::Complete, "all of it");
}

/// People begin, select and mark; what they decided is there after a restart.
async fn people_decide<D: Door, Q: QualitativeDoor>(launch: impl AsyncFn() -> (D, Q)) {
    let world = world("tee and ends");
    let (door, nx) = launch().await;
    door.create_map(MAP, 0.1).await.expect("a new map");
    let mut rover = Rover::new(&door, MAP, &world, Eyes::Ring).await;
    let id = rover.session.id.clone();
    let begin = |sensor: &str, corridor_width_m| v1::BeginQualitativeExplorationRequest {
        sensor: sensor.to_owned(),
        corridor_width_m,
        ..beginning(&id)
    };
    refused(nx.begin(begin("nose", None)).await, "SENSOR_NOT_FOUND");
    refused(nx.begin(begin("", Some(9.0))).await, "INVALID_FIELD");
    let far =
        v1::BeginQualitativeExplorationRequest { rehearsal_edges_max: Some(9), ..beginning(&id) };
    refused(nx.begin(far).await, "INVALID_FIELD");
    refused(nx.home(&id, None, false).await, "NOTHING_FIRED");
    nx.begin(begin("eyes", Some(2.2))).await.expect("a good request");
    let mut known = None;
    while known.is_none() {
        rover.fire(&door).await;
        let step = nx.step(&id).await.expect("it fired");
        assert!(rover.carry_out(&step) && step.firings < N_FIRINGS_MAX, "{step:?}");
        known = nx.known(&id).await.ok().filter(|told| !told.places.is_empty());
    }
    let known = known.expect("a first place");
    assert!(!known.places[0].home && !known.agenda.is_empty(), "{known:?}");
    refused(nx.home(&id, Some(7), false).await, "PLACE_NOT_FOUND");
    assert_eq!(nx.home(&id, None, false).await, Ok(0), "the one where it was last");
    let selected = nx.select(&id, v1::TravelSelection::MostRotation).await.expect("a rule");
    assert_eq!(selected.selection(), v1::TravelSelection::MostRotation, "{selected:?}");
    assert_eq!(selected.corridor_width_m, 2.2, "{selected:?}");

    let (door, nx) = launch().await;
    let after = nx.known(&id).await.expect("it fired");
    assert_eq!(after.exploration, Some(selected), "as it was decided");
    assert!(after.places[0].home, "{after:?}");
    assert_eq!(nx.home(&id, Some(0), true).await, Ok(0), "taken back");
    assert!(!nx.known(&id).await.expect("it fired").places[0].home, "it is not home any more");
    rover.fire(&door).await;
    let anew = nx.begin(beginning(&id)).await.expect("a good request");
    assert_eq!(anew.begun_after_batch, anew.read_through, "from now on: {anew:?}");
    refused(nx.step(&id).await, "NOTHING_FIRED");
    rover.fire(&door).await;
    let step = nx.step(&id).await.expect("it fired");
    assert_eq!((step.firings, step.state()), (1, v1::QualitativeState::Starting), "{step:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn people_decide_over_grpc() {
    let data = empty_folder();
    let running = std::cell::RefCell::new(None::<Running>);
    people_decide(async || {
        let service = restarted(&running, data.path());
        (service.0, QualitativeGrpc::new(service.2))
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn people_decide_over_rest() {
    let data = empty_folder();
    let running = std::cell::RefCell::new(None::<Running>);
    people_decide(async || {
        let service = restarted(&running, data.path());
        (service.1.clone(), service.1)
    })
    .await;
}

/// Kills the service, if it runs, and starts it again.
fn restarted(
    running: &std::cell::RefCell<Option<Running>>,
    data: &std::path::Path,
) -> (crate::grpc_door::GrpcDoor, crate::rest_door::RestDoor, tonic::transport::Channel) {
    if let Some(before) = running.take() {
        before.kill();
    }
    let service = Launch::at(data).start();
    let doors = (service.grpc(), service.rest(), service.channel());
    running.replace(Some(service));
    doors
}

/// Sessions that cannot explore so.
async fn others_are_refused(door: &impl Door, nx: &impl QualitativeDoor) {
    door.create_map(MAP, 0.1).await.expect("a new map");
    refused(nx.step("0199d3a6-6ac5-7c4e-9d51-2d9a3f1f3c11").await, "SESSION_NOT_FOUND");
    refused(nx.step("nobody").await, "INVALID_FIELD");
    let blind = opened(door, opening(MAP, "blind", &[])).await;
    refused(nx.step(&blind.id).await, "NOT_ALL_AROUND");
    refused(nx.known(&blind.id).await, "NOT_ALL_AROUND");
    let drive = SimulatedDrive::through_the_hall(1);
    let ahead = opened(door, opening(MAP, "ahead", &[drive.sensor])).await;
    refused(nx.begin(beginning(&ahead.id)).await, "NOT_ALL_AROUND");
    let silent = opened(door, opening(MAP, "silent", &[Eyes::Ring.sensor()])).await;
    send(door, &silent, &[mark(1, "home")]).await;
    refused(nx.known(&silent.id).await, "NOTHING_FIRED");
}

#[tokio::test(flavor = "multi_thread")]
async fn others_are_refused_over_both() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    others_are_refused(&service.grpc(), &QualitativeGrpc::new(service.channel())).await;
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    others_are_refused(&service.rest(), &service.rest()).await;
}
