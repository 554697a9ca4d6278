//! Tiny worlds, and parameters under which nothing is dropped.

use std::f64::consts::PI;
use std::num::NonZero;

use meetpoint_relaxation::{
    Area, Calibration, Detector, EmParams, Landmark, LandmarkKind, MapParams, Motion, MotionParams,
    PerceptionParams, PoseGrid, Sighting, StartBelief, Step, Travel,
};
use meetpoint_sim::ChaCha8Rng;
use nalgebra::{Matrix2, Point2};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};

use meetpoint_geometry::Pose;

/// A grid of `width` by `height` nodes from (0, 0) on, a metre apart, with four headings.
pub(crate) fn grid(width: u32, height: u32) -> PoseGrid {
    let last = Point2::new(f64::from(width - 1), f64::from(height - 1));
    let area = Area { min: Point2::new(0.0, 0.0), max: last };
    PoseGrid::new(area, 1.0, 4).expect("a grid")
}

/// Nothing is dropped, and a sighting tells the node exactly: errors below a node's size are the
/// grid's own.
pub(crate) fn params(grid: PoseGrid, start: StartBelief) -> EmParams {
    EmParams {
        grid,
        n_coarse_iterations: 0,
        coarse_factor: 1,
        motion: MotionParams {
            translation_per_m: 0.9,
            translation_min_m: 1.2,
            ..MotionParams::CARPET
        },
        calibration: Calibration::NONE,
        perception: PerceptionParams {
            position_std_m: 0.1,
            range_std_share: 0.0,
            bearing_std_rad: 0.0,
            missed: 0.2,
            false_per_m2: 0.05,
            mistaken: 0.2,
            radius_m: 2.0,
        },
        map: MapParams { n_even_iterations: 0, n_seen_nothing: 0.0 },
        start,
        selection_share: 0.0,
        change_max: 0.0,
        n_iterations_max: 100,
        n_threads: NonZero::<usize>::MIN,
    }
}

/// Something to be seen straight ahead or to the left, one metre away or here.
fn sighting(rng: &mut ChaCha8Rng, n_types: u32) -> Sighting {
    Sighting {
        identity: None,
        landmark_type: rng.random_range(0..n_types),
        range_m: if rng.random() { 1.0 } else { 0.0 },
        bearing_rad: if rng.random() { 0.0 } else { PI / 2.0 },
    }
}

/// A travel of random motions, at most one sighting a step.
pub(crate) fn random_travel(seed: u64, n_steps: usize, n_types: u32) -> Travel {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let range_max_m = if rng.random() { 2.0 } else { 0.0 };
    let detector = Detector { range_max_m, half_field_of_view_rad: PI };
    let steps = (0..n_steps).map(|step| {
        let along = rng.random_range(-0.5..2.0);
        let leg = Pose::new(along, rng.random_range(-0.3..0.3), rng.random_range(-2.0..2.0));
        let motion = if step == 0 { Motion::NONE } else { Motion::new(vec![leg]) };
        let n_seen = usize::from(rng.random_bool(0.7));
        let sightings = (0..n_seen).map(|_| sighting(&mut rng, n_types)).collect();
        Step { motion, sightings }
    });
    Travel { detector, steps: steps.collect() }
}

/// Landmarks somewhere on a grid, sure or not.
pub(crate) fn random_landmarks(
    seed: u64,
    grid: &PoseGrid,
    n: usize,
    n_types: u32,
) -> Vec<Landmark> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let last = grid.area().max;
    let landmark = |_| Landmark {
        position: Point2::new(rng.random_range(0.0..=last.x), rng.random_range(0.0..=last.y)),
        covariance_m2: Matrix2::identity() * rng.random_range(0.0..2.0),
        kind: LandmarkKind::Type(rng.random_range(0..n_types)),
        certainty: rng.random_range(0.1..1.0),
    };
    (0..n).map(landmark).collect()
}

/// A start that is known, or anywhere.
pub(crate) fn start() -> impl Strategy<Value = StartBelief> {
    let anywhere = Area { min: Point2::new(-1.0, -1.0), max: Point2::new(9.0, 9.0) };
    prop_oneof![
        Just(StartBelief::At(Pose::IDENTITY)),
        Just(StartBelief::At(Pose::new(1.3, 0.0, 0.4))),
        Just(StartBelief::Within(anywhere)),
    ]
}
