//! A door closes: the map changes after a robot drove by, and a query tells which cells.

use meetpoint_client::v1;
use meetpoint_geometry::{Point2, Pose};
use meetpoint_sim::{Building, Robot};
use serde_json::Value;

use crate::door::{Door, finished, refused};
use crate::drive::{SimulatedDrive, opened, opening, pose, send};
use crate::running::{Launch, Running, empty_folder, meetpoint};

/// Two rooms, a door of a metre between them; a character is a quarter of a metre.
pub(crate) const ROOMS: &str = "
    ################################
    #..............#...............#
    #..............#...............#
    #.....C........#.......D.......#
    #..............#...............#
    #..............1...............#
    #..............1...............#
    #..............1...............#
    #..............1...............#
    #..............#...............#
    #......B...A...#...............#
    #..............#...............#
    #..............#...............#
    ################################";
/// Edge of a character, in metres.
pub(crate) const CHARACTER_M: f64 = 0.25;
/// Digit of the door.
pub(crate) const DOOR: char = '1';

pub(crate) fn drive(building: &Building, names: &str, seed: u64) -> SimulatedDrive {
    let places: Vec<Point2<f64>> = building.places(names).expect("drawn places");
    SimulatedDrive::by_way_of(building, Robot::INDOOR, &places, seed)
}

/// Sends a drive that begins somewhere in the map; the version that holds it all.
pub(crate) async fn driven_from<D: Door>(
    door: &D,
    robot: &str,
    drive: &SimulatedDrive,
    map_from_start: Pose,
) -> u64 {
    let kind = Some(v1::start::Kind::Known(pose(map_from_start)));
    let mut request = opening("rooms", robot, std::slice::from_ref(&drive.sensor));
    request.start = Some(v1::Start { kind });
    let session = opened(door, request).await;
    send(door, &session, &drive.batches(40)).await;
    finished(door, &session).await.complete_in_version
}

fn asked(since: u64) -> v1::ListChangesRequest {
    v1::ListChangesRequest { map: "rooms".to_owned(), since, ..Default::default() }
}

/// The door's cells in the map's frame, as a box, in metres.
pub(crate) fn door_m(building: &Building, building_from_map: Pose) -> [f64; 4] {
    let frame = building.info().frame;
    let centers = building.door(DOOR).iter().map(|&cell| frame.center_of(cell));
    let places: Vec<_> = centers.map(|at| building_from_map.inverse() * at).collect();
    let of = |axis: usize, pick: fn(f64, f64) -> f64, start: f64| {
        places.iter().map(|at| at[axis]).fold(start, pick)
    };
    let (low, high) = (f64::INFINITY, f64::NEG_INFINITY);
    [of(0, f64::min, low), of(1, f64::min, low), of(0, f64::max, high), of(1, f64::max, high)]
}

