//! The search over associations against its definition: all ways to tell sightings apart.

use std::f64::consts::PI;
use std::num::NonZero;

use meetpoint_geometry::{Point2, Pose};
use meetpoint_relaxation::{
    Calibration, Detector, ErrorModel, Hypothesis, Motion, Relaxation, RelaxationParams, Search,
    SearchParams, Sighting, Step, Travel, refined,
};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Legs of a way.
const N_LEGS: u32 = 20;

/// A robot that goes from landmark to landmark in straight lines, its odometry drifting.
fn travel(tour: &[Point2<f64>], drift_rad_per_m: f64, seed: u64) -> Travel {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut truth = Pose::new(tour[0].x, tour[0].y, 0.0);
    let button = || Sighting { identity: None, landmark_type: 0, range_m: 0.0, bearing_rad: 0.0 };
    let mut steps = vec![Step { motion: Motion::NONE, sightings: vec![button()] }];
    for &goal in &tour[1..] {
        let ahead = truth.inverse() * goal;
        let turn = ahead.y.atan2(ahead.x) * (1.0 + rng.random_range(-0.02..0.02));
        let length_m = ahead.coords.norm() * (1.0 + rng.random_range(-0.02..0.02));
        let mut legs = vec![Pose::new(0.0, 0.0, turn)];
        let leg_m = length_m / f64::from(N_LEGS);
        legs.extend((0..N_LEGS).map(|_| Pose::new(leg_m, 0.0, drift_rad_per_m * leg_m)));
        steps.push(Step { motion: Motion::new(legs), sightings: vec![button()] });
        let heading = truth.theta_rad + ahead.y.atan2(ahead.x);
        truth = Pose::new(goal.x, goal.y, heading);
    }
    Travel { detector: Detector { range_max_m: 0.0, half_field_of_view_rad: PI }, steps }
}

fn searched(travel: &Travel, params: SearchParams) -> Vec<Hypothesis> {
    let mut search = Search::new(travel, &ErrorModel::BUTTON, params);
    while search.advance() {}
    search.hypotheses()
}

/// All ways to tell `n` sightings apart, none of them false: landmarks are numbered in the order in
/// which they are first seen.
fn partitions(n: usize) -> Vec<Vec<Option<u32>>> {
    let mut all = vec![Vec::new()];
    for _ in 0..n {
        let grow = |partition: Vec<Option<u32>>| {
            let n_landmarks = partition.iter().flatten().max().map_or(0, |last| last + 1);
            (0..=n_landmarks).map(move |landmark| {
                let mut grown = partition.clone();
                grown.push(Some(landmark));
                grown
            })
        };
        all = all.into_iter().flat_map(grow).collect();
    }
    all
}

fn square(corners: &[usize]) -> Vec<Point2<f64>> {
    let places = [[0.0, 0.0], [12.0, 0.0], [12.0, 9.0], [0.0, 9.0], [20.0, 4.0]];
    corners.iter().map(|&corner| Point2::from(places[corner])).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, ..ProptestConfig::default() })]
    #[test]
    fn best_is_the_best_of_all(
        corners in prop::collection::vec(0_usize..5, 6),
        drift in -0.01_f64..0.01,
        seed: u64,
    ) {
        prop_assume!(corners.windows(2).all(|pair| pair[0] != pair[1]));
        let travel = travel(&square(&corners), drift, seed);
        // Forward alone, a search may drop what would have turned out the best.
        let params = RelaxationParams { runs_em: false, ..RelaxationParams::of(&travel) };
        let mut relaxation = Relaxation::new(&travel, params);
        while !relaxation.advance().is_done {}
        let found = relaxation.outcome().expect("sightings were given").log_evidence;
        let evidence = |partition: &Vec<Option<u32>>| {
            let mut search = Search::new(&travel, &ErrorModel::BUTTON, SearchParams::BUTTON)
                .along(partition.clone());
            while search.advance() {}
            search.hypotheses().first().map(|only| only.log_evidence)
        };
        let best = partitions(6)
            .iter()
            .filter_map(evidence)
            .fold(f64::NEG_INFINITY, f64::max);
        prop_assert!((found - best).abs() < 0.05, "{found} {best}");
    }

    #[test]
    fn a_past_that_is_fitted_no_more_says_the_same(drift in -0.01_f64..0.01, seed: u64) {
        let tour = square(&[0, 1, 2, 3, 0, 1, 4, 2, 3, 0, 1, 2, 3, 0, 1, 4]);
        let travel = travel(&tour, drift, seed);
        let best = |n_fitted| searched(&travel, SearchParams { n_fitted, ..SearchParams::BUTTON });
        let (all, few) = (best(100), best(6));
        prop_assert_eq!(&all[0].association, &few[0].association);
        let off = (all[0].log_evidence - few[0].log_evidence).abs();
        prop_assert!(off < 0.5, "{} {}", all[0].log_evidence, few[0].log_evidence);
    }
}

