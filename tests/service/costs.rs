//! What is closed, dear or drawn on top of a map: in force in the very next answer, kept over
//! restarts, rebuilding and rolling back.

use meetpoint_client::v1;
use v1::PlanCode as Code;
use v1::cost::Kind;
use v1::obstacle::Shape;
use v1::watch_map_response::Kind as Seen;

use crate::door::{Door, eventually, refused};
use crate::four_rooms::{ROOMS, arcs, asked, at, imported, path, tables_answer};
use crate::running::{Launch, empty_folder};

fn drawn(kind: Kind) -> v1::Cost {
    let (reason, author) = ("glass".to_owned(), "ann".to_owned());
    v1::Cost { kind: Some(kind), reason, author, ..v1::Cost::default() }
}

/// A line through the door between the lower rooms.
fn glass() -> Kind {
    let points = vec![at(3.15, 1.0), at(3.15, 2.5)];
    let shape = Some(Shape::Polyline(v1::Polyline { points, width_m: 0.05 }));
    Kind::Obstacle(v1::Obstacle { shape })
}

fn rectangle([x0, y0, x1, y1]: [f64; 4]) -> v1::Polygon {
    v1::Polygon { points: vec![at(x0, y0), at(x1, y0), at(x1, y1), at(x0, y1)] }
}

async fn revision<D: Door>(door: &D) -> u64 {
    door.map("rooms").await.expect("it was made").cost_revision
}

/// A closed door gives the detour in the very next answer, then there is no route, and what to do.
async fn doors_are_closed_and_opened<D: Door>(door: &D) {
    imported(door).await;
    tables_answer(door).await;
    let direct = path(door, ROOMS[0], ROOMS[1]).await;
    let arc = arcs(&direct)[0];
    let closed = door.close_arc("rooms", arc, "ann").await.expect("an arc");
    assert_eq!((closed.cost_revision, closed.author.as_str()), (1, "ann"), "{closed:?}");
    assert_eq!(revision(door).await, 1, "counted");
    let detour = path(door, ROOMS[0], ROOMS[1]).await;
    assert!(direct.cost_m + 4.0 < detour.cost_m, "by the other rooms: {detour:?}");
    assert!(!arcs(&detour).contains(&arc) && detour.route.len() == 4, "{detour:?}");
    assert!(detour.path_length_m + 0.2 < detour.grid_length_m, "pulled tight too: {detour:?}");
    let again = door.close_arc("rooms", arc, "bob").await.expect("an arc");
    assert_eq!((again, revision(door).await), (closed.clone(), 1), "closed already");
    let by_tables = tables_answer(door).await.path.expect("a path");
    assert_eq!(by_tables.route, detour.route, "tables and search agree");
    assert_eq!(by_tables.cost_m, detour.cost_m, "whichever answered first");

    let other = arcs(&detour)[1];
    let second = door.close_arc("rooms", other, "").await.expect("an arc");
    for _ in 0..2 {
        let reply = door.plan(asked(ROOMS[0], ROOMS[1])).await.expect("an answer");
        assert_eq!(reply.code(), Code::NoRoute, "both ways are closed: {reply:?}");
        assert_eq!(reply.basis.as_ref().map(|basis| basis.cost_revision), Some(2), "{reply:?}");
        let advice = [format!("arc {arc} (closed by ann)"), format!("arc {other} (closed)")];
        assert!(advice.iter().any(|text| reply.what_to_do.contains(text)), "{reply:?}");
    }
    let (listed, _) = door.costs("rooms").await.expect("a list");
    assert_eq!(listed, [closed.clone(), second], "oldest first");
    assert_eq!(door.open_arc("rooms", other).await, Ok(3), "a revision");
    assert_eq!(door.open_arc("rooms", other).await, Ok(3), "open already");
    assert_eq!(path(door, ROOMS[0], ROOMS[1]).await.route, detour.route, "as before");

    let dear = door.toll("rooms", arc, 1.5).await.expect("an arc");
    let listed = door.costs("rooms").await.expect("a list").0;
    assert_eq!(listed, std::slice::from_ref(&dear), "in its place");
    let priced = path(door, ROOMS[0], ROOMS[1]).await;
    assert_eq!(priced.grid_length_m, direct.grid_length_m, "the same way: {priced:?}");
    assert!((priced.cost_m - direct.cost_m - 1.5).abs() < 1e-3, "dearer: {priced:?}");
    assert_eq!(door.toll("rooms", arc, 1.5).await, Ok(dear), "set already");
    door.toll("rooms", arc, 100.0).await.expect("an arc");
    assert_eq!(path(door, ROOMS[0], ROOMS[1]).await.route.len(), 4, "too dear");
    door.open_arc("rooms", arc).await.expect("an arc");
    assert_eq!(path(door, ROOMS[0], ROOMS[1]).await.cost_m, direct.cost_m, "free again");

    refused(door.close_arc("rooms", 999, "").await, "ARC_NOT_FOUND");
    refused(door.open_arc("rooms", 999).await, "ARC_NOT_FOUND");
    refused(door.close_arc("nowhere", arc, "").await, "MAP_NOT_FOUND");
    for toll_m in [0.0, -1.0, 1e9] {
        let wrong = refused(door.toll("rooms", arc, toll_m).await, "INVALID_FIELD");
        assert_eq!(wrong.fact("field"), "toll_m", "{wrong:?}");
    }
    refused(door.close_arc("rooms", arc, &"x".repeat(201)).await, "INVALID_FIELD");
}

