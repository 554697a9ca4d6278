//! Maps of landmarks laid over one another.

use std::f64::consts::PI;

use meetpoint_geometry::{Point2, Pose};
use meetpoint_relaxation::{
    AlignmentParams, Calibration, Constellation, Coverage, Detector, LandmarkAlignments,
    LandmarkKind, Motion, Star, Step, Travel, aligned,
};
use nalgebra::Matrix2;
use proptest::prelude::*;

/// Ten to one in a hundred ways: what nobody would call a guess.
const SURE: f64 = 6.9;

/// A robot's map of landmarks at these places of the world, who looked at a square from a corner on.
fn map(places: &[Point2<f64>], corner: Point2<f64>, side_m: f64, frame: Pose) -> Constellation {
    let detector = Detector { range_max_m: 4.0, half_field_of_view_rad: PI };
    let n = side_m / 2.0;
    let lanes = std::iter::successors(Some(1.0), |lane| (lane + 1.0 < n).then_some(lane + 1.0));
    let at = |x, y| frame * Pose::new(corner.x + 2.0 * x, corner.y + 2.0 * y, 0.0);
    let poses: Vec<Pose> =
        lanes.clone().flat_map(|x| lanes.clone().map(move |y| at(x, y))).collect();
    let step = |_: &Pose| Step { motion: Motion::NONE, sightings: Vec::new() };
    let travel = Travel { detector, steps: poses.iter().map(step).collect() };
    let is_inside = |place: &&Point2<f64>| {
        let off = **place - corner;
        (0.0..=side_m).contains(&off.x) && (0.0..=side_m).contains(&off.y)
    };
    let star = |place: &Point2<f64>| Star {
        position: frame * *place,
        covariance_m2: Matrix2::identity() * 0.0025,
        kind: LandmarkKind::Type(0),
        exists: 0.98,
    };
    Constellation {
        stars: places.iter().filter(is_inside).map(star).collect(),
        coverage: Coverage::of(&travel, &poses, &Calibration::NONE),
    }
}

fn found(site: &Constellation, other: &Constellation) -> LandmarkAlignments {
    aligned(site, other, &AlignmentParams::CAMERA)
}

fn log_odds(found: &LandmarkAlignments) -> f64 {
    found.ranked.first().map_or(f64::NEG_INFINITY, |best| best.log_odds)
}

fn points(places: &[[f64; 2]]) -> Vec<Point2<f64>> {
    places.iter().copied().map(Point2::from).collect()
}

/// One in each cell of five metres, somewhere.
fn strewn() -> impl Strategy<Value = Vec<Point2<f64>>> {
    prop::collection::vec((0.5..4.5_f64, 0.5..4.5_f64), 24).prop_map(|places| {
        let corners =
            (0..24_u32).map(|cell| (f64::from(cell % 6) * 5.0, f64::from(cell / 6) * 5.0));
        let places = places.into_iter().zip(corners);
        places.map(|((x, y), corner)| Point2::new(corner.0 + x, corner.1 + y)).collect()
    })
}

fn frame() -> impl Strategy<Value = Pose> {
    (-20.0..20.0_f64, -20.0..20.0_f64, -PI..PI).prop_map(|(x, y, turn)| Pose::new(x, y, turn))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn half_in_common_is_found(world in strewn(), frame in frame()) {
        let site = map(&world, Point2::origin(), 20.0, Pose::IDENTITY);
        let other = map(&world, Point2::new(10.0, 0.0), 20.0, frame);
        let found = found(&site, &other);
        // Few landmarks may happen to lie in the common half.
        if SURE < log_odds(&found) {
            let off = found.ranked[0].site_from_other.step_to(frame.inverse());
            prop_assert!(off.distance_m() < 0.1 && off.theta_rad.abs() < 0.02, "{:?}", off);
            prop_assert_eq!(found.ranked[0].n_contradicted, 0, "nothing speaks against it");
        }
    }

    #[test]
    fn strangers_are_not_taken_for_friends(one in strewn(), two in strewn(), frame in frame()) {
        let site = map(&one, Point2::origin(), 20.0, Pose::IDENTITY);
        let other = map(&two, Point2::origin(), 20.0, frame);
        prop_assert!(log_odds(&found(&site, &other)) < SURE);
    }

    #[test]
    fn the_same_architects_buildings_are_not_one(
        missing in prop::collection::vec(prop::bool::weighted(0.1), 60),
        first_m in (0.0..4.0_f64, 0.0..4.0_f64),
        frame in frame(),
    ) {
        let door = |index: u32| (f64::from(index / 6), f64::from(index / 2 % 3), f64::from(index % 2));
        let building = |first_m: f64, is_missing: &[bool]| -> Vec<Point2<f64>> {
            let doors = (0..30).map(door).zip(is_missing).filter(|(_, is_missing)| !**is_missing);
            doors.map(|((column, corridor, side), _)| {
                Point2::new(first_m + 4.0 * column, 2.0 + 7.0 * corridor + 2.0 * side)
            })
            .collect()
        };
        let (one, two) = missing.split_at(30);
        let site = map(&building(first_m.0, one), Point2::origin(), 20.0, Pose::IDENTITY);
        let other = map(&building(first_m.1, two), Point2::origin(), 20.0, frame);
        prop_assert!(log_odds(&found(&site, &other)) < SURE);
    }

    #[test]
    fn it_does_not_matter_who_comes_first(world in strewn(), frame in frame()) {
        let site = map(&world, Point2::origin(), 20.0, Pose::IDENTITY);
        let other = map(&world, Point2::new(6.0, 0.0), 20.0, frame);
        let (there, back) = (found(&site, &other), found(&other, &site));
        prop_assume!(SURE < log_odds(&there) && SURE < log_odds(&back));
        let off = there.ranked[0].site_from_other * back.ranked[0].site_from_other;
        prop_assert!(off.distance_m() < 1e-3 && off.theta_rad.abs() < 1e-3, "{:?}", off);
    }
}

