//! Named landmarks in the relaxation of laser sessions, in simulated buildings.

mod simulated_drive;

use std::num::NonZero;

use meetpoint_geometry::{Point2, Pose};
use meetpoint_sim::{Building, Laser, OdometryError, Robot, corridor_loop};
use meetpoint_tracking::{
    LandmarkSighting, LaserOutcome, LaserRelaxation, LaserRelaxationParams, LaserTravel,
    PlacedTravel,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use simulated_drive::{Driven, ROBOT, accepted, driven, error_max_m, poses, relaxed_together};

const PARAMS: LaserRelaxationParams = LaserRelaxationParams::INDOOR;
/// How far a camera sees tags, in metres, and half of its field of view, in radians.
const SEEN_MAX_M: f64 = 5.0;
const HALF_FIELD_OF_VIEW_RAD: f64 = 1.0;

/// A tag's name and place.
type Tag = (usize, [f64; 2]);

/// What a camera sees of tags along a drive, half a metre up to 10 % off, and a decimetre always.
fn sightings(driven: &Driven, tags: &[Tag], seed: u64) -> Vec<LandmarkSighting> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut seen = Vec::new();
    for (scan, truth) in driven.truths.iter().enumerate() {
        for &(landmark, [x_m, y_m]) in tags {
            let there = truth.inverse() * Point2::new(x_m, y_m);
            let (range_m, bearing_rad) = (there.coords.norm(), there.y.atan2(there.x));
            if SEEN_MAX_M < range_m || HALF_FIELD_OF_VIEW_RAD < bearing_rad.abs() {
                continue;
            }
            let mut off_m = || 0.1 + rng.random_range(-0.1..0.1) * range_m;
            let robot_from_landmark = Point2::new(there.x + off_m(), there.y + off_m());
            let std_m = 0.2_f64.hypot(0.05 * range_m);
            seen.push(LandmarkSighting { scan, robot_from_landmark, landmark, std_m });
        }
    }
    seen
}

fn placed(driven: &Driven, sightings: Vec<LandmarkSighting>) -> PlacedTravel {
    PlacedTravel { sightings, ..PlacedTravel::of_known_start(driven.travel.clone()) }
}

fn relaxed(placed: PlacedTravel) -> LaserOutcome {
    relaxed_together(&PARAMS, vec![placed], &[])
}

/// A box of so many cells of half a metre, with a block in the middle that leaves a corridor of so many.
fn ring(width: usize, height: usize, corridor: Option<usize>) -> Building {
    let cell = |column: usize, row: usize| {
        let is_end = row == 0 || row + 1 == height || column == 0 || column + 1 == width;
        let is_block = corridor.is_some_and(|corridor| {
            (corridor..width - corridor).contains(&column)
                && (corridor..height - corridor).contains(&row)
        });
        if is_end || is_block { '#' } else { '.' }
    };
    let row = |row: usize| (0..width).map(|column| cell(column, row)).collect::<String>();
    let rows: Vec<String> = (0..height).map(row).collect();
    Building::from_drawing(&rows.join("\n"), 0.5).expect("a drawing")
}

fn points(list: &[[f64; 2]]) -> Vec<Point2<f64>> {
    list.iter().map(|&[x_m, y_m]| Point2::new(x_m, y_m)).collect()
}

/// A drive far from all walls of a hall of 40 m by 30 m, half around it twice, with a laser that does not
/// see them and odometry that ends 13 m off.
fn through_the_hall(seed: u64) -> Driven {
    let laser = Laser { range_max_m: 4.0, ..Laser::INDOOR };
    let odometry_error = OdometryError { drift_rad_per_m: 0.009, ..OdometryError::UNCALIBRATED };
    let robot = Robot { laser, odometry_error, ..ROBOT };
    let around = [[8.0, 8.0], [32.0, 8.0], [32.0, 22.0], [8.0, 22.0]];
    let way = [around.as_slice(), &around[..3]].concat();
    driven(&ring(80, 60, None), robot, &points(&way), seed)
}

/// Tags along that drive.
const HALL_TAGS: [Tag; 5] =
    [(4, [10.0, 7.0]), (2, [20.0, 9.0]), (9, [33.0, 15.0]), (11, [20.0, 22.5]), (5, [7.0, 15.0])];

fn error_mean_m(poses: &[Pose], truths: &[Pose]) -> f64 {
    let errors = poses.iter().zip(truths).map(|(pose, truth)| truth.step_to(*pose).distance_m());
    errors.sum::<f64>() / truths.len() as f64
}

