//! One expectation maximisation over several travels that each told their sightings by themselves: what one of
//! them told wrongly is put right by the landmarks of the other, and what was right stays.

use std::f64::consts::{FRAC_PI_2, PI};
use std::ops::ControlFlow;

use meetpoint_geometry::{Point2, Pose};
use meetpoint_relaxation::{
    AlignmentParams, Detector, JointOutcome, Motion, OneEm, Outcome, Placed, Relaxation,
    RelaxationParams, Sighting, StartBelief, Started, Step, Travel, joint, one_em,
};

/// Ways between doors around a block, in metres, and the turn after each.
const AROUND: [(f64, f64); 6] = [
    (9.0, 0.0),
    (11.0, FRAC_PI_2),
    (12.0, FRAC_PI_2),
    (14.0, 0.0),
    (6.0, FRAC_PI_2),
    (12.0, FRAC_PI_2),
];
const BUTTON: Detector = Detector { range_max_m: 0.0, half_field_of_view_rad: PI };
const CAMERA: Detector = Detector { range_max_m: 8.0, half_field_of_view_rad: 1.5 };
/// Posts that the camera sees, in metres.
const POSTS: [[f64; 2]; 5] = [[6.0, 3.0], [12.0, -2.0], [17.0, 5.0], [25.0, 4.0], [18.0, 15.0]];
/// Where the second travel begins, as it is taken to.
const SECOND: Pose = Pose { x_m: 20.0, y_m: 0.0, theta_rad: FRAC_PI_2 };

/// Twice around from a corner on, with odometry that tells so much of each metre, and which door was passed
/// at each step.
fn around(first: usize, scale: f64) -> (Travel, Vec<usize>) {
    let button = Sighting { identity: None, landmark_type: 0, range_m: 0.0, bearing_rad: 0.0 };
    let mut steps = vec![Step { motion: Motion::NONE, sightings: vec![button] }];
    let mut doors = vec![first];
    for index in first..first + 2 * AROUND.len() {
        let (length_m, turn_rad) = AROUND[index % AROUND.len()];
        let mut legs = vec![Pose::new(length_m * scale / 20.0, 0.0, 0.001); 20];
        legs.push(Pose::new(0.0, 0.0, turn_rad));
        steps.push(Step { motion: Motion::new(legs), sightings: vec![button] });
        doors.push((index + 1) % AROUND.len());
    }
    (Travel { detector: BUTTON, steps }, doors)
}

/// The same way seen by a camera every metre, and which post each sighting is of.
fn past_posts(first: usize, scale: f64) -> (Travel, Vec<usize>) {
    let mut at = if first == 0 { Pose::IDENTITY } else { SECOND };
    let (mut steps, mut seen) = (Vec::new(), Vec::new());
    let mut legs = Vec::new();
    for index in first..first + 2 * AROUND.len() {
        let (length_m, turn_rad) = AROUND[index % AROUND.len()];
        let n = length_m.round();
        let mut way_m = 0.0;
        while way_m < n {
            let mut sightings = Vec::new();
            for (post, place) in POSTS.iter().enumerate() {
                let offset = (at.inverse() * Point2::from(*place)).coords;
                let (range_m, bearing_rad) = (offset.norm(), offset.y.atan2(offset.x));
                if range_m < CAMERA.range_max_m && bearing_rad.abs() < 1.4 {
                    sightings.push(Sighting {
                        identity: None,
                        landmark_type: 0,
                        range_m,
                        bearing_rad,
                    });
                    seen.push(post);
                }
            }
            steps.push(Step { motion: Motion::new(std::mem::take(&mut legs)), sightings });
            legs.push(Pose::new(scale, 0.0, 0.0005));
            at = at * Pose::new(1.0, 0.0, 0.0);
            way_m += 1.0;
        }
        legs.push(Pose::new(0.0, 0.0, turn_rad));
        at = at * Pose::new(0.0, 0.0, turn_rad);
    }
    (Travel { detector: CAMERA, steps }, seen)
}

fn relaxed(travel: &Travel) -> Outcome {
    let mut relaxation = Relaxation::new(travel, RelaxationParams::of(travel));
    while !relaxation.advance().is_done {}
    relaxation.outcome().cloned().expect("landmarks were seen")
}

/// The same with one sighting of another landmark.
fn told_wrongly(outcome: &Outcome, sighting: usize) -> Outcome {
    let mut outcome = outcome.clone();
    let is = outcome.association[sighting].expect("of a landmark") as usize;
    let other = (is + 1) % outcome.landmarks.len();
    let of_is = outcome.association[..sighting].iter();
    let nth = of_is.filter(|it| it.is_some_and(|it| it as usize == is)).count();
    let moved = outcome.landmarks[is].sightings.remove(nth);
    outcome.landmarks[other].sightings.push(moved);
    outcome.landmarks[other].sightings.sort_unstable();
    outcome.association[sighting] = u32::try_from(other).ok();
    outcome
}

