//! Localisation on a known map, against its definition and in a hall.

use std::f64::consts::PI;

use meetpoint_geometry::{Point2, Pose};
use meetpoint_relaxation::{
    Detector, Em, Landmark, LandmarkKind, Localization, LocalizationParams, Motion, Sighting,
    Start, StartBelief, Step,
};
use nalgebra::Matrix2;
use proptest::prelude::*;

use crate::definition::{World, probabilities};
use crate::worlds::{grid, params, random_landmarks, random_travel};

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn equals_the_definition(seed: u64, n_types in 1_u32..3) {
        let grid = grid(6, 5);
        let em_params = params(grid, StartBelief::At(Pose::IDENTITY));
        let travel = random_travel(seed, 5, n_types);
        let mut landmarks = random_landmarks(seed, &grid, 4, n_types);
        for kind in 0..n_types {
            landmarks[kind as usize].kind = LandmarkKind::Type(kind);
        }
        let em = Em::new(&travel, em_params, Start::Map(&landmarks));
        let given = em.map().expect("given");
        let world = World::new(&travel, &em_params, given.kinds());
        let map = probabilities(given);
        let nothing_pooled = LocalizationParams {
            motion: em_params.motion,
            perception: em_params.perception,
            selection_share: 0.0,
            mean_share: 0.0,
            ..LocalizationParams::BUTTON
        };
        let mut found = Localization::on(grid, &landmarks, travel.detector, nothing_pooled);
        let n = world.cells.len();
        let even = 1.0 / n as f64;
        // The pool stays even until something is seen.
        let (mut alpha, mut pool) = (vec![0.0; n], 1.0);
        for (index, step) in travel.steps.iter().enumerate() {
            if 0 < index {
                let reached = |to: usize| -> f64 {
                    let ways = world.cells.iter().map(|&from| world.motion(index - 1, from, world.cells[to]));
                    ways.zip(&alpha).map(|(way, weight)| way * weight).sum()
                };
                let stays = 1.0 - nothing_pooled.carried_away;
                alpha = (0..n).map(|to| stays * reached(to)).collect();
                // Who leaves the grid, or is carried away, may be anywhere.
                pool = 1.0 - alpha.iter().sum::<f64>();
            }
            if 0.0 < travel.detector.range_max_m || !step.sightings.is_empty() {
                for (weight, &cell) in alpha.iter_mut().zip(&world.cells) {
                    *weight = (*weight + pool * even) * world.perception(&map, step, cell);
                }
                let sum: f64 = alpha.iter().sum();
                prop_assume!(1e-12 < sum);
                for weight in &mut alpha {
                    *weight /= sum;
                }
                pool = 0.0;
            }
            let told = found.advance(step);
            prop_assert!((told.elsewhere - pool).abs() < 1e-4, "{} not {}", told.elsewhere, pool);
            let kept = found.alpha().expect("after a step");
            for (&weight, &cell) in alpha.iter().zip(&world.cells) {
                let is = f64::from(kept.at(cell));
                prop_assert!((is - weight).abs() < 2e-3, "{} not {}", is, weight);
            }
            prop_assert!(told.entropy <= (n as f64).ln() + 1e-6, "no more than nothing known");
        }
    }
}

/// Markers of a hall, all alike.
const MARKERS: [[f64; 2]; 6] =
    [[3.0, 4.0], [12.0, 9.0], [20.0, 3.0], [28.0, 11.0], [33.0, 4.0], [8.0, 16.0]];

fn hall() -> Localization {
    let landmark = |at: [f64; 2]| Landmark {
        position: Point2::from(at),
        covariance_m2: Matrix2::identity() * 0.1,
        kind: LandmarkKind::Type(0),
        certainty: 0.95,
    };
    let detector = Detector { range_max_m: 0.0, half_field_of_view_rad: PI };
    let map = MARKERS.map(landmark);
    Localization::new(&map, detector, LocalizationParams::BUTTON).expect("a grid")
}

