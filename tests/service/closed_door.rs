//! A door is found closed: the map changes after some evidence, plans change with it, and the robot takes the
//! other way (Thrun 1998, Fig. 11).

use meetpoint_client::v1;
use meetpoint_geometry::{Point2, Pose};
use meetpoint_sim::{Building, World, lab};
use v1::explorer::Kind;

use crate::door::{Door, Page, finished};
use crate::drive::{SimulatedDrive, opened, opening, pose, send};
use crate::exploring::{Explorer, N_TICKS_A_ROUND, ROBOT, map_from_building};
use crate::running::{Launch, empty_folder};

/// What the robot asks for: ten centimetres more than it has.
const RADIUS_M: f64 = 0.3;
/// A robot that has not arrived after so many rounds of two seconds never will.
const N_ROUNDS_MAX: usize = 120;
/// A robot that has a wall this near ahead, in metres, and is to go on looks around first.
const STOPPED_M: f64 = 0.8;
/// The robot has arrived this near to its goal, in metres.
const ARRIVED_M: f64 = 0.4;
/// The evidence that the door is closed is in after so many scans at most: twenty seconds.
const N_SCANS_MAX: usize = 100;

/// What happened on the way.
#[derive(Debug, Default)]
struct Trip {
    /// Lengths of the ways that were told, in metres, each of which was driven for two seconds.
    lengths_m: Vec<f64>,
    /// Scans that the robot made on ways through the closed door.
    n_scans_before: usize,
}

fn place(building: &Building, name: char) -> Point2<f64> {
    building.place(name).expect("a place that is drawn")
}

async fn mapped<D: Door>(door: &D, world: &World) {
    door.create_map("lab", 0.05).await.expect("a new map");
    let World { building, tours } = world;
    let tour = SimulatedDrive::by_way_of(building, ROBOT, &tours[0], 11);
    let start = map_from_building(building) * tour.building_from_start;
    let known = v1::start::Kind::Known(pose(start));
    let request = v1::OpenSessionRequest {
        start: Some(v1::Start { kind: Some(known) }),
        ..opening("lab", "first", std::slice::from_ref(&tour.sensor))
    };
    let session = opened(door, request).await;
    send(door, &session, &tour.batches(40)).await;
    finished(door, &session).await;
}

/// Where the robot takes itself to be.
async fn pose_of<D: Door>(door: &D, robot: &str) -> Pose {
    let request = v1::GetExplorationRequest {
        map: "lab".to_owned(),
        explorers: vec![v1::Explorer { kind: Some(Kind::Robot(robot.to_owned())) }],
        ..Default::default()
    };
    let told = door.exploration(request).await.expect("it sends");
    let at = told.robots[0].pose.expect("it has a place");
    Pose::new(at.x_m, at.y_m, at.theta_rad)
}

async fn way<D: Door>(door: &D, from: Pose, to: Point2<f64>) -> v1::PlannedPath {
    let at = |x_m, y_m| Some(v1::Point { x_m, y_m });
    let kind = Some(v1::robot_choice::Kind::RobotRadiusM(RADIUS_M));
    let request = v1::PlanPathRequest {
        map: "lab".to_owned(),
        start: at(from.x_m, from.y_m),
        goal: at(to.x, to.y),
        robot: Some(v1::RobotChoice { kind }),
        ..Default::default()
    };
    let reply = door.plan(request).await.expect("a good question");
    assert_eq!(reply.code(), v1::PlanCode::Ok, "there is always a way: {reply:?}");
    reply.path.expect("a path")
}

/// Whether the way that was told leads into a wall that the robot sees.
fn is_blocked(building: &Building, way: &[Point2<f64>]) -> bool {
    way.windows(2).any(|pair| {
        let step = pair[1] - pair[0];
        let bearing_rad = step.y.atan2(step.x);
        building.range_m(pair[0], bearing_rad, 30.0).is_some_and(|wall_m| wall_m < step.norm())
    })
}

/// From A to B by asking the service, while the door between is closed.
async fn driven<D: Door>(door: &D, building: &Building) -> Trip {
    let goal = place(building, 'B');
    let mut robot = Explorer::new(door, "lab", building, 'A').await;
    let mut trip = Trip::default();
    let mut is_turning = false;
    for _ in 0..N_ROUNDS_MAX {
        let n_ticks = robot.drive_on(door).await;
        let truth = robot.drive.truth();
        if (truth.position() - goal).norm() < ARRIVED_M {
            finished(door, &robot.session).await;
            return trip;
        }
        let here = pose_of(door, &robot.name).await;
        let told = way(door, here, map_from_building(building) * goal).await;
        trip.lengths_m.push(told.path_length_m);
        let truth_from_map = truth * here.inverse();
        let points = told.points.iter().map(|at| truth_from_map * Point2::new(at.x_m, at.y_m));
        let points: Vec<_> = points.collect();
        let is_blocked = is_blocked(building, &points);
        if is_blocked {
            trip.n_scans_before += n_ticks / ROBOT.n_ticks_per_scan as usize;
        }
        let ahead_m = building.range_m(truth.position(), truth.theta_rad, STOPPED_M);
        is_turning &= is_blocked && n_ticks == N_TICKS_A_ROUND;
        if !is_turning && is_blocked && ahead_m.is_some() {
            robot.drive.look_around();
            is_turning = true;
        } else if !is_turning {
            robot.drive.follow(&points);
        }
    }
    panic!("not there after {N_ROUNDS_MAX} rounds: {trip:?}");
}

async fn the_other_way_is_taken<D: Door>(door: &D) {
    let world = lab();
    mapped(door, &world).await;
    let mut building = world.building;
    assert!(building.set_door('1', true), "it is drawn");
    let trip = driven(door, &building).await;
    let first_m = trip.lengths_m[0];
    let longest_m = trip.lengths_m.iter().copied().fold(0.0, f64::max);
    assert!(first_m < 5.0 && 12.0 < longest_m, "through the door, then around: {trip:?}");
    assert!((1..=N_SCANS_MAX).contains(&trip.n_scans_before), "after some evidence: {trip:?}");
    let (versions, _) = door.versions("lab", Page(0, "")).await.expect("a map");
    // The tour's last one, one for the door, one at the end; more where people would not tell the difference.
    assert!((3..10).contains(&versions.len()), "{versions:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn over_grpc() {
    let data = empty_folder();
    // The simulation runs faster than the clock.
    let launch = Launch::at(data.path()).setting("mapping.moved_snapshot_ms", 1);
    the_other_way_is_taken(&launch.start().grpc()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn over_rest() {
    let data = empty_folder();
    let launch = Launch::at(data.path()).setting("mapping.moved_snapshot_ms", 1);
    the_other_way_is_taken(&launch.start().rest()).await;
}
