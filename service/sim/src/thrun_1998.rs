//! The data sets of S. Thrun, W. Burgard and D. Fox, "A probabilistic approach to concurrent
//! mapping and localization for mobile robots", Machine Learning 31 (1998), section 6, in kind:
//! what the paper prints of them holds, the rest is made up and said here.
//!
//! Landmarks are all alike, and a button is pressed within 0.3 m of them. Errors are drawn until
//! they end as printed.

use std::ops::RangeInclusive;

use meetpoint_geometry::{Point2, Vector2};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::landmark_drive::{LandmarkRobot, Waypoint, landmark_drive};
use crate::landmark_sensor::LandmarkSensor;
use crate::landmark_travel::{Landmark, LandmarkTravel};
use crate::triangular_odometry::TriangularError;

/// An RWI B21 on carpet and tiles: the random part of its errors. Widths are made up.
pub(crate) const B21: TriangularError = TriangularError {
    length_width_per_m: 0.06,
    heading_width_rad_per_m: 0.006,
    turn_width_rad_per_rad: 0.05,
    ..TriangularError::NONE
};
/// The button is pressed within this distance of a landmark, in metres.
const PASS_OFFSET_MAX_M: f64 = 0.3;

/// Controls of the first data set (Fig. 5).
const N_CONTROLS_FIRST: usize = 2972;
/// The large loop is closed with an error of "more than 14 meters"; how much more is made up.
const CLOSING_ERROR_M: RangeInclusive<f64> = 14.0..=18.0;
/// The final odometric error of the first data set is "approximately 24.9 meters" (Fig. 5).
const FINAL_ERROR_FIRST_M: RangeInclusive<f64> = 24.4..=25.4;
/// The sighting that closes the large loop: Fig. 8.
const CLOSING_SIGHTING: usize = 15;
/// Carpet turns the robot by no more than this, in radians a metre: 34 degrees in 60 m.
const CARPET_MAX_RAD_PER_M: f64 = 0.01;

/// Landmarks of the first data set, in metres: the small loop 0 to 3 of 16 by 14 m, and the large
/// one of 60 by 25 m on from place 1.
const FIRST_PLACES_M: [(f64, f64); 13] = [
    (-16.0, 0.0),
    (0.0, 0.0),
    (0.0, 14.0),
    (-16.0, 14.0),
    (22.0, 0.0),
    (41.0, 0.0),
    (60.0, 0.0),
    (60.0, 11.0),
    (60.0, 25.0),
    (43.0, 25.0),
    (19.0, 25.0),
    (0.0, 25.0),
    (-16.0, 25.0),
];
/// The small loop and a little more (6 sightings), the large loop, closed at the 15th, and the
/// large loop once more with the dead end beside it.
const FIRST_WALK: [usize; 27] =
    [0, 1, 2, 3, 0, 1, 4, 5, 6, 7, 8, 9, 10, 11, 2, 1, 4, 5, 6, 7, 8, 9, 10, 11, 12, 11, 2];
/// Sides of the large loop with carpet, by the y of both their ends, in metres: the drift is
/// systematic "in some of the corridors".
const CARPETS_Y_M: [f64; 2] = [0.0, 25.0];

/// The first data set (Figs. 5 to 11): a loop of 60 by 25 m with a smaller loop beside it, 2,972
/// controls, 27 sightings of 13 landmarks.
///
/// The small loop is driven first: sightings 1 to 5, with little error (Fig. 7). The 15th sighting
/// closes the large loop, more than 14 m off; from there on the robot is in known territory, but
/// for one dead end (sighting 25). It ends 24.9 m off, about. In the two long corridors carpet
/// turns the robot, in each by another amount.
pub fn first_data_set(seed: u64) -> LandmarkTravel {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let landmarks = landmarks(&FIRST_PLACES_M);
    loop {
        let mut waypoints = waypoints(&landmarks, &FIRST_WALK);
        for y_m in CARPETS_Y_M {
            let carpet_rad_per_m = rng.random_range(-CARPET_MAX_RAD_PER_M..CARPET_MAX_RAD_PER_M);
            lay_carpet(&mut waypoints, y_m, carpet_rad_per_m);
        }
        let robot = robot(B21);
        let travel = landmark_drive(&landmarks, &waypoints, &robot, N_CONTROLS_FIRST, &mut rng);
        let closing = travel.moment_of_sighting(CLOSING_SIGHTING).unwrap_or_default();
        let closing_m = travel.dead_reckoning_error(closing).distance_m();
        if CLOSING_ERROR_M.contains(&closing_m)
            && FINAL_ERROR_FIRST_M.contains(&travel.final_error_m())
        {
            return travel;
        }
    }
}

