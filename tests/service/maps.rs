//! Maps, robots and sessions: made, found, listed by pages, refused with stable codes.

use crate::door::{Answer, Door, FIRST_PAGE, Page, Rows, refused};
use crate::drive::{opened, opening};
use crate::running::{Launch, empty_folder};
use meetpoint_client::v1;

/// Every row of a list, fetched two at a time.
async fn by_pages<T, F>(mut fetch: impl FnMut(String) -> F) -> Vec<T>
where
    F: Future<Output = Answer<Rows<T>>>,
{
    let (mut all, mut token) = (Vec::new(), String::new());
    loop {
        let (rows, next) = fetch(token).await.expect("a page");
        assert!(rows.len() <= 2, "no more than asked for");
        all.extend(rows);
        if next.is_empty() {
            return all;
        }
        token = next;
    }
}

async fn maps_are_made_found_and_listed<D: Door>(door: &D) {
    let made = door.create_map("m3", 0.1).await.expect("a new map");
    assert_eq!((made.id.as_str(), made.resolution_m), ("m3", 0.1), "as asked for");
    assert_eq!((made.published_version, made.latest_version), (0, 0), "nothing is there yet");
    assert!(made.publishes_automatically, "until a person moves the pointer");
    assert_eq!(door.map("m3").await, Ok(made), "the same again");
    for id in ["m1", "m5", "m2", "m4"] {
        let map = door.create_map(id, 0.0).await.expect("a new map");
        assert_eq!(map.resolution_m, 0.05, "the default");
    }
    let maps = by_pages(async |token| door.maps(Page(2, &token)).await).await;
    let ids: Vec<&str> = maps.iter().map(|map| map.id.as_str()).collect();
    assert_eq!(ids, ["m1", "m2", "m3", "m4", "m5"], "each once, by id");
    assert_eq!(door.maps(FIRST_PAGE).await.expect("a page").0, maps, "or all at once");

    refused(door.create_map("m3", 0.1).await, "MAP_EXISTS");
    refused(door.map("nowhere").await, "MAP_NOT_FOUND");
    refused(door.versions("nowhere", FIRST_PAGE).await, "MAP_NOT_FOUND");
    refused(door.version("m1", 0).await, "NOTHING_PUBLISHED");
    refused(door.version("m1", 7).await, "VERSION_NOT_FOUND");
    refused(door.publish("m1", 7).await, "VERSION_NOT_FOUND");
    refused(door.grid("m1", 0, None).await, "NOTHING_PUBLISHED");
    assert_eq!(door.versions("m1", FIRST_PAGE).await, Ok((vec![], String::new())), "none");
    for id in ["", "UPPER", "a b", "-a", "ä", &"x".repeat(64)] {
        let wrong = refused(door.create_map(id, 0.05).await, "INVALID_FIELD");
        assert!(wrong.fact("field").ends_with("id"), "{wrong:?}");
    }
    for resolution_m in [0.001, 3.0, -0.05] {
        let wrong = refused(door.create_map("m6", resolution_m).await, "INVALID_FIELD");
        assert!(wrong.fact("field").ends_with("resolution_m"), "{wrong:?}");
    }
}

async fn robots_are_made_found_and_listed<D: Door>(door: &D) {
    for id in ["r2", "r1", "r3"] {
        let robot = door.create_robot(id).await.expect("a new robot");
        assert_eq!((robot.id.as_str(), robot.epoch), (id, 0), "it has opened no session");
        assert_eq!(door.robot(id).await, Ok(robot), "the same again");
    }
    let robots = by_pages(async |token| door.robots(Page(2, &token)).await).await;
    let ids: Vec<&str> = robots.iter().map(|robot| robot.id.as_str()).collect();
    assert_eq!(ids, ["r1", "r2", "r3"], "each once, by id");
    refused(door.create_robot("r2").await, "ROBOT_EXISTS");
    refused(door.robot("nobody").await, "ROBOT_NOT_FOUND");
    refused(door.create_robot("no body").await, "INVALID_FIELD");
}

