//! Places relaxed into one frame: the true map agrees with odometry, others do not.

use meetpoint_geometry::{Point2, Pose};
use meetpoint_places::{
    Assumptions, FrameParams, Hypothesis, MapTree, MapTreeParams, Travel, TravelRecord, World,
    consistent_frame, sightings,
};
use meetpoint_sim::ChaCha8Rng;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};

const FLOOR: &str = "
    A   B---C
    |   |   |
    D---E---F
    |   |   |
    G---H---I";
/// Places of the floor stand so far apart, in metres.
const WAY_M: f64 = 8.0;
const TOUR: &str = "ADGHIFCBEHGDEFC";
const PARAMS: FrameParams = FrameParams::WHEELS;

/// Where a place of the floor is.
fn position(name: char) -> Point2<f64> {
    let index = ('A'..='I').position(|other| other == name).expect("a place");
    Point2::new(WAY_M * (index % 3) as f64, -WAY_M * (index / 3) as f64)
}

/// Something between -1 and 1 that sums of three of are nearly normal, of deviation 1.
fn noise(rng: &mut ChaCha8Rng) -> f64 {
    (0..3).map(|_| rng.random_range(-1.0..1.0)).sum()
}

/// What odometry says of a tour by straight ways, in the order of its steps: headings are those of arriving.
fn odometry(tour: &str, share: f64, rng: &mut ChaCha8Rng) -> Vec<TravelRecord> {
    let names: Vec<char> = tour.chars().collect();
    let at: Vec<Point2<f64>> = names.iter().map(|&name| position(name)).collect();
    let heading_rad = |index: usize| {
        let way = at[index.max(1)] - at[index.max(1) - 1];
        way.y.atan2(way.x)
    };
    let pose = |index: usize| Pose::new(at[index].x, at[index].y, heading_rad(index));
    (1..at.len())
        .map(|index| {
            let moved = pose(index - 1).step_to(pose(index));
            let moved = Pose::new(
                moved.x_m + share * PARAMS.place_m * noise(rng),
                moved.y_m + share * PARAMS.place_m * noise(rng),
                moved.theta_rad + share * PARAMS.turned_rad * noise(rng),
            );
            TravelRecord { moved: Some(moved), ..TravelRecord::default() }
        })
        .collect()
}

/// The tour's travel, all maps that fit it, and which is true.
fn maps() -> (Travel, Vec<Hypothesis>, usize) {
    let world = World::from_drawing(FLOOR).expect("a drawing");
    let (from, turns) = world.turns(TOUR).expect("a route");
    let travel = world.travel(from, &turns);
    let truth = sightings(world.map(), from, turns.iter().copied());
    let params = MapTreeParams { assumptions: Assumptions::HSSH_2004, n_hypotheses_max: 1000 };
    let tree = MapTree::of_travel(params, &travel).expect("gateways that are there");
    let is_true = |leaf: &Hypothesis| leaf.sightings(&travel) == truth;
    let index = tree.hypotheses().iter().position(is_true).expect("the true map");
    (travel, tree.hypotheses().to_vec(), index)
}

/// The first visit of the place of each visit.
fn visited(map: &Hypothesis, travel: &Travel) -> Vec<usize> {
    let sightings = map.sightings(travel).expect("a map of the travel");
    sightings.into_iter().map(|sighting| sighting.first_visit).collect()
}

#[test]
fn exact_odometry_is_drawn_as_it_was() {
    let (travel, maps, index) = maps();
    let records = odometry(TOUR, 0.0, &mut ChaCha8Rng::seed_from_u64(1));
    let frame = consistent_frame(&maps[index], &travel, &records, &PARAMS).expect("measured");
    assert!(frame.chi2 < 1e-9 && !frame.is_contradicted(), "{frame:?}");
    assert_eq!(frame.n_degrees, 2 * 14 - 2 * 8, "fourteen ways, nine places");
    // Places are numbered as they were come to first.
    let mut names: Vec<char> = Vec::new();
    names.extend(TOUR.chars());
    let mut seen = std::collections::BTreeSet::new();
    names.retain(|name| seen.insert(*name));
    for (a, place_a) in frame.places.iter().enumerate() {
        for (b, place_b) in frame.places.iter().enumerate() {
            let apart_m = (position(names[a]) - position(names[b])).norm();
            let off_m = (place_a - place_b).norm() - apart_m;
            assert!(off_m.abs() < 1e-6, "{} to {}: {off_m} m off", names[a], names[b]);
        }
    }
}

