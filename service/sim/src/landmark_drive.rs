//! A robot driven from waypoint to waypoint by a person: it turns on the spot, then goes straight.
//!
//! It does not meet a waypoint exactly, but passes within [`LandmarkRobot::pass_offset_max_m`] of
//! it, evenly distributed over that disc. A button is pressed there; what it says (range 0) is
//! wrong by this much.

use std::f64::consts::TAU;

use meetpoint_geometry::{Point2, Pose, Vector2, angle_between};
use rand::{Rng, RngExt};

use crate::landmark_sensor::LandmarkSensor;
use crate::landmark_travel::{Landmark, LandmarkTravel, Moment, TrueSighting};
use crate::triangular_odometry::TriangularError;

/// A turn of one radian takes as many controls as this many metres: an RWI B21 at 36 cm/s and 40
/// degrees a second.
const TURN_M_PER_RAD: f64 = 0.5;

/// A point that a robot is driven to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Waypoint {
    /// Where it is in the building's frame, in metres.
    pub position: Point2<f64>,
    /// The landmark that is there: an index into the building's landmarks.
    pub landmark: Option<usize>,
    /// What the floor of the way to this point adds to the robot's own drift, in radians a metre:
    /// 0 but where carpet pulls.
    pub floor_rad_per_m: f64,
}

/// How a robot is driven, measures its way and finds landmarks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LandmarkRobot {
    /// How its odometry errs.
    pub odometry_error: TriangularError,
    /// How it finds landmarks. A detector sees the landmark last passed and the one next on the
    /// way; walls hide the others.
    pub sensor: LandmarkSensor,
    /// Waypoints are met to within this distance, in metres.
    pub pass_offset_max_m: f64,
}

/// Controls that a drive takes if one is a step of about `step_m` metres.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a positive length over a step is a small count"
)]
pub fn n_controls(waypoints: &[Waypoint], step_m: f64) -> usize {
    let points: Vec<Point2<f64>> = waypoints.iter().map(|waypoint| waypoint.position).collect();
    let way_m: f64 = legs(&points).iter().map(|leg| leg.turning_m() + leg.length_m()).sum();
    (way_m / step_m).round() as usize
}

/// Drives a robot to all waypoints in turn, in `n_controls` controls of about equal size; in more
/// only if there are legs shorter than a control. It starts at the first, facing the second.
///
/// # Panics
/// If there is no waypoint, or one names a landmark that is not there.
pub fn landmark_drive(
    landmarks: &[Landmark],
    waypoints: &[Waypoint],
    robot: &LandmarkRobot,
    n_controls: usize,
    rng: &mut impl Rng,
) -> LandmarkTravel {
    let mut pass =
        |waypoint: &Waypoint| waypoint.position + vector_within_disc(robot.pass_offset_max_m, rng);
    let passed: Vec<Point2<f64>> = waypoints.iter().map(&mut pass).collect();
    let legs = legs(&passed);
    let start_rad = legs.first().map_or(0.0, |leg| leg.heading_before_rad);
    let start = Pose::new(passed[0].x, passed[0].y, start_rad);
    let mut near = Near { behind: waypoints[0].landmark, ahead: None, upon: waypoints[0].landmark };
    let sightings = near.sightings(landmarks, start, &robot.sensor, rng);
    let mut moments = vec![Moment { odometry: Pose::IDENTITY, truth: start, sightings }];
    let counts = controls_of_legs(&legs, n_controls);
    for (index, (leg, counts)) in legs.iter().zip(counts).enumerate() {
        let ahead = &waypoints[index + 1..];
        let error = robot.odometry_error.command(ahead[0].floor_rad_per_m, rng);
        near.ahead = ahead.iter().find_map(|waypoint| waypoint.landmark);
        let n_moments = moments.len() + counts.n_turning + counts.n_driving;
        for truth in leg.poses(counts) {
            let is_last = moments.len() + 1 == n_moments;
            near.upon = ahead[0].landmark.filter(|_| is_last);
            let before = &moments[moments.len() - 1];
            let odometry = before.odometry * error.measured(before.truth.step_to(truth));
            let sightings = near.sightings(landmarks, truth, &robot.sensor, rng);
            moments.push(Moment { odometry, truth, sightings });
        }
        near.behind = ahead[0].landmark.or(near.behind);
    }
    LandmarkTravel { landmarks: landmarks.to_vec(), moments }
}

