//! Local control strategies: how to get from place to place (KB 1988, section 2.3).

use std::f64::consts::{FRAC_PI_2, PI};

use meetpoint_geometry::angle_between;

use super::ring::Ring;
use super::surroundings::Scale;

/// Turn for every metre off the line.
const TURN_RAD_PER_M: f64 = 0.5;
/// Turn for every radian that the line is turned.
const TURN_RAD_PER_RAD: f64 = 0.45;
/// Sharpest turn between two steps.
const TURN_MAX_RAD: f64 = 0.35;

/// A local control strategy.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Strategy {
    /// In the middle between an object on either side.
    FollowMidline,
    /// At a distance from the object on the left.
    WalkAlongLeft,
    /// At a distance from the object on the right.
    WalkAlongRight,
    /// Straight on: there is nothing to go by.
    BlindStep,
}

/// The rules: which strategy fits, for a robot that travels along `heading_rad`.
pub fn fitting(ring: &Ring, heading_rad: f64, scale: &Scale) -> Strategy {
    let is_near = |side_rad: f64| ring.nearest_m(heading_rad + side_rad, 0.2 * PI) <= scale.open_m;
    match (is_near(FRAC_PI_2), is_near(-FRAC_PI_2)) {
        (true, true) => Strategy::FollowMidline,
        (true, false) => Strategy::WalkAlongLeft,
        (false, true) => Strategy::WalkAlongRight,
        (false, false) => Strategy::BlindStep,
    }
}

/// How far to turn before the next small step, counter-clockwise.
pub fn steering_rad(strategy: Strategy, ring: &Ring, heading_rad: f64, scale: &Scale) -> f64 {
    let line = match strategy {
        Strategy::FollowMidline => {
            let sides = [FRAC_PI_2, -FRAC_PI_2].map(|side| beside(ring, heading_rad, side, scale));
            match sides {
                [Some(left), Some(right)] => Line {
                    left_by_m: left.left_by_m.midpoint(right.left_by_m),
                    turned_rad: left.turned_rad.midpoint(right.turned_rad),
                },
                _ => return 0.0,
            }
        }
        Strategy::WalkAlongLeft => match beside(ring, heading_rad, FRAC_PI_2, scale) {
            Some(wall) => Line { left_by_m: wall.left_by_m - scale.wall_m, ..wall },
            None => return 0.0,
        },
        Strategy::WalkAlongRight => match beside(ring, heading_rad, -FRAC_PI_2, scale) {
            Some(wall) => Line { left_by_m: wall.left_by_m + scale.wall_m, ..wall },
            None => return 0.0,
        },
        Strategy::BlindStep => return 0.0,
    };
    let turn_rad = TURN_RAD_PER_M * line.left_by_m + TURN_RAD_PER_RAD * line.turned_rad;
    turn_rad.clamp(-TURN_MAX_RAD, TURN_MAX_RAD)
}

/// A line beside a robot, or one to follow.
#[derive(Clone, Copy, Debug)]
struct Line {
    /// How far it is to the left of the robot, in metres.
    left_by_m: f64,
    /// Its direction, from the robot's.
    turned_rad: f64,
}

/// The object on one side: the mean of what is near there, weighed by nearness, as a line across its
/// direction. So a corner is walked around as a wall is walked along.
fn beside(ring: &Ring, heading_rad: f64, side_rad: f64, scale: &Scale) -> Option<Line> {
    let on_side = |at_rad: f64| angle_between(heading_rad + side_rad, at_rad);
    let near = || {
        let readings = ring.readings().map(|(at_rad, range_m)| (on_side(at_rad), range_m));
        readings.filter(|&(off_rad, range_m)| off_rad.abs() < 1.2 && range_m <= scale.open_m)
    };
    let least_m = near().map(|(_, range_m)| range_m).fold(f64::INFINITY, f64::min).max(1e-6);
    let (mut sum, mut sum_off_rad) = (0.0, 0.0);
    for (off_rad, range_m) in near() {
        let weight = (-6.0 * (range_m / least_m - 1.0)).exp();
        sum += weight;
        sum_off_rad += weight * off_rad;
    }
    let turned_rad = sum_off_rad / sum;
    let (mut sum, mut sum_m) = (0.0, 0.0);
    for (off_rad, range_m) in near().filter(|(off_rad, _)| (off_rad - turned_rad).abs() < 0.6) {
        sum += 1.0;
        sum_m += range_m * (off_rad - turned_rad).cos();
    }
    (0.0 < sum).then(|| Line { left_by_m: side_rad.signum() * sum_m / sum, turned_rad })
}
