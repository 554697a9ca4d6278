//! Travels past landmarks, judged by what their descriptions promise.

use std::ops::RangeInclusive;

use meetpoint_geometry::{Pose, angle_between};
use meetpoint_sim::{
    BenchmarkKind, ChaCha8Rng, LandmarkDetector, LandmarkRobot, LandmarkSensor, LandmarkTravel,
    Moment, Sense, TriangularError, TrueSighting, benchmark_tour, benchmark_travel, first_data_set,
    landmark_drive, museum, museum_again, n_controls, random_building, second_data_set, tour,
};
use proptest::prelude::*;
use rand::SeedableRng;

const KINDS: [BenchmarkKind; 2] = [BenchmarkKind::RandomError, BenchmarkKind::SteadyDrift];
const PERFECT: LandmarkRobot = LandmarkRobot {
    odometry_error: TriangularError::NONE,
    sensor: LandmarkSensor::BUTTON,
    pass_offset_max_m: 0.3,
};
const ALL_AROUND: LandmarkDetector = LandmarkDetector {
    range_max_m: 6.0,
    half_field_of_view_rad: std::f64::consts::PI,
    range_std_per_m: 0.0,
    bearing_std_rad: 0.0,
};

/// A tour of the seed's building by this robot, half a metre a control.
fn toured(seed: u64, robot: &LandmarkRobot) -> LandmarkTravel {
    let (building, walk) = benchmark_tour(seed);
    let waypoints = building.waypoints(&walk);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    landmark_drive(&building.landmarks(), &waypoints, robot, n_controls(&waypoints, 0.5), &mut rng)
}

fn sightings(travel: &LandmarkTravel) -> impl Iterator<Item = (&Moment, &TrueSighting)> {
    travel
        .moments
        .iter()
        .flat_map(|moment| moment.sightings.iter().map(move |sighting| (moment, sighting)))
}

fn seen(travel: &LandmarkTravel) -> Vec<usize> {
    sightings(travel).map(|(_, sighting)| sighting.landmark).collect()
}

/// Distance from the robot to the landmark that it sights, in metres.
fn distance_m(travel: &LandmarkTravel, moment: &Moment, sighting: &TrueSighting) -> f64 {
    (travel.landmarks[sighting.landmark].position - moment.truth.position()).norm()
}

#[test]
fn benchmarks_are_as_described() {
    for seed in 0..10 {
        let of_kinds = KINDS.map(|kind| benchmark_travel(kind, seed));
        for (kind, travel) in KINDS.into_iter().zip(&of_kinds) {
            let shown = format!("{kind:?} {seed}");
            let error_m = travel.final_error_m();
            assert!(kind.final_error_m().contains(&error_m), "{shown}: {error_m} m");
            let n_landmarks = travel.landmarks.len();
            assert!((10..=15).contains(&n_landmarks), "{shown}: {n_landmarks} landmarks");
            let n_sightings = travel.n_sightings();
            assert!((28..=34).contains(&n_sightings), "{shown}: {n_sightings} sightings");
            for (moment, sighting) in sightings(travel) {
                let offset_m = distance_m(travel, moment, sighting);
                assert!(offset_m <= 0.3, "{shown}: pressed {offset_m} m off");
                let &TrueSighting { landmark_type, range_m, bearing_rad, .. } = sighting;
                assert_eq!((landmark_type, range_m, bearing_rad), (0, 0.0, 0.0), "all alike");
            }
        }
        assert_eq!(seen(&of_kinds[0]), seen(&of_kinds[1]), "both kinds share building and tour");
    }
}

#[test]
fn same_seed_same_bits() {
    for kind in KINDS {
        assert_eq!(benchmark_travel(kind, 3), benchmark_travel(kind, 3), "nothing but the seed");
        assert_ne!(benchmark_travel(kind, 3), benchmark_travel(kind, 4), "another travel");
    }
    for data_set in [first_data_set, second_data_set, museum, museum_again] {
        assert_eq!(data_set(1), data_set(1), "nothing random but the seed");
        assert_ne!(data_set(1), data_set(2), "another seed, other errors");
    }
}

