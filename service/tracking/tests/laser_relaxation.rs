//! Relaxation of laser sessions in simulated buildings.

mod simulated_drive;

use std::num::NonZero;

use meetpoint_geometry::{Point2, Pose, angle_between};
use meetpoint_sim::{Building, OdometryError, Robot, corridor_loop, ring_corridor};
use meetpoint_tracking::{
    Closure, ClosureKey, ClosureMoment, LaserOutcome, LaserRelaxation, LaserRelaxationParams,
    LaserTravel, PlacedTravel, Refusal, Verdict,
};
use nalgebra::{Matrix3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use simulated_drive::{Driven, ROBOT, accepted, error_max_m, poses, relaxed_together};

const PARAMS: LaserRelaxationParams = LaserRelaxationParams::INDOOR;

fn driven(building: &Building, waypoints: &[Point2<f64>], seed: u64) -> Driven {
    simulated_drive::driven(building, ROBOT, waypoints, seed)
}

fn relaxed(travel: &LaserTravel, refused: &[ClosureKey]) -> LaserOutcome {
    relaxed_by(&PARAMS, travel, refused)
}

fn relaxed_by(
    params: &LaserRelaxationParams,
    travel: &LaserTravel,
    refused: &[ClosureKey],
) -> LaserOutcome {
    relaxed_together(params, vec![PlacedTravel::of_known_start(travel.clone())], refused)
}

/// Where the later pose of a closure truly is, seen from the earlier one.
fn truth_of(closure: &Closure, driven: &Driven) -> Pose {
    let at = |moment: ClosureMoment| {
        let scans = &driven.travel.scans;
        let index = scans.iter().position(|scan| scan.stamp_ns == moment.stamp_ns);
        driven.truths[index.expect("a scan of the travel")]
    };
    at(closure.key.from).step_to(at(closure.key.to))
}

/// How far the poses that a closure joins truly are from what it says, in metres.
fn error_of_m(closure: &Closure, driven: &Driven) -> f64 {
    truth_of(closure, driven).step_to(closure.from_to).distance_m()
}

/// The same in units of its covariance, squared.
fn chi2_of_error(closure: &Closure, driven: &Driven) -> f64 {
    let (truth, said) = (truth_of(closure, driven), closure.from_to);
    let turn_rad = angle_between(said.theta_rad, truth.theta_rad);
    let error = Vector3::new(truth.x_m - said.x_m, truth.y_m - said.y_m, turn_rad);
    let covariance = Matrix3::from_fn(|row, column| closure.covariance[row][column]);
    let information = covariance.try_inverse().expect("a covariance");
    error.dot(&(information * error))
}

#[test]
fn a_loop_is_closed_and_its_scale_found() {
    let world = corridor_loop();
    let driven = driven(&world.building, &world.tours[0], 3);
    let outcome = relaxed(&driven.travel, &[]);
    assert_eq!(poses(&outcome).len(), driven.travel.scans.len(), "a pose for each scan");
    let error_m = error_max_m(poses(&outcome), &driven.truths);
    assert!(error_m < 0.1, "{error_m} m off");
    assert!(1 <= accepted(&outcome).count(), "{:?}", outcome.closures);
    for closure in accepted(&outcome) {
        // A corridor says nothing of where along it one is, and does not claim to.
        let chi2 = chi2_of_error(closure, &driven);
        assert!(chi2 < 25.0, "{} m off: {closure:?}", error_of_m(closure, &driven));
        assert!(closure.chi2 < 16.5, "what the poses contradict is refused: {closure:?}");
    }
    let scale = outcome.travels[0].calibration.length_scale * OdometryError::UNCALIBRATED.scale;
    assert!((scale - 1.0).abs() < 0.01, "{:?}", outcome.travels[0].calibration);
    assert!(outcome.after.chi2 < outcome.before.chi2, "{:?} {:?}", outcome.before, outcome.after);
    let n_threads = NonZero::new(3).expect("not zero");
    let by_three = relaxed_by(&LaserRelaxationParams { n_threads, ..PARAMS }, &driven.travel, &[]);
    assert_eq!(outcome, by_three, "the same bits on any number of threads");
}

#[test]
fn where_the_laser_sits_is_found() {
    let world = corridor_loop();
    let Driven { mut travel, truths } = driven(&world.building, &world.tours[0], 3);
    let truly = travel.lasers[0].robot_from_sensor;
    let declared = truly * Pose::new(0.15, -0.1, 0.09);
    // Live mapping goes by what is declared too.
    for scan in &mut travel.scans {
        scan.map_from_robot = scan.map_from_robot * truly * declared.inverse();
    }
    travel.lasers[0].robot_from_sensor = declared;
    let outcome = relaxed(&travel, &[]);
    let found = outcome.travels[0].calibration.robot_from_wheels.inverse() * declared;
    let off = truly.step_to(found);
    assert!(off.distance_m() < 0.03 && off.theta_rad.abs() < 0.01, "{truly:?}, found {found:?}");
    // The first pose stays where it was said to be; from there on the laser is where it truly was.
    let lasers: Vec<Pose> = poses(&outcome).iter().map(|&pose| pose * declared).collect();
    let truths: Vec<Pose> = truths.iter().map(|&pose| pose * truly).collect();
    let error_m = error_max_m(&lasers, &truths);
    assert!(error_m < 0.1, "{error_m} m off");
}

#[test]
fn what_is_switched_off_is_not_believed() {
    let world = corridor_loop();
    let driven = driven(&world.building, &world.tours[0], 3);
    let mut refused: Vec<ClosureKey> = Vec::new();
    // Refusing one may bring up another.
    for _ in 0..5 {
        let outcome = relaxed(&driven.travel, &refused);
        for closure in &outcome.closures {
            let is_off = closure.verdict == Verdict::Refused(Refusal::SwitchedOff);
            let is_refused = refused.contains(&closure.key);
            assert!(is_refused || !is_off, "nobody refused {closure:?}");
            assert!(!is_refused || closure.verdict != Verdict::Accepted, "{closure:?}");
        }
        refused.extend(accepted(&outcome).map(|closure| closure.key));
    }
    assert!(!refused.is_empty(), "something was accepted at first");
}

/// Offices alike, six on each side of a corridor: half a metre a character.
fn offices() -> Building {
    let repeated = |row: &str| format!("#{}", row.repeat(6));
    let above =
        ["###########", "..........#", "......##..#", "..........#", "..........#", ".##.......#"];
    let door = "###....####";
    let corridor = "...........";
    let rows = above.iter().chain([&door]).map(|row| repeated(row));
    let below = [&door].into_iter().chain(above.iter().rev()).map(|row| repeated(row));
    let mut middle = vec![repeated(corridor); 4];
    for row in &mut middle {
        row.replace_range(row.len() - 1.., "#");
    }
    let drawing: Vec<String> = rows.chain(middle).chain(below).collect();
    Building::from_drawing(&drawing.join("\n"), 0.5).expect("a drawing")
}

#[test]
fn an_office_is_not_taken_for_another_alike() {
    let building = offices();
    let middle_m = 4.5;
    let inside = |office: u32, up: f64| {
        let x_m = 5.5 * f64::from(office) + 3.0;
        [0.0, 2.6 * up, 0.0].map(|y_m| Point2::new(x_m, middle_m + y_m))
    };
    let visits = [(1, 1.0), (4, 1.0), (2, -1.0), (1, 1.0), (5, -1.0), (2, 1.0)];
    let start = std::iter::once(Point2::new(1.0, middle_m));
    let waypoints: Vec<Point2<f64>> =
        start.chain(visits.into_iter().flat_map(|(office, up)| inside(office, up))).collect();
    let driven = driven(&building, &waypoints, 5);
    let outcome = relaxed(&driven.travel, &[]);
    assert!(1 <= accepted(&outcome).count(), "{:?}", outcome.closures);
    for closure in accepted(&outcome) {
        let error_m = error_of_m(closure, &driven);
        assert!(error_m < 1.5, "another office is 5.5 m off: {error_m} m, {closure:?}");
    }
    let error_m = error_max_m(poses(&outcome), &driven.truths);
    assert!(error_m < 0.3, "{error_m} m off");
}

/// A bare corridor twice around a block: nowhere is it certain where along it the robot is.
#[test]
fn what_a_bare_corridor_leaves_open_is_closed_across_it() {
    let (building, way) =
        ring_corridor(&mut ChaCha8Rng::seed_from_u64(10)).expect("a good drawing");
    let robot = Robot { n_ticks_per_scan: 8, ..ROBOT };
    let driven = simulated_drive::driven(&building, robot, &way, 10);
    let outcome = relaxed(&driven.travel, &[]);
    let back = |closure: &&Closure| truth_of(closure, &driven).distance_m() < 3.0;
    let n_back = outcome.closures.iter().filter(back).count();
    let n_closed = accepted(&outcome).filter(back).count();
    assert!(40 <= n_back && 9 * n_back <= 10 * n_closed, "{n_closed} of {n_back} closed");
    let along = |closure: &&Closure| 1.0 < closure.covariance[0][0].max(closure.covariance[1][1]);
    assert!(5 <= accepted(&outcome).filter(along).count(), "of which some are open along it");
    for closure in accepted(&outcome) {
        let chi2 = chi2_of_error(closure, &driven);
        assert!(chi2 < 25.0, "{} m off: {closure:?}", error_of_m(closure, &driven));
    }
    let error_m = error_max_m(poses(&outcome), &driven.truths);
    assert!(error_m < 0.2, "{error_m} m off");
}

/// A travel that was placed somewhat wrong.
fn misplaced(mut travel: LaserTravel, map_from_there: Pose) -> PlacedTravel {
    for scan in &mut travel.scans {
        scan.map_from_robot = map_from_there * scan.map_from_robot;
    }
    PlacedTravel::of_known_start(travel)
}

#[test]
fn robots_that_saw_the_same_are_laid_over_one_another() {
    let world = corridor_loop();
    let [a, b] = [3, 8].map(|seed| driven(&world.building, &world.tours[0], seed));
    let off = Pose::new(0.3, -0.2, 0.05);
    let placed =
        vec![PlacedTravel::of_known_start(a.travel.clone()), misplaced(b.travel.clone(), off)];
    let outcome = relaxed_together(&PARAMS, placed.clone(), &[]);
    assert_eq!(outcome.travels.len(), 2, "an outcome each");
    for (found, driven) in outcome.travels.iter().zip([&a, &b]) {
        let error_m = error_max_m(&found.poses, &driven.truths);
        assert!(error_m < 0.12, "{error_m} m off");
        let scale = found.calibration.length_scale * OdometryError::UNCALIBRATED.scale;
        assert!((scale - 1.0).abs() < 0.01, "{:?}", found.calibration);
    }
    let between: Vec<&Closure> =
        accepted(&outcome).filter(|one| one.key.from.travel != one.key.to.travel).collect();
    assert!(!between.is_empty(), "{:?}", outcome.closures);
    assert!(between.iter().all(|one| one.key.from.travel < one.key.to.travel), "in their order");
    let n_threads = NonZero::new(3).expect("not zero");
    let by_three = LaserRelaxationParams { n_threads, ..PARAMS };
    assert_eq!(outcome, relaxed_together(&by_three, placed.clone(), &[]), "the same bits");

    let refused: Vec<ClosureKey> = between.iter().map(|one| one.key).collect();
    let without = relaxed_together(&PARAMS, placed, &refused);
    let is_believed = |key: &ClosureKey| accepted(&without).any(|one| one.key == *key);
    assert!(!refused.iter().any(is_believed), "switched off between travels too");
}

#[test]
fn who_meets_nobody_stays_where_he_was() {
    let world = corridor_loop();
    let [a, b] = [3, 8].map(|seed| driven(&world.building, &world.tours[0], seed));
    let far = Pose::new(80.0, -30.0, 2.0);
    let alone = relaxed(&b.travel, &[]);
    let nothing = PlacedTravel::of_known_start(LaserTravel::default());
    let placed = vec![
        nothing,
        PlacedTravel::of_known_start(a.travel.clone()),
        misplaced(b.travel.clone(), far),
    ];
    let outcome = relaxed_together(&PARAMS, placed, &[]);
    assert!(outcome.travels[0].poses.is_empty(), "of a travel without scans");
    let (found, expected) = (&outcome.travels[2].poses, poses(&alone));
    let start = found[0].step_to(far * b.travel.scans[0].map_from_robot);
    assert!(start.distance_m() < 0.02, "{start:?}");
    for (pose, expected) in found.iter().zip(expected) {
        // Grids lie otherwise under a turned building: the same but for millimetres.
        let off_m = (far * *expected).step_to(*pose).distance_m();
        assert!(off_m < 0.05, "as alone: {off_m} m");
    }
    let between = outcome.closures.iter().filter(|one| one.key.from.travel != one.key.to.travel);
    assert_eq!(between.count(), 0, "nothing was seen twice");
}

/// The first scans of a travel as relaxed, the others carried on from there as live mapping would.
fn grown(travel: &LaserTravel, relaxed: &[Pose]) -> PlacedTravel {
    let mut travel = travel.clone();
    let last = relaxed.len() - 1;
    let moved = relaxed[last] * travel.scans[last].map_from_robot.inverse();
    for (index, scan) in travel.scans.iter_mut().enumerate() {
        scan.map_from_robot = relaxed.get(index).copied().unwrap_or(moved * scan.map_from_robot);
    }
    PlacedTravel { n_relaxed: relaxed.len(), ..PlacedTravel::of_known_start(travel) }
}

fn gone_on(placed: PlacedTravel, n_threads: usize, outcome: &LaserOutcome) -> LaserOutcome {
    let n_threads = NonZero::new(n_threads).expect("not zero");
    let (params, known) = (LaserRelaxationParams { n_threads, ..PARAMS }, outcome.closures.clone());
    let mut relaxation =
        LaserRelaxation::going_on(vec![placed], params, &[], known).expect("a resolution");
    while relaxation.advance().is_some() {}
    relaxation.into_outcome()
}

#[test]
fn a_loop_is_closed_while_the_robot_drives() {
    let world = corridor_loop();
    let driven = driven(&world.building, &world.tours[0], 3);
    let n_scans = driven.travel.scans.len();
    let mut outcome = relaxed(
        &LaserTravel {
            scans: driven.travel.scans[..n_scans / 2].to_vec(),
            ..driven.travel.clone()
        },
        &[],
    );
    for n in [n_scans * 7 / 10, n_scans * 9 / 10, n_scans] {
        let scans = driven.travel.scans[..n].to_vec();
        let travel = LaserTravel { scans, ..driven.travel.clone() };
        let placed = grown(&travel, poses(&outcome));
        let next = gone_on(placed.clone(), 1, &outcome);
        assert_eq!(next, gone_on(placed, 3, &outcome), "the same bits on any number of threads");
        assert_eq!(poses(&next).len(), n, "a pose for each scan");
        let is_kept = |one: &Closure| next.closures.iter().any(|other| other.key == one.key);
        assert!(outcome.closures.iter().all(is_kept), "what was judged stays in the ledger");
        outcome = next;
    }
    assert!(1 <= accepted(&outcome).count(), "{:?}", outcome.closures);
    let error_m = error_max_m(poses(&outcome), &driven.truths);
    assert!(error_m < 0.15, "{error_m} m off");
    let again = gone_on(grown(&driven.travel, poses(&outcome)), 1, &outcome);
    for (pose, before) in poses(&again).iter().zip(poses(&outcome)) {
        assert!(before.step_to(*pose).distance_m() < 0.02, "nothing is new: {before:?} {pose:?}");
    }
}

/// No pose.
const ENDLESS: Pose = Pose { x_m: f64::INFINITY, y_m: 0.0, theta_rad: 0.0 };

#[test]
fn whatever_comes_is_survived() {
    let empty = relaxed(&LaserTravel::default(), &[]);
    assert!(poses(&empty).is_empty() && empty.closures.is_empty(), "nothing in, nothing out");
    let world = corridor_loop();
    let mut travel = driven(&world.building, &world.tours[0], 4).travel;
    travel.scans.truncate(60);
    for (index, scan) in travel.scans.iter_mut().enumerate() {
        match index % 10 {
            3 => scan.map_from_robot = Pose { x_m: f64::NAN, ..scan.map_from_robot },
            5 => scan.odometry_from_robot = None,
            6 => scan.odometry_from_robot = Some(ENDLESS),
            7 => scan.ranges_m = vec![f32::NAN; 181].into(),
            8 => scan.laser = 7,
            9 => scan.ranges_m = vec![1.0, -3.0].into(),
            _ => {}
        }
    }
    travel.scans[40].map_from_robot = Pose { x_m: 1e12, y_m: -1e12, theta_rad: 1.0 };
    let outcome = relaxed(&travel, &[]);
    assert_eq!(poses(&outcome).len(), 60, "a pose for each scan");
    assert!(poses(&outcome).iter().all(|pose| pose.is_finite()), "{:?}", poses(&outcome));
    for n_scans in (1..4).rev() {
        travel.scans.truncate(n_scans);
        assert_eq!(poses(&relaxed(&travel, &[])).len(), n_scans, "a pose for each scan");
    }
}
