//! What a robot sees that has arrived at a distinctive place.

use std::f64::consts::{FRAC_PI_4, PI};

use meetpoint_geometry::{Point2, angle_between, wrap_angle};

use super::distinctiveness::Goal;
use super::surroundings::{NearObject, OpenDirection, Surroundings};
use super::travel_edge::Traversal;
use crate::observation::{Observation, View};
use crate::star::{N_GATEWAYS_MAX, Opening, Star};

/// Directions are taken for one another up to this angle.
const SAME_RAD: f64 = 0.75;
/// Opposite directions within this angle are one path.
const STRAIGHT_RAD: f64 = FRAC_PI_4;
/// A robot came in by an open direction that is less than this off where it came from, in radians: 72
/// degrees, less than from one arm of a crossing to the next.
const CAME_FROM_RAD: f64 = 0.4 * PI;

/// A place as seen on arrival: its signature, and how the robot got there.
#[derive(Clone, Debug, PartialEq)]
pub struct Arrival {
    /// What was maximised.
    pub goal: Goal,
    /// The directions that are open, clockwise; the first is where the robot came from.
    pub directions: Vec<OpenDirection>,
    /// What stands near.
    pub objects: Vec<NearObject>,
    /// Whether this is "home".
    pub is_home: bool,
    /// The way here; `None` at the first place.
    pub traversal: Option<Traversal>,
    /// Where this is by dead reckoning, in metres.
    pub position: Point2<f64>,
}

impl Arrival {
    /// Of a robot that came from the direction `from_rad`, or, if it came from nowhere, looks along
    /// `from_rad`; `None` if no open direction is where it came from, or there are more than a star has.
    pub(crate) fn new(
        goal: Goal,
        around: &Surroundings,
        from_rad: f64,
        is_first: bool,
    ) -> Option<Self> {
        let (first, off_rad) = around.direction_towards(from_rad)?;
        let is_there = is_first || around.directions.len() == 1 || off_rad < CAME_FROM_RAD;
        let mut directions = around.directions.clone();
        directions.rotate_left(first);
        let objects = around.objects.clone();
        let arrival = Self {
            goal,
            directions,
            objects,
            is_home: false,
            traversal: None,
            position: Point2::origin(),
        };
        (is_there && around.directions.len() <= N_GATEWAYS_MAX).then_some(arrival)
    }

    /// The same place as a star, read from where the robot came in.
    ///
    /// # Panics
    /// Never: there are 1 to 32 directions, and opposite ones are found from both.
    pub fn observation(&self) -> Observation {
        let n = self.directions.len();
        let opposite = |index: usize| {
            let straight = |&other: &usize| {
                let (a, b) = (self.directions[index], self.directions[other]);
                let bend_rad = angle_between(a.heading_rad + PI, b.heading_rad).abs();
                bend_rad < STRAIGHT_RAD
            };
            let mut found = (0..n).filter(|&other| other != index).filter(straight);
            found.next().filter(|_| found.next().is_none())
        };
        let opening = |index: usize| {
            let other = opposite(index).filter(|&other| opposite(other) == Some(index));
            let onward = other.map_or(0, |other| (other + n - index) % n);
            let continues_after = u8::try_from(onward).unwrap_or(0);
            Opening { continues_after, control_law: self.directions[index].control_law }
        };
        let star = Star::new((0..n).map(opening).collect()).expect("mutual, and not empty");
        let view = self.is_home.then(|| View { name: "home".to_owned(), is_unique: true });
        Observation { star, view }
    }

    /// The direction of gateway `to` as seen now, where gateway `came_by` is the first direction.
    pub(crate) fn heading_to(&self, came_by: u8, to: u8) -> f64 {
        let n = self.directions.len();
        let index = (usize::from(to) + n - usize::from(came_by) % n) % n;
        self.directions[index].heading_rad
    }

    /// The same place as seen by one who came by its direction `index`.
    pub(crate) fn come_by(mut self, index: usize) -> Self {
        let n = self.directions.len();
        self.directions.rotate_left(index % n);
        self
    }

    /// The same place as seen through a frame that is turned clockwise by that angle.
    pub(crate) fn turned(mut self, by_rad: f64) -> Self {
        for direction in &mut self.directions {
            direction.heading_rad = wrap_angle(direction.heading_rad + by_rad);
        }
        self
    }

    /// How far this place is turned counter-clockwise against `known`, if the two look alike where
    /// this one's first direction is that one's `gateway`: the same number of directions by the same
    /// laws at about the same angles, the same goal.
    pub fn turned_against(&self, known: &Self, gateway: u8) -> Option<f64> {
        let n = known.directions.len();
        if self.directions.len() != n || self.goal != known.goal || self.is_home != known.is_home {
            return None;
        }
        let pairs = || {
            let onward = (0..n).map(|index| known.directions[(index + usize::from(gateway)) % n]);
            self.directions.iter().copied().zip(onward)
        };
        if pairs().any(|(a, b)| a.control_law != b.control_law) {
            return None;
        }
        let off_rad =
            |(a, b): (OpenDirection, OpenDirection)| angle_between(b.heading_rad, a.heading_rad);
        // The mean of directions, as that of the points on a circle.
        let (sin, cos) = pairs()
            .map(off_rad)
            .fold((0.0, 0.0), |(sin, cos), off_rad| (sin + off_rad.sin(), cos + off_rad.cos()));
        let turned_rad = f64::atan2(sin, cos);
        let fits = pairs().all(|pair| angle_between(turned_rad, off_rad(pair)).abs() < SAME_RAD);
        fits.then(|| wrap_angle(turned_rad))
    }
}
