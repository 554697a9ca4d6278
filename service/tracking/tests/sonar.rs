//! Sonar rings on live maps: alone, beside a laser, and cut in the middle.

use std::sync::Arc;

use meetpoint_geometry::Pose;
use meetpoint_occupancy::SonarRing;
use meetpoint_sim::{Building, ChaCha8Rng, Laser, SonarRing as Sonars, hall, route};
use meetpoint_tracking::{
    LiveMap, MappingParams, Observation, ObservationKind, Sensor, SensorKind, SessionConfig,
    SessionKey,
};
use rand::SeedableRng;

const ROBOT: SessionKey = SessionKey(1);
const RESOLUTION_M: f64 = 0.1;

fn ring(sonars: &Sonars) -> Sensor {
    let robot_from_transducer = (0..sonars.n_sonars).map(|at| sonars.robot_from_sonar(at));
    let ring = SonarRing {
        robot_from_transducer: robot_from_transducer.collect(),
        cone_rad: sonars.cone_rad,
        range_min_m: sonars.range_min_m,
        range_max_m: sonars.range_max_m,
    };
    Sensor { robot_from_sensor: Pose::IDENTITY, kind: SensorKind::SonarRing(Arc::new(ring)) }
}

fn laser() -> Sensor {
    let geometry = Laser::INDOOR.geometry();
    let robot_from_sensor = Laser::INDOOR.robot_from_laser;
    Sensor { robot_from_sensor, kind: SensorKind::Laser(geometry) }
}

/// What a robot with a ring, and a laser after it if `has_laser`, sends from a round through the hall.
fn round(building: &Building, has_laser: bool) -> Vec<Observation> {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let places = building.places("ABCDA").expect("places of the hall");
    let path = route(building, &places, 0.35).expect("a way");
    let mut sent = Vec::new();
    for (index, pair) in path.windows(2).enumerate().step_by(2) {
        let step = pair[1] - pair[0];
        let robot = Pose::new(pair[0].x, pair[0].y, step.y.atan2(step.x));
        let stamp_ns = i64::try_from(index).expect("a short way") * 50_000_000;
        let mut send = |kind| sent.push(Observation { stamp_ns, kind });
        send(ObservationKind::OdometryPose(robot));
        if has_laser {
            let ranges_m = Laser::INDOOR.scan(building, robot, &mut rng);
            send(ObservationKind::LaserScan { sensor: 1, ranges_m });
        }
        let ranges_m = Sonars::RING_24.scan(building, robot, &mut rng);
        send(ObservationKind::SonarScan { sensor: 0, ranges_m });
    }
    sent
}

fn opened(sent: &[Observation], sensors: Vec<Sensor>) -> LiveMap {
    let mut map = LiveMap::new(MappingParams::INDOOR, RESOLUTION_M).expect("a length");
    let ObservationKind::OdometryPose(start) = sent[0].kind else { panic!("odometry comes first") };
    map.open_session(ROBOT, SessionConfig { map_from_start: start, sensors });
    map
}

/// Of the cells decided, how many there are and the share that is as the building has it.
fn decided(map: &LiveMap, building: &Building) -> (usize, f64) {
    let frame = map.grid().frame();
    let raster = map.grid().raster(None);
    let width = raster.info.width as usize;
    let cells = raster.log_odds.iter().enumerate().filter(|(_, log_odds)| 0.85 < log_odds.abs());
    let right = cells.filter_map(|(index, &log_odds)| {
        let offset = |n: usize| i32::try_from(n).expect("a small map");
        let mut cell = raster.info.first;
        (cell.x, cell.y) = (cell.x + offset(index % width), cell.y + offset(index / width));
        let at = frame.center_of(cell);
        let is_open = 0.25 <= building.clearance_m(at, 0.25);
        is_open.then_some(log_odds < 0.0)
    });
    let right: Vec<bool> = right.collect();
    let n_right = right.iter().filter(|&&is_right| is_right).count();
    (right.len(), n_right as f64 / right.len() as f64)
}