async fn obstacles_and_zones_are_drawn<D: Door>(door: &D) {
    let direct = path(door, ROOMS[0], ROOMS[1]).await;
    let new = v1::Cost { client_key: "glass-1".into(), ..drawn(glass()) };
    let made = door.create_cost("rooms", new.clone()).await.expect("an obstacle");
    assert_eq!((&made.kind, made.reason.as_str()), (&new.kind, "glass"), "{made:?}");
    let detour = path(door, ROOMS[0], ROOMS[1]).await;
    assert!(direct.cost_m + 4.0 < detour.cost_m, "around the glass: {detour:?}");
    assert_eq!(door.create_cost("rooms", new.clone()).await, Ok(made.clone()), "by its key");
    let moved = v1::Cost { kind: Some(Kind::Closure(v1::ArcClosure { arc: 1 })), ..new };
    refused(door.create_cost("rooms", moved).await, "COST_KEY_TAKEN");
    let on_it = door.plan(asked(at(3.15, 1.75), ROOMS[1])).await.expect("an answer");
    assert_eq!(on_it.code(), Code::StartOccupied, "no robot stands in glass: {on_it:?}");
    let before = revision(door).await;
    assert_eq!(door.delete_cost("rooms", &made.id).await, Ok(before + 1), "taken back");
    assert_eq!(path(door, ROOMS[0], ROOMS[1]).await.cost_m, direct.cost_m, "as before");
    refused(door.delete_cost("rooms", &made.id).await, "COST_NOT_FOUND");

    // All of the wall with its doors, so that each half is cut off.
    let wall = Shape::Polygon(rectangle([3.0, 0.2, 3.3, 6.0]));
    let wall = drawn(Kind::Obstacle(v1::Obstacle { shape: Some(wall) }));
    let wall = door.create_cost("rooms", wall).await.expect("an obstacle");
    let reply = door.plan(asked(ROOMS[0], ROOMS[1])).await.expect("an answer");
    assert_eq!(reply.code(), Code::NoRoute, "{reply:?}");
    assert!(reply.what_to_do.contains("drawn"), "{reply:?}");
    door.delete_cost("rooms", &wall.id).await.expect("it is in force");

    let zone = v1::Zone { polygon: Some(rectangle([2.0, 0.0, 4.0, 3.0])), factor: 8.0 };
    let zone = door.create_cost("rooms", drawn(Kind::Zone(zone))).await.expect("a zone");
    let slow = path(door, ROOMS[0], ROOMS[1]).await;
    assert_eq!(slow.route.len(), 4, "around the zone: {slow:?}");
    assert!(slow.cost_m < 8.0 * direct.cost_m, "dearer within: {slow:?}");
    door.delete_cost("rooms", &zone.id).await.expect("it is in force");

    let two = v1::Polygon { points: vec![at(0.0, 0.0), at(1.0, 0.0)] };
    let line = |points, width_m| Shape::Polyline(v1::Polyline { points, width_m });
    let of = |shape| Kind::Obstacle(v1::Obstacle { shape: Some(shape) });
    for wrong in [
        of(Shape::Polygon(two)),
        of(line(vec![at(0.0, 0.0); 1001], 0.1)),
        of(line(vec![at(0.0, 0.0), at(1e9, 0.0)], 0.1)),
        of(line(vec![at(0.0, 0.0), at(1.0, 0.0)], -0.1)),
        Kind::Zone(v1::Zone { polygon: Some(rectangle([0.0, 0.0, 1.0, 1.0])), factor: 0.5 }),
        Kind::Zone(v1::Zone { polygon: Some(rectangle([0.0, 0.0, 1.0, 1.0])), factor: 9.0 }),
    ] {
        refused(door.create_cost("rooms", drawn(wrong)).await, "INVALID_FIELD");
    }
    refused(door.create_cost("rooms", v1::Cost::default()).await, "INVALID_FIELD");
}

