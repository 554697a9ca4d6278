//! A robot with a camera that reads tags, some way ahead and not all round: with identities and
//! without.

use std::num::NonZero;

use meetpoint_geometry::Pose;
use meetpoint_relaxation::{
    Calibration, Detector, Em, EmParams, Motion, MotionParams, PeakParams, PerceptionParams,
    Sighting, Start, Step, Travel, grid_for,
};
use nalgebra::Point2;

/// Tags around a hall of 8 by 6 m, in metres.
const TAGS_M: [(f64, f64); 6] =
    [(3.0, 1.0), (5.5, 0.5), (6.5, 3.0), (5.0, 6.0), (1.0, 6.5), (-1.5, 3.0)];

/// Twice round the hall on a circle; odometry errs by up to two degrees in every turn.
fn travel(with_identities: bool) -> (Travel, Vec<Pose>) {
    let detector = Detector { range_max_m: 4.0, half_field_of_view_rad: 0.7 };
    let mut truth = Pose::new(1.0, 0.0, 0.0);
    let (mut steps, mut poses) = (Vec::new(), Vec::new());
    for step in 0..48_u32 {
        let turn_rad = 0.262 + 0.04 * f64::from(step).sin();
        let motion = match step {
            0 => Motion::NONE,
            _ => Motion::new(vec![Pose::new(0.65, 0.0, turn_rad)]),
        };
        if step > 0 {
            truth = truth * Pose::new(0.65, 0.0, 0.262);
        }
        let tags = (0..).zip(TAGS_M).filter_map(|(tag, (x, y))| {
            let seen = truth.inverse() * Point2::new(x, y);
            let (range_m, bearing_rad) = (seen.coords.norm(), seen.y.atan2(seen.x));
            let in_view = range_m < detector.range_max_m
                && bearing_rad.abs() < detector.half_field_of_view_rad;
            let identity = with_identities.then_some(tag);
            in_view.then_some(Sighting { identity, landmark_type: 0, range_m, bearing_rad })
        });
        steps.push(Step { motion, sightings: tags.collect() });
        poses.push(truth);
    }
    (Travel { detector, steps }, poses)
}

#[test]
fn tags_are_found_where_they_are() {
    for with_identities in [true, false] {
        let (travel, truth) = travel(with_identities);
        let motion = MotionParams { rotation_per_rad: 0.15, ..MotionParams::CARPET };
        let perception = PerceptionParams {
            position_std_m: 0.15,
            range_std_share: 0.03,
            bearing_std_rad: 0.05,
            ..PerceptionParams::BUTTON
        };
        let grid = grid_for(&travel, &Calibration::NONE, &motion, &perception).expect("a grid");
        let n_threads = NonZero::new(2).expect("not zero");
        let params = EmParams { motion, perception, n_threads, ..EmParams::button(grid) };
        let params = EmParams { n_iterations_max: 8, ..params };
        let mut em = Em::new(&travel, params, Start::Controls);
        while !em.has_converged() {
            em.iterate();
        }
        let peaks = PeakParams { radius_m: 1.0, certainty_min: 0.5 };
        let landmarks = em.map().expect("made").landmarks(&peaks);
        let path = em.path().expect("on the grid");
        for (found, truth_pose) in path.poses.iter().zip(&truth) {
            let expected = truth[0].step_to(*truth_pose).position();
            let off_m = (found.position() - expected).norm();
            assert!(off_m < 0.8, "identities {with_identities}: {off_m} m off at {expected}");
        }
        for tag in TAGS_M.map(|(x, y)| truth[0].inverse() * Point2::new(x, y)) {
            let off_m = landmarks.iter().map(|found| (found.position - tag).norm());
            let off_m = off_m.fold(f64::INFINITY, f64::min);
            assert!(off_m < 0.6, "identities {with_identities}: {tag} is {off_m} m off");
        }
    }
}
