//! Live mapping of drawn rooms, seen from outside.

mod drawn_world;

use std::sync::{Arc, OnceLock};

use meetpoint_geometry::{Pose, angle_between};
use meetpoint_occupancy::{Tile, TileIndex};
use meetpoint_tracking::{
    Estimate, LiveMap, MappingParams, Observation, ObservationKind, Sensor, SensorKind,
    SessionConfig, SessionKey,
};
use proptest::prelude::*;

use drawn_world::{DrawnWorld, LASER};

const RESOLUTION_M: f64 = 0.05;
const ROBOT: SessionKey = SessionKey(7);
const OTHER_ROBOT: SessionKey = SessionKey(3);

/// A drive of 20 m into the unknown, half of it along a corridor whose ends are out of sight, drifts
/// by no more than this, in metres.
const DRIFT_MAX_M: f64 = 0.15;

/// ... and by no more than this if the odometry stalls three times on the way, in metres.
const STALL_DRIFT_MAX_M: f64 = 0.3;

/// 20 m by 9 m, a character half a metre.
const OFFICE: &str = "
########################################
#..........#...............#...........#
#..........#...............#...........#
#......................................#
#......................................#
#...#......#.......#.......#......##...#
#..........#...............#...........#
###..#########..#######..######..#######
#......................................#
#......................................#
#......................................#
###..#########..############..##########
#..........#...............#...........#
#..........#....#..........#....#......#
#......................................#
#......................................#
#..........#...............#.........###
########################################";

/// Along the corridor, into a room and back, and on: every 0.1 m or 0.1 rad.
fn office_drive() -> Vec<Pose> {
    let corners = [(2.0, 4.2), (7.2, 4.2), (7.2, 7.0), (7.4, 4.2), (14.5, 4.2), (14.6, 2.0)];
    let mut drive = vec![Pose::new(2.0, 4.2, 0.0)];
    for corner in corners {
        let from = drive[drive.len() - 1];
        let (dx, dy) = (corner.0 - from.x_m, corner.1 - from.y_m);
        let length_m = dx.hypot(dy);
        if length_m < 0.05 {
            continue;
        }
        let turn_rad = angle_between(from.theta_rad, dy.atan2(dx));
        let n_turns = (turn_rad.abs() / 0.1).ceil();
        let n_steps = (length_m / 0.1).ceil();
        let turned = Pose::new(from.x_m, from.y_m, from.theta_rad + turn_rad);
        let arrived = Pose::new(corner.0, corner.1, turned.theta_rad);
        for (start, end, n) in [(from, turned, n_turns), (turned, arrived, n_steps)] {
            let mut done = 0.0;
            while done < n {
                done += 1.0;
                drive.push(start.interpolate(end, done / n));
            }
        }
    }
    drive
}

/// Odometry that turns too far and runs short: 3 % of the way, 2 % of the turn, and a drift.
fn crooked_odometry(drive: &[Pose]) -> Vec<Pose> {
    let mut at = Pose::new(-3.0, 11.0, 1.0);
    let mut odometry = vec![at];
    for pair in drive.windows(2) {
        let step = pair[0].step_to(pair[1]);
        let turn_rad = 1.02 * step.theta_rad + 0.01 * step.distance_m();
        at = at * Pose::new(0.97 * step.x_m, 0.97 * step.y_m, turn_rad);
        odometry.push(at);
    }
    odometry
}

fn stamp_ns(index: usize) -> i64 {
    1_000_000_000 + 200_000_000 * i64::try_from(index).expect("a short drive")
}

/// What a robot would send on a drive: odometry and a scan at each pose.
fn observations(world: &DrawnWorld, drive: &[Pose], odometry: &[Pose]) -> Vec<Observation> {
    let each = drive.iter().zip(odometry).enumerate().flat_map(|(index, (truth, odometry))| {
        let ranges_m = world.scan(*truth, index);
        let kinds = [
            ObservationKind::OdometryPose(*odometry),
            ObservationKind::LaserScan { sensor: 0, ranges_m },
        ];
        kinds.map(|kind| Observation { stamp_ns: stamp_ns(index), kind })
    });
    each.collect()
}

fn office_observations() -> &'static [Observation] {
    static OBSERVATIONS: OnceLock<Vec<Observation>> = OnceLock::new();
    OBSERVATIONS.get_or_init(|| {
        let drive = office_drive();
        observations(&DrawnWorld::new(OFFICE), &drive, &crooked_odometry(&drive))
    })
}

fn config(map_from_start: Pose) -> SessionConfig {
    let laser = Sensor { robot_from_sensor: Pose::IDENTITY, kind: SensorKind::Laser(LASER) };
    SessionConfig { map_from_start, sensors: vec![laser] }
}

