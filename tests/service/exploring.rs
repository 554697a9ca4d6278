//! Robots that explore by asking the service, closed loop, until nothing that they can reach is
//! unexplored.

use meetpoint_client::v1;
use meetpoint_geometry::{Cell, Point2, Pose};
use meetpoint_sim::{Building, ChaCha8Rng, Drive, Robot, rooms};
use rand::SeedableRng;
use v1::ExplorationCode as Code;
use v1::explorer::Kind;
use v1::ingest_batch_request::Kind as Upload;

use crate::door::{Door, eventually, finished, job_done, refused};
use crate::drive::{self, START_NS, SimulatedDrive, opened, opening};
use crate::running::{Launch, empty_folder, meetpoint};

/// A robot with a scan every fifth of a second.
pub(crate) const ROBOT: Robot = Robot { n_ticks_per_scan: 4, ..Robot::INDOOR };
/// What robots ask for: ten centimetres more than they have.
const RADIUS_M: f64 = 0.3;
/// Ticks between two questions: two seconds.
pub(crate) const N_TICKS_A_ROUND: usize = 40;
/// Robots are done that were told so in so many rounds, in which they turned around.
const N_ROUNDS_DONE: u32 = 3;
/// Robots that are not done after so many rounds never will be: thirteen minutes.
const N_ROUNDS_MAX: u32 = 400;

/// A robot that goes where the service says.
pub(crate) struct Explorer<'a> {
    pub(crate) name: String,
    pub(crate) drive: Drive<'a>,
    pub(crate) session: v1::Session,
    n_batches: u64,
}

impl<'a> Explorer<'a> {
    /// At a place of the building, where its session begins: it knows where that is in the map, whose
    /// origin is at A.
    pub(crate) async fn new<D: Door>(
        door: &D,
        map: &str,
        building: &'a Building,
        place: char,
    ) -> Self {
        let at = building.place(place).expect("a place that is drawn");
        let at = map_from_building(building) * Pose::new(at.x, at.y, 0.0);
        let known = v1::start::Kind::Known(drive::pose(at));
        Self::starting(door, map, (building, place), known).await
    }