#[test]
fn data_sets_are_as_printed() {
    for seed in 0..3 {
        let first = first_data_set(seed);
        check(&first, 2972, 27, 24.4..=25.4);
        let closing = first.moment_of_sighting(15).expect("27 are more than 15");
        let closing_m = first.dead_reckoning_error(closing).distance_m();
        assert!(14.0 < closing_m, "the large loop is closed {closing_m} m off");
        let landmark = seen(&first)[14];
        assert!(seen(&first)[..14].contains(&landmark), "the 15th closes the loop");
        assert!(!seen(&first)[6..14].iter().any(|new| seen(&first)[..6].contains(new)), "first");
        check(&second_data_set(seed), 2091, 24, 8.0..=14.0);

        let hall = museum(seed);
        check(&hall, hall.n_controls(), 20, 24.6..=25.6);
        let turn_rad = hall.dead_reckoning_error(hall.n_controls()).theta_rad.abs();
        assert!((80.0..=90.0).contains(&turn_rad.to_degrees()), "almost 90°: {turn_rad} rad");
        let again = museum_again(seed);
        check(&again, again.n_controls(), 22, 10.0..=25.0);
        for met in [seen(&hall), seen(&again)] {
            let n_met = |marker| met.iter().filter(|&&landmark| landmark == marker).count();
            assert!((0..9).all(|marker| 2 <= n_met(marker)), "every marker twice: {met:?}");
        }
        assert_eq!(hall.landmarks, again.landmarks, "the same nine markers");
        assert_eq!(hall.landmarks.len(), 9, "the same nine markers");
        assert_ne!(seen(&hall)[0], seen(&again)[0], "from another start");
    }
}

fn check(
    travel: &LandmarkTravel,
    n_controls: usize,
    n_sightings: usize,
    final_error_m: RangeInclusive<f64>,
) {
    assert_eq!(travel.n_controls(), n_controls, "controls");
    assert_eq!(travel.n_sightings(), n_sightings, "sightings");
    assert!(final_error_m.contains(&travel.final_error_m()), "{} m", travel.final_error_m());
    let seen = seen(travel);
    assert!((0..travel.landmarks.len()).all(|index| seen.contains(&index)), "all are seen");
}

#[test]
fn a_prefix_ends_with_its_sighting() {
    let whole = first_data_set(0);
    for n_sightings in [1, 15, 20] {
        let prefix = whole.until_sighting(n_sightings);
        assert_eq!(prefix.n_sightings(), n_sightings, "as many as asked for");
        assert_eq!(prefix.moments, whole.moments[..prefix.moments.len()], "the same beginning");
        let last = prefix.moments.last().expect("the start at least");
        assert_eq!(last.sightings.len(), 1, "it ends where the button is pressed");
    }
    assert_eq!(whole.until_sighting(1000), whole, "all if there are not as many");
}

#[test]
fn steady_drift_turns_as_set() {
    let error = TriangularError { drift_rad_per_m: 0.002, ..TriangularError::NONE };
    let travel = toured(0, &LandmarkRobot { odometry_error: error, ..PERFECT });
    let expected_rad = Pose::new(0.0, 0.0, 0.002 * travel.length_m()).theta_rad;
    let off_rad = travel.dead_reckoning_error(travel.n_controls()).theta_rad;
    assert!(angle_between(expected_rad, off_rad).abs() < 1e-6, "{off_rad} rad");
}

#[test]
fn a_detector_that_never_errs_points_at_landmarks() {
    let sensor = LandmarkSensor { sense: Sense::Detector(ALL_AROUND), ..LandmarkSensor::BUTTON };
    let travel = toured(1, &LandmarkRobot { sensor, ..PERFECT });
    let button = toured(1, &PERFECT);
    assert!(5 * button.n_sightings() < travel.n_sightings(), "seen from afar, many times");
    for (moment, sighting) in sightings(&travel) {
        let to = moment.truth.theta_rad + sighting.bearing_rad;
        let seen = moment.truth.position()
            + sighting.range_m * meetpoint_geometry::Vector2::new(to.cos(), to.sin());
        let off_m = (seen - travel.landmarks[sighting.landmark].position).norm();
        assert!(off_m < 1e-9, "{off_m} m off");
        assert!(sighting.range_m <= 6.0, "{} m are too far", sighting.range_m);
    }
    let ahead = LandmarkDetector { half_field_of_view_rad: 0.5, ..ALL_AROUND };
    let sensor = LandmarkSensor { sense: Sense::Detector(ahead), ..LandmarkSensor::BUTTON };
    let travel = toured(1, &LandmarkRobot { sensor, ..PERFECT });
    assert!(sightings(&travel).all(|(_, sighting)| sighting.bearing_rad.abs() <= 0.5), "ahead");
}