#[test]
fn tags_close_what_the_laser_does_not_see() {
    let driven = through_the_hall(3);
    let without = relaxed(placed(&driven, Vec::new()));
    let without_m = error_mean_m(poses(&without), &driven.truths);
    assert!(5.0 < without_m, "{without_m} m");
    let seen = sightings(&driven, &HALL_TAGS, 3);
    let outcome = relaxed(placed(&driven, seen.clone()));
    let (error_m, max_m) = (
        error_mean_m(poses(&outcome), &driven.truths),
        error_max_m(poses(&outcome), &driven.truths),
    );
    assert!(error_m < 0.8 && max_m < 2.0, "{error_m} m, {max_m} m at most");
    let n_in_graph = outcome.travels[0].n_sightings_in_graph;
    assert!(seen.len() * 3 / 4 < n_in_graph && n_in_graph <= seen.len(), "{n_in_graph}");
    assert_eq!(outcome.travels[0].n_sightings_doubted, 0, "all names are right");
    let params = LaserRelaxationParams { n_threads: NonZero::new(3).expect("not zero"), ..PARAMS };
    let by_three = relaxed_together(&params, vec![placed(&driven, seen)], &[]);
    assert_eq!(outcome, by_three, "the same bits on any number of threads");
}

#[test]
fn a_name_that_two_tags_have_breaks_nothing() {
    let driven = through_the_hall(3);
    let mut tags = HALL_TAGS;
    tags[3].0 = tags[1].0;
    let mut seen = sightings(&driven, &tags, 3);
    for misread in seen.iter_mut().skip(5).step_by(29) {
        misread.landmark = 9;
    }
    let outcome = relaxed(placed(&driven, seen.clone()));
    let error_m = error_mean_m(poses(&outcome), &driven.truths);
    assert!(error_m < 0.8, "{error_m} m");
    let n_doubted = outcome.travels[0].n_sightings_doubted;
    assert!(n_doubted < seen.len() / 10, "few but those that were misread: {n_doubted}");
}

#[test]
fn what_the_laser_closes_stays_as_it_is() {
    let world = corridor_loop();
    let tags = [(4, [5.0, 0.3]), (2, [12.0, 0.3]), (9, [15.7, 5.0]), (11, [8.0, 9.7])];
    let driven = driven(&world.building, ROBOT, &world.tours[0], 3);
    let without = relaxed(placed(&driven, Vec::new()));
    let mut seen = sightings(&driven, &tags, 3);
    let outcome = relaxed(placed(&driven, seen.clone()));
    assert!(seen.len() / 2 < outcome.travels[0].n_sightings_in_graph, "they take part");
    let error_m = |outcome: &LaserOutcome| error_mean_m(poses(outcome), &driven.truths);
    let (with_m, without_m) = (error_m(&outcome), error_m(&without));
    assert!(with_m < 1.1 * without_m, "{with_m} m, {without_m} m without");
    assert!(2 <= accepted(&outcome).count(), "closures as before: {:?}", outcome.closures);
    // A name for two tags that are 13 m apart, of which one is seen in the second round only.
    let n_round = driven.truths.len() * 3 / 4;
    seen.retain(|one| one.landmark != 9 || one.scan < n_round);
    for other in seen.iter_mut().filter(|one| one.landmark == 4 && n_round <= one.scan) {
        other.landmark = 9;
    }
    let wrong_m = error_m(&relaxed(placed(&driven, seen)));
    assert!(wrong_m < 1.1 * without_m, "{wrong_m} m, {without_m} m without");
}

#[test]
fn a_laser_that_sees_little_does_better_with_tags() {
    let laser = Laser { range_max_m: 4.0, ..Laser::INDOOR };
    let odometry_error = OdometryError { drift_rad_per_m: 0.009, ..OdometryError::UNCALIBRATED };
    let robot = Robot { laser, odometry_error, ..ROBOT };
    let around = [[10.0, 1.25], [38.75, 1.25], [38.75, 18.75], [1.25, 18.75], [1.25, 1.25]];
    let way = [around.as_slice(), &around[1..3], &[[20.0, 18.75]]].concat();
    let tags: [Tag; 4] = [(4, [15.0, 0.6]), (2, [28.0, 0.6]), (9, [39.4, 9.0]), (11, [20.0, 19.4])];
    let driven = driven(&ring(80, 40, Some(5)), robot, &points(&way), 3);
    let error_m = |outcome: &LaserOutcome| error_mean_m(poses(outcome), &driven.truths);
    let without_m = error_m(&relaxed(placed(&driven, Vec::new())));
    let with_m = error_m(&relaxed(placed(&driven, sightings(&driven, &tags, 3))));
    assert!(with_m < 0.7 * without_m, "{with_m} m, {without_m} m without");
}