fn office_map() -> LiveMap {
    let mut map = LiveMap::new(MappingParams::INDOOR, RESOLUTION_M).expect("a length");
    map.open_session(ROBOT, config(office_drive()[0]));
    map
}

fn apply_all(map: &mut LiveMap, key: SessionKey, observations: &[Observation]) -> Vec<Estimate> {
    observations.iter().filter_map(|observation| map.apply(key, observation)).collect()
}

/// The largest distance between estimates and truth, in metres.
fn error_max_m(estimates: &[Estimate], truth: &[Pose]) -> f64 {
    assert_eq!(estimates.len(), truth.len(), "a pose for each scan");
    let errors_m = estimates
        .iter()
        .zip(truth)
        .map(|(estimate, truth)| truth.step_to(estimate.map_from_robot).distance_m());
    errors_m.fold(0.0, f64::max)
}

fn tiles(map: &LiveMap) -> Vec<(TileIndex, Arc<Tile>)> {
    map.grid().tiles().map(|(index, tile)| (index, Arc::clone(tile))).collect()
}

#[test]
fn follows_a_drive_better_than_its_odometry() {
    let drive = office_drive();
    let mut map = office_map();
    let estimates = apply_all(&mut map, ROBOT, office_observations());
    let error_m = error_max_m(&estimates, &drive);
    assert!(error_m < DRIFT_MAX_M, "{error_m} m off at worst");
    assert!(estimates.iter().all(|estimate| !estimate.lost), "never lost");
    assert!(map.n_drawn() < estimates.len() as u64, "not every scan is drawn");

    let odometry = crooked_odometry(&drive);
    let end = odometry[0].step_to(odometry[odometry.len() - 1]);
    let odometry_error_m = (drive[0] * end).step_to(drive[drive.len() - 1]).distance_m();
    assert!(0.5 < odometry_error_m, "odometry alone is {odometry_error_m} m off");
}

#[test]
fn corrects_the_odometrys_frame() {
    let mut map = office_map();
    let estimates = apply_all(&mut map, ROBOT, office_observations());
    let odometry = crooked_odometry(&office_drive());
    for (estimate, odometry) in estimates.iter().zip(&odometry) {
        let robot = estimate.map_from_odometry * *odometry;
        assert!(robot.step_to(estimate.map_from_robot).distance_m() < 1e-6, "the same pose");
    }
}

fn office_scans() -> Vec<Observation> {
    let is_scan = |it: &&Observation| !matches!(it.kind, ObservationKind::OdometryPose(_));
    office_observations().iter().filter(is_scan).cloned().collect()
}

#[test]
fn follows_without_odometry() {
    let estimates = apply_all(&mut office_map(), ROBOT, &office_scans());
    let error_m = error_max_m(&estimates, &office_drive());
    assert!(error_m < DRIFT_MAX_M, "{error_m} m off at worst");
}

/// Scans wait somewhere and are stamped when they come through: five of them a millisecond apart, one of
/// them before the last.
#[test]
fn follows_without_odometry_by_stamps_that_stutter() {
    let mut scans = office_scans();
    for (index, scan) in scans.iter_mut().enumerate() {
        let n_before = index % 5;
        let late_ns = if n_before == 3 { -2_000_000 } else { 1_000_000 };
        scan.stamp_ns = stamp_ns(index - n_before + 5)
            + late_ns * i64::try_from(n_before).expect("less than five");
    }
    let estimates = apply_all(&mut office_map(), ROBOT, &scans);
    let error_m = error_max_m(&estimates, &office_drive());
    assert!(error_m < DRIFT_MAX_M, "{error_m} m off at worst");
}

#[test]
fn survives_odometry_that_stalls_and_jumps() {
    let drive = office_drive();
    let mut odometry = crooked_odometry(&drive);
    for stall in [30, 60, 100] {
        let stuck = odometry[stall];
        odometry[stall + 1..stall + 5].fill(stuck);
    }
    let world = DrawnWorld::new(OFFICE);
    let estimates = apply_all(&mut office_map(), ROBOT, &observations(&world, &drive, &odometry));
    let error_m = error_max_m(&estimates, &drive);
    assert!(error_m < STALL_DRIFT_MAX_M, "{error_m} m off at worst");
}

#[test]
fn a_second_robot_locks_on_from_a_rough_start() {
    let drive = office_drive();
    let mut map = office_map();
    apply_all(&mut map, ROBOT, office_observations());
    let rough = drive[0] * Pose::new(0.3, -0.2, 0.15);
    map.open_session(OTHER_ROBOT, config(rough));
    let estimates = apply_all(&mut map, OTHER_ROBOT, office_observations());
    let error_m = error_max_m(&estimates, &drive);
    assert!(error_m < 2.0 * DRIFT_MAX_M, "{error_m} m off at worst");
}