#[test]
fn hypotheses_that_will_fare_alike_are_merged() {
    let travel = travel(&square(&[0, 1, 2, 3, 0, 1, 4, 2, 3, 0]), 0.005, 4);
    let all = searched(&travel, SearchParams::BUTTON);
    let merged = searched(&travel, SearchParams { n_compared: 3, ..SearchParams::BUTTON });
    assert_eq!(merged[0].association, all[0].association, "the best stays");
    assert!(merged.len() < all.len(), "{} of {}", merged.len(), all.len());
    let few = SearchParams { n_compared: 3, n_kept_max: 8, ..SearchParams::BUTTON };
    let recent = |hypothesis: &Hypothesis| hypothesis.association[6..].to_vec();
    let differ = |found: Vec<Hypothesis>| {
        let mut recent: Vec<_> = found.iter().map(recent).collect();
        recent.sort();
        recent.dedup();
        recent.len()
    };
    let crowded = differ(searched(&travel, SearchParams { n_compared: usize::MAX, ..few }));
    assert!(crowded <= differ(searched(&travel, few)), "room for what differs lately");
}

#[test]
fn a_drifting_robot_finds_its_loop() {
    let corners = [0, 1, 2, 3, 0, 1, 4, 2, 3, 0];
    let travel = travel(&square(&corners), 0.02, 7);
    let mut relaxation = Relaxation::new(&travel, RelaxationParams::of(&travel));
    while !relaxation.advance().is_done {}
    let outcome = relaxation.outcome().expect("sightings were given");
    let found: Vec<_> = outcome.association.iter().map(|landmark| landmark.unwrap_or(9)).collect();
    assert_eq!(found, [0, 1, 2, 3, 0, 1, 4, 2, 3, 0]);
    for (landmark, corner) in outcome.landmarks.iter().zip(square(&[0, 1, 2, 3, 4])) {
        let off = landmark.position - corner;
        let precision = landmark.covariance_m2.try_inverse().expect("positive definite");
        // Four standard deviations.
        assert!(off.dot(&(precision * off)) < 16.0, "{landmark:?} {corner}");
    }
    assert!(0.5 < outcome.confidence, "{}", outcome.confidence);
}

#[test]
fn the_frame_is_the_first_pose_also_where_nothing_is_seen() {
    let corners = [0, 1, 2, 3, 0, 1, 2];
    let mut travel = travel(&square(&corners), 0.01, 7);
    // Two metres backward, then a turn, before anything is seen.
    let lead = Pose::new(-2.0, 0.0, 0.0) * Pose::new(0.0, 0.0, 2.0);
    let legs = vec![Pose::new(-1.0, 0.0, 0.0), Pose::new(-1.0, 0.0, 0.0), Pose::new(0.0, 0.0, 2.0)];
    travel.steps[0].motion = Motion::new(legs);
    let nowhere = Step { motion: Motion::NONE, sightings: Vec::new() };
    travel.steps.insert(0, nowhere);
    let mut relaxation = Relaxation::new(&travel, RelaxationParams::of(&travel));
    while !relaxation.advance().is_done {}
    let outcome = relaxation.outcome().expect("sightings were given");
    assert!(outcome.poses[0].distance_m() < 1e-6, "{:?}", outcome.poses[0]);
    assert!(outcome.poses[0].theta_rad.abs() < 1e-6, "{:?}", outcome.poses[0]);
    for (landmark, corner) in outcome.landmarks.iter().zip(square(&[0, 1, 2, 3])) {
        let off = landmark.position - lead * corner;
        assert!(off.norm() < 1.0, "{landmark:?} {corner}");
    }
}

#[test]
fn put_down_and_taken_up_at_every_piece_it_ends_the_same() {
    let travel = travel(&square(&[0, 1, 2, 3, 0, 1, 2]), 0.01, 3);
    let params = RelaxationParams::of(&travel);
    let mut through = Relaxation::new(&travel, params);
    while !through.advance().is_done {}
    let mut relaxation = Relaxation::new(&travel, params);
    let mut n_pieces = 0;
    while !relaxation.advance().is_done {
        let bytes = relaxation.to_bytes();
        if n_pieces < 7 || !bytes.starts_with(&[1, 0]) {
            relaxation = Relaxation::from_bytes(&travel, params, &bytes).expect("its own bytes");
        }
        n_pieces += 1;
        assert!(n_pieces < 100, "no end");
    }
    assert_eq!(relaxation.outcome(), through.outcome());
}