/// Straight from place to place, the button pressed at each: the steps, and the last pose.
fn walk(places: &[[f64; 2]]) -> (Vec<Step>, Pose) {
    let button = Sighting { identity: None, landmark_type: 0, range_m: 0.0, bearing_rad: 0.0 };
    let mut at = Pose::new(places[0][0], places[0][1], 0.4);
    let mut steps = vec![Step { motion: Motion::NONE, sightings: vec![button] }];
    for &goal in &places[1..] {
        let ahead = at.inverse() * Point2::from(goal);
        let turn = Pose::new(0.0, 0.0, ahead.y.atan2(ahead.x));
        let leg = Pose::new(ahead.coords.norm() / 10.0, 0.0, 0.0);
        let mut legs = vec![turn];
        legs.extend([leg; 10]);
        at = legs.iter().fold(at, |pose, &leg| pose * leg);
        steps.push(Step { motion: Motion::new(legs), sightings: vec![button] });
    }
    (steps, at)
}

#[test]
fn a_robot_set_down_anywhere_is_found() {
    let (steps, end) = walk(&[MARKERS[3], MARKERS[1], MARKERS[5], MARKERS[0], MARKERS[2]]);
    let mut hall = hall();
    let told: Vec<_> = steps.iter().map(|step| hall.advance(step)).collect();
    let best = told[4].peaks[0];
    let off = end.step_to(best.pose);
    assert!(off.distance_m() < 1.0 && off.theta_rad.abs() < 0.15, "{off:?}");
    assert!(0.8 < best.around && best.probability <= best.around, "{best:?}");
    assert!(told[0].peaks[0].around < 0.1, "one marker is like another");
    assert!(told[4].entropy < told[0].entropy - 3.0, "more and more is known");
    let sum: f32 = hall.over_positions().iter().sum();
    assert!((sum - 1.0).abs() < 1e-3, "a picture of probabilities: {sum}");
}

#[test]
fn what_the_map_does_not_know_kills_no_truth() {
    let new = [16.0, 14.0];
    let (steps, end) =
        walk(&[MARKERS[3], MARKERS[1], new, MARKERS[5], MARKERS[0], MARKERS[2], MARKERS[4]]);
    let mut hall = hall();
    let told: Vec<_> = steps.iter().map(|step| hall.advance(step)).collect();
    let off = end.step_to(told[6].peaks[0].pose);
    assert!(off.distance_m() < 1.0 && off.theta_rad.abs() < 0.15, "{off:?}");
    assert!(0.8 < told[6].peaks[0].around, "{:?}", told[6]);
}

#[test]
fn a_robot_that_was_carried_away_is_found_again() {
    let (before, _) = walk(&[MARKERS[3], MARKERS[1], MARKERS[5], MARKERS[0]]);
    let (after, end) =
        walk(&[MARKERS[4], MARKERS[3], MARKERS[2], MARKERS[1], MARKERS[5], MARKERS[0]]);
    let mut hall = hall();
    for step in before.iter().chain(&after) {
        hall.advance(step);
    }
    let best = hall.whereabouts().peaks[0];
    let off = end.step_to(best.pose);
    assert!(off.distance_m() < 1.0 && off.theta_rad.abs() < 0.15, "{off:?}, {best:?}");
}

#[test]
fn wild_data_are_no_harm() {
    let landmark = |x: f64| Landmark {
        position: Point2::new(x, 0.0),
        covariance_m2: Matrix2::identity() * f64::NAN,
        kind: LandmarkKind::Identity(3),
        certainty: f64::NAN,
    };
    let detector = Detector { range_max_m: 5.0, half_field_of_view_rad: 0.5 };
    let made = |map: &[Landmark]| Localization::new(map, detector, LocalizationParams::CAMERA);
    assert!(made(&[landmark(f64::NAN)]).is_err(), "nowhere");
    assert!(made(&[]).is_ok(), "nothing known");
    let mut wild = made(&[landmark(1.0)]).expect("a grid");
    let seen =
        Sighting { identity: Some(9), landmark_type: 0, range_m: f64::NAN, bearing_rad: 0.0 };
    let motion = Motion::new(vec![Pose::new(f64::INFINITY, 0.0, 0.0)]);
    let told = [
        wild.advance(&Step { motion: Motion::NONE, sightings: vec![seen] }),
        wild.advance(&Step {
            motion,
            sightings: vec![seen, Sighting { identity: Some(3), ..seen }],
        }),
    ];
    assert!(told.iter().all(|told| told.elsewhere.is_finite()), "{told:?}");
}
