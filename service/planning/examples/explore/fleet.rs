//! Robots that share a map and explore it.

use meetpoint_geometry::{Point2, Pose};
use meetpoint_planning::{Errand, Exploration, ExplorationParams, Known, exploration_rectangle};
use meetpoint_sim::{ChaCha8Rng, Drive, Robot, Tick};
use meetpoint_tracking::{
    LiveMap, MappingParams, Observation, ObservationKind, Sensor, SensorKind, SessionConfig,
    SessionKey,
};
use rand::SeedableRng;

use super::floor::Floor;

/// Edge of a cell of the map, in metres.
const RESOLUTION_M: f64 = 0.05;
/// Ticks between two questions: a second.
const N_TICKS_A_ROUND: usize = 20;
/// Robots are done that were told so for so many rounds, in which they turned around: one wrong reading
/// may close a door for a while.
const N_ROUNDS_DONE: u32 = 6;
/// Who is not done after so many seconds is stopped.
const DURATION_MAX_S: f64 = 1800.0;
/// Robots with a scan every fifth of a second.
const ROBOT: Robot = Robot { n_ticks_per_scan: 4, ..Robot::INDOOR };

/// What came of it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Account {
    /// Share of the floor that can be reached which was observed.
    pub(crate) seen_share: f64,
    /// Until nothing was left, by the robots' clocks.
    pub(crate) duration_s: f64,
    /// That all robots truly drove together.
    pub(crate) way_m: f64,
    /// Share of the time that robots had a goal.
    pub(crate) at_work_share: f64,
    /// Mean distance of the poses from the truth.
    pub(crate) error_mean_m: f64,
    /// Length of the frontiers at the end.
    pub(crate) left_m: f64,
}

impl Account {
    /// Figure by figure.
    pub(crate) fn mean(accounts: &[Self]) -> Self {
        let mean = |of: fn(&Self) -> f64| {
            accounts.iter().map(of).sum::<f64>() / accounts.len().max(1) as f64
        };
        Self {
            seen_share: mean(|account| account.seen_share),
            duration_s: mean(|account| account.duration_s),
            way_m: mean(|account| account.way_m),
            at_work_share: mean(|account| account.at_work_share),
            error_mean_m: mean(|account| account.error_mean_m),
            left_m: mean(|account| account.left_m),
        }
    }
}

/// A robot, and where the map has it.
struct Member<'a> {
    drive: Drive<'a>,
    map_from_robot: Pose,
}

/// Robots in a building whose frame is the map's.
pub(crate) struct Fleet<'a> {
    floor: &'a Floor<'a>,
    map: LiveMap,
    members: Vec<Member<'a>>,
    exploration: Exploration,
    params: ExplorationParams,
    /// Rounds since when all were told that nothing is left.
    n_rounds_done: u32,
    way_m: f64,
    errors_m: Vec<f64>,
}

impl<'a> Fleet<'a> {
    /// Robots that start side by side and know where.
    pub(crate) fn new(
        floor: &'a Floor<'a>,
        n_robots: usize,
        params: ExplorationParams,
        seed: u64,
    ) -> Self {
        let mut map = LiveMap::new(MappingParams::INDOOR, RESOLUTION_M).expect("a length");
        let mut members = vec![];
        for (number, start) in (0..).zip(floor.starts(n_robots)) {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(number);
            let drive = Drive::standing(floor.building, ROBOT, start, 0, rng).expect("room");
            let config = SessionConfig { map_from_start: start, sensors: vec![laser()] };
            map.open_session(SessionKey(number.into()), config);
            members.push(Member { drive, map_from_robot: start });
        }
        let exploration = Exploration::new(params);
        let (way_m, errors_m) = (0.0, vec![]);
        Self { floor, map, members, exploration, params, n_rounds_done: 0, way_m, errors_m }
    }