#[test]
fn robots_take_turns_on_one_map() {
    let drive = office_drive();
    let mut map = office_map();
    map.open_session(OTHER_ROBOT, config(drive[0]));
    let (mut first, mut second) = (Vec::new(), Vec::new());
    for observation in office_observations() {
        first.extend(map.apply(ROBOT, observation));
        second.extend(map.apply(OTHER_ROBOT, observation));
    }
    assert!(error_max_m(&first, &drive) < DRIFT_MAX_M, "the first is followed");
    assert!(error_max_m(&second, &drive) < DRIFT_MAX_M, "the second is followed on the same map");
}

#[test]
fn finds_itself_again_after_a_hole() {
    let drive = office_drive();
    let observations = office_observations();
    let mut map = office_map();
    apply_all(&mut map, ROBOT, observations);
    map.open_session(OTHER_ROBOT, config(drive[0]));
    apply_all(&mut map, OTHER_ROBOT, &observations[..60]);
    map.break_odometry(OTHER_ROBOT);
    let after = apply_all(&mut map, OTHER_ROBOT, &observations[80..]);
    let error_m = error_max_m(&after, &drive[40..]);
    assert!(error_m < 2.0 * DRIFT_MAX_M, "{error_m} m off at worst");
}

#[test]
fn a_scan_of_nothing_known_is_not_drawn_after_a_hole() {
    let drive = office_drive();
    let mut map = office_map();
    apply_all(&mut map, ROBOT, &office_observations()[..40]);
    map.break_odometry(ROBOT);
    let strange = (0..180_u16).map(|beam| if beam / 9 % 2 == 0 { 0.6 } else { 1.1 }).collect();
    let kind = ObservationKind::LaserScan { sensor: 0, ranges_m: strange };
    let estimate = map.apply(ROBOT, &Observation { stamp_ns: stamp_ns(20), kind });
    let estimate = estimate.expect("a pose for each scan");
    assert!(estimate.lost && !estimate.drawn, "lost, and the map is left alone");
    assert!(drive[19].step_to(estimate.map_from_robot).distance_m() < 0.1, "where it was last");
}

#[test]
fn other_observations_get_a_pose_by_odometry() {
    let mut map = office_map();
    apply_all(&mut map, ROBOT, &office_observations()[..41]);
    let mark = Observation { stamp_ns: stamp_ns(20), kind: ObservationKind::Mark };
    let estimate = map.apply(ROBOT, &mark).expect("a pose for each mark");
    assert_eq!(estimate.sensor, None, "a mark has no sensor");
    let error_m = office_drive()[20].step_to(estimate.map_from_robot).distance_m();
    assert!(error_m < 0.1, "{error_m} m off, one odometry pose after the last scan");
    assert_eq!(map.apply(OTHER_ROBOT, &mark), None, "a session that is not open");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(6))]

    /// Same bits, whatever was stored and restored in between.
    #[test]
    fn goes_on_from_a_stored_state_bit_for_bit(mut cuts in prop::collection::vec(0..320_usize, 1..4)) {
        let observations = &office_observations()[..320];
        let mut undisturbed = office_map();
        let expected = apply_all(&mut undisturbed, ROBOT, observations);

        cuts.sort_unstable();
        cuts.push(observations.len());
        let mut map = office_map();
        let (mut estimates, mut from) = (Vec::new(), 0);
        for cut in cuts {
            estimates.extend(apply_all(&mut map, ROBOT, &observations[from..cut]));
            from = cut;
            let stored: Vec<_> = tiles(&map)
                .iter()
                .map(|(index, tile)| (*index, Tile::from_bytes(&tile.to_bytes()).expect("ours")))
                .map(|(index, tile)| (index, Arc::new(tile)))
                .collect();
            let state = map.state_bytes();
            map = LiveMap::restore(MappingParams::INDOOR, RESOLUTION_M, stored, &state)
                .expect("our own bytes");
        }
        prop_assert_eq!(estimates, expected);
        prop_assert_eq!(map.state_bytes(), undisturbed.state_bytes());
        prop_assert_eq!(tiles(&map), tiles(&undisturbed));
    }

    #[test]
    fn any_numbers_may_come(
        poses in prop::collection::vec((any::<f64>(), any::<f64>(), any::<f64>(), any::<i64>()), 1..4),
        ranges_m in prop::collection::vec(any::<f32>(), 0..40),
    ) {
        let mut map = office_map();
        apply_all(&mut map, ROBOT, &office_observations()[..8]);
        for (x, y, theta, stamp_ns) in poses {
            let velocity = ObservationKind::OdometryVelocity {
                forward_m_per_s: y,
                left_m_per_s: theta,
                turn_rad_per_s: x,
            };
            let kinds = [
                ObservationKind::OdometryPose(Pose { x_m: x, y_m: y, theta_rad: theta }),
                ObservationKind::LaserScan { sensor: 0, ranges_m: ranges_m.clone() },
                velocity,
                ObservationKind::LaserScan { sensor: 0, ranges_m: ranges_m.clone() },
                ObservationKind::LaserScan { sensor: 9, ranges_m: ranges_m.clone() },
                ObservationKind::SonarScan { sensor: 9, ranges_m: ranges_m.clone() },
            ];
            for kind in kinds {
                if let Some(estimate) = map.apply(ROBOT, &Observation { stamp_ns, kind }) {
                    prop_assert!(estimate.map_from_robot.is_finite());
                    prop_assert!(estimate.map_from_odometry.is_finite());
                }
            }
        }
    }

    #[test]
    fn no_bytes_panic_as_a_state(bytes in prop::collection::vec(any::<u8>(), 0..200), n in 0..400_usize) {
        let restored = |state: &[u8]| LiveMap::restore(MappingParams::INDOOR, RESOLUTION_M, [], state);
        let _ = restored(&bytes);
        let state = office_map().state_bytes();
        prop_assert!(restored(&state[..n.min(state.len() - 1)]).is_err(), "cut short");
    }
}

