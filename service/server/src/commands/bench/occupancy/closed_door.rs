//! A robot whose way leads through a door that was closed since the map was made (T98, Fig. 11): how much it has to
//! see until the map has changed so far that the plan is another, and what that costs it.
//!
//! The plan is the shortest path on the map as it grows, asked for every second. A robot that stands before a wall
//! on its way looks around, as the paper's moved in a circle: the mapper draws nothing of a robot that stands.

use anyhow::Context;
use meetpoint_geometry::{Point2, Pose};
use meetpoint_occupancy::Grid;
use meetpoint_planning::{Cost, Search, Space, enterable};
use meetpoint_sim::{Building, ChaCha8Rng, Drive, Laser, Robot, Tick, World, lab};
use meetpoint_topology::FreeSpace;
use meetpoint_tracking::{
    LiveMap, MappingParams, Observation, ObservationKind, Sensor, SensorKind, SessionConfig,
    SessionKey,
};
use rand::SeedableRng;

/// Edge of a cell, in metres.
const RESOLUTION_M: f64 = 0.05;
/// The robot keeps so much off walls, in metres: ten centimetres more than it has.
const RADIUS_M: f64 = 0.3;
/// A scan every fifth of a second.
const ROBOT: Robot = Robot { n_ticks_per_scan: 4, ..Robot::INDOOR };
/// Ticks between two plans: a second.
const N_TICKS_A_ROUND: usize = 20;
/// Rounds after which the robot is given up.
const N_ROUNDS_MAX: u32 = 300;
/// A robot that has a wall this near ahead, in metres, and is to go on looks around first.
const STOPPED_M: f64 = 0.8;
/// The robot has arrived this near to its goal, in metres.
const ARRIVED_M: f64 = 0.3;
/// A robot that is too near to a wall for its plan goes on from a cell this near, along both axes.
const N_CELLS_NEAR: usize = 6;
/// Robots.
const N_SEEDS: u64 = 10;

/// What happened on the way.
#[derive(Debug, Default)]
struct Trip {
    /// Scans made on ways through the closed door.
    n_scans: usize,
    /// Time spent on them, in seconds.
    seconds: f64,
    /// Length of the whole way that was driven, in metres.
    driven_m: f64,
}

/// Prints a table with a row for every robot.
pub(super) fn print() -> anyhow::Result<()> {
    println!(
        "| seed | way by the map, m | scans until the plan was another | seconds | driven in all, m | \
         had it known, m |"
    );
    println!("|{}", "---|".repeat(6));
    for seed in 1..=N_SEEDS {
        let World { mut building, tours } = lab();
        let [start, goal] = ['A', 'B'].map(|name| building.place(name));
        let (start, goal) = start.zip(goal).context("places of the drawing")?;
        let mut map = LiveMap::new(MappingParams::INDOOR, RESOLUTION_M)
            .map_err(|_| anyhow::anyhow!("no length"))?;
        let rng = ChaCha8Rng::seed_from_u64(seed);
        let tour = Drive::new(&building, ROBOT, &tours[0], 0, rng).context("no way around")?;
        open(&mut map, SessionKey(0), tour.truth());
        for tick in tour {
            see(&mut map, SessionKey(0), tick);
        }
        let before = way(map.grid(), start, goal).context("a way through the door")?;
        building.set_door('1', true);
        let trip = driven(&mut map, &building, seed, (start, goal))?;
        let known = way(map.grid(), start, goal).context("the other way")?;
        println!(
            "| {seed} | {:.1} | {} | {:.0} | {:.1} | {:.1} |",
            length_m(&before),
            trip.n_scans,
            trip.seconds,
            trip.driven_m,
            length_m(&known)
        );
    }
    Ok(())
}

fn open(map: &mut LiveMap, key: SessionKey, map_from_start: Pose) {
    let laser = Laser::INDOOR;
    let geometry = laser.geometry();
    let kind = SensorKind::Laser(geometry);
    let sensor = Sensor { robot_from_sensor: laser.robot_from_laser, kind };
    map.open_session(key, SessionConfig { map_from_start, sensors: vec![sensor] });
}

/// Where the robot takes itself to be, if there was a scan.
fn see(map: &mut LiveMap, key: SessionKey, tick: Tick) -> Option<Pose> {
    let Tick { stamp_ns, truth: _, odometry, scan } = tick;
    map.apply(key, &Observation { stamp_ns, kind: ObservationKind::OdometryPose(odometry) });
    let kind = ObservationKind::LaserScan { sensor: 0, ranges_m: scan? };
    Some(map.apply(key, &Observation { stamp_ns, kind })?.map_from_robot)
}

