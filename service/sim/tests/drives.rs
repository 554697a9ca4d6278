//! Robots driving through the crate's own worlds.

use meetpoint_geometry::{Point2, Pose, angle_between};
use meetpoint_sim::{
    ChaCha8Rng, Drive, Laser, OdometryError, Robot, Tick, World, corridor_loop, hall, office, rooms,
};
use rand::SeedableRng;

fn drive(world: &World, tour: usize, robot: Robot, seed: u64) -> Drive<'_> {
    let rng = ChaCha8Rng::seed_from_u64(seed);
    Drive::new(&world.building, robot, &world.tours[tour], 1_000, rng).expect("a way to drive")
}

/// A robot that hardly looks, for tests that are not about its laser.
fn blind(odometry_error: OdometryError) -> Robot {
    let laser = Laser { n_beams: 1, ..Laser::INDOOR };
    Robot { laser, odometry_error, ..Robot::INDOOR }
}

#[test]
fn every_tour_is_driven_to_its_end_without_a_collision() {
    for (name, world) in
        [("office", office()), ("hall", hall()), ("loop", corridor_loop()), ("rooms", rooms())]
    {
        for tour in 0..world.tours.len() {
            let robot = blind(OdometryError::NONE);
            let drive = drive(&world, tour, robot, 1);
            let ticks: Vec<Tick> = drive.clone().collect();
            for tick in &ticks {
                let position = tick.truth.position();
                let is_free = world.building.is_free(position, robot.radius_m);
                assert!(is_free, "{name}, tour {tour}: collision at {:?}", tick.truth);
            }
            let goal = world.tours[tour][world.tours[tour].len() - 1];
            let end = ticks[ticks.len() - 1].truth.position();
            assert!((goal - end).norm() < 0.2, "{name}, tour {tour}: ends at {end:?}");
            let driving_s = ticks.len() as f64 * 0.05;
            let speed_m_per_s = drive.length_m() / driving_s;
            assert!(0.4 < speed_m_per_s, "{name}, tour {tour}: {speed_m_per_s} m/s");
        }
    }
}

#[test]
fn keeps_within_its_limits() {
    let world = hall();
    let robot = blind(OdometryError::NONE);
    let ticks: Vec<Tick> = drive(&world, 0, robot, 1).collect();
    let steps = ticks.windows(2).map(|pair| (pair[0].truth.step_to(pair[1].truth), &pair[1]));
    let mut speed_before_m_per_s = 0.0;
    for (step, tick) in steps {
        let speed_m_per_s = step.distance_m() / 0.05;
        assert!(speed_m_per_s < robot.speed_max_m_per_s + 1e-9, "{speed_m_per_s} m/s");
        let acceleration = (speed_m_per_s - speed_before_m_per_s).abs() / 0.05;
        assert!(acceleration < robot.acceleration_max_m_per_s2 + 1e-6, "{acceleration} m/s2");
        let turn_rad_per_s = step.theta_rad.abs() / 0.05;
        assert!(turn_rad_per_s < robot.turn_max_rad_per_s + 1e-9, "{turn_rad_per_s} rad/s");
        assert_eq!(tick.scan.is_some(), tick.stamp_ns % 100_000_000 == 1_000, "every other tick");
        speed_before_m_per_s = speed_m_per_s;
    }
}

#[test]
fn same_seed_same_bits() {
    let world = hall();
    let ticks = |seed| drive(&world, 0, Robot::INDOOR, seed).take(200).collect::<Vec<_>>();
    assert_eq!(ticks(7), ticks(7), "nothing random but the generator");
    assert_ne!(ticks(7), ticks(8), "another seed, another drive");
}

#[test]
fn perfect_odometry_is_the_truth_seen_from_the_start() {
    let world = corridor_loop();
    let drive = drive(&world, 0, blind(OdometryError::NONE), 1);
    let start = drive.truth();
    for tick in drive {
        let error = tick.truth.step_to(start * tick.odometry);
        assert!(error.distance_m() < 1e-6, "{} m off", error.distance_m());
    }
}

#[test]
fn odometry_error_grows_as_set() {
    let world = corridor_loop();
    let error = OdometryError { scale: 1.1, ..OdometryError::NONE };
    let drive_scaled = drive(&world, 0, blind(error), 1);
    let start = drive_scaled.truth();
    for tick in drive_scaled {
        let step = start.step_to(tick.truth);
        let scaled = Pose::new(1.1 * step.x_m, 1.1 * step.y_m, step.theta_rad);
        assert!(scaled.step_to(tick.odometry).distance_m() < 1e-6, "all lengths by a tenth");
    }
    let error = OdometryError { drift_rad_per_m: 0.01, ..OdometryError::NONE };
    let drive_bent = drive(&world, 0, blind(error), 1);
    let start = drive_bent.truth();
    let mut driven_m = 0.0;
    let mut before = start;
    for tick in drive_bent {
        driven_m += before.step_to(tick.truth).distance_m();
        before = tick.truth;
        let off_rad = angle_between(start.step_to(tick.truth).theta_rad, tick.odometry.theta_rad);
        assert!((off_rad - 0.01 * driven_m).abs() < 1e-6, "{off_rad} rad after {driven_m} m");
    }
    assert!(40.0 < driven_m, "{driven_m} m around the loop");
}

