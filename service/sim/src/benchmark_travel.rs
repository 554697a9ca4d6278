//! A hundred random buildings, and more: travels that relaxation is judged by.
//!
//! A seed determines the building ([`random_building`]), whose 10 to 15 landmarks look all alike,
//! and a tour ([`tour`]) of 28 to 34 sightings, about half a metre a control; a person presses the
//! button within 0.3 m of a landmark. Both kinds of a seed share them and differ in odometry:
//!
//! * [`BenchmarkKind::RandomError`]: triangular errors of widths that are drawn for the robot, and
//!   a small drift; dead reckoning ends 4 to 15 m off.
//! * [`BenchmarkKind::SteadyDrift`]: mostly a steady drift of heading with every metre and every
//!   turn, of random sign, with random errors of the smaller widths of the first kind; dead
//!   reckoning ends 10 to 35 m off.
//!
//! Errors are drawn until the distance between the true and the measured final position, both from
//! the same start, lies in its interval.

use std::ops::{Range, RangeInclusive};

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::corridors::Corridors;
use crate::landmark_drive::{LandmarkRobot, landmark_drive, n_controls};
use crate::landmark_sensor::LandmarkSensor;
use crate::landmark_travel::LandmarkTravel;
use crate::random_building::random_building;
use crate::tour::tour;
use crate::triangular_odometry::TriangularError;

/// Sightings of a tour.
const N_SIGHTINGS: RangeInclusive<usize> = 28..=34;
/// Length of a control, in metres.
const STEP_M: f64 = 0.5;
/// A person presses the button within this distance of a landmark, in metres.
const PASS_OFFSET_MAX_M: f64 = 0.3;

/// How odometry errs in a benchmark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BenchmarkKind {
    /// Random errors: dead reckoning ends 4 to 15 m off.
    RandomError,
    /// Mostly steady drift of heading: dead reckoning ends 10 to 35 m off.
    SteadyDrift,
}

/// What the errors of a robot are drawn from.
struct ErrorRanges {
    /// Of [`TriangularError::length_width_per_m`].
    length_width_per_m: Range<f64>,
    /// Of [`TriangularError::heading_width_rad_per_m`].
    heading_width_rad_per_m: Range<f64>,
    /// Of [`TriangularError::turn_width_rad_per_rad`].
    turn_width_rad_per_rad: Range<f64>,
    /// Of the size of [`TriangularError::drift_rad_per_m`].
    drift_rad_per_m: Range<f64>,
    /// Of the size of [`TriangularError::drift_rad_per_rad`].
    drift_rad_per_rad: Range<f64>,
    /// Of the difference of [`TriangularError::scale`] from 1.
    scale_off: Range<f64>,
}

/// Widths that bring three of five tours into the interval, which is what they are chosen by; a
/// drift of up to 3 degrees in 100 m and 1 % of every turn.
const RANDOM_ERROR: ErrorRanges = ErrorRanges {
    length_width_per_m: 0.03..0.10,
    heading_width_rad_per_m: 0.004..0.012,
    turn_width_rad_per_rad: 0.03..0.10,
    drift_rad_per_m: 0.0..0.0005,
    drift_rad_per_rad: 0.0..0.01,
    scale_off: 0.0..0.01,
};

/// The smaller half of these widths, a drift of up to 34 degrees in 100 m and 5 % of every turn.
const STEADY_DRIFT: ErrorRanges = ErrorRanges {
    length_width_per_m: 0.03..0.065,
    heading_width_rad_per_m: 0.004..0.008,
    turn_width_rad_per_rad: 0.03..0.065,
    drift_rad_per_m: 0.001..0.006,
    drift_rad_per_rad: 0.01..0.05,
    scale_off: 0.0..0.02,
};

impl BenchmarkKind {
    /// How far off dead reckoning ends, in metres.
    pub fn final_error_m(self) -> RangeInclusive<f64> {
        match self {
            Self::RandomError => 4.0..=15.0,
            Self::SteadyDrift => 10.0..=35.0,
        }
    }

    /// Draws how a robot's odometry errs.
    pub fn odometry_error(self, rng: &mut impl Rng) -> TriangularError {
        let ranges = match self {
            Self::RandomError => &RANDOM_ERROR,
            Self::SteadyDrift => &STEADY_DRIFT,
        };
        let mut drawn = |range: &Range<f64>| rng.random_range(range.clone());
        let length_width_per_m = drawn(&ranges.length_width_per_m);
        let heading_width_rad_per_m = drawn(&ranges.heading_width_rad_per_m);
        let turn_width_rad_per_rad = drawn(&ranges.turn_width_rad_per_rad);
        let mut either_sign =
            |range: &Range<f64>| drawn_sign(rng) * rng.random_range(range.clone());
        TriangularError {
            scale: 1.0 + either_sign(&ranges.scale_off),
            drift_rad_per_m: either_sign(&ranges.drift_rad_per_m),
            drift_rad_per_rad: either_sign(&ranges.drift_rad_per_rad),
            length_width_per_m,
            heading_width_rad_per_m,
            turn_width_rad_per_rad,
        }
    }
}

fn drawn_sign(rng: &mut impl Rng) -> f64 {
    if rng.random() { 1.0 } else { -1.0 }
}

/// The building of a seed and the tour through it, place by place: the same for both kinds.
pub fn benchmark_tour(seed: u64) -> (Corridors, Vec<usize>) {
    toured_building(&mut ChaCha8Rng::seed_from_u64(seed))
}

/// A building in which a tour was found.
fn toured_building(rng: &mut impl Rng) -> (Corridors, Vec<usize>) {
    loop {
        let building = random_building(rng);
        let n_sightings = rng.random_range(N_SIGHTINGS);
        if let Some(walk) = tour(&building, n_sightings, rng) {
            return (building, walk);
        }
    }
}

/// The travel of a seed.
pub fn benchmark_travel(kind: BenchmarkKind, seed: u64) -> LandmarkTravel {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (building, walk) = toured_building(&mut rng);
    let waypoints = building.waypoints(&walk);
    let landmarks = building.landmarks();
    let n_controls = n_controls(&waypoints, STEP_M);
    loop {
        let robot = LandmarkRobot {
            odometry_error: kind.odometry_error(&mut rng),
            sensor: LandmarkSensor::BUTTON,
            pass_offset_max_m: PASS_OFFSET_MAX_M,
        };
        let travel = landmark_drive(&landmarks, &waypoints, &robot, n_controls, &mut rng);
        if kind.final_error_m().contains(&travel.final_error_m()) {
            return travel;
        }
    }
}
