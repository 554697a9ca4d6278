//! A robot on its way: what it truly does, and what its odometry and laser say.
//!
//! The robot steers for a point of its path a little ahead (R. C. Coulter, "Implementation of the
//! pure pursuit path tracking algorithm", CMU-RI-TR-92-01): it turns towards it, slower the more
//! it has to turn, within its limits of speed, turn rate and acceleration.

use std::f64::consts::TAU;

use meetpoint_geometry::{Point2, Pose, angle_between};
use rand_chacha::ChaCha8Rng;

use crate::building::Building;
use crate::laser::Laser;
use crate::odometry::{Odometer, OdometryError};
use crate::route::{filled, route};

/// The point steered for lies this far ahead on the path, in metres: corners are cut by less than
/// [`CLEARANCE_SPARE_M`].
const LOOK_AHEAD_M: f64 = 0.35;
/// Paths keep this much more off the walls than the robot's radius, in metres.
const CLEARANCE_SPARE_M: f64 = 0.12;
/// Turn rate for every radian off the course, per second.
const STEERING_GAIN_PER_S: f64 = 3.0;
/// Beyond this angle off the course the robot turns on the spot, in radians.
const OFF_COURSE_MAX_RAD: f64 = 0.6;
/// A robot this near to the end of its path has arrived, in metres.
const ARRIVED_M: f64 = 0.1;
/// A drive that takes this many times what its length needs is given up: a guard, not a tuning.
const DURATION_FACTOR_MAX: f64 = 20.0;
/// Ticks that the shortest way is given: time to turn around first.
const N_TICKS_LEAST: u32 = 200;

/// The same on ways that somebody else gives, which turn about corners as near as the robot can.
const LOOK_AHEAD_GIVEN_M: f64 = 0.2;
/// A robot that has touched something goes back so fast, in metres a second...
const BACK_M_PER_S: f64 = 0.2;
/// ...for so many ticks: ten centimetres.
const N_TICKS_BACK: u32 = 10;

/// How a robot is built.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Robot {
    /// Radius of the disc that it needs, in metres.
    pub radius_m: f64,
    /// Fastest speed, in metres a second.
    pub speed_max_m_per_s: f64,
    /// Fastest turn, in radians a second.
    pub turn_max_rad_per_s: f64,
    /// Strongest acceleration and braking, in metres a second squared.
    pub acceleration_max_m_per_s2: f64,
    /// Time between ticks, each with odometry, in nanoseconds; positive.
    pub tick_ns: i64,
    /// Ticks from one scan to the next; at least 1.
    pub n_ticks_per_scan: u32,
    /// Its laser.
    pub laser: Laser,
    /// How its odometry errs.
    pub odometry_error: OdometryError,
}

impl Robot {
    /// A cleaning or delivery robot: 0.7 m/s, odometry 20 and scans 10 times a second.
    pub const INDOOR: Self = Self {
        radius_m: 0.2,
        speed_max_m_per_s: 0.7,
        turn_max_rad_per_s: 1.2,
        acceleration_max_m_per_s2: 1.0,
        tick_ns: 50_000_000,
        n_ticks_per_scan: 2,
        laser: Laser::INDOOR,
        odometry_error: OdometryError::UNCALIBRATED,
    };
}

/// One moment of a drive.
#[derive(Clone, Debug, PartialEq)]
pub struct Tick {
    /// The robot's clock, in nanoseconds.
    pub stamp_ns: i64,
    /// Where the robot truly is: its pose in the building's frame.
    pub truth: Pose,
    /// Where its odometry has it, in a frame that begins where the drive begins.
    pub odometry: Pose,
    /// What its laser saw: metres, one a beam, as REP 117. `None` between scans.
    pub scan: Option<Vec<f32>>,
}

/// Stops a robot before it touches a wall, and has it go back a little.
#[derive(Clone, Copy, Debug, Default)]
struct Bumper {
    /// Ticks that it still goes back.
    n_ticks_back: u32,
}

/// A robot driving through a building; an iterator over its ticks until it has arrived.
#[derive(Clone, Debug)]
pub struct Drive<'a> {
    building: &'a Building,
    robot: Robot,
    path: Vec<Point2<f64>>,
    /// The point of the path that the robot steers for.
    next: usize,
    truth: Pose,
    speed_m_per_s: f64,
    odometer: Odometer,
    start_ns: i64,
    n_ticks: u32,
    n_ticks_max: u32,
    /// How far it still turns on the spot to look around, in radians.
    turn_left_rad: f64,
    /// What is needed on ways that somebody else gives; `None` on ways that are known to be free.
    bumper: Option<Bumper>,
    rng: ChaCha8Rng,
}