#[test]
fn a_robot_with_sonar_alone_draws_a_map() {
    let building = hall().building;
    let sent = round(&building, false);
    let mut map = opened(&sent, vec![ring(&Sonars::RING_24)]);
    let estimates: Vec<_> = sent.iter().filter_map(|one| map.apply(ROBOT, one)).collect();
    let n_drawn = estimates.iter().filter(|estimate| estimate.drawn).count();
    assert!(estimates.len() / 4 < n_drawn && n_drawn < estimates.len(), "{n_drawn} drawn");
    let (n, right) = decided(&map, &building);
    assert!(1500 < n, "{n} open cells of the hall are decided");
    assert!(0.95 < right, "{right} of them are free");
}

#[test]
fn cut_in_the_middle_it_goes_on_bit_for_bit() {
    let building = hall().building;
    let both = vec![ring(&Sonars::RING_24), laser()];
    goes_on_when_cut(&round(&building, true), &both);
    goes_on_when_cut(&round(&building, false), &both[..1]);
}

fn goes_on_when_cut(sent: &[Observation], sensors: &[Sensor]) {
    let mut whole = opened(sent, sensors.to_vec());
    let mut cut = opened(sent, sensors.to_vec());
    for (index, one) in sent.iter().enumerate() {
        if index == sent.len() / 2 {
            let tiles: Vec<_> = cut.grid().tiles().map(|(at, tile)| (at, tile.clone())).collect();
            let state = cut.state_bytes();
            cut = LiveMap::restore(MappingParams::INDOOR, RESOLUTION_M, tiles, &state)
                .expect("its own state");
        }
        assert_eq!(whole.apply(ROBOT, one), cut.apply(ROBOT, one), "observation {index}");
    }
    assert_eq!(whole.state_bytes(), cut.state_bytes(), "the states");
    let bytes = |map: &LiveMap| {
        map.grid().tiles().map(|(at, tile)| (at, tile.to_bytes())).collect::<Vec<_>>()
    };
    assert_eq!(bytes(&whole), bytes(&cut), "the tiles");
}

#[test]
fn what_a_laser_looked_at_is_as_without_sonar() {
    let building = hall().building;
    let sent = round(&building, true);
    let sensors = vec![ring(&Sonars::RING_24), laser()];
    let mut both = opened(&sent, sensors.clone());
    let mut laser_alone = opened(&sent, sensors);
    for one in &sent {
        let estimate = both.apply(ROBOT, one);
        if !matches!(one.kind, ObservationKind::SonarScan { .. }) {
            assert_eq!(laser_alone.apply(ROBOT, one), estimate, "at {} ns", one.stamp_ns);
        }
    }
    let (mut n_seen, mut n_heard) = (0, 0);
    for (index, tile) in both.grid().tiles() {
        let seen = laser_alone.grid().tile(index);
        for (at, log_odds) in tile.log_odds().iter().enumerate() {
            let by_laser = seen.map_or(f32::NAN, |seen| seen.log_odds()[at]);
            if by_laser.is_nan() {
                n_heard += i32::from(!log_odds.is_nan());
                assert!(log_odds.is_nan() || tile.is_heard(at), "cell {at} of {index:?} is heard");
            } else {
                n_seen += 1;
                assert_eq!(log_odds.to_bits(), by_laser.to_bits(), "cell {at} of {index:?}");
                assert_eq!(tile.hit_mean(at), seen.and_then(|seen| seen.hit_mean(at)), "its hits");
            }
        }
    }
    assert!(1000 < n_seen && 20 < n_heard, "{n_seen} cells seen, {n_heard} only heard");
}