#[test]
fn what_one_robot_saw_places_another() {
    let [a, b] = [3, 8].map(through_the_hall);
    let mut second = placed(&b, sightings(&b, &HALL_TAGS, 8));
    let off = Pose::new(0.6, -0.5, 0.08);
    for scan in &mut second.travel.scans {
        scan.map_from_robot = off * scan.map_from_robot;
    }
    let together = vec![placed(&a, sightings(&a, &HALL_TAGS, 3)), second];
    let outcome = relaxed_together(&PARAMS, together, &[]);
    for (found, driven) in outcome.travels.iter().zip([&a, &b]) {
        let error_m = error_mean_m(&found.poses, &driven.truths);
        assert!(error_m < 1.2, "{error_m} m");
        assert_eq!(found.n_sightings_doubted, 0, "the names mean the same to both");
    }
}

#[test]
fn tags_close_a_loop_while_the_robot_drives() {
    let driven = through_the_hall(3);
    let seen = sightings(&driven, &HALL_TAGS, 3);
    let n_scans = driven.travel.scans.len();
    let mut known: Vec<Pose> = Vec::new();
    for n in [n_scans / 2, n_scans * 3 / 4, n_scans] {
        let mut travel = placed(&driven, seen.clone());
        travel.travel.scans.truncate(n);
        travel.n_relaxed = known.len();
        if let (Some(last), Some(&relaxed)) = (known.len().checked_sub(1), known.last()) {
            let moved = relaxed * travel.travel.scans[last].map_from_robot.inverse();
            for (index, scan) in travel.travel.scans.iter_mut().enumerate() {
                let carried = moved * scan.map_from_robot;
                scan.map_from_robot = known.get(index).copied().unwrap_or(carried);
            }
        }
        let relaxation = LaserRelaxation::going_on(vec![travel], PARAMS, &[], Vec::new());
        let mut relaxation = relaxation.expect("a resolution");
        while relaxation.advance().is_some() {}
        known = poses(&relaxation.into_outcome()).to_vec();
    }
    let error_m = error_mean_m(&known, &driven.truths);
    assert!(error_m < 1.5, "{error_m} m");
}

#[test]
fn whatever_is_said_of_landmarks_is_survived() {
    let world = corridor_loop();
    let mut driven = driven(&world.building, ROBOT, &world.tours[0], 4);
    driven.travel.scans.truncate(80);
    let numbers = [f64::NAN, f64::INFINITY, -1e300, 1e9, 900.0, 0.0, 3.0];
    let mut seen = Vec::new();
    for (index, &number) in numbers.iter().cycle().take(200).enumerate() {
        seen.push(LandmarkSighting {
            scan: if index % 50 == 49 { usize::MAX } else { index },
            robot_from_landmark: Point2::new(number, numbers[(index / 7) % numbers.len()]),
            landmark: [0, 1, usize::MAX][index % 3],
            std_m: if index % 5 == 0 { number } else { 0.3 },
        });
    }
    driven.travel.scans[30].map_from_robot = Pose { x_m: f64::NAN, y_m: 0.0, theta_rad: 0.0 };
    driven.travel.scans[40].map_from_robot = Pose { x_m: 1e12, y_m: -1e12, theta_rad: 1.0 };
    let outcome = relaxed(placed(&driven, seen));
    assert_eq!(poses(&outcome).len(), 80, "a pose for each scan");
    assert!(poses(&outcome).iter().all(|pose| pose.is_finite()), "{:?}", poses(&outcome));
    let nothing = PlacedTravel::of_known_start(LaserTravel::default());
    let blind = LandmarkSighting {
        scan: 0,
        robot_from_landmark: Point2::new(1.0, 0.0),
        landmark: 0,
        std_m: 0.2,
    };
    let outcome = relaxed(PlacedTravel { sightings: vec![blind], ..nothing });
    assert!(poses(&outcome).is_empty(), "nothing in, nothing out");
}