#[test]
fn a_whole_map_is_surely_found() {
    let world = points(&[
        [2.0, 3.0],
        [5.0, 9.0],
        [11.0, 4.0],
        [14.0, 12.0],
        [8.0, 17.0],
        [18.0, 6.0],
        [3.0, 14.0],
    ]);
    let frame = Pose::new(3.0, -8.0, 2.5);
    let site = map(&world, Point2::origin(), 20.0, Pose::IDENTITY);
    let found = found(&site, &map(&world, Point2::origin(), 20.0, frame));
    assert!(SURE < log_odds(&found), "{}", log_odds(&found));
    assert_eq!(found.ranked[0].n_matched, 7, "all of them");
    let matches = &found.ranked[0].matches;
    assert!(matches.iter().all(|(a, b)| a == b), "each is itself: {matches:?}");
}

#[test]
fn a_square_fits_in_four_ways() {
    let world = points(&[[5.0, 5.0], [15.0, 5.0], [15.0, 15.0], [5.0, 15.0]]);
    let site = map(&world, Point2::origin(), 20.0, Pose::IDENTITY);
    let found = found(&site, &map(&world, Point2::origin(), 20.0, Pose::new(1.0, 2.0, 0.7)));
    assert!(log_odds(&found) < 0.0, "{}", log_odds(&found));
    assert!(4 <= found.ranked.len(), "{}", found.ranked.len());
    let evidence: Vec<f64> = found.ranked.iter().map(|it| it.log_evidence).collect();
    assert!(evidence[0] - evidence[3] < 0.5, "alike: {evidence:?}");
}

#[test]
fn a_row_of_doors_repeats_itself() {
    let mut doors = Vec::new();
    for door in 0..5_u32 {
        doors.extend([[2.0 + 4.0 * f64::from(door), 8.0], [2.0 + 4.0 * f64::from(door), 10.0]]);
    }
    let world = points(&doors);
    let site = map(&world, Point2::origin(), 20.0, Pose::IDENTITY);
    let found = found(&site, &map(&world, Point2::origin(), 20.0, Pose::new(1.0, 2.0, 0.7)));
    assert!(found.is_repeated, "{found:?}");
    assert!(log_odds(&found) < SURE, "{}", log_odds(&found));
}

#[test]
fn names_tell_at_once_what_likeness_cannot() {
    let world = points(&[[5.0, 5.0], [15.0, 5.0], [15.0, 15.0], [5.0, 15.0]]);
    let named = |frame| {
        let mut map = map(&world, Point2::origin(), 20.0, frame);
        for (number, star) in (0..).zip(&mut map.stars) {
            star.kind = LandmarkKind::Identity(number);
        }
        map
    };
    let found = found(&named(Pose::IDENTITY), &named(Pose::new(1.0, 2.0, 0.7)));
    assert!(SURE < log_odds(&found), "{}", log_odds(&found));
    let off = found.ranked[0].site_from_other * Pose::new(1.0, 2.0, 0.7);
    assert!(off.distance_m() < 0.01 && off.theta_rad.abs() < 0.01, "{off:?}");
}

#[test]
fn few_landmarks_tell_nothing() {
    let world = points(&[[5.0, 5.0], [15.0, 7.0]]);
    for n in 0..=2 {
        let few = map(&world[..n], Point2::origin(), 20.0, Pose::IDENTITY);
        let found = found(&few, &few);
        assert!(!found.is_enough, "{n}");
        assert!(log_odds(&found) < SURE, "{n}: {}", log_odds(&found));
    }
}

#[test]
fn wild_data_are_no_harm() {
    let mut wild =
        map(&points(&[[1.0, 2.0], [3.0, 4.0], [5.0, 2.0]]), Point2::origin(), 20.0, Pose::IDENTITY);
    let tame = wild.clone();
    wild.stars[0].position.x = f64::NAN;
    wild.stars[1].position.y = f64::INFINITY;
    wild.stars[2].covariance_m2 *= f64::NAN;
    assert!(log_odds(&found(&wild, &tame)) < SURE, "nothing is sure");
    assert!(log_odds(&found(&tame, &wild)) < SURE, "nor the other way round");
}