/// The same round, and odometry that turns by so much more with every metre.
fn drifting(sent: &[Observation], drift_rad_per_m: f64) -> Vec<Observation> {
    let mut before: Option<(Pose, Pose)> = None;
    let mut drift = |one: &Observation| {
        let ObservationKind::OdometryPose(truth) = one.kind else { return one.clone() };
        let reckoned = before.map_or(truth, |(truth_before, reckoned)| {
            let step = truth_before.step_to(truth);
            let turn_rad = drift_rad_per_m * step.distance_m();
            reckoned * Pose::new(step.x_m, step.y_m, step.theta_rad + turn_rad)
        });
        before = Some((truth, reckoned));
        Observation { stamp_ns: one.stamp_ns, kind: ObservationKind::OdometryPose(reckoned) }
    };
    sent.iter().map(&mut drift).collect()
}

/// Distance of the last pose from the truth, in metres.
fn final_error_m(sent: &[Observation], truth: &[Observation], params: &MappingParams) -> f64 {
    let mut map = LiveMap::new(*params, RESOLUTION_M).expect("a length");
    let ObservationKind::OdometryPose(start) = truth[0].kind else { panic!("odometry first") };
    let sensors = vec![ring(&Sonars::RING_24)];
    map.open_session(ROBOT, SessionConfig { map_from_start: start, sensors });
    let last = sent.iter().filter_map(|one| map.apply(ROBOT, one)).last().expect("firings");
    let is_odometry = |one: &&Observation| matches!(one.kind, ObservationKind::OdometryPose(_));
    let at = truth.iter().rfind(is_odometry).expect("odometry");
    let ObservationKind::OdometryPose(at) = at.kind else { panic!("odometry") };
    (last.map_from_robot.position() - at.position()).norm()
}

#[test]
fn what_is_heard_corrects_odometry_that_drifts() {
    let building = hall().building;
    let truth = [round(&building, false), round(&building, false)].concat();
    let truth: Vec<Observation> = (0_i64..)
        .zip(truth)
        .map(|(index, one)| Observation { stamp_ns: index / 2 * 100_000_000, kind: one.kind })
        .collect();
    let sent = drifting(&truth, 0.02);
    let mut reckoned = MappingParams::INDOOR;
    (reckoned.position.correlation_gain, reckoned.position.wall_gain) = (0.0, 0.0);
    let by_odometry_m = final_error_m(&sent, &truth, &reckoned);
    let found_m = final_error_m(&sent, &truth, &MappingParams::INDOOR);
    assert!(1.0 < by_odometry_m, "odometry alone ends {by_odometry_m} m off");
    assert!(found_m < 0.3, "{found_m} m off; odometry alone {by_odometry_m} m");
}

#[test]
fn any_numbers_may_be_heard_anywhere() {
    let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, 0.0, 1e30, 1.0, 1e-30];
    let mut map = LiveMap::new(MappingParams::INDOOR, RESOLUTION_M).expect("a length");
    let sensors = vec![ring(&Sonars::RING_24), ring(&Sonars { n_sonars: 0, ..Sonars::RING_24 })];
    map.open_session(ROBOT, SessionConfig { map_from_start: Pose::IDENTITY, sensors });
    let places_m = [0.0, 1.0, 1e8, 214_748_364.0, -214_748_364.8, 1e300, -1e300, f64::NAN, 2.0];
    for (index, x_m) in places_m.into_iter().enumerate() {
        for sensor in 0..3 {
            let stamp_ns = i64::try_from(3 * index + sensor).expect("small");
            let odometry = ObservationKind::OdometryPose(Pose { x_m, y_m: -x_m, theta_rad: x_m });
            map.apply(ROBOT, &Observation { stamp_ns, kind: odometry });
            let ranges_m = odd.iter().copied().cycle().take(20 + 2 * sensor).collect();
            let kind = ObservationKind::SonarScan { sensor, ranges_m };
            if let Some(estimate) = map.apply(ROBOT, &Observation { stamp_ns, kind }) {
                assert!(estimate.map_from_robot.is_finite(), "{estimate:?} from {x_m} m");
            }
        }
    }
}