fn reckoned(map: &mut LiveMap, stamp_ns: i64, kind: ObservationKind) -> Option<Pose> {
    let estimate = map.apply(ROBOT, &Observation { stamp_ns, kind });
    estimate.map(|estimate| estimate.map_from_robot)
}

#[test]
fn without_a_laser_the_robot_is_where_its_odometry_says() {
    let mut map = LiveMap::new(MappingParams::INDOOR, RESOLUTION_M).expect("a length");
    let start = Pose::new(1.0, 2.0, 0.5);
    map.open_session(ROBOT, SessionConfig { map_from_start: start, sensors: Vec::new() });
    let odometry = |x_m| ObservationKind::OdometryPose(Pose::new(x_m, 7.0, 0.0));
    assert_eq!(reckoned(&mut map, 1, odometry(10.0)), None, "odometry has no pose of its own");
    assert_eq!(reckoned(&mut map, 1, ObservationKind::Mark), Some(start), "at its start");
    reckoned(&mut map, 2, odometry(13.0));
    let there = start * Pose::new(3.0, 0.0, 0.0);
    assert_eq!(reckoned(&mut map, 2, ObservationKind::Mark), Some(there), "3 m on");
    map.break_odometry(ROBOT);
    reckoned(&mut map, 3, odometry(50.0));
    assert_eq!(reckoned(&mut map, 3, ObservationKind::Mark), Some(there), "over a hole it stands");
    reckoned(&mut map, 4, odometry(51.0));
    let farther = there * Pose::new(1.0, 0.0, 0.0);
    assert_eq!(reckoned(&mut map, 4, ObservationKind::Mark), Some(farther), "and goes on");
}

#[test]
fn known_poses_are_drawn_at_and_gone_on_from() {
    let (world, drive) = (DrawnWorld::new(OFFICE), office_drive());
    let mut map = LiveMap::new(MappingParams::INDOOR, RESOLUTION_M).expect("a length");
    let laser = Sensor { robot_from_sensor: Pose::IDENTITY, kind: SensorKind::Laser(LASER) };
    map.open_session(ROBOT, SessionConfig { map_from_start: drive[0], sensors: vec![laser] });
    let half = drive.len() / 2;
    for (index, &truth) in drive.iter().enumerate() {
        let stamp_ns = 1_000_000_000 + i64::try_from(index).expect("few") * 100_000_000;
        let odometry = ObservationKind::OdometryPose(truth);
        map.apply(ROBOT, &Observation { stamp_ns, kind: odometry });
        let kind = ObservationKind::LaserScan { sensor: 0, ranges_m: world.scan(truth, index) };
        let scan = Observation { stamp_ns, kind };
        if index < half {
            let estimate = map.apply_at(ROBOT, &scan, truth).expect("it is open");
            assert_eq!((estimate.map_from_robot, estimate.lost), (truth, false), "as told");
        } else {
            let estimate = map.apply(ROBOT, &scan).expect("it is open");
            let off_m = truth.step_to(estimate.map_from_robot).distance_m();
            assert!(off_m < DRIFT_MAX_M && !estimate.lost, "{off_m} m at {index}");
        }
    }
    assert!(30 < map.n_drawn(), "{} scans drawn", map.n_drawn());
}
