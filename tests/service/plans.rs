//! Ways through a map: paths, lengths, motions, what is near and what can be reached; by tables, by
//! search, and by tables that a robot took along.

use meetpoint_client::{PlanTables, v1};
use v1::PlanCode as Code;
use v1::robot_choice::Kind as Robot;

use crate::door::{Door, refused};
use crate::four_rooms::{
    CLOSET, ROOMS, STRIP, arcs, asked, at, four_rooms, imported, path, tables_answer,
};
use crate::running::{Launch, empty_folder, meetpoint};

/// Radius of the default profile, in metres.
const RADIUS_M: f64 = 0.2;

#[expect(clippy::unnecessary_wraps, reason = "as the field of a request wants it")]
fn robot(radius_m: f64) -> Option<v1::RobotChoice> {
    Some(v1::RobotChoice { kind: Some(Robot::RobotRadiusM(radius_m)) })
}

fn distance_m(a: v1::Point, b: v1::Point) -> f64 {
    (a.x_m - b.x_m).hypot(a.y_m - b.y_m)
}

/// The reply of a question, and that of the same by tables.
async fn a_path_leads_through_the_door<D: Door>(door: &D) {
    let version = imported(door).await;
    let first = door.plan(asked(ROOMS[0], ROOMS[1])).await.expect("a good question");
    assert_eq!(first.code(), Code::Ok, "at once: {first:?}");
    let by_tables = tables_answer(door).await;
    let [a, b] = [&first, &by_tables].map(|reply| reply.path.as_ref().expect("a path"));
    assert_eq!((a.grid_length_m, &a.route), (b.grid_length_m, &b.route), "search is exact too");
    let basis = by_tables.basis.as_ref().expect("told");
    assert_eq!((basis.map.as_str(), basis.map_version), ("rooms", version), "{basis:?}");
    assert_eq!((basis.profile.as_str(), basis.robot_radius_m), ("default", RADIUS_M), "{basis:?}");
    assert!((3.1..3.4).contains(&b.grid_length_m), "through the door: {b:?}");
    assert!(b.path_length_m <= b.grid_length_m && 3.09 < b.path_length_m, "pulled tight: {b:?}");
    assert!(RADIUS_M - 1e-6 <= b.clearance_min_m, "keeps away: {b:?}");
    assert_eq!((b.points.first(), b.points.last()), (Some(&ROOMS[0]), Some(&ROOMS[1])), "{b:?}");
    assert_eq!((b.route.len(), b.loss_bound, b.cells.len()), (2, 0.0, 0), "two rooms: {b:?}");
    let graph = door.graph("rooms", 0, v1::GraphPruning::Unspecified, false).await.expect("one");
    let arc = graph.arcs.iter().find(|arc| arc.id == arcs(b)[0]).expect("an arc of the graph");
    let ends = [arc.region_a, arc.region_b];
    assert!(b.route.iter().all(|step| ends.contains(&step.region)), "it joins them: {arc:?}");

    let bare = v1::PlanPathRequest { route_only: true, ..asked(ROOMS[0], ROOMS[1]) };
    let bare = door.plan(bare).await.expect("a good question").path.expect("a path");
    let expected = v1::PlannedPath { grid_length_m: b.grid_length_m, ..bare.clone() };
    assert_eq!((&bare.route, bare.points.len()), (&b.route, 0), "no points: {bare:?}");
    assert_eq!(bare, expected, "the same length");
    let cells = v1::PlanPathRequest { cells: true, ..asked(ROOMS[0], ROOMS[1]) };
    let cells = door.plan(cells).await.expect("a good question").path.expect("a path").cells;
    let walked: f64 = cells.windows(2).map(|pair| distance_m(pair[0], pair[1])).sum();
    assert!((walked - b.grid_length_m).abs() < 1e-6, "cell by cell: {walked}");
}