/// Landmarks that no wall hides from the robot.
struct Near {
    /// The one last passed.
    behind: Option<usize>,
    /// The next on the way.
    ahead: Option<usize>,
    /// The one that the robot drives over at this moment.
    upon: Option<usize>,
}

impl Near {
    fn sightings(
        &self,
        landmarks: &[Landmark],
        truth: Pose,
        sensor: &LandmarkSensor,
        rng: &mut impl Rng,
    ) -> Vec<TrueSighting> {
        let ahead = self.ahead.filter(|_| self.ahead != self.behind);
        let both = self.behind.into_iter().chain(ahead);
        let sighting = |index| {
            let is_upon = self.upon == Some(index);
            sensor.sighting((index, landmarks[index]), truth, is_upon, rng)
        };
        both.filter_map(sighting).collect()
    }
}

/// The way from one waypoint to the next.
struct Leg {
    from: Point2<f64>,
    to: Point2<f64>,
    /// Heading before the turn, in radians.
    heading_before_rad: f64,
    /// The turn on the spot before the straight way, in radians.
    turn_rad: f64,
}

impl Leg {
    fn length_m(&self) -> f64 {
        (self.to - self.from).norm()
    }

    /// Metres that could be driven while the robot turns.
    fn turning_m(&self) -> f64 {
        TURN_M_PER_RAD * self.turn_rad.abs()
    }

    /// The pose after every control.
    fn poses(&self, counts: LegControls) -> impl Iterator<Item = Pose> {
        let LegControls { n_turning, n_driving } = counts;
        let share = |index: usize, n: usize| (index + 1) as f64 / n as f64;
        let turning = (0..n_turning).map(move |index| {
            let heading_rad = self.heading_before_rad + share(index, n_turning) * self.turn_rad;
            Pose::new(self.from.x, self.from.y, heading_rad)
        });
        let driving = (0..n_driving).map(move |index| {
            let position = self.from + share(index, n_driving) * (self.to - self.from);
            Pose::new(position.x, position.y, self.heading_before_rad + self.turn_rad)
        });
        turning.chain(driving)
    }
}

/// Legs through these points; none turns before the first.
fn legs(points: &[Point2<f64>]) -> Vec<Leg> {
    let mut heading_before_rad = None;
    let leg = |pair: &[Point2<f64>]| {
        let way = pair[1] - pair[0];
        let heading_rad = way.y.atan2(way.x);
        let before_rad = heading_before_rad.replace(heading_rad).unwrap_or(heading_rad);
        let turn_rad = angle_between(before_rad, heading_rad);
        Leg { from: pair[0], to: pair[1], heading_before_rad: before_rad, turn_rad }
    };
    points.windows(2).map(leg).collect()
}

/// Controls of one leg.
#[derive(Clone, Copy)]
struct LegControls {
    /// Controls that turn on the spot; where there are none, the first on the way turns, too.
    n_turning: usize,
    /// Controls on the straight way; at least 1.
    n_driving: usize,
}

/// Shares `n_controls` out among the legs, in proportion to their lengths and turns.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a share of a count is between 0 and the count"
)]
fn controls_of_legs(legs: &[Leg], n_controls: usize) -> Vec<LegControls> {
    let way_m: f64 = legs.iter().map(|leg| leg.turning_m() + leg.length_m()).sum();
    let (mut done_m, mut n_done) = (0.0, 0);
    let mut n_for = |part_m: f64, n_min: usize| {
        done_m += part_m;
        let n_until = (n_controls as f64 * done_m / way_m).round() as usize;
        let n = n_until.saturating_sub(n_done).max(n_min);
        n_done += n;
        n
    };
    let counts = |leg: &Leg| LegControls {
        n_turning: n_for(leg.turning_m(), 0),
        n_driving: n_for(leg.length_m(), 1),
    };
    legs.iter().map(counts).collect()
}

/// A vector no longer than `radius_m`, evenly distributed over the disc.
fn vector_within_disc(radius_m: f64, rng: &mut impl Rng) -> Vector2<f64> {
    let distance_m = radius_m * rng.random::<f64>().sqrt();
    let (sin, cos) = (TAU * rng.random::<f64>()).sin_cos();
    Vector2::new(distance_m * cos, distance_m * sin)
}
