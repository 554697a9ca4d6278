//! The museum of S. Thrun, W. Burgard and D. Fox, "A probabilistic approach to concurrent mapping
//! and localization for mobile robots", Machine Learning 31 (1998), sections 7 and 8, in kind.
//!
//! In a hall 45 m long, nine markers are on the floor, all alike. A person drives the robot freely
//! from one to that of the four nearest that was met least often, around what is exhibited, and
//! presses the button on each. Where the markers are is made up, and so is the way.

use std::f64::consts::FRAC_PI_2;
use std::ops::RangeInclusive;

use meetpoint_geometry::Vector2;
use rand::seq::IndexedRandom;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::landmark_drive::{Waypoint, landmark_drive, n_controls};
use crate::landmark_travel::{Landmark, LandmarkTravel};
use crate::thrun_1998::{B21, landmarks, robot};
use crate::triangular_odometry::TriangularError;

/// The markers, in metres.
const MARKERS_M: [(f64, f64); 9] = [
    (3.0, 4.0),
    (4.0, 15.0),
    (12.0, 9.0),
    (18.0, 17.0),
    (20.0, 3.0),
    (28.0, 11.0),
    (34.0, 18.0),
    (37.0, 4.0),
    (43.0, 12.0),
];
/// A person drives on to one of this many nearest markers.
const N_NEAREST: usize = 4;
/// Half way, the robot is up to this far aside of the straight line, in metres.
const ASIDE_MAX_M: f64 = 3.0;
/// Length of a control, in metres: as in the paper's first data set.
const STEP_M: f64 = 0.14;
/// Sightings of the first run: 11 minutes at the tour guide's 36.6 cm/s are 240 m.
const N_SIGHTINGS: usize = 20;
/// Sightings of the second run: 12 minutes 19 seconds.
const N_SIGHTINGS_AGAIN: usize = 22;
/// Final odometric error: "approximately 25.1 meters", in metres.
const FINAL_ERROR_M: RangeInclusive<f64> = 24.6..=25.6;
/// And "almost 90 degrees", in radians.
const FINAL_TURN_RAD: RangeInclusive<f64> = 0.9 * FRAC_PI_2..=FRAC_PI_2;
/// Final odometric error of the second run, in metres; the paper does not print it.
const FINAL_ERROR_AGAIN_M: RangeInclusive<f64> = 10.0..=25.0;
/// Steady drift, in radians a metre; made up so that 240 m bring 90 degrees.
const DRIFT_MAX_RAD_PER_M: f64 = 0.01;

/// The run that the museum's map is made from (Figs. 16 and 17): 20 sightings of nine markers, each
/// of them seen at least twice; dead reckoning ends 25.1 m and almost 90 degrees off, about.
pub fn museum(seed: u64) -> LandmarkTravel {
    let first_marker = 0;
    run(ChaCha8Rng::seed_from_u64(seed), first_marker, N_SIGHTINGS, |travel| {
        let error = travel.dead_reckoning_error(travel.n_controls());
        FINAL_ERROR_M.contains(&error.distance_m())
            && FINAL_TURN_RAD.contains(&error.theta_rad.abs())
    })
}

/// A second run past the same markers, from the other end of the hall (Fig. 18): 22 sightings, dead
/// reckoning ends 10 to 25 m off.
pub fn museum_again(seed: u64) -> LandmarkTravel {
    let first_marker = MARKERS_M.len() - 1;
    run(ChaCha8Rng::seed_from_u64(seed), first_marker, N_SIGHTINGS_AGAIN, |travel| {
        FINAL_ERROR_AGAIN_M.contains(&travel.final_error_m())
    })
}

/// A run that meets every marker twice or more often, with errors that are drawn until the travel
/// is fit.
fn run(
    mut rng: ChaCha8Rng,
    first_marker: usize,
    n_sightings: usize,
    is_fit: impl Fn(&LandmarkTravel) -> bool,
) -> LandmarkTravel {
    let markers = landmarks(&MARKERS_M);
    loop {
        let walk = walk(&markers, first_marker, n_sightings, &mut rng);
        if !(0..markers.len()).all(|marker| 2 <= n_met(&walk, marker)) {
            continue;
        }
        let waypoints = around_exhibits(&markers, &walk, &mut rng);
        let drift_rad_per_m = rng.random_range(-DRIFT_MAX_RAD_PER_M..DRIFT_MAX_RAD_PER_M);
        let robot = robot(TriangularError { drift_rad_per_m, ..B21 });
        let n_controls = n_controls(&waypoints, STEP_M);
        let travel = landmark_drive(&markers, &waypoints, &robot, n_controls, &mut rng);
        if is_fit(&travel) {
            return travel;
        }
    }
}

/// From marker to marker, never straight back.
fn walk(markers: &[Landmark], first: usize, n_sightings: usize, rng: &mut impl Rng) -> Vec<usize> {
    let mut walk = vec![first];
    let (mut before, mut here) = (first, first);
    while walk.len() < n_sightings {
        let mut nearest: Vec<usize> = (0..markers.len()).filter(|&next| next != here).collect();
        let distance_m = |next: usize| (markers[next].position - markers[here].position).norm();
        nearest.sort_by(|&a, &b| distance_m(a).total_cmp(&distance_m(b)));
        nearest.truncate(N_NEAREST);
        nearest.retain(|&next| next != before);
        let least = nearest.iter().map(|&next| n_met(&walk, next)).min();
        nearest.retain(|&next| Some(n_met(&walk, next)) == least);
        let next = nearest.choose(rng).copied().unwrap_or(before);
        (before, here) = (here, next);
        walk.push(here);
    }
    walk
}

/// How often a walk meets a marker.
fn n_met(walk: &[usize], marker: usize) -> usize {
    walk.iter().filter(|&&met| met == marker).count()
}

/// The walk, with a point aside of the straight line half way to each marker.
fn around_exhibits(markers: &[Landmark], walk: &[usize], rng: &mut impl Rng) -> Vec<Waypoint> {
    let marker = |index: usize| markers[index].position;
    let mut waypoints = Vec::new();
    for (place, &here) in walk.iter().enumerate() {
        if let Some(before) = place.checked_sub(1) {
            let way = marker(here) - marker(walk[before]);
            let aside = Vector2::new(-way.y, way.x).normalize();
            let aside_m = rng.random_range(-ASIDE_MAX_M..ASIDE_MAX_M);
            let position = marker(walk[before]) + way / 2.0 + aside * aside_m;
            waypoints.push(Waypoint { position, landmark: None, floor_rad_per_m: 0.0 });
        }
        let (position, landmark) = (marker(here), Some(here));
        waypoints.push(Waypoint { position, landmark, floor_rad_per_m: 0.0 });
    }
    waypoints
}