async fn other_ways<D: Door>(door: &D) {
    let best = path(door, ROOMS[0], ROOMS[2]).await;
    for mode in [v1::PlanMode::Triplet, v1::PlanMode::Paper] {
        let request = v1::PlanPathRequest { mode: mode.into(), ..asked(ROOMS[0], ROOMS[2]) };
        let reply = door.plan(request).await.expect("a good question");
        let found = reply.path.expect("a path");
        assert!(best.grid_length_m <= found.grid_length_m + 1e-9, "{mode:?}: {found:?}");
        let loss = found.cost_m / best.cost_m - 1.0;
        assert!((loss - found.loss_bound).abs() < 1e-6, "its loss is told: {loss} {found:?}");
    }
    let request = v1::PlanPathRequest { alternatives: 3, ..asked(ROOMS[0], ROOMS[2]) };
    let reply = door.plan(request).await.expect("a good question");
    let [other] = reply.alternatives.as_slice() else { panic!("one other way: {reply:?}") };
    assert!(best.cost_m <= other.cost_m, "no shorter: {other:?}");
    assert!(arcs(other).iter().all(|arc| !arcs(&best).contains(arc)), "other doors: {other:?}");
    assert_eq!(other.route.len(), 3, "three rooms: {other:?}");
}

async fn lengths_agree<D: Door>(door: &D) {
    let starts = [ROOMS[0], ROOMS[1], STRIP];
    let goals = [ROOMS[2], ROOMS[3], CLOSET, at(-5.0, 0.0)];
    let (map, starts, goals) = ("rooms".to_owned(), starts.to_vec(), goals.to_vec());
    let request = v1::PlanMatrixRequest { map, starts, goals, robot: None, map_version: 0 };
    let found = door.matrix(request.clone()).await.expect("a good question");
    let codes: Vec<Code> = found.start_codes().collect();
    assert_eq!(codes, [Code::Ok, Code::Ok, Code::StartUnknown], "{found:?}");
    let codes: Vec<Code> = found.goal_codes().collect();
    assert_eq!(codes, [Code::Ok, Code::Ok, Code::Ok, Code::OutsideMap], "{found:?}");
    for (row, &start) in found.rows.iter().zip(&request.starts).take(2) {
        for (&length_m, &goal) in row.lengths_m.iter().zip(&request.goals).take(2) {
            let alone = path(door, start, goal).await;
            assert!((length_m - alone.cost_m).abs() < 1e-9, "{length_m} for {alone:?}");
        }
        assert_eq!(row.lengths_m[2..], [-1.0, -1.0], "no way: {row:?}");
    }
    assert_eq!(found.rows[2].lengths_m, [-1.0; 4], "from nowhere");
    let empty = v1::PlanMatrixRequest { starts: vec![], ..request.clone() };
    assert_eq!(door.matrix(empty).await.expect("nothing").rows, [], "nothing asked for");
    let many = v1::PlanMatrixRequest { goals: vec![ROOMS[0]; 40], ..request };
    let many = refused(door.matrix(many).await, "MATRIX_TOO_LARGE");
    assert_eq!(many.fact("limit_pairs"), "100", "{many:?}");
}

async fn motions_lead_to_the_goal<D: Door>(door: &D) {
    let goal = ROOMS[2];
    let mut here = ROOMS[0];
    let mut left_m = f64::INFINITY;
    for _ in 0..200 {
        let (position, goal) = (Some(here), Some(goal));
        let request =
            v1::NextMotionRequest { map: "rooms".into(), position, goal, ..Default::default() };
        let motion = door.motion(request).await.expect("a good question");
        assert_eq!(motion.code(), Code::Ok, "{motion:?}");
        assert!(motion.distance_left_m < left_m, "nearer: {motion:?}");
        left_m = motion.distance_left_m;
        let Some(heading_rad) = motion.heading_rad else {
            assert_eq!((left_m, motion.next_arc), (0.0, 0), "there: {motion:?}");
            return;
        };
        let next = motion.next_point.expect("where it leads");
        let along = (next.y_m - here.y_m).atan2(next.x_m - here.x_m);
        assert!((along - heading_rad).abs() < 1e-6, "{along} for {motion:?}");
        here = next;
    }
    panic!("not there after 200 steps: {here:?}");
}