async fn profiles_are_declared<D: Door>(door: &D) {
    let names = |profiles: &[v1::Profile]| {
        profiles.iter().map(|profile| profile.name.clone()).collect::<Vec<_>>()
    };
    assert_eq!(names(&door.profiles("rooms").await.expect("a list")), ["default"], "always");
    let cart = v1::Profile {
        name: "cart".into(),
        robot_radius_m: 0.3,
        clearance_distance_m: 1.0,
        clearance_factor: 6.0,
        occupancy_factor: 1.0,
    };
    let before = revision(door).await;
    assert_eq!(door.set_profile("rooms", cart.clone()).await, Ok(cart.clone()), "declared");
    assert_eq!(door.set_profile("rooms", cart.clone()).await, Ok(cart.clone()), "again");
    assert_eq!(revision(door).await, before + 1, "once");
    assert_eq!(names(&door.profiles("rooms").await.expect("a list")), ["cart", "default"], "two");
    // Along a wall: who likes clearance keeps away from it.
    let (from, to) = (at(0.6, 0.6), at(2.6, 0.6));
    let plain = path(door, from, to).await;
    let kind = Some(v1::robot_choice::Kind::Profile("cart".into()));
    let robot = Some(v1::RobotChoice { kind });
    let careful = v1::PlanPathRequest { robot, ..asked(from, to) };
    let careful = door.plan(careful).await.expect("an answer").path.expect("a path");
    assert!(plain.grid_length_m < careful.grid_length_m, "a bend: {careful:?}");
    assert!(careful.grid_length_m < careful.cost_m, "weighed: {careful:?}");
    let kind = Some(v1::robot_choice::Kind::RobotRadiusM(0.25));
    let robot = Some(v1::RobotChoice { kind });
    let next = door.plan(v1::PlanPathRequest { robot, ..asked(from, to) }).await;
    let next = next.expect("an answer").basis.expect("told");
    assert_eq!((next.profile.as_str(), next.robot_radius_m), ("cart", 0.3), "the next larger");
    for wrong in [
        v1::Profile { name: "No".into(), ..cart.clone() },
        v1::Profile { robot_radius_m: 7.0, ..cart.clone() },
        v1::Profile { clearance_factor: 99.0, ..cart.clone() },
        v1::Profile { clearance_distance_m: -1.0, ..cart.clone() },
    ] {
        refused(door.set_profile("rooms", wrong).await, "INVALID_FIELD");
    }
    door.delete_profile("rooms", "cart").await.expect("it is declared");
    refused(door.delete_profile("rooms", "cart").await, "PROFILE_NOT_FOUND");
    assert_eq!(names(&door.profiles("rooms").await.expect("a list")), ["default"], "as before");
}

async fn all<D: Door>(door: &D) {
    doors_are_closed_and_opened(door).await;
    obstacles_and_zones_are_drawn(door).await;
    profiles_are_declared(door).await;
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
    // Sent again with its key, it is answered from memory; for another map it is another request.
    let (http, map) = (service.http(), "rooms");
    let key = [("content-type", "application/json"), ("idempotency-key", "k1")];
    let body = br#"{"closed_arc": 1, "origin": "EVIDENCE", "reason": "found closed"}"#;
    let path = format!("/v1/maps/{map}/costs");
    let first = http.post_with(&path, &key, body);
    assert_eq!((first.status, &first.json()["origin"]), (201, &"EVIDENCE".into()), "made");
    let again = http.post_with(&path, &key, body);
    assert_eq!(again.header("idempotency-replayed"), "true", "not twice");
    assert_eq!(again.json(), first.json(), "the same answer");
    let other = http.post_with("/v1/maps/empty/costs", &key, body);
    assert_eq!(other.problem()["code"], "IDEMPOTENCY_KEY_REUSED", "another map");
    let id = first.json()["id"].as_str().expect("an id").to_owned();
    let gone = http.delete(&format!("/v1/maps/{map}/costs/{id}?reason=open&author=bob"));
    assert_eq!(gone.status, 200, "{}", gone.text());
    let arc = 1;
    assert_eq!(http.get(&format!("/v1/maps/{map}/arcs/{arc}/close")).status, 405, "POST it");
}