impl<'a> Drive<'a> {
    /// A drive from the first waypoint, facing along the path, through all others to the last,
    /// beginning at `start_ns` of the robot's clock. `None` if there is no such way.
    pub fn new(
        building: &'a Building,
        robot: Robot,
        waypoints: &[Point2<f64>],
        start_ns: i64,
        rng: ChaCha8Rng,
    ) -> Option<Self> {
        let path = route(building, waypoints, robot.radius_m + CLEARANCE_SPARE_M)?;
        let start = path[0];
        let ahead = path.iter().find(|&&point| LOOK_AHEAD_M < (point - start).norm())?;
        let truth = Pose::new(start.x, start.y, bearing_rad(start, *ahead));
        Some(Self {
            building,
            robot,
            n_ticks_max: n_ticks_max(&path, &robot),
            path,
            next: 0,
            truth,
            speed_m_per_s: 0.0,
            odometer: Odometer::new(robot.odometry_error),
            start_ns,
            n_ticks: 0,
            turn_left_rad: 0.0,
            bumper: None,
            rng,
        })
    }

    /// A robot that stands at a pose of the building's frame until it is told where to go by
    /// [`Drive::follow`]: one tick, and the end. `None` where it does not fit.
    pub fn standing(
        building: &'a Building,
        robot: Robot,
        pose: Pose,
        start_ns: i64,
        rng: ChaCha8Rng,
    ) -> Option<Self> {
        building.is_free(pose.position(), robot.radius_m).then(|| Self {
            building,
            robot,
            path: vec![pose.position()],
            next: 0,
            truth: pose,
            speed_m_per_s: 0.0,
            odometer: Odometer::new(robot.odometry_error),
            start_ns,
            n_ticks: 0,
            n_ticks_max: 1,
            turn_left_rad: 0.0,
            bumper: Some(Bumper::default()),
            rng,
        })
    }

    /// Has the robot go another way from now on: straight from point to point of the building's
    /// frame, but rounding corners. It stops where walls are; where the way ends, the ticks do.
    pub fn follow(&mut self, way: &[Point2<f64>]) {
        let mut points = vec![self.truth.position()];
        points.extend(way);
        self.path = filled(&points);
        self.next = 0;
        let more = n_ticks_max(&self.path, &self.robot).max(N_TICKS_LEAST);
        self.n_ticks_max = self.n_ticks.saturating_add(more);
        self.turn_left_rad = 0.0;
        self.bumper.get_or_insert_default();
    }

    /// Has the robot turn around once where it is, in place of its way.
    pub fn look_around(&mut self) {
        self.follow(&[]);
        self.turn_left_rad = TAU;
    }

    /// Seconds since the robot started, by its clock.
    pub fn elapsed_s(&self) -> f64 {
        f64::from(self.n_ticks) * self.tick_s()
    }

    /// Where the robot truly is now, in the building's frame; before the first tick, where it
    /// starts.
    pub fn truth(&self) -> Pose {
        self.truth
    }

    /// Length of the whole way, in metres.
    pub fn length_m(&self) -> f64 {
        length_m(&self.path)
    }

    fn has_arrived(&self) -> bool {
        let is_last = self.next + 1 == self.path.len() && self.turn_left_rad <= 0.0;
        is_last && (self.path[self.next] - self.truth.position()).norm() < ARRIVED_M
    }