async fn what_is_near_and_what_is_reached<D: Door>(door: &D) {
    let near = |point, distance_max_m| v1::GetNearestFreePointRequest {
        map: "rooms".into(),
        point: Some(point),
        distance_max_m,
        ..Default::default()
    };
    let found = door.nearest(near(ROOMS[0], 0.0)).await.expect("a good question");
    assert_eq!((found.point, found.distance_m), (Some(ROOMS[0]), 0.0), "there already");
    let wall = at(0.05, 1.55);
    let found = door.nearest(near(wall, 0.0)).await.expect("a good question");
    let point = found.point.expect("there is one");
    assert!((distance_m(point, wall) - found.distance_m).abs() < 1e-9, "{found:?}");
    assert!((0.25..0.4).contains(&found.distance_m) && 0 < found.region, "{found:?}");
    let found = door.nearest(near(at(6.3, 3.0), 0.01)).await.expect("a good question");
    assert_eq!(found.point, None, "not that near");

    let from = |start, length_max_m| v1::GetReachableAreaRequest {
        map: "rooms".into(),
        start: Some(start),
        length_max_m,
        ..Default::default()
    };
    let all = door.reachable(from(ROOMS[0], 0.0)).await.expect("a good question");
    assert_eq!((all.code(), all.regions.len()), (Code::Ok, 4), "four rooms: {all:?}");
    let sum_m2: f64 = all.regions.iter().map(|region| region.area_m2).sum();
    assert!((sum_m2 - all.area_m2).abs() < 1e-6 && (25.0..36.0).contains(&sum_m2), "{all:?}");
    let some = door.reachable(from(ROOMS[0], 1.0)).await.expect("a good question");
    assert_eq!(some.regions.len(), 1, "one room: {some:?}");
    assert!((2.0..3.2).contains(&some.area_m2), "an eight-sided disk: {some:?}");
    let nowhere = door.reachable(from(STRIP, 0.0)).await.expect("a good question");
    assert_eq!(nowhere.code(), Code::StartUnknown, "{nowhere:?}");
    assert!(!nowhere.what_to_do.is_empty(), "{nowhere:?}");
}

async fn ends_are_judged<D: Door>(door: &D) {
    let beside = at(0.27, 1.55);
    let reply = door.plan(asked(beside, ROOMS[1])).await.expect("a good question");
    let snapped = reply.snapped_start.expect("it was moved");
    assert!(0.0 < distance_m(snapped, beside) && distance_m(snapped, beside) <= 0.1, "{reply:?}");
    assert!(reply.warnings.iter().any(|warning| warning.contains("was moved")), "{reply:?}");
    assert_eq!(reply.path.expect("a path").points[0], snapped, "starts there");
    assert_eq!(reply.snapped_goal, None, "the goal was not");
    for (start, goal, code, advice) in [
        (at(0.12, 1.55), ROOMS[1], Code::StartOccupied, "nearest point"),
        (ROOMS[0], at(3.15, 3.15), Code::GoalOccupied, "nearest point"),
        (STRIP, ROOMS[1], Code::StartUnknown, "never observed"),
        (ROOMS[0], STRIP, Code::GoalUnknown, "never observed"),
        (at(-3.0, 1.0), ROOMS[1], Code::OutsideMap, "the start lies outside"),
        (ROOMS[0], at(99_000.0, 1.0), Code::OutsideMap, "the goal lies outside"),
        (ROOMS[0], CLOSET, Code::NoRoute, "nothing that was observed joins"),
    ] {
        let reply = door.plan(asked(start, goal)).await.expect("an answer");
        assert_eq!((reply.code(), reply.path.is_none()), (code, true), "{reply:?}");
        assert!(reply.what_to_do.contains(advice), "{reply:?}");
    }
    let wide = v1::PlanPathRequest { robot: robot(0.6), ..asked(ROOMS[0], ROOMS[1]) };
    let reply = door.plan(wide).await.expect("an answer");
    assert_eq!(reply.code(), Code::NoRoute, "too wide for the door: {reply:?}");
    assert!(reply.what_to_do.contains("too narrow"), "{reply:?}");
    let basis = reply.basis.expect("told");
    assert_eq!((basis.profile.as_str(), basis.robot_radius_m), ("", 0.6), "on the spot: {basis:?}");
    let small = v1::PlanPathRequest { robot: robot(0.1), ..asked(ROOMS[0], ROOMS[1]) };
    let reply = door.plan(small).await.expect("an answer");
    assert_eq!(reply.basis.expect("told").profile, "default", "the next larger one");
    assert!(reply.warnings[0].contains("`default`"), "which is told: {:?}", reply.warnings);
}