#[test]
fn scans_show_the_walls_around() {
    let world = hall();
    let ticks: Vec<Tick> = drive(&world, 0, Robot::INDOOR, 3).take(300).collect();
    let laser = Laser::INDOOR;
    let (mut n_right, mut n_all) = (0, 0);
    for tick in ticks.iter().filter(|tick| tick.scan.is_some()) {
        let from = tick.truth * laser.robot_from_laser;
        let scan = tick.scan.as_deref().unwrap_or_default();
        for (index, &range_m) in (0_u32..).zip(scan) {
            let bearing_rad =
                from.theta_rad + laser.angle_min_rad + f64::from(index) * laser.angle_increment_rad;
            let wall_m = world.building.range_m(from.position(), bearing_rad, laser.range_max_m);
            let error_m = f64::from(range_m) - wall_m.expect("walls all around");
            n_right += u32::from(error_m.abs() < 4.0 * laser.noise.range_std_m);
            n_all += 1;
        }
    }
    let share = f64::from(n_right) / f64::from(n_all);
    assert!((0.995..0.999).contains(&share), "{share} of {n_all} readings are right");
}

/// Ticks of a robot in the hall that is told to go straight to these points, one after the other.
fn told(start: Pose, ways: &[&[Point2<f64>]]) -> Vec<Tick> {
    let (world, robot) = (hall(), blind(OdometryError::NONE));
    let rng = ChaCha8Rng::seed_from_u64(1);
    let mut drive = Drive::standing(&world.building, robot, start, 1_000, rng).expect("room");
    let mut ticks: Vec<Tick> = drive.by_ref().collect();
    assert_eq!((ticks.len(), ticks[0].truth), (1, start), "it stands, and looks once");
    for way in ways {
        drive.follow(way);
        ticks.extend(drive.by_ref());
    }
    for tick in &ticks {
        let is_free = world.building.is_free(tick.truth.position(), robot.radius_m);
        assert!(is_free, "collision at {:?}", tick.truth);
    }
    let stamps = ticks.windows(2).map(|pair| pair[1].stamp_ns - pair[0].stamp_ns);
    assert!(stamps.into_iter().all(|step_ns| step_ns == robot.tick_ns), "its clock goes on");
    assert!((drive.elapsed_s() - ticks.len() as f64 * 0.05).abs() < 1e-9, "and tells");
    ticks
}

#[test]
fn goes_where_it_is_told() {
    let start = Pose::new(1.0, 1.0, 3.0);
    let [a, b, c] = [(3.0, 1.2), (6.0, 1.0), (6.0, 3.0)].map(|(x, y)| Point2::new(x, y));
    let ticks = told(start, &[&[a], &[], &[b, c]]);
    for goal in [a, b, c] {
        let nearest = ticks.iter().map(|tick| (tick.truth.position() - goal).norm());
        let nearest_m = nearest.fold(f64::INFINITY, f64::min);
        assert!(nearest_m < 0.25, "{nearest_m} m from {goal:?}");
    }
    let end = ticks[ticks.len() - 1].truth.position();
    assert!((end - c).norm() < 0.15, "there: {end:?}");
}

#[test]
fn looks_around_where_it_is() {
    let (world, robot) = (hall(), blind(OdometryError::NONE));
    let start = Pose::new(1.0, 1.0, 0.5);
    let rng = ChaCha8Rng::seed_from_u64(1);
    let mut drive = Drive::standing(&world.building, robot, start, 0, rng).expect("room");
    drive.look_around();
    let ticks: Vec<Tick> = drive.by_ref().collect();
    let turned = ticks.windows(2).map(|pair| pair[0].truth.step_to(pair[1].truth));
    let turned_rad: f64 = turned.map(|step| step.theta_rad).sum();
    assert!((turned_rad - std::f64::consts::TAU).abs() < 1e-9, "{turned_rad} rad");
    assert_eq!(drive.truth().position(), start.position(), "on the spot");
    assert!(drive.next().is_none(), "and then it stands");
}

#[test]
fn touches_no_wall_wherever_it_is_told_to_go() {
    let start = Pose::new(1.0, 1.0, 0.0);
    let beyond = Point2::new(-2.0, 1.0);
    let ticks = told(start, &[&[beyond], &[Point2::new(2.0, 1.0)]]);
    let end = ticks[ticks.len() - 1].truth.position();
    assert!((end - Point2::new(2.0, 1.0)).norm() < 0.15, "and comes back: {end:?}");
    let wall = Pose::new(0.1, 1.0, 0.0);
    let rng = ChaCha8Rng::seed_from_u64(1);
    let hall = hall();
    assert!(Drive::standing(&hall.building, Robot::INDOOR, wall, 0, rng).is_none(), "no room");
}
