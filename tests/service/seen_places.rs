//! What a robot's laser saw of the places of its travel, hung on them.

use meetpoint_client::v1;
use meetpoint_geometry::Point2;
use meetpoint_sim::{Building, Robot, Tick};
use v1::observation::Kind;

use crate::door::refused;
use crate::drive::{SimulatedDrive, observation, opened, opening, send};
use crate::place_door::PlaceDoor;
use crate::running::{Launch, empty_folder, meetpoint};

const MAP: &str = "crossing";
/// Two corridors of 2 m that cross.
const CROSSING: &str = "
    ###########
    ##### #####
    ##### #####
    ##### #####
    #         #
    ##### #####
    ##### #####
    ##### #####
    ###########";
const CHARACTER_M: f64 = 2.0;
/// Where they do, in the building's frame, in metres.
const MIDDLE_M: [f64; 2] = [11.0, 9.0];
/// Ticks of a batch.
const N_TICKS: usize = 10;

/// Up from the south, over the crossing, and on to the east.
fn drive() -> SimulatedDrive {
    let building = Building::from_drawing(CROSSING, CHARACTER_M).expect("a drawing");
    let way = [[11.0, 3.0], MIDDLE_M, [18.0, 9.0]].map(|[x_m, y_m]| Point2::new(x_m, y_m));
    SimulatedDrive::by_way_of(&building, Robot::INDOOR, &way, 1)
}

fn visit(number: u32, turn: u32, star: &str) -> Kind {
    let star = star.to_owned();
    Kind::PlaceVisit(v1::PlaceVisit { number, turn, star, ..Default::default() })
}

/// The tick at which it is nearest to where the corridors cross.
fn at_crossing(drive: &SimulatedDrive) -> usize {
    let [x_m, y_m] = MIDDLE_M;
    let away_m = |tick: &Tick| (tick.truth.position() - Point2::new(x_m, y_m)).norm();
    let ticks = drive.ticks.iter().enumerate();
    ticks.min_by(|(_, a), (_, b)| away_m(a).total_cmp(&away_m(b))).expect("ticks").0
}

/// Tells of a dead end where it begins, of the crossing when it is there, and of a dead end.
fn batches(drive: &SimulatedDrive) -> Vec<v1::Batch> {
    let middle = at_crossing(drive);
    let mut batches = drive.batches(N_TICKS);
    let last = drive.ticks.len() - 1;
    for (number, (at, turn, star)) in (0..).zip([(0, 0, "a"), (middle, 0, "abab"), (last, 3, "a")])
    {
        let told = observation(drive.ticks[at].stamp_ns, "", visit(number, turn, star));
        batches[at / N_TICKS].observations.push(told);
    }
    batches
}

async fn places_have_maps<D: PlaceDoor>(door: D, url: &str) {
    door.create_map(MAP, 0.05).await.expect("a new map");
    let drive = drive();
    let request = opening(MAP, "rover", std::slice::from_ref(&drive.sensor));
    let session = opened(&door, request).await;
    send(&door, &session, &batches(&drive)).await;
    let tree = v1::TreeName { map: MAP.to_owned(), session: session.id, ..Default::default() };
    let seen = door.seen(&tree, (1, None)).await.expect("it was scanned");
    assert_eq!((seen.place, &seen.visits[..], seen.visit), (1, &[1][..], 1), "{seen:?}");
    assert!(
        seen.png.starts_with(b"\x89PNG") && 20 < seen.scans && !seen.cut_short,
        "{}",
        seen.scans
    );
    let grid = seen.grid.clone().expect("a frame");
    let side_m = |cells: u32| f64::from(cells) * grid.resolution_m;
    assert!(8.0 < side_m(grid.width) && side_m(grid.width) <= 16.5, "bounded: {grid:?}");
    let v1::Pose { x_m, y_m, .. } = seen.robot.expect("somewhere");
    assert!(x_m.hypot(y_m) < 0.1, "the robot is at the origin: {:?}", seen.robot);
    let star = seen.star.clone().expect("a crossing");
    let core = star.core.expect("somewhere");
    // The robot looked up the drawing when it began, which is along x in this frame.
    let truth = drive.ticks[at_crossing(&drive)].truth;
    let expected_m = [MIDDLE_M[1] - truth.y_m, truth.x_m - MIDDLE_M[0]];
    let off_m = (core.x_m - expected_m[0]).hypot(core.y_m - expected_m[1]);
    assert!(off_m < 0.25, "the middle of the crossing: {core:?} for {expected_m:?}");
    assert_eq!(star.gateways.len(), 4, "{star:?}");
    // Of the arm on its left it saw but a part, in passing.
    let widths_m = star.gateways.iter().map(|gateway| gateway.width_m);
    assert!(widths_m.clone().all(|width_m| 1.2 < width_m && width_m < 2.3), "{star:?}");
    assert!(3 <= widths_m.filter(|width_m| (width_m - 2.0).abs() < 0.1).count(), "{star:?}");
    assert!(star.gateways.iter().all(|gateway| gateway.to_place.is_none()), "not known here");
    let came_in_by = seen.came_in_by.expect("it came from the south") as usize;
    // It looked along x when it began, and came straight.
    let behind = star.gateways[came_in_by].left.expect("a wall");
    assert!(behind.x_m < core.x_m - 0.5, "{behind:?}");
    assert_eq!((&seen.star_found[..], &seen.star_told[..]), ("abab", "abab"), "the same");
    let around: Vec<u32> = seen.states.iter().map(|state| state.around).collect();
    assert_eq!(around, [3, 4, 1, 2], "two paths that pass: {:?}", seen.states);
    let turns: Vec<(&[u32], &[u32])> =
        seen.states.iter().map(|state| (&state.right[..], &state.left[..])).collect();
    assert_eq!(turns[0], (&[2][..], &[4][..]), "one to each side: {turns:?}");
    let again = door.seen(&tree, (1, Some(1))).await.expect("the same visit");
    assert_eq!(again, seen, "the same bits");

    refused(door.seen(&tree, (7, None)).await, "PLACE_NOT_FOUND");
    refused(door.seen(&tree, (1, Some(0))).await, "INVALID_FIELD");
    let blind = opened(&door, opening(MAP, "mole", &[])).await;
    let told = observation(1, "", visit(0, 0, "abab"));
    send(&door, &blind, &[v1::Batch { number: 1, observations: vec![told] }]).await;
    let blind = v1::TreeName { session: blind.id, ..tree.clone() };
    refused(door.seen(&blind, (0, None)).await, "PLACE_NOT_SCANNED");

    let folder = empty_folder();
    let drawing = folder.path().join("place.png");
    let path = drawing.to_str().expect("a plain path");
    let asked = ["hypotheses", "--map", MAP, "--session", &tree.session, "--place", "1"];
    let shown = meetpoint(&asked).args(["--server", url, "--png", path]).output();
    let shown = shown.expect("the binary runs");
    let text = String::from_utf8_lossy(&shown.stdout);
    assert!(text.contains("was told as abab"), "{text}{}", String::from_utf8_lossy(&shown.stderr));
    assert!(std::fs::read(&drawing).expect("it was saved").starts_with(b"\x89PNG"), "a PNG");
}

#[tokio::test(flavor = "multi_thread")]
async fn places_have_maps_over_grpc() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    places_have_maps(service.grpc(), &service.url()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn places_have_maps_over_rest() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    places_have_maps(service.rest(), &service.url()).await;
}