async fn bad_questions_are_refused<D: Door>(door: &D) {
    let good = || asked(ROOMS[0], ROOMS[1]);
    let far = v1::PlanPathRequest { start: Some(at(1e300, 0.0)), ..good() };
    assert_eq!(refused(door.plan(far).await, "INVALID_FIELD").fact("field"), "start", "named");
    let many = v1::PlanPathRequest { alternatives: 9, ..good() };
    refused(door.plan(many).await, "INVALID_FIELD");
    for radius_m in [-0.1, 1e9] {
        let wrong = v1::PlanPathRequest { robot: robot(radius_m), ..good() };
        let wrong = refused(door.plan(wrong).await, "INVALID_FIELD");
        assert_eq!(wrong.fact("field"), "robot_radius_m", "{wrong:?}");
    }
    let kind = Some(Robot::Profile("giant".into()));
    let giant = v1::PlanPathRequest { robot: Some(v1::RobotChoice { kind }), ..good() };
    refused(door.plan(giant).await, "PROFILE_NOT_FOUND");
    refused(door.tables("rooms", "giant").await, "PROFILE_NOT_FOUND");
    let nowhere = v1::PlanPathRequest { map: "nowhere".into(), ..good() };
    refused(door.plan(nowhere).await, "MAP_NOT_FOUND");
    refused(
        door.plan(v1::PlanPathRequest { map_version: 99, ..good() }).await,
        "VERSION_NOT_FOUND",
    );
    door.create_map("empty", 0.1).await.expect("a new map");
    let empty = v1::PlanPathRequest { map: "empty".into(), ..good() };
    refused(door.plan(empty).await, "NOTHING_PUBLISHED");
    let wrong = v1::GetNearestFreePointRequest {
        map: "rooms".into(),
        point: Some(ROOMS[0]),
        distance_max_m: 1e4,
        ..Default::default()
    };
    refused(door.nearest(wrong).await, "INVALID_FIELD");
}

/// Tables that were taken along tell what the service tells, and lead there.
async fn tables_are_taken_along<D: Door>(door: &D) {
    let bytes = door.tables("rooms", "default").await.expect("a file");
    let tables = PlanTables::read(&bytes).expect("whole");
    assert_eq!(tables.basis().profile, "default", "{:?}", tables.basis());
    for (from, to) in [(0, 1), (1, 0), (0, 2), (3, 1), (2, 2)] {
        let (start, goal) = (at(ROOMS[from].x_m + 0.8, ROOMS[from].y_m - 0.9), ROOMS[to]);
        let told = path(door, start, goal).await;
        let plan = tables.towards(goal).expect("the robot can be there");
        let mut here = start;
        let mut left_m = f64::INFINITY;
        let mut walked_m = 0.0;
        for n in 0.. {
            let motion = plan.next_motion(here).expect("a way");
            if n == 0 {
                let difference_m = (motion.distance_left_m - told.cost_m).abs();
                assert!(difference_m < 1e-9, "{motion:?} for {told:?}");
                assert_eq!(motion.region, told.route[0].region, "the same room");
            }
            assert!(motion.distance_left_m < left_m, "nearer: {motion:?}");
            left_m = motion.distance_left_m;
            if motion.heading_rad.is_none() {
                break;
            }
            if 0 < n {
                walked_m += distance_m(here, motion.next);
            }
            here = motion.next;
        }
        assert_eq!(left_m, 0.0, "there");
        assert!(walked_m <= told.cost_m + 0.15, "{walked_m} m for {told:?}");
    }
    assert!(tables.next_motion(ROOMS[0], CLOSET).is_none(), "no way");
    assert!(tables.next_motion(STRIP, ROOMS[0]).is_none(), "nowhere");
}

async fn all<D: Door>(door: &D) {
    a_path_leads_through_the_door(door).await;
    other_ways(door).await;
    lengths_agree(door).await;
    motions_lead_to_the_goal(door).await;
    what_is_near_and_what_is_reached(door).await;
    ends_are_judged(door).await;
    bad_questions_are_refused(door).await;
    tables_are_taken_along(door).await;
}

/// Few pairs, so that too many are quickly asked for.
fn launch(data: &std::path::Path) -> Launch {
    Launch::at(data).setting("planning.matrix_pairs_max", 100)
}

#[tokio::test(flavor = "multi_thread")]
async fn over_grpc() {
    let data = empty_folder();
    let service = launch(data.path()).start();
    let door = service.grpc();
    all(&door).await;
    let unsaid = v1::PlanPathRequest { start: None, ..asked(ROOMS[0], ROOMS[1]) };
    refused(door.plan(unsaid).await, "INVALID_FIELD");
    for number in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let wrong =
            v1::PlanPathRequest { goal: Some(at(0.0, number)), ..asked(ROOMS[0], ROOMS[1]) };
        refused(door.plan(wrong).await, "INVALID_FIELD");
        let wrong = v1::PlanPathRequest { robot: robot(number), ..asked(ROOMS[0], ROOMS[1]) };
        refused(door.plan(wrong).await, "INVALID_FIELD");
    }
    let strange = v1::PlanPathRequest { mode: 77, ..asked(ROOMS[0], ROOMS[1]) };
    refused(door.plan(strange).await, "INVALID_FIELD");
    let (tables, bytes) = service.client().plan_tables("rooms", "").await.expect("the client's");
    assert!(!bytes.is_empty() && tables.resolution_m() == 0.1, "{:?}", tables.basis());
}