#[test]
fn a_detector_errs_as_set() {
    let detector = LandmarkDetector { range_std_per_m: 0.1, bearing_std_rad: 0.05, ..ALL_AROUND };
    let sensor = LandmarkSensor { sense: Sense::Detector(detector), ..LandmarkSensor::BUTTON };
    let travels: Vec<_> =
        (0..10).map(|seed| toured(seed, &LandmarkRobot { sensor, ..PERFECT })).collect();
    let errors: Vec<(f64, f64)> = travels
        .iter()
        .flat_map(|travel| {
            sightings(travel).map(|(moment, sighting)| {
                let landmark = travel.landmarks[sighting.landmark];
                let seen = moment.truth.inverse() * landmark.position;
                let range_m = distance_m(travel, moment, sighting);
                let off_rad = angle_between(seen.y.atan2(seen.x), sighting.bearing_rad);
                (sighting.range_m / range_m - 1.0, off_rad)
            })
        })
        .collect();
    let std = |squares: f64| (squares / errors.len() as f64).sqrt();
    let range_std = std(errors.iter().map(|(range, _)| range.powi(2)).sum());
    let bearing_std_rad = std(errors.iter().map(|(_, bearing)| bearing.powi(2)).sum());
    assert!((range_std / 0.1 - 1.0).abs() < 0.1, "{range_std} of the range");
    assert!((bearing_std_rad / 0.05 - 1.0).abs() < 0.1, "{bearing_std_rad} rad");
}

#[test]
fn sightings_fail_as_often_as_set() {
    let sensor = LandmarkSensor {
        sense: Sense::Detector(ALL_AROUND),
        miss_share: 0.3,
        wrong_type_share: 0.2,
        n_types: 3,
    };
    let (mut n_seen, mut n_wrong, mut n_all) = (0, 0, 0);
    for seed in 0..10 {
        let travel = toured(seed, &LandmarkRobot { sensor, ..PERFECT });
        let never_fails = LandmarkSensor { miss_share: 0.0, ..sensor };
        n_all += toured(seed, &LandmarkRobot { sensor: never_fails, ..PERFECT }).n_sightings();
        n_seen += travel.n_sightings();
        n_wrong += sightings(&travel).filter(|(_, sighting)| sighting.landmark_type != 0).count();
    }
    let seen_share = n_seen as f64 / n_all as f64;
    assert!((seen_share - 0.7).abs() < 0.03, "{seen_share} of {n_all} seen");
    let wrong_share = n_wrong as f64 / n_seen as f64;
    assert!((wrong_share - 0.2).abs() < 0.03, "{wrong_share} of {n_seen} taken for another");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn buildings_are_as_described(seed: u64) {
        let building = random_building(&mut ChaCha8Rng::seed_from_u64(seed));
        prop_assert!(building.is_connected(), "every corridor can be reached");
        let n_landmarks = building.landmarks().len();
        prop_assert!((10..=15).contains(&n_landmarks), "{} landmarks", n_landmarks);
        let lengths_m = building.loop_lengths_m();
        prop_assert!(lengths_m.iter().any(|length_m| (60.0..=120.0).contains(length_m)), "a loop");
        for (index, place) in building.places().iter().enumerate() {
            for other in &building.places()[..index] {
                let apart_m = (place - other).norm();
                prop_assert!((8.0..128.0).contains(&apart_m), "places {} m apart", apart_m);
            }
        }
    }

    #[test]
    fn tours_go_by_corridors_and_see_everything(seed: u64) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let building = random_building(&mut rng);
        let Some(walk) = tour(&building, 30, &mut rng) else { return Ok(()) };
        for pair in walk.windows(2) {
            prop_assert!(building.neighbours(pair[0]).any(|place| place == pair[1]), "{:?}", pair);
        }
        let seen: Vec<usize> =
            building.waypoints(&walk).iter().filter_map(|waypoint| waypoint.landmark).collect();
        prop_assert_eq!(seen.len(), 30, "as many sightings as asked for");
        let known = &seen[..26];
        prop_assert!((0..building.landmarks().len()).all(|index| known.contains(&index)), "all");
    }

    #[test]
    fn odometry_without_error_is_the_truth(seed: u64) {
        let travel = toured(seed, &PERFECT);
        for index in 0..travel.moments.len() {
            let error = travel.dead_reckoning_error(index);
            prop_assert!(error.distance_m() < 1e-9, "{} m off", error.distance_m());
            prop_assert!(error.theta_rad.abs() < 1e-9, "{} rad off", error.theta_rad);
        }
    }

    #[test]
    fn controls_are_as_many_as_asked_for_and_no_longer(seed: u64, step_m in 0.1_f64..1.0) {
        let (building, walk) = benchmark_tour(seed);
        let waypoints = building.waypoints(&walk);
        let n_controls = n_controls(&waypoints, step_m);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let landmarks = building.landmarks();
        let travel = landmark_drive(&landmarks, &waypoints, &PERFECT, n_controls, &mut rng);
        prop_assert_eq!(travel.n_controls(), n_controls);
        for pair in travel.moments.windows(2) {
            let driven_m = pair[0].truth.step_to(pair[1].truth).distance_m();
            prop_assert!(driven_m < 1.3 * step_m, "{} m in a control of {} m", driven_m, step_m);
        }
    }
}