#[test]
fn odometry_speaks_for_the_true_map_and_against_others() {
    let (travel, maps, index) = maps();
    let (mut n_others, mut n_contradicted) = (0, 0);
    for seed in 0..20 {
        let records = odometry(TOUR, 1.0, &mut ChaCha8Rng::seed_from_u64(seed));
        for (at, map) in maps.iter().enumerate() {
            let frame = consistent_frame(map, &travel, &records, &PARAMS).expect("measured");
            if at == index {
                assert!(!frame.is_contradicted(), "seed {seed}: {frame:?}");
                continue;
            }
            // Nothing says of two places that they are one; and maps that differ only in which gateway leads
            // where put every visit where the true one does.
            let is_judged = map.map.n_places() <= maps[index].map.n_places()
                && visited(map, &travel) != visited(&maps[index], &travel);
            n_others += usize::from(is_judged);
            n_contradicted += usize::from(is_judged && frame.is_contradicted());
        }
    }
    println!("{n_contradicted} of {n_others} maps as simple as the true one are contradicted");
    assert!(0 < n_others && 10 * n_others <= 11 * n_contradicted, "{n_contradicted} of {n_others}");
}

#[test]
fn no_place_can_be_moved_for_the_better() {
    let (travel, maps, index) = maps();
    let records = odometry(TOUR, 1.0, &mut ChaCha8Rng::seed_from_u64(3));
    let settled = consistent_frame(&maps[index], &travel, &records, &PARAMS).expect("measured");
    let hasty = FrameParams { n_steps_max: 0, ..PARAMS };
    let reckoned = consistent_frame(&maps[index], &travel, &records, &hasty).expect("measured");
    assert!(settled.is_settled && settled.chi2 < reckoned.chi2, "{settled:?} {reckoned:?}");
    assert!(!reckoned.is_settled && !reckoned.is_contradicted(), "nothing is known of it yet");
    let longer = FrameParams { n_steps_max: 500, ..PARAMS };
    let longer = consistent_frame(&maps[index], &travel, &records, &longer).expect("measured");
    assert!((longer.chi2 - settled.chi2).abs() < 1e-6, "more steps find nothing better");
}

#[test]
fn what_was_not_measured_has_no_metres() {
    let (travel, maps, index) = maps();
    let mut records = odometry(TOUR, 0.0, &mut ChaCha8Rng::seed_from_u64(1));
    records[4].moved = None;
    assert_eq!(consistent_frame(&maps[index], &travel, &records, &PARAMS), None, "one is missing");
    records.truncate(4);
    assert_eq!(consistent_frame(&maps[index], &travel, &records, &PARAMS), None, "ten are missing");
}

#[test]
fn what_odometry_speaks_against_can_be_left_out() {
    let (travel, maps, index) = maps();
    let records = odometry(TOUR, 1.0, &mut ChaCha8Rng::seed_from_u64(1));
    let params = MapTreeParams { assumptions: Assumptions::HSSH_2004, n_hypotheses_max: 1000 };
    let mut tree = MapTree::of_travel(params, &travel).expect("gateways that are there");
    let speaks_against = |map: &Hypothesis| {
        consistent_frame(map, &travel, &records, &PARAMS)
            .is_some_and(|frame| frame.is_contradicted())
    };
    let n_left_out = tree.leave_out(speaks_against);
    assert!(0 < n_left_out, "some are");
    assert_eq!(tree.hypotheses().len() + n_left_out, maps.len(), "and the others stay");
    assert!(tree.hypotheses().contains(&maps[index]), "the true one is among them");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Whatever odometry says, of whichever map: the frame is of numbers, and no worse than dead reckoning.
    #[test]
    fn odometry_may_say_anything(
        moved in prop::collection::vec((-1.0e4..1.0e4_f64, -1.0e4..1.0e4_f64, -700.0..700.0_f64), 14),
        scale in prop_oneof![Just(1.0), Just(1.0e-3), Just(0.0)],
        map in 0..1000_usize,
    ) {
        let (travel, maps, _) = maps();
        let record = |(x, y, theta): (f64, f64, f64)| TravelRecord {
            moved: Some(Pose::new(scale * x, scale * y, scale * theta)),
            ..TravelRecord::default()
        };
        let records: Vec<TravelRecord> = moved.into_iter().map(record).collect();
        let map = &maps[map % maps.len()];
        let frame = consistent_frame(map, &travel, &records, &PARAMS).expect("measured");
        let hasty = FrameParams { n_steps_max: 0, ..PARAMS };
        let reckoned = consistent_frame(map, &travel, &records, &hasty).expect("measured");
        prop_assert!(0.0 <= frame.chi2 && frame.chi2 <= reckoned.chi2, "{frame:?} {reckoned:?}");
        prop_assert!(frame.places.iter().all(|at| at.x.is_finite() && at.y.is_finite()), "{frame:?}");
        prop_assert_eq!(frame.places.len(), map.map.n_places());
    }
}