#[tokio::test(flavor = "multi_thread")]
async fn over_rest() {
    let data = empty_folder();
    let service = launch(data.path()).start();
    all(&service.rest()).await;
    let map = "rooms";
    let post = |body: &str| {
        let kind = [("content-type", "application/json")];
        let path = format!("/v1/maps/{map}/paths");
        service.http().post_with(&path, &kind, body.as_bytes()).problem()["code"].clone()
    };
    assert_eq!(post("{}"), "INVALID_FIELD", "no start");
    assert_eq!(post("[]"), "INVALID_FIELD", "no question");
    assert_eq!(post("{"), "MALFORMED_BODY", "cut off");
    let strange = r#"{"start": {"x_m": 1, "y_m": NaN}, "goal": {"x_m": 1, "y_m": 1}}"#;
    assert_eq!(post(strange), "MALFORMED_BODY", "no number");
    let both = r#"{"start": {"x_m": 1, "y_m": 1}, "goal": {"x_m": 1, "y_m": 1},
        "profile": "default", "robot_radius_m": 0.1}"#;
    assert_eq!(post(both), "INVALID_FIELD", "one of the two");
    let get = |query: &str| {
        let path = format!("/v1/maps/{map}/next-motion?{query}");
        service.http().get(&path).problem()["code"].clone()
    };
    assert_eq!(get("x_m=1&y_m=1&goal_x_m=1"), "INVALID_QUERY", "no goal");
    assert_eq!(get("x_m=NaN&y_m=1&goal_x_m=1&goal_y_m=2"), "INVALID_FIELD", "no number");
}

#[test]
fn by_the_command() {
    let (data, files) = (empty_folder(), empty_folder());
    let service = Launch::at(data.path()).start();
    let (yaml, image) = four_rooms();
    let folder = files.path();
    std::fs::write(folder.join("rooms.yaml"), yaml).expect("a writable folder");
    std::fs::write(folder.join("rooms.pgm"), image).expect("a writable folder");
    let run = |arguments: &[&str]| {
        let url = service.url();
        let all = [arguments, &["--server", &url]].concat();
        let done = meetpoint(&all).output().expect("the binary under test starts");
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (done.status.code(), text(&done.stdout), text(&done.stderr))
    };
    let file = |name: &str| folder.join(name).display().to_string();
    let (status, _, told) = run(&["map", "import", &file("rooms.yaml")]);
    assert_eq!(status, Some(0), "{told}");
    let ask =
        |arguments: &[&str]| run(&[&["plan", "rooms", "--from", "1.55,1.55"], arguments].concat());
    let (status, told, _) = ask(&["--to", "4.65,4.75", "--alternatives", "1"]);
    assert_eq!(status, Some(0), "{told}");
    assert!(told.contains(" m in the grid") && told.contains("route: "), "{told}");
    for name in ["way.png", "way.geojson", "way.json"] {
        let (status, _, told) = ask(&["--to", "4.65,1.55", "--out", &file(name)]);
        assert_eq!(status, Some(0), "{told}");
    }
    let png = std::fs::read(folder.join("way.png")).expect("it was written");
    assert!(png.starts_with(b"\x89PNG"), "a picture");
    let read = |name: &str| -> serde_json::Value {
        let bytes = std::fs::read(folder.join(name)).expect("it was written");
        serde_json::from_slice(&bytes).expect("JSON")
    };
    let line = &read("way.geojson")["features"][0]["geometry"];
    assert_eq!(line["type"], "LineString", "{line}");
    assert_eq!(read("way.json")["code"], "OK", "the answer as REST gives it");
    let (status, told, why) = ask(&["--to", "7.35,5.75", "--json"]);
    assert_eq!(status, Some(1), "{told}");
    assert!(told.contains("NO_ROUTE") && why.contains("nothing that was observed"), "{why}");
    assert_eq!(ask(&["--to", "1;2"]).0, Some(2), "no point");
}