    /// Moves the robot for the time of one tick.
    fn advance(&mut self) {
        if 0.0 < self.turn_left_rad {
            let turn_rad = (self.robot.turn_max_rad_per_s * self.tick_s()).min(self.turn_left_rad);
            self.turn_left_rad -= turn_rad;
            self.speed_m_per_s = 0.0;
            return self.step(arc(0.0, turn_rad));
        }
        let position = self.truth.position();
        let look_ahead_m = if self.bumper.is_some() { LOOK_AHEAD_GIVEN_M } else { LOOK_AHEAD_M };
        let is_near = |index: usize| (self.path[index] - position).norm() < look_ahead_m;
        let last = self.path.len() - 1;
        while self.next < last && is_near(self.next) {
            self.next += 1;
        }
        let target = self.path[self.next];
        let off_course_rad = angle_between(self.truth.theta_rad, bearing_rad(position, target));
        let remaining_m = if self.next == last { (target - position).norm() } else { f64::MAX };
        self.speed_m_per_s = self.new_speed_m_per_s(off_course_rad, remaining_m);
        let turn_max = self.robot.turn_max_rad_per_s;
        let turn_rad_per_s = (STEERING_GAIN_PER_S * off_course_rad).clamp(-turn_max, turn_max);

        let step = arc(self.speed_m_per_s * self.tick_s(), turn_rad_per_s * self.tick_s());
        let step = self.bumped(step);
        self.step(step);
    }

    fn step(&mut self, step: Pose) {
        self.truth = self.truth * step;
        self.odometer.count(step, &mut self.rng);
    }

    /// The step that is taken in place of one that might lead into a wall.
    fn bumped(&mut self, wanted: Pose) -> Pose {
        let Some(bumper) = self.bumper else { return wanted };
        let is_free =
            |step: Pose| self.building.is_free((self.truth * step).position(), self.robot.radius_m);
        let back = arc(-BACK_M_PER_S * self.tick_s(), 0.0);
        let on_the_spot = arc(0.0, wanted.theta_rad);
        let (step, n_ticks_back) = match bumper.n_ticks_back {
            0 if is_free(wanted) => return wanted,
            0 => (on_the_spot, N_TICKS_BACK),
            n if is_free(back) => (back, n - 1),
            _ => (on_the_spot, 0),
        };
        self.speed_m_per_s = 0.0;
        self.bumper = Some(Bumper { n_ticks_back });
        step
    }

    fn new_speed_m_per_s(&self, off_course_rad: f64, remaining_m: f64) -> f64 {
        let acceleration = self.robot.acceleration_max_m_per_s2;
        let on_course = (1.0 - off_course_rad.abs() / OFF_COURSE_MAX_RAD).max(0.0);
        let stopping_m_per_s = (2.0 * acceleration * remaining_m).sqrt();
        let wished = (self.robot.speed_max_m_per_s * on_course).min(stopping_m_per_s);
        let change = acceleration * self.tick_s();
        wished.clamp(self.speed_m_per_s - change, self.speed_m_per_s + change)
    }

    fn tick_s(&self) -> f64 {
        self.robot.tick_ns as f64 * 1e-9
    }
}

impl Iterator for Drive<'_> {
    type Item = Tick;

    fn next(&mut self) -> Option<Tick> {
        if 0 < self.n_ticks && self.has_arrived() || self.n_ticks == self.n_ticks_max {
            return None;
        }
        if 0 < self.n_ticks {
            self.advance();
        }
        let has_scan = self.n_ticks.is_multiple_of(self.robot.n_ticks_per_scan.max(1));
        let laser = &self.robot.laser;
        let scan = has_scan.then(|| laser.scan(self.building, self.truth, &mut self.rng));
        let stamp_ns = self.start_ns + i64::from(self.n_ticks) * self.robot.tick_ns;
        self.n_ticks += 1;
        let odometry = self.odometer.odometry_from_robot();
        Some(Tick { stamp_ns, truth: self.truth, odometry, scan })
    }
}

/// The step of a robot that drives `length_m` metres while it turns by `turn_rad`.
fn arc(length_m: f64, turn_rad: f64) -> Pose {
    // The chord of a short arc is as long as the arc to within 1e-4 of it at the turns of a tick.
    let half_rad = turn_rad / 2.0;
    Pose::new(length_m * half_rad.cos(), length_m * half_rad.sin(), turn_rad)
}

fn bearing_rad(from: Point2<f64>, to: Point2<f64>) -> f64 {
    (to.y - from.y).atan2(to.x - from.x)
}

fn length_m(path: &[Point2<f64>]) -> f64 {
    path.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum()
}

/// After how many ticks a drive is given up.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "saturating on purpose: a limit"
)]
fn n_ticks_max(path: &[Point2<f64>], robot: &Robot) -> u32 {
    let driving_s = length_m(path) / robot.speed_max_m_per_s;
    (DURATION_FACTOR_MAX * driving_s / (robot.tick_ns as f64 * 1e-9)) as u32
}