#[test]
fn threads_change_nothing() {
    let travel = travel(&square(&[0, 1, 2, 3, 0, 1, 4, 2]), 0.01, 6);
    let outcome = |n_threads| {
        let n_threads = NonZero::new(n_threads).expect("not zero");
        let params = RelaxationParams { n_threads, ..RelaxationParams::of(&travel) };
        let mut relaxation = Relaxation::new(&travel, params);
        while !relaxation.advance().is_done {}
        relaxation.outcome().cloned()
    };
    assert_eq!(outcome(1), outcome(3), "the same bits");
}

#[test]
fn damaged_state_is_refused() {
    let travel = travel(&square(&[0, 1, 2, 3, 0, 1, 2]), 0.01, 3);
    let params = RelaxationParams::of(&travel);
    let mut relaxation = Relaxation::new(&travel, params);
    while relaxation.em().is_none_or(|em| em.figures().is_none()) {
        assert!(!relaxation.advance().is_done, "EM comes before the end");
    }
    let bytes = relaxation.to_bytes();
    for cut in [0, 1, 2, 9, 40, bytes.len() - 1] {
        assert!(Relaxation::from_bytes(&travel, params, &bytes[..cut]).is_err(), "{cut}");
    }
    let other = Relaxation::from_bytes(&travel, params, &[bytes.as_slice(), &[0]].concat());
    assert!(other.is_err(), "one byte more");
}

#[test]
fn nothing_seen_is_no_outcome() {
    let steps = vec![Step { motion: Motion::NONE, sightings: Vec::new() }];
    let detector = Detector { range_max_m: 0.0, half_field_of_view_rad: PI };
    let travel = Travel { detector, steps };
    let mut relaxation = Relaxation::new(&travel, RelaxationParams::of(&travel));
    for _ in 0..10 {
        relaxation.advance();
    }
    assert!(relaxation.outcome().is_none(), "{:?}", relaxation.outcome());
}

#[test]
fn refinement_straightens_what_a_drift_has_bent() {
    let corners = [0, 1, 2, 3, 0, 1, 2, 3];
    let travel = travel(&square(&corners), 0.02, 5);
    let bent = travel.dead_reckoning(&Calibration::NONE);
    let association: Vec<_> = [0, 1, 2, 3, 0, 1, 2, 3].map(Some).to_vec();
    let start = (bent, Calibration::NONE);
    let fit = refined(&travel, &ErrorModel::BUTTON, &association, start).expect("can be solved");
    for (index, corner) in square(&[0, 1, 2, 3]).iter().enumerate() {
        let off = fit.landmarks[index] - corner;
        let spread = fit.landmark_covariance.fixed_view::<2, 2>(2 * index, 2 * index);
        let precision = spread.into_owned().try_inverse().expect("positive definite");
        // Four standard deviations.
        assert!(off.dot(&(precision * off)) < 16.0, "{off} {corner}");
    }
    // Drift with the way and error of turns cannot be told apart on a square that is always turned
    // the same way; together they straighten it.
    let straight = travel.dead_reckoning(&fit.calibration);
    let off = (straight[4].position() - straight[0].position()).norm();
    let off_before = {
        let bent = travel.dead_reckoning(&Calibration::NONE);
        (bent[4].position() - bent[0].position()).norm()
    };
    assert!(off < 0.5 * off_before, "{off} {off_before}");
}

#[test]
fn an_association_that_cannot_be_has_no_evidence() {
    let mut travel = travel(&square(&[0, 1, 2]), 0.0, 1);
    // Two sightings of one step are of two landmarks.
    let twice = travel.steps[2].sightings[0];
    travel.steps[2].sightings.push(twice);
    let once = [0, 1, 2, 2].map(Some);
    let mut search =
        Search::new(&travel, &ErrorModel::BUTTON, SearchParams::BUTTON).along(once.to_vec());
    while search.advance() {}
    assert!(search.hypotheses().is_empty(), "{:?}", search.hypotheses());
    assert_eq!(search.log_evidence(), None, "nor any number");
}

#[test]
fn landmarks_stay_within_their_bound() {
    let travel = travel(&square(&[0, 1, 2, 3, 4]), 0.0, 1);
    let found = searched(&travel, SearchParams { n_landmarks_max: 3, ..SearchParams::BUTTON });
    assert!(found.iter().all(|hypothesis| hypothesis.landmarks.len() <= 3), "{found:?}");
    assert!(!found.is_empty(), "what is beyond counts as false");
}
