//! A square of corridors with a landmark at each corner, all alike, driven round with odometry that
//! drifts: the corners that were seen twice are found to be the same.

use std::f64::consts::{FRAC_PI_2, PI};
use std::num::NonZero;

use meetpoint_geometry::Pose;
use meetpoint_relaxation::{
    Calibration, Detector, Em, EmParams, MapParams, Motion, MotionParams, PeakParams,
    PerceptionParams, Sighting, Start, StartBelief, Step, Travel, grid_for,
};

/// Length of a side, in metres.
const SIDE_M: f64 = 20.0;

/// `n_corners` corners with odometry that turns a little to the left all the way, and truly.
pub(crate) fn travel(n_corners: usize, drift_rad_per_m: f64) -> (Travel, Vec<Pose>) {
    let button = Sighting { identity: None, landmark_type: 0, range_m: 0.0, bearing_rad: 0.0 };
    let mut steps = vec![Step { motion: Motion::NONE, sightings: vec![button] }];
    let mut truth = vec![Pose::IDENTITY];
    for _ in 1..n_corners {
        let leg = Pose::new(0.5, 0.0, 0.5 * drift_rad_per_m);
        let mut legs = vec![leg; 40];
        legs.push(Pose::new(0.0, 0.0, FRAC_PI_2));
        steps.push(Step { motion: Motion::new(legs), sightings: vec![button] });
        let before = truth[truth.len() - 1];
        truth.push(before * Pose::new(SIDE_M, 0.0, FRAC_PI_2));
    }
    let detector = Detector { range_max_m: 0.0, half_field_of_view_rad: PI };
    (Travel { detector, steps }, truth)
}

pub(crate) fn loop_params(travel: &Travel) -> EmParams {
    let motion = MotionParams {
        translation_per_m: 0.06,
        rotation_per_rad: 0.1,
        rotation_per_m: 0.012,
        ..MotionParams::CARPET
    };
    let perception = PerceptionParams::BUTTON;
    EmParams {
        grid: grid_for(travel, &Calibration::NONE, &motion, &perception).expect("a grid"),
        n_coarse_iterations: 2,
        coarse_factor: 2,
        motion,
        calibration: Calibration::NONE,
        perception,
        map: MapParams { n_even_iterations: 4, ..MapParams::THRUN_1998 },
        start: StartBelief::At(Pose::IDENTITY),
        selection_share: 1e-3,
        change_max: 1e-3,
        n_iterations_max: 12,
        n_threads: NonZero::<usize>::MIN,
    }
}

#[test]
fn corners_seen_twice_are_the_same() {
    for drift_rad_per_m in [0.003, -0.002, 0.0] {
        let (travel, truth) = travel(8, drift_rad_per_m);
        let mut em = Em::new(&travel, loop_params(&travel), Start::Controls);
        while !em.has_converged() {
            em.iterate();
        }
        let path = em.path().expect("on the grid");
        for (found, truth) in path.poses.iter().zip(&truth) {
            let off_m = (found.position() - truth.position()).norm();
            assert!(off_m < 2.5, "drift {drift_rad_per_m}: {found:?} is {off_m} m off {truth:?}");
        }
        let landmarks = em.map().expect("made").landmarks(&PeakParams::BUTTON);
        assert_eq!(landmarks.len(), 4, "drift {drift_rad_per_m}: {landmarks:?}");
        let between = path.between_steps(&travel, &Calibration::NONE);
        let ends: Vec<Pose> = between.iter().filter_map(|poses| poses.last().copied()).collect();
        assert_eq!(ends, path.poses, "steps are met");
    }
}

/// With the map in hand the robot finds itself, wherever it is put (section 8).
#[test]
fn a_known_map_tells_where_the_robot_is() {
    let (travel, _) = travel(6, 0.002);
    let mut params = loop_params(&travel);
    params.n_coarse_iterations = 0;
    let mut em = Em::new(&travel, params, Start::Controls);
    while !em.has_converged() {
        em.iterate();
    }
    let landmarks = em.map().expect("made").landmarks(&PeakParams::BUTTON);
    let anywhere = EmParams { start: StartBelief::Within(params.grid.area()), ..params };
    let lost = Em::new(&travel, anywhere, Start::Map(&landmarks));
    let found = lost.path().expect("somewhere");
    // A square looks the same from each of its corners.
    let corner =
        landmarks.iter().map(|landmark| (landmark.position - found.poses[0].position()).norm());
    assert!(corner.fold(f64::INFINITY, f64::min) < 2.0, "at a corner: {:?}", found.poses[0]);
    let beta = lost.beta(travel.steps.len() - 1);
    assert!(beta.n_cells() == params.grid.n_cells(), "the last beta is uniform");
}