/// Costs are in the journal: they outlast a crash, a rebuild, and hold on older versions too.
#[tokio::test(flavor = "multi_thread")]
async fn costs_last() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    let door = service.grpc();
    imported(&door).await;
    let direct = path(&door, ROOMS[0], ROOMS[1]).await;
    let watch = v1::WatchMapRequest { map: "rooms".into() };
    let mut seen = door.maps.clone().watch_map(watch).await.expect("a stream").into_inner();
    let mut events = service.http().events("/v1/events?map=rooms");
    let closed = door.close_arc("rooms", arcs(&direct)[0], "ann").await.expect("an arc");
    let glass = door.create_cost("rooms", drawn(glass())).await.expect("an obstacle");
    loop {
        let event = seen.message().await.expect("it stands").expect("it stands");
        if let Some(Seen::Costs(costs)) = event.kind {
            assert_eq!((costs.map.as_str(), costs.cost_revision), ("rooms", 1), "the first");
            break;
        }
    }
    let told = std::iter::from_fn(|| events.next()).find(|(name, _)| name == "costs");
    assert_eq!(told.expect("it is told").1["cost_revision"], 1, "the first");
    let detour = path(&door, ROOMS[0], ROOMS[1]).await;
    service.kill();

    let service = Launch::at(data.path()).start();
    let door = service.grpc();
    let (listed, at) = door.costs("rooms").await.expect("a list");
    assert_eq!((listed, at), (vec![closed.clone(), glass.clone()], 2), "kept");
    assert_eq!(path(&door, ROOMS[0], ROOMS[1]).await.route, detour.route, "in force");
    let job = door.create_job("rooms").await.expect("a job");
    let done = eventually("the job's end", || async {
        let now = door.job(&job.id).await.expect("it was made");
        now.done.then_some(now)
    })
    .await;
    assert_eq!(done.result_version, 2, "a new version: {done:?}");
    let reply = door.plan(asked(ROOMS[0], ROOMS[1])).await.expect("an answer");
    let basis = reply.basis.expect("told");
    assert_eq!((basis.map_version, basis.cost_revision), (2, 2), "the new one: {basis:?}");
    assert_eq!(reply.path.expect("a path").route, detour.route, "the same places, the same ids");
    door.publish("rooms", 1).await.expect("it is there");
    let reply = door.plan(asked(ROOMS[0], ROOMS[1])).await.expect("an answer");
    assert_eq!(reply.basis.expect("told").map_version, 1, "rolled back at once");
    assert_eq!(reply.path.expect("a path").route, detour.route, "consistent");
    for cost in [closed, glass] {
        door.delete_cost("rooms", &cost.id).await.expect("it is in force");
    }
    assert_eq!(path(&door, ROOMS[0], ROOMS[1]).await.cost_m, direct.cost_m, "all as it was");
}

/// However many change costs at once, each change is counted and none is lost.
#[tokio::test(flavor = "multi_thread")]
async fn changes_at_once() {
    let data = empty_folder();
    let service = Launch::at(data.path()).setting("planning.n_costs_max", 21).start();
    let door = service.grpc();
    imported(&door).await;
    let mut tasks = Vec::new();
    for n in 0..20 {
        let door = door.clone();
        tasks.push(tokio::spawn(async move {
            let new = v1::Cost { client_key: format!("{n}"), ..drawn(glass()) };
            let made = door.create_cost("rooms", new).await.expect("an obstacle");
            let found = door.costs("rooms").await.expect("a list").0;
            assert!(found.contains(&made), "whoever made it sees it");
        }));
    }
    for task in tasks {
        task.await.expect("it held");
    }
    let (costs, revision) = door.costs("rooms").await.expect("a list");
    assert_eq!((costs.len(), revision), (20, 20), "each counted once");
    door.create_cost("rooms", drawn(glass())).await.expect("one more");
    refused(door.create_cost("rooms", drawn(glass())).await, "TOO_MANY_COSTS");
}