/// From start to goal by plans on the map as it grows, with the door closed.
fn driven(
    map: &mut LiveMap,
    building: &Building,
    seed: u64,
    (start, goal): (Point2<f64>, Point2<f64>),
) -> anyhow::Result<Trip> {
    let key = SessionKey(1);
    let rng = ChaCha8Rng::seed_from_u64(1000 + seed);
    let begin = Pose::new(start.x, start.y, 0.0);
    let hour_ns = 3_600_000_000_000;
    let mut robot = Drive::standing(building, ROBOT, begin, hour_ns, rng).context("no room")?;
    open(map, key, begin);
    let (mut trip, mut here, mut is_turning) = (Trip::default(), begin, false);
    for _ in 0..N_ROUNDS_MAX {
        let planned = way(map.grid(), here.position(), goal);
        let truth_from_map = robot.truth() * here.inverse();
        let points: Vec<_> =
            planned.into_iter().flatten().map(|point| truth_from_map * point).collect();
        let blocked = is_blocked(building, &points);
        let ahead_m =
            building.range_m(robot.truth().position(), robot.truth().theta_rad, STOPPED_M);
        if !is_turning && blocked && ahead_m.is_some() {
            robot.look_around();
            is_turning = true;
        } else if !(is_turning && blocked) {
            robot.follow(&points);
            is_turning = false;
        }
        let (before_s, mut n_ticks) = (robot.elapsed_s(), 0);
        for _ in 0..N_TICKS_A_ROUND {
            let from = robot.truth();
            let Some(tick) = robot.next() else { break };
            n_ticks += 1;
            trip.driven_m += from.step_to(robot.truth()).distance_m();
            let has_scan = tick.scan.is_some();
            here = see(map, key, tick).unwrap_or(here);
            trip.n_scans += usize::from(blocked && has_scan);
        }
        is_turning &= n_ticks == N_TICKS_A_ROUND;
        if blocked {
            trip.seconds += robot.elapsed_s() - before_s;
        }
        if (robot.truth().position() - goal).norm() < ARRIVED_M {
            return Ok(trip);
        }
    }
    anyhow::bail!("robot {seed} is not there after {N_ROUNDS_MAX} seconds: {trip:?}")
}

/// The shortest path on a grid: centres of its cells.
fn way(grid: &Grid, from: Point2<f64>, to: Point2<f64>) -> Option<Vec<Point2<f64>>> {
    let free = FreeSpace::from_raster(&grid.raster(None), FreeSpace::PROBABILITY_MAX);
    let (info, frame) = (free.info(), grid.frame());
    let space = Space::uniform(info, &enterable(&free, RADIUS_M)).ok()?;
    let [from, to] = [from, to].map(|point| info.index_of(frame.cell_at(point)));
    let (from, to) = from.zip(to)?;
    let mut search = Search::default();
    // From where the robot is, though it be too near to a wall, the cells about it are tried.
    let seeds = near(from, info.width as usize, info.n_cells()).map(|cell| (cell, 0));
    search.flood(&space, seeds, Cost::MAX);
    let cells = search.path(&space, to);
    let all: Vec<_> = info.cells().collect();
    let center = |index: usize| frame.center_of(all[index]);
    (!cells.is_empty()).then(|| cells.into_iter().map(center).collect())
}

/// Cells no farther than this along both axes.
fn near(cell: usize, width: usize, n_cells: usize) -> impl Iterator<Item = usize> {
    let side = 0..=2 * N_CELLS_NEAR;
    let middles =
        side.clone().filter_map(move |dy| (cell + dy * width).checked_sub(N_CELLS_NEAR * width));
    let cells = middles.flat_map(move |middle| {
        side.clone().filter_map(move |dx| (middle + dx).checked_sub(N_CELLS_NEAR))
    });
    cells.filter(move |&cell| cell < n_cells)
}

/// Whether a way leads into a wall.
fn is_blocked(building: &Building, way: &[Point2<f64>]) -> bool {
    way.windows(2).any(|pair| {
        let step = pair[1] - pair[0];
        let wall_m = building.range_m(pair[0], step.y.atan2(step.x), step.norm());
        wall_m.is_some()
    })
}

fn length_m(way: &[Point2<f64>]) -> f64 {
    way.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum()
}
