//! NX, the robot of B. J. Kuipers and Y.-T. Byun, "A robust, qualitative method for robot spatial
//! learning", AAAI 1988: sixteen sonars all around, chains that turn it and move it, a compass or none.
//!
//! A reading is the distance to what the middle of the cone meets, with a random error of a share
//! of that distance (the paper: "subject to a 10% random error"; how it is distributed it does not
//! say):
//!
//! ```text
//! reading = distance (1 + e),      e ~ N(0, share²)
//! ```

use std::f64::consts::TAU;

use meetpoint_geometry::{Point2, Pose};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use crate::building::Building;
use crate::odometry::{Odometer, OdometryError};

/// Sonars around the robot.
const N_SONARS: u32 = 16;
/// Farther walls are not heard, in metres.
const RANGE_MAX_M: f64 = 6.0;
/// It comes no nearer to walls than this, in metres.
const RADIUS_M: f64 = 0.2;
/// Distances within which the mark of "home" is seen, in metres.
const HOME_M: f64 = 1.0;

/// How NX senses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NxSenses {
    /// Standard deviation of a reading, as a share of the distance.
    pub range_error: f64,
    /// How its wheels err.
    pub odometry_error: OdometryError,
    /// Whether headings come from a compass, or else from the wheels.
    pub has_compass: bool,
}

/// NX in a building.
#[derive(Clone, Debug)]
pub struct Nx<'a> {
    building: &'a Building,
    senses: NxSenses,
    building_from_robot: Pose,
    odometer: Odometer,
    moved_m: f64,
    ranges_m: Vec<f64>,
    home: Option<Point2<f64>>,
    rng: ChaCha8Rng,
}

impl<'a> Nx<'a> {
    /// NX at a pose of the building. Without a compass its headings begin at 0.
    pub fn new(building: &'a Building, start: Pose, senses: NxSenses, rng: ChaCha8Rng) -> Self {
        let odometer = Odometer::new(senses.odometry_error);
        let ranges_m = Vec::new();
        let mut nx = Self {
            building,
            senses,
            building_from_robot: start,
            odometer,
            moved_m: 0.0,
            ranges_m,
            home: None,
            rng,
        };
        nx.fire();
        nx
    }

    /// Puts the mark where everybody sees that this is home.
    pub fn with_home(mut self, home: Point2<f64>) -> Self {
        self.home = Some(home);
        self
    }

    /// Where it really is.
    pub fn truth(&self) -> Pose {
        self.building_from_robot
    }

    /// Turns on the spot, counter-clockwise, and fires.
    pub fn turn(&mut self, by_rad: f64) {
        self.step(Pose::new(0.0, 0.0, by_rad));
    }

    /// Moves ahead, or back, but into no wall, and fires.
    pub fn advance(&mut self, by_m: f64) {
        self.step(Pose::new(by_m, 0.0, 0.0));
    }

    /// Stays, and fires.
    pub fn look(&mut self) {
        self.moved_m = 0.0;
        self.fire();
    }

    fn fire(&mut self) {
        let from = self.building_from_robot;
        let reading = |index: u32| {
            let bearing_rad = from.theta_rad + TAU * f64::from(index) / f64::from(N_SONARS);
            let range_m = self.building.range_m(from.position(), bearing_rad, RANGE_MAX_M);
            let error: f64 = self.rng.sample(StandardNormal);
            range_m.map_or(f64::INFINITY, |range_m| {
                (range_m * (1.0 + self.senses.range_error * error)).max(0.0)
            })
        };
        self.ranges_m = (0..N_SONARS).map(reading).collect();
    }

    fn step(&mut self, step: Pose) {
        let next = self.building_from_robot * step;
        self.moved_m = 0.0;
        if self.building.is_free(next.position(), RADIUS_M) {
            let before = self.odometer.odometry_from_robot();
            self.building_from_robot = next;
            self.odometer.count(step, &mut self.rng);
            let after = self.odometer.odometry_from_robot();
            self.moved_m = (after.position() - before.position()).norm();
        }
        self.fire();
    }

    /// The last firing, in metres, ahead first, then counter-clockwise; `+inf` where nothing came back.
    pub fn ranges_m(&self) -> &[f64] {
        &self.ranges_m
    }

    /// Its heading as it knows it.
    pub fn heading_rad(&self) -> f64 {
        if self.senses.has_compass {
            self.building_from_robot.theta_rad
        } else {
            self.odometer.odometry_from_robot().theta_rad
        }
    }

    /// How far its wheels say that the last step was, in metres.
    pub fn moved_m(&self) -> f64 {
        self.moved_m
    }

    /// Whether it sees the mark of home.
    pub fn sees_home(&self) -> bool {
        let here = self.building_from_robot.position();
        self.home.is_some_and(|home| (home - here).norm() <= HOME_M)
    }
}