async fn a_door_that_closes_is_told<D: Door>(door: &D) -> (u64, u64) {
    let mut building = Building::from_drawing(ROOMS, CHARACTER_M).expect("a drawing");
    door.create_map("rooms", 0.05).await.expect("a new map");
    let first = drive(&building, "BADAC", 3);
    let since = driven_from(door, "first", &first, Pose::IDENTITY).await;
    assert!(building.set_door(DOOR, true), "it is drawn");
    let second = drive(&building, "BCABCAB", 5);
    let map_from_start = first.building_from_start.inverse() * second.building_from_start;
    let version = driven_from(door, "second", &second, map_from_start).await;
    let reply = door.changes(asked(since)).await.expect("two versions");
    assert_eq!((reply.since, reply.map_version), (since, version), "both are named");
    let largest = reply.changes.first().expect("a change");
    assert_eq!(largest.kind, i32::from(v1::ChangeKind::Appeared), "{reply:?}");
    let [min_x_m, min_y_m, max_x_m, max_y_m] = door_m(&building, first.building_from_start);
    let found = largest.bounding_box.expect("a box");
    // The nearer side of the door's characters is seen, to a cell or two.
    assert!(min_x_m - 0.3 < found.min_x_m && found.max_x_m < max_x_m + 0.3, "{found:?}");
    assert!((found.min_y_m - (min_y_m - 0.125)).abs() < 0.2, "{found:?}");
    assert!((found.max_y_m - (max_y_m + 0.125)).abs() < 0.2, "{found:?}");
    let at = largest.position.expect("a place");
    assert!((found.min_x_m..=found.max_x_m).contains(&at.x_m), "within it: {at:?}");
    assert!(15 <= largest.cells, "a metre in cells of 5 cm: {largest:?}");
    assert!(largest.cells <= reply.cells_appeared, "of all that appeared");

    let back = v1::ListChangesRequest { version: since, ..asked(version) };
    let back = door.changes(back).await.expect("any two versions");
    assert_eq!(back.changes[0].kind, i32::from(v1::ChangeKind::Vanished), "the other way around");
    assert_eq!(back.changes[0].bounding_box, largest.bounding_box, "the same cells");
    assert_eq!(back.cells_vanished, reply.cells_appeared, "all of them");
    let same = door.changes(asked(version)).await.expect("the same version twice");
    assert_eq!((same.changes, same.cells_appeared), (vec![], 0), "nothing changed");
    limits(door, since, &reply).await;
    (since, version)
}

async fn limits<D: Door>(door: &D, since: u64, reply: &v1::ListChangesResponse) {
    let cells = u32::try_from(reply.changes[0].cells).expect("a small change");
    let large = v1::ListChangesRequest { cells_min: cells, ..asked(since) };
    let large = door.changes(large).await.expect("the largest alone");
    assert!(large.changes.iter().all(|change| u64::from(cells) <= change.cells), "{large:?}");
    let far = v1::BoundingBox { min_x_m: 90.0, min_y_m: 90.0, max_x_m: 91.0, max_y_m: 91.0 };
    let far = v1::ListChangesRequest { bounding_box: Some(far), ..asked(since) };
    assert_eq!(door.changes(far).await.expect("a good box").changes, [], "nobody was there");
    let mut paged = Vec::new();
    let mut request = v1::ListChangesRequest { page_size: 1, ..asked(since) };
    loop {
        let page = door.changes(request.clone()).await.expect("a page");
        paged.extend(page.changes);
        if page.next_page_token.is_empty() {
            break;
        }
        request.page_token = page.next_page_token;
    }
    assert_eq!(paged, reply.changes, "pages are the whole");
    refused(door.changes(asked(0)).await, "INVALID_FIELD");
    refused(door.changes(asked(9999)).await, "VERSION_NOT_FOUND");
    let elsewhere = v1::ListChangesRequest { map: "nowhere".to_owned(), ..asked(1) };
    refused(door.changes(elsewhere).await, "MAP_NOT_FOUND");
    let wrong = v1::ListChangesRequest { page_token: "x".to_owned(), ..asked(since) };
    refused(door.changes(wrong).await, "INVALID_FIELD");
}

fn by_command(service: &Running, since: u64) -> Value {
    let (url, since) = (service.url(), since.to_string());
    let words = ["changes", "rooms", "--since", &since, "--json", "--server", &url];
    let done = meetpoint(&words).output().expect("the binary under test starts");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    serde_json::from_slice(&done.stdout).expect("JSON")
}

#[tokio::test(flavor = "multi_thread")]
async fn a_door_that_closes_over_grpc() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    let (since, version) = a_door_that_closes_is_told(&service.grpc()).await;
    let body = by_command(&service, since);
    assert_eq!(body["map_version"], version, "{body}");
    assert_eq!(body["changes"][0]["kind"], "APPEARED", "{body}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_door_that_closes_over_rest() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    a_door_that_closes_is_told(&service.rest()).await;
}
