//! A door that is closed and opened again and again is told as a door; what changed once is not.

use meetpoint_client::v1;
use meetpoint_geometry::Pose;
use meetpoint_sim::Building;
use serde_json::Value;

use crate::changes::{CHARACTER_M, DOOR, ROOMS, door_m, drive, driven_from};
use crate::door::{Door, job_done, refused};
use crate::drive::{SECOND_NS, SimulatedDrive};
use crate::running::{Launch, Running, empty_folder, meetpoint};

/// From one drive to the next.
const HOUR_NS: i64 = 3600 * SECOND_NS;
/// A drive through the open door and back, and one before the closed one.
const OPEN_AND_CLOSED: [&str; 2] = ["BADACB", "BCABCABCB"];

fn asked(version: u64) -> v1::ListDoorsRequest {
    v1::ListDoorsRequest { map: "rooms".to_owned(), version, ..Default::default() }
}

/// So many hours later than it was.
fn later(mut drive: SimulatedDrive, n_hours: i64) -> SimulatedDrive {
    for tick in &mut drive.ticks {
        tick.stamp_ns += n_hours * HOUR_NS;
    }
    drive
}

/// Robots drive for seven hours, before a door that is closed every other hour: the version after each drive, and
/// the clock of the last robot at its start.
async fn driven<D: Door>(door: &D, building: &mut Building) -> (Vec<u64>, Pose, i64) {
    door.create_map("rooms", 0.05).await.expect("a new map");
    let first = drive(building, OPEN_AND_CLOSED[0], 3);
    let building_from_map = first.building_from_start;
    let mut versions = vec![driven_from(door, "robot-0", &first, Pose::IDENTITY).await];
    let mut start_ns = 0;
    for hour in 1..7_i64 {
        let is_closed = hour % 2 == 1;
        assert!(building.set_door(DOOR, is_closed), "it is drawn");
        let names = OPEN_AND_CLOSED[usize::from(is_closed)];
        let one = later(drive(building, names, 3 + hour.unsigned_abs()), hour);
        start_ns = one.ticks[0].stamp_ns;
        let map_from_start = building_from_map.inverse() * one.building_from_start;
        versions.push(driven_from(door, &format!("robot-{hour}"), &one, map_from_start).await);
    }
    (versions, building_from_map, start_ns)
}

async fn a_door_is_told<D: Door>(door: &D) -> v1::ListDoorsResponse {
    let mut building = Building::from_drawing(ROOMS, CHARACTER_M).expect("a drawing");
    let (versions, building_from_map, last_start_ns) = driven(door, &mut building).await;
    for &version in &versions[..2] {
        let before = door.doors(asked(version)).await.expect("a version");
        assert_eq!((before.doors, before.map_version), (vec![], version), "it was closed once");
    }
    let reply = door.doors(asked(0)).await.expect("the newest");
    assert_eq!(Some(&reply.map_version), versions.last(), "it is named");
    let [found] = &reply.doors[..] else { panic!("one door: {reply:?}") };
    let [min_x_m, min_y_m, max_x_m, max_y_m] = door_m(&building, building_from_map);
    let at = found.position.expect("a place");
    assert!((min_x_m - 0.3..=max_x_m + 0.3).contains(&at.x_m), "{found:?}");
    assert!((min_y_m..=max_y_m).contains(&at.y_m), "{found:?}");
    let around = found.bounding_box.expect("a box");
    assert!((0.5..1.2).contains(&(around.max_y_m - around.min_y_m)), "a metre: {found:?}");
    assert!(10 <= found.cells, "{found:?}");
    assert_eq!(found.changes, 6, "closed three times, opened three times: {found:?}");
    assert_eq!(found.state(), v1::DoorState::Open, "{found:?}");
    let since_ns = last_start_ns..last_start_ns + HOUR_NS;
    assert!(since_ns.contains(&found.change_time_ns), "in the last drive: {found:?}");
    assert!(found.since_time_ns < last_start_ns - 4 * HOUR_NS, "{found:?}");
    assert!((0.1..0.9).contains(&found.closed_share), "{found:?}");
    assert!(0.5 <= found.autocorrelation && 0.05 <= found.variance, "{found:?}");

    let before = door.doors(asked(versions[5])).await.expect("a version");
    assert_eq!(before.doors[0].id, found.id, "the same door");
    assert_eq!(before.doors[0].state(), v1::DoorState::Closed, "{before:?}");
    limits(door, &reply).await;
    rebuilt(door, &reply).await;
    reply
}

async fn limits<D: Door>(door: &D, reply: &v1::ListDoorsResponse) {
    let second = v1::ListDoorsRequest { page_token: "1".to_owned(), page_size: 1, ..asked(0) };
    let second = door.doors(second).await.expect("a page");
    assert_eq!((second.doors, second.next_page_token.as_str()), (vec![], ""), "only one");
    let wrong = v1::ListDoorsRequest { page_token: "x".to_owned(), ..asked(0) };
    refused(door.doors(wrong).await, "INVALID_FIELD");
    refused(door.doors(asked(reply.map_version + 9)).await, "VERSION_NOT_FOUND");
    let elsewhere = v1::ListDoorsRequest { map: "nowhere".to_owned(), ..asked(0) };
    refused(door.doors(elsewhere).await, "MAP_NOT_FOUND");
}

/// Drawn again from the journal, it is the same.
async fn rebuilt<D: Door>(door: &D, reply: &v1::ListDoorsResponse) {
    let job = door.create_job("rooms").await.expect("a rebuild");
    let job = job_done(door, &job.id).await;
    assert!(reply.map_version < job.result_version, "{job:?}");
    let again = door.doors(asked(job.result_version)).await.expect("a version");
    assert_eq!(again.doors, reply.doors, "all of it, to the bit");
}

fn by_command(service: &Running, options: &[&str]) -> String {
    let url = service.url();
    let words = [&["doors", "rooms", "--server", &url], options].concat();
    let done = meetpoint(&words).output().expect("the binary under test starts");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    String::from_utf8(done.stdout).expect("text")
}

#[tokio::test(flavor = "multi_thread")]
async fn over_grpc_and_after_a_restart() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    let before = a_door_is_told(&service.grpc()).await;
    service.stop();
    let service = Launch::at(data.path()).start();
    let after = service.grpc().doors(asked(0)).await.expect("it is stored");
    assert_eq!(after.doors, before.doors, "as before");
}

#[tokio::test(flavor = "multi_thread")]
async fn over_rest_and_by_the_command() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    let told = a_door_is_told(&service.rest()).await;
    let body: Value = serde_json::from_str(&by_command(&service, &["--json"])).expect("JSON");
    assert_eq!(body["doors"][0]["id"], told.doors[0].id, "{body}");
    let text = by_command(&service, &["--limit", "1"]);
    assert!(text.contains("is open, changed 6 times") && text.contains(": 1 doors"), "{text}");
}