    /// Has the robots explore until nothing is left.
    pub(crate) fn explored(mut self) -> Account {
        let (mut n_rounds, mut n_at_work) = (0_u32, 0_usize);
        let round_s = N_TICKS_A_ROUND as f64 * ROBOT.tick_ns as f64 * 1e-9;
        let left_m = loop {
            self.drive_on();
            let (is_done, left_m, n_going) = self.ask();
            n_rounds += 1;
            n_at_work += n_going;
            if is_done || DURATION_MAX_S < f64::from(n_rounds) * round_s {
                break left_m;
            }
        };
        let n_robots = self.members.len() as f64;
        Account {
            seen_share: self.floor.seen_share(self.map.grid()),
            duration_s: f64::from(n_rounds) * round_s,
            way_m: self.way_m,
            at_work_share: n_at_work as f64 / (n_robots * f64::from(n_rounds)),
            error_mean_m: self.errors_m.iter().sum::<f64>() / self.errors_m.len().max(1) as f64,
            left_m,
        }
    }

    /// A second of everybody's way, by turns.
    fn drive_on(&mut self) {
        for (number, member) in (0..).zip(&mut self.members) {
            let key = SessionKey(number);
            let mut before = member.drive.truth().position();
            for tick in member.drive.by_ref().take(N_TICKS_A_ROUND) {
                self.way_m += (tick.truth.position() - before).norm();
                before = tick.truth.position();
                for kind in observed(&tick) {
                    let stamp_ns = tick.stamp_ns;
                    if let Some(estimate) = self.map.apply(key, &Observation { stamp_ns, kind }) {
                        member.map_from_robot = estimate.map_from_robot;
                        let error = tick.truth.step_to(estimate.map_from_robot);
                        self.errors_m.push(error.distance_m());
                    }
                }
            }
        }
    }

    /// Asks where to go: whether nothing is left, how much, and how many have a goal.
    fn ask(&mut self) -> (bool, f64, usize) {
        let Some(bounds) = self.map.grid().bounds() else { return (false, 0.0, 0) };
        let rectangle = exploration_rectangle(bounds, self.params.radius_m);
        let raster = self.map.grid().raster(Some(rectangle));
        let known = Known { info: raster.info, log_odds: &raster.log_odds, closed: &[] };
        let points: Vec<Point2<f64>> =
            self.members.iter().map(|member| member.map_from_robot.position()).collect();
        let explored = self.exploration.explore(&known, &points).expect("one number a cell");
        let mut n_going = 0;
        for (member, errand) in self.members.iter_mut().zip(&explored.errands) {
            let Errand::Go(way) = errand else {
                match errand {
                    Errand::Explored if self.n_rounds_done == 0 => member.drive.look_around(),
                    Errand::Explored => {}
                    _ => member.drive.follow(&[]),
                }
                continue;
            };
            n_going += 1;
            // The robot goes by where it takes itself to be.
            let truth_from_map = member.drive.truth() * member.map_from_robot.inverse();
            let way: Vec<_> = way.points.iter().map(|&point| truth_from_map * point).collect();
            member.drive.follow(&way);
        }
        let is_done = explored.errands.iter().all(|errand| *errand == Errand::Explored);
        self.n_rounds_done = if is_done { self.n_rounds_done + 1 } else { 0 };
        (N_ROUNDS_DONE <= self.n_rounds_done, explored.frontier_m(), n_going)
    }
}

/// What a robot sends of a tick; the odometry of a scan comes with it.
fn observed(tick: &Tick) -> impl Iterator<Item = ObservationKind> {
    let scan = tick.scan.clone();
    let scan = scan.map(|ranges_m| ObservationKind::LaserScan { sensor: 0, ranges_m });
    std::iter::once(ObservationKind::OdometryPose(tick.odometry)).chain(scan)
}

fn laser() -> Sensor {
    let laser = ROBOT.laser;
    let geometry = laser.geometry();
    Sensor { robot_from_sensor: laser.robot_from_laser, kind: SensorKind::Laser(geometry) }
}