/// Lays carpet in the corridor of the large loop along this y.
fn lay_carpet(waypoints: &mut [Waypoint], y_m: f64, floor_rad_per_m: f64) {
    for index in 1..waypoints.len() {
        let ends = [waypoints[index - 1].position, waypoints[index].position];
        if ends.iter().all(|end| end.y == y_m && 0.0 <= end.x) {
            waypoints[index].floor_rad_per_m = floor_rad_per_m;
        }
    }
}

/// Controls of the second data set (Fig. 12).
const N_CONTROLS_SECOND: usize = 2091;
/// Final odometric error of the second data set, in metres. The paper does not print it.
const FINAL_ERROR_SECOND_M: RangeInclusive<f64> = 8.0..=14.0;
/// Steady drift of the second data set, in radians a metre; made up.
const DRIFT_SECOND_MAX_RAD_PER_M: f64 = 0.003;

/// Landmarks of the second data set, in metres: a corridor of 60 m along y = 0, and others off it,
/// of which three make a loop of 18 by 17 m.
const SECOND_PLACES_M: [(f64, f64); 9] = [
    (0.0, 0.0),
    (13.0, 0.0),
    (30.0, 0.0),
    (48.0, 0.0),
    (13.0, -15.0),
    (30.0, 17.0),
    (48.0, 17.0),
    (60.0, 0.0),
    (20.0, 17.0),
];
/// 24 steps, as many as Fig. 14 has.
const SECOND_WALK: [usize; 24] =
    [0, 1, 4, 1, 2, 3, 7, 3, 6, 5, 2, 3, 6, 5, 8, 5, 2, 1, 0, 1, 2, 3, 6, 5];
/// In a crowd, the robot goes straight for this far, in metres.
const DODGE_EVERY_M: f64 = 3.0;
/// In a crowd, the robot goes aside by up to this, in metres.
const DODGE_MAX_M: f64 = 0.8;

/// The second data set (Figs. 12 to 14): another part of the building, 2,091 controls, 24 sightings
/// of nine landmarks; one corridor, the longest, is so crowded that the robot has to dodge people
/// all along.
pub fn second_data_set(seed: u64) -> LandmarkTravel {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let landmarks = landmarks(&SECOND_PLACES_M);
    loop {
        let waypoints = dodging(&waypoints(&landmarks, &SECOND_WALK), &mut rng);
        let drift_rad_per_m =
            rng.random_range(-DRIFT_SECOND_MAX_RAD_PER_M..DRIFT_SECOND_MAX_RAD_PER_M);
        let robot = robot(TriangularError { drift_rad_per_m, ..B21 });
        let travel = landmark_drive(&landmarks, &waypoints, &robot, N_CONTROLS_SECOND, &mut rng);
        if FINAL_ERROR_SECOND_M.contains(&travel.final_error_m()) {
            return travel;
        }
    }
}

/// The same way with points aside of it where it follows the crowded corridor.
fn dodging(waypoints: &[Waypoint], rng: &mut impl Rng) -> Vec<Waypoint> {
    let mut dodging = vec![waypoints[0]];
    for pair in waypoints.windows(2) {
        let (from, to) = (pair[0].position, pair[1].position);
        let is_crowded = from.y == 0.0 && to.y == 0.0;
        let way = to - from;
        let mut driven_m = DODGE_EVERY_M;
        while is_crowded && driven_m + DODGE_EVERY_M / 2.0 < way.norm() {
            let aside = Vector2::new(0.0, rng.random_range(-DODGE_MAX_M..DODGE_MAX_M));
            let position = from + way.normalize() * driven_m + aside;
            dodging.push(Waypoint { position, landmark: None, floor_rad_per_m: 0.0 });
            driven_m += DODGE_EVERY_M;
        }
        dodging.push(pair[1]);
    }
    dodging
}

/// Landmarks all alike.
pub(crate) fn landmarks(places_m: &[(f64, f64)]) -> Vec<Landmark> {
    let landmark =
        |&(x_m, y_m): &(f64, f64)| Landmark { position: Point2::new(x_m, y_m), landmark_type: 0 };
    places_m.iter().map(landmark).collect()
}

/// A walk from landmark to landmark.
fn waypoints(landmarks: &[Landmark], walk: &[usize]) -> Vec<Waypoint> {
    let waypoint = |&index: &usize| Waypoint {
        position: landmarks[index].position,
        landmark: Some(index),
        floor_rad_per_m: 0.0,
    };
    walk.iter().map(waypoint).collect()
}

/// A robot with a person at the button.
pub(crate) fn robot(odometry_error: TriangularError) -> LandmarkRobot {
    LandmarkRobot {
        odometry_error,
        sensor: LandmarkSensor::BUTTON,
        pass_offset_max_m: PASS_OFFSET_MAX_M,
    }
}