async fn sessions_are_opened_found_and_listed<D: Door>(door: &D) {
    door.create_map("office", 0.05).await.expect("a new map");
    door.create_map("empty", 0.05).await.expect("a new map");
    let mut ids = Vec::new();
    for robot in ["a", "b", "c"] {
        let reply = door.open(opening("office", robot, &[])).await.expect("a new session");
        assert!(!reply.resumed, "it is new");
        let limits = reply.limits.expect("limits are told");
        assert!(0 < limits.n_in_flight_max && 0 < limits.batch_bytes_max, "{limits:?}");
        let session = reply.session.expect("a session");
        assert_eq!(session.state, i32::from(v1::SessionState::Open), "open");
        assert_eq!(door.robot(robot).await.expect("registered on the way").epoch, 1, "its epoch");
        ids.push(session.id);
    }
    let sessions = by_pages(async |token| door.sessions("office", Page(2, &token)).await).await;
    assert!(sessions.iter().map(|session| &session.id).eq(&ids), "each once, oldest first");
    assert_eq!(door.sessions("empty", FIRST_PAGE).await.expect("a page").0, [], "by map");

    let again = door.open(opening("office", "b", &[])).await.expect("the same again");
    assert!(again.resumed, "it was there before");
    assert_eq!(again.session.expect("a session").id, ids[1], "the client's key names it");
    let other = v1::OpenSessionRequest { map: "empty".into(), ..opening("office", "b", &[]) };
    refused(door.open(other).await, "SESSION_KEY_TAKEN");
    refused(door.open(opening("nowhere", "b", &[])).await, "MAP_NOT_FOUND");
    let keyless =
        v1::OpenSessionRequest { client_key: String::new(), ..opening("office", "b", &[]) };
    refused(door.open(keyless).await, "INVALID_FIELD");
    refused(door.session("not-a-uuid").await, "INVALID_FIELD");
    refused(door.session("0199d3a6-6ac5-7c4e-9d51-2d9a3f1f3c11").await, "SESSION_NOT_FOUND");
    let frameless = v1::GetTrajectoryRequest { session: ids[0].clone(), ..Default::default() };
    refused(door.trajectory(frameless).await, "NOTHING_PUBLISHED");
    let blind = v1::GetTrajectoryRequest {
        session: ids[0].clone(),
        frame: "eye".into(),
        ..Default::default()
    };
    refused(door.trajectory(blind).await, "SENSOR_NOT_FOUND");
}

/// What is wrong with a declared sensor is named by its field.
async fn sensors_are_checked<D: Door>(door: &D) {
    door.create_map("lab", 0.05).await.expect("a new map");
    let good = v1::LaserGeometry {
        angle_min_rad: -1.5,
        angle_increment_rad: 0.1,
        n_beams: 31,
        range_min_m: 0.1,
        range_max_m: 10.0,
    };
    let laser = |geometry| v1::Sensor {
        id: "laser".into(),
        robot_from_sensor: None,
        kind: Some(v1::sensor::Kind::Laser(geometry)),
    };
    for wrong in [
        v1::LaserGeometry { angle_increment_rad: 0.0, ..good },
        v1::LaserGeometry { n_beams: 0, ..good },
        v1::LaserGeometry { n_beams: 8193, ..good },
        v1::LaserGeometry { range_min_m: -1.0, ..good },
        v1::LaserGeometry { range_max_m: 1e9, ..good },
        v1::LaserGeometry { range_max_m: 0.05, ..good },
    ] {
        let wrong = refused(door.open(opening("lab", "r", &[laser(wrong)])).await, "INVALID_FIELD");
        assert!(wrong.fact("field").starts_with("sensors[0]"), "{wrong:?}");
    }
    let kindless = v1::Sensor { kind: None, ..laser(good) };
    refused(door.open(opening("lab", "r", &[kindless])).await, "INVALID_FIELD");
    let twice = [laser(good), laser(good)];
    refused(door.open(opening("lab", "r", &twice)).await, "INVALID_FIELD");
    let many: Vec<v1::Sensor> =
        (0..17).map(|n| v1::Sensor { id: format!("laser{n}"), ..laser(good) }).collect();
    refused(door.open(opening("lab", "r", &many)).await, "INVALID_FIELD");
    opened(door, opening("lab", "r", &[laser(good)])).await;
}

async fn all<D: Door>(door: &D) {
    maps_are_made_found_and_listed(door).await;
    robots_are_made_found_and_listed(door).await;
    sessions_are_opened_found_and_listed(door).await;
    sensors_are_checked(door).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn over_grpc() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    all(&service.grpc()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn over_rest() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    all(&service.rest()).await;
}