    /// The same, with what it says of where it starts.
    async fn starting<D: Door>(
        door: &D,
        map: &str,
        (building, place): (&'a Building, char),
        start_kind: v1::start::Kind,
    ) -> Self {
        let start = building.place(place).expect("a place that is drawn");
        let start = Pose::new(start.x, start.y, 0.0);
        let rng = ChaCha8Rng::seed_from_u64(u64::from(u32::from(place)));
        let drive = Drive::standing(building, ROBOT, start, START_NS, rng).expect("room");
        let name = format!("{map}-{}", place.to_ascii_lowercase());
        let request = v1::OpenSessionRequest {
            start: Some(v1::Start { kind: Some(start_kind) }),
            ..opening(map, &name, &[drive::laser(&ROBOT.laser)])
        };
        let session = opened(door, request).await;
        Self { name, drive, session, n_batches: 0 }
    }

    /// Drives on for a round, and sends what it saw: how many ticks that were.
    pub(crate) async fn drive_on<D: Door>(&mut self, door: &D) -> usize {
        let ticks: Vec<_> = self.drive.by_ref().take(N_TICKS_A_ROUND).collect();
        let n_ticks = ticks.len();
        if n_ticks == 0 {
            return 0;
        }
        let driven = SimulatedDrive {
            sensor: drive::laser(&ROBOT.laser),
            ticks,
            building_from_start: Pose::IDENTITY,
        };
        self.n_batches += 1;
        let [batch] = &driven.batches(N_TICKS_A_ROUND)[..] else { panic!("one round, one batch") };
        let batch = v1::Batch { number: self.n_batches, ..batch.clone() };
        let sent = door.upload(&self.session.id, self.session.epoch, Upload::Batch(batch)).await;
        assert_eq!(sent.expect("a good batch").rejected, [], "nothing is wrong with it");
        eventually("that it is mapped", || async {
            let now = door.session(&self.session.id).await.expect("it is open");
            (self.n_batches <= now.mapped_through).then_some(())
        })
        .await;
        n_ticks
    }

    /// Goes the way that it was given, by where it takes itself to be; stands where it was given none.
    fn follow(&mut self, given: &v1::RobotExploration) {
        let here = given.pose.expect("it has a place");
        let here = Pose::new(here.x_m, here.y_m, here.theta_rad);
        let truth_from_map = self.drive.truth() * here.inverse();
        let way = given.points.iter().map(|at| truth_from_map * Point2::new(at.x_m, at.y_m));
        self.drive.follow(&way.collect::<Vec<_>>());
    }
}

pub(crate) fn map_from_building(building: &Building) -> Pose {
    let origin = building.place('A').expect("a place that is drawn");
    Pose::new(origin.x, origin.y, 0.0).inverse()
}

fn asked(map: &str, explorers: Vec<Kind>) -> v1::GetExplorationRequest {
    let kind = v1::robot_choice::Kind::RobotRadiusM(RADIUS_M);
    v1::GetExplorationRequest {
        map: map.to_owned(),
        explorers: explorers.into_iter().map(|kind| v1::Explorer { kind: Some(kind) }).collect(),
        robot: Some(v1::RobotChoice { kind: Some(kind) }),
        ..Default::default()
    }
}

/// Has robots explore until they can reach nothing unexplored: how often two had goals at once.
async fn explored<D: Door>(door: &D, map: &str, robots: &mut [Explorer<'_>]) -> u32 {
    let names = robots.iter().map(|robot| Kind::Robot(robot.name.clone())).collect();
    explored_by(door, asked(map, names), robots).await
}

/// The same by a question.
async fn explored_by<D: Door>(
    door: &D,
    request: v1::GetExplorationRequest,
    robots: &mut [Explorer<'_>],
) -> u32 {
    let (mut n_shared, mut n_done) = (0, 0);
    for _ in 0..N_ROUNDS_MAX {
        for robot in &mut *robots {
            robot.drive_on(door).await;
        }
        let now = door.exploration(request.clone()).await.expect("a good question");
        assert!(now.live, "the map as it grows: {now:?}");
        assert_eq!(now.robots.len(), robots.len(), "each is told: {now:?}");
        assert_eq!(now.frame_session, request.session, "in the frame asked for: {now:?}");
        assert_eq!(now.frontier_m == 0.0, now.frontiers.is_empty(), "{now:?}");
        for (robot, given) in robots.iter_mut().zip(&now.robots) {
            assert_eq!((&given.robot, &given.session), (&robot.name, &robot.session.id), "{now:?}");
            let is_going = given.code() == Code::Ok;
            let is_idle = matches!(given.code(), Code::Explored | Code::LeftToOthers);
            assert!(is_going || is_idle, "it is where it can be: {given:?}");
            assert_eq!(given.points.last(), given.goal.as_ref(), "the way ends there: {given:?}");
            match given.code() {
                Code::Explored if n_done == 0 => robot.drive.look_around(),
                Code::Explored => {}
                _ => robot.follow(given),
            }
        }
        let goals: Vec<_> = now.robots.iter().filter_map(|given| given.goal).collect();
        if let [a, b] = goals[..] {
            n_shared += 1;
            assert_ne!(a, b, "not both to the same");
        }
        if now.explored {
            assert!(goals.is_empty() && now.frontier_m == 0.0, "nothing is left: {now:?}");
        }
        n_done = if now.explored { n_done + 1 } else { 0 };
        if n_done == N_ROUNDS_DONE {
            return n_shared;
        }
    }
    panic!("not explored after {N_ROUNDS_MAX} rounds");
}

/// Share of the cells that a robot can be at, by the drawing, which a grid has observed.
fn seen_share(building: &Building, grid: &v1::Grid) -> f64 {
    let info = building.info();
    let origin = grid.origin.expect("a grid has one");
    let is_seen = |point: Point2<f64>| {
        let at = map_from_building(building) * point;
        let column = ((at.x - origin.x_m) / grid.resolution_m).floor();
        let row = ((at.y - origin.y_m) / grid.resolution_m).floor();
        let (width, height) = (f64::from(grid.width), f64::from(grid.height));
        let is_inside = 0.0 <= column && column < width && 0.0 <= row && row < height;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "inside")]
        let index = (row * width + column) as usize;
        is_inside && grid.cells[index] != 255
    };
    let cells = (0..info.height.cast_signed())
        .flat_map(|y| (0..info.width.cast_signed()).map(move |x| Cell { x, y }));
    let free = cells.map(|cell| info.frame.center_of(cell));
    let free: Vec<_> = free.filter(|&point| building.is_free(point, RADIUS_M)).collect();
    let n_seen = free.iter().filter(|&&point| is_seen(point)).count();
    n_seen as f64 / free.len() as f64
}

async fn one_robot_and_then_two<D: Door>(door: &D) {
    let building = rooms().building;
    for places in ["A", "AB"] {
        let map = format!("rooms-{}", places.len());
        door.create_map(&map, 0.05).await.expect("a new map");
        refused(door.exploration(asked(&map, vec![])).await, "NOTHING_OBSERVED");
        let mut robots = Vec::new();
        for place in places.chars() {
            robots.push(Explorer::new(door, &map, &building, place).await);
        }
        let n_shared = explored(door, &map, &mut robots).await;
        assert_eq!(0 < n_shared, places.len() == 2, "two go to two places: {n_shared}");
        let all = door.exploration(asked(&map, vec![])).await.expect("all with open sessions");
        assert_eq!(all.robots.len(), robots.len(), "{all:?}");
        follows_the_relaxed_map(door, &map, &building, &robots).await;
        // Drawn where robots were, and not where they took themselves to be, it may have holes.
        explored(door, &map, &mut robots).await;
        for robot in &robots {
            finished(door, &robot.session).await;
        }
        let grid = door.grid(&map, 0, None).await.expect("a version");
        let share = seen_share(&building, &grid);
        assert!(0.995 < share, "{share} of what can be reached was seen");
        published(door, &map, &robots[0].name).await;
    }
}

/// The map is drawn again by a relaxation while the robots stand there: they are told of the new one.
async fn follows_the_relaxed_map<D: Door>(
    door: &D,
    map: &str,
    building: &Building,
    robots: &[Explorer<'_>],
) {
    let (map, kind) = (map.to_owned(), v1::JobKind::Relax.into());
    let request = v1::CreateJobRequest { map: map.clone(), kind, ..Default::default() };
    let job = door.start_job(request).await.expect("there is something to relax");
    let job = job_done(door, &job.id).await;
    assert_eq!(job.state, i32::from(v1::JobState::Succeeded), "{job:?}");
    let now = door.exploration(asked(&map, vec![])).await.expect("a good question");
    assert!(now.live && job.result_version <= now.map_version, "the new map: {now:?}");
    for (robot, given) in robots.iter().zip(&now.robots) {
        let at = given.pose.expect("it has a place");
        let truth = map_from_building(building) * robot.drive.truth();
        let error_m = truth.step_to(Pose::new(at.x_m, at.y_m, at.theta_rad)).distance_m();
        assert!(error_m < 0.15, "{error_m} m off in the map that is drawn again: {given:?}");
    }
}

/// What a version says when all is over.
async fn published<D: Door>(door: &D, map: &str, robot: &str) {
    let here = Kind::Position(v1::Point { x_m: 0.1, y_m: 0.0 });
    let far = Kind::Position(v1::Point { x_m: 1e4, y_m: 0.0 });
    let wall = Kind::Position(v1::Point { x_m: 2.0, y_m: 2.75 });
    let newest = door.version(map, 0).await.expect("it was published").number;
    let request =
        |explorers| v1::GetExplorationRequest { map_version: newest, ..asked(map, explorers) };
    let of_version = door.exploration(request(vec![here.clone()])).await.expect("good");
    assert!(of_version.explored && !of_version.live, "{of_version:?}");
    assert_eq!(of_version.map_version, newest, "{of_version:?}");
    assert!(20.0 < of_version.reached_m2, "{of_version:?}");
    assert!(of_version.reached_m2 < of_version.observed_m2, "{of_version:?}");
    let odd = vec![Kind::Robot(robot.to_owned()), far, wall, here.clone()];
    let odd = door.exploration(request(odd)).await.expect("good");
    let codes: Vec<Code> = odd.robots.iter().map(v1::RobotExploration::code).collect();
    let expected = [Code::NotPlaced, Code::OutsideMap, Code::StartOccupied, Code::Explored];
    assert_eq!(codes, expected, "{odd:?}");
    assert!(!odd.explored, "nobody knows of the others: {odd:?}");
    closed_doors_bar_ways(door, map, request(vec![here.clone()]), of_version.reached_m2).await;
    let picture = v1::GetExplorationRequest { picture: true, ..request(vec![here.clone()]) };
    let png = door.exploration_picture(picture).await.expect("a picture");
    assert!(png.starts_with(b"\x89PNG"), "a PNG");
    let many = refused(door.exploration(request(vec![here; 33])).await, "INVALID_FIELD");
    assert!(many.message.contains("33, at most 32"), "{many:?}");
    let nobody = Kind::Robot("nobody".to_owned());
    refused(door.exploration(request(vec![nobody])).await, "ROBOT_NOT_FOUND");
    refused(door.exploration(asked("no-map", vec![])).await, "MAP_NOT_FOUND");
    let later = v1::GetExplorationRequest { map_version: 999, ..asked(map, vec![]) };
    refused(door.exploration(later).await, "VERSION_NOT_FOUND");
}

/// Each arc closed by itself, then open again. The rooms have one door each.
async fn closed_doors_bar_ways<D: Door>(
    door: &D,
    map: &str,
    request: v1::GetExplorationRequest,
    reached_m2: f64,
) {
    let graph = door.graph(map, request.map_version, v1::GraphPruning::Unspecified, false).await;
    let arcs = graph.expect("a version has one").arcs;
    assert!(!arcs.is_empty(), "rooms with doors");
    let mut n_bars = 0;
    for arc in &arcs {
        door.close_arc(map, arc.id, "").await.expect("an arc of it");
        let closed = door.exploration(request.clone()).await.expect("good");
        assert!(closed.missing_arcs.is_empty(), "it has all: {closed:?}");
        assert!(closed.reached_m2 <= reached_m2, "{closed:?}");
        n_bars += usize::from(closed.reached_m2 < reached_m2 - 2.0);
        door.open_arc(map, arc.id).await.expect("it is closed");
    }
    assert!(0 < n_bars, "behind some door lies more than 2 of {reached_m2} square metres");
    let open = door.exploration(request).await.expect("good");
    assert!((open.reached_m2 - reached_m2).abs() < 1e-9, "as before: {open:?}");
}

/// A robot that nobody placed explores the frame that it maps in.
async fn of_unknown_start<D: Door>(door: &D) {
    let building = rooms().building;
    let map = "anywhere";
    door.create_map(map, 0.05).await.expect("a new map");
    let unknown = v1::start::Kind::Unknown(v1::UnknownStart {});
    let robot = Explorer::starting(door, map, (&building, 'B'), unknown).await;
    let session = robot.session.id.clone();
    let robots = &mut [robot];
    robots[0].drive_on(door).await;
    let all = asked(map, vec![]);
    let within = v1::GetExplorationRequest { session: session.clone(), ..all.clone() };
    explored_by(door, within.clone(), robots).await;
    refused(door.exploration(all).await, "NOTHING_OBSERVED");
    let placed = Explorer::new(door, map, &building, 'A').await;
    let robots = [robots[0].name.clone(), placed.name.clone()].map(Kind::Robot).to_vec();
    let of_both = v1::GetExplorationRequest { explorers: asked(map, robots).explorers, ..within };
    let told = door.exploration(of_both.clone()).await.expect("the frame has a grid");
    let elsewhere = |told: &v1::Exploration| {
        let codes = told.robots.iter().map(v1::RobotExploration::code);
        let frames = told.robots.iter().map(|robot| robot.frame_session.clone());
        codes.zip(frames).collect::<Vec<_>>()
    };
    let [_, of_placed] = &elsewhere(&told)[..] else { panic!("two: {told:?}") };
    assert_eq!(*of_placed, (Code::NotPlaced, Some(String::new())), "it lies in the map: {told:?}");
    let mut placed = placed;
    placed.drive_on(door).await;
    let of_map = v1::GetExplorationRequest { session: String::new(), ..of_both.clone() };
    let told = door.exploration(of_map).await.expect("the map has a grid");
    let [of_unplaced, _] = &elsewhere(&told)[..] else { panic!("two: {told:?}") };
    assert_eq!(*of_unplaced, (Code::NotPlaced, Some(session)), "it says whom to ask for: {told:?}");
    let in_map =
        v1::GetExplorationRequest { session: placed.session.id.clone(), ..of_both.clone() };
    refused(door.exploration(in_map).await, "SESSION_PLACED");
    let nobody =
        v1::GetExplorationRequest { session: uuid::Uuid::nil().to_string(), ..of_both.clone() };
    refused(door.exploration(nobody).await, "SESSION_NOT_FOUND");
    door.create_map("elsewhere", 0.05).await.expect("a new map");
    let other = v1::GetExplorationRequest { map: "elsewhere".to_owned(), ..of_both };
    refused(door.exploration(other).await, "INVALID_FIELD");
}

#[tokio::test(flavor = "multi_thread")]
async fn of_unknown_start_over_grpc() {
    let data = empty_folder();
    of_unknown_start(&Launch::at(data.path()).start().grpc()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn of_unknown_start_over_rest() {
    let data = empty_folder();
    of_unknown_start(&Launch::at(data.path()).start().rest()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn over_grpc() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    one_robot_and_then_two(&service.grpc()).await;
    let request = v1::GetExplorationRequest {
        explorers: vec![v1::Explorer { kind: None }],
        ..asked("rooms-1", vec![])
    };
    refused(service.grpc().exploration(request).await, "INVALID_FIELD");
}

#[tokio::test(flavor = "multi_thread")]
async fn over_rest_and_by_the_command() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    one_robot_and_then_two(&service.rest()).await;
    let picture = data.path().join("values.png").display().to_string();
    let url = service.url();
    let run = |arguments: &[&str]| {
        let all = [&["explore", "rooms-2", "--server", &url], arguments].concat();
        let done = meetpoint(&all).output().expect("the binary under test starts");
        (done.status.code(), String::from_utf8_lossy(&done.stdout).into_owned())
    };
    let (status, told) = run(&["--at", "0,0", "--radius", "0.3", "--png", &picture]);
    assert_eq!(status, Some(0), "{told}");
    assert!(told.contains("explored: nothing"), "{told}");
    assert!(std::fs::read(&picture).expect("it was written").starts_with(b"\x89PNG"), "a PNG");
    let (status, told) = run(&["--robot", "rooms-2-a", "--json"]);
    assert_eq!(status, Some(0), "{told}");
    assert!(told.contains("\"NOT_PLACED\""), "its session is closed: {told}");
}