/// The map of both before and what one EM makes of it.
fn both(travels: [&Travel; 2], outcomes: [&Outcome; 2]) -> (JointOutcome, OneEm) {
    let begins = [Pose::IDENTITY, SECOND];
    let covariance = [[0.04, 0.0, 0.0], [0.0, 0.04, 0.0], [0.0, 0.0, 0.0025]];
    let started = [0, 1].map(|index| Started {
        placed: Placed {
            travel: travels[index],
            outcome: outcomes[index],
            site_from_travel: begins[index],
        },
        start: if index == 0 {
            StartBelief::At(begins[0])
        } else {
            StartBelief::About { pose: begins[1], covariance }
        },
    });
    let placed = started.map(|it| it.placed);
    let before = joint(&placed, &AlignmentParams::of_travels(travels)).expect("it fits");
    let ControlFlow::Continue(Some(after)) =
        one_em(&started, before.clone(), |_| ControlFlow::Continue(()))
    else {
        panic!("it fits")
    };
    (before, after)
}

/// Pairs of sightings that are told as of one landmark and are of two, or the other way round.
fn n_wrong(travels: [&Travel; 2], truths: [&[usize]; 2], outcome: &JointOutcome) -> usize {
    let mut told = Vec::new();
    for (index, travel) in travels.iter().enumerate() {
        let steps = travel.steps.iter().enumerate();
        let all = steps.flat_map(|(step, at)| (0..at.sightings.len()).map(move |it| (step, it)));
        for ((step, within), truth) in all.zip(truths[index]) {
            let is_of = |it: &meetpoint_relaxation::JointLandmark| {
                it.sightings.contains(&(index, step, within))
            };
            told.push((outcome.landmarks.iter().position(is_of), *truth));
        }
    }
    let pairs = told.iter().enumerate().flat_map(|(at, a)| told[..at].iter().map(move |b| (a, b)));
    pairs.filter(|(a, b)| (a.0.is_some() && a.0 == b.0) != (a.1 == b.1)).count()
}

#[test]
fn a_door_told_wrongly_is_put_right_on_a_grid() {
    let ((first, passed), (second, passed_then)) = (around(0, 1.01), around(2, 0.99));
    let [one, two] = [&first, &second].map(relaxed);
    let (travels, truths) = ([&first, &second], [&passed[..], &passed_then[..]]);
    let (before, after) = both(travels, [&one, &two]);
    assert_eq!(n_wrong(travels, truths, &before), 0, "each is right by itself");
    assert_eq!(after.n_told_otherwise, 0, "and stays so: {}", after.log_odds);
    assert_eq!(after.outcome, before, "bit for bit");
    assert!(0 < after.n_iterations, "on the paper's grid");

    let wrong = told_wrongly(&two, 9);
    let (before, after) = both(travels, [&one, &wrong]);
    assert!(0 < n_wrong(travels, truths, &before), "one door is told wrongly");
    assert_eq!(n_wrong(travels, truths, &after.outcome), 0, "and is put right");
    assert!(1 <= after.n_told_otherwise && 3.0 < after.log_odds, "{}", after.log_odds);
    assert_eq!(after.outcome.landmarks.len(), AROUND.len(), "one a door");
}

#[test]
fn what_cameras_saw_stands() {
    let ((first, _), (second, _)) = (past_posts(0, 1.01), past_posts(2, 0.99));
    let [one, two] = [&first, &second].map(relaxed);
    let (before, after) = both([&first, &second], [&one, &two]);
    assert_eq!((after.n_iterations, after.n_told_otherwise), (0, 0), "no grid is as fine");
    assert_eq!(after.outcome, before, "bit for bit");
}

#[test]
fn who_is_told_to_stop_stops() {
    let (travel, _) = around(0, 1.0);
    let outcome = relaxed(&travel);
    let placed = Placed { travel: &travel, outcome: &outcome, site_from_travel: Pose::IDENTITY };
    let before = joint(&[placed], &AlignmentParams::of_travels([&travel])).expect("it fits");
    let started = [Started { placed, start: StartBelief::At(Pose::IDENTITY) }];
    let mut n_told = 0;
    let stopped = one_em(&started, before, |_| {
        n_told += 1;
        ControlFlow::Break(())
    });
    assert_eq!((stopped, n_told), (ControlFlow::Break(()), 1), "after the first iteration");
}
