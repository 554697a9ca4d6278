//! Simulated drives as live mapping has them, to be relaxed and held against the truth.

use meetpoint_geometry::{Point2, Pose};
use meetpoint_sim::{Building, Drive, OdometryError, Robot, Tick};
use meetpoint_tracking::{
    Closure, ClosureKey, DrivenScan, LaserOutcome, LaserRelaxation, LaserRelaxationParams,
    LaserTravel, LiveMap, MappingParams, Observation, ObservationKind, PlacedTravel, Sensor,
    SensorKind, SessionConfig, SessionKey, TravelLaser, Verdict,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const KEY: SessionKey = SessionKey(0);
/// Odometry that was never calibrated, and a scan every fifth of a second.
pub(crate) const ROBOT: Robot =
    Robot { odometry_error: OdometryError::UNCALIBRATED, n_ticks_per_scan: 4, ..Robot::INDOOR };

/// A travel by live mapping, and where the robot truly was at each scan.
pub(crate) struct Driven {
    pub(crate) travel: LaserTravel,
    pub(crate) truths: Vec<Pose>,
}

pub(crate) fn driven(
    building: &Building,
    robot: Robot,
    waypoints: &[Point2<f64>],
    seed: u64,
) -> Driven {
    let rng = ChaCha8Rng::seed_from_u64(seed);
    let drive = Drive::new(building, robot, waypoints, 0, rng).expect("there is such a way");
    let laser = robot.laser;
    let geometry = laser.geometry();
    let robot_from_sensor = laser.robot_from_laser;
    let mut map = LiveMap::new(MappingParams::INDOOR, 0.05).expect("a length");
    let sensor = Sensor { robot_from_sensor, kind: SensorKind::Laser(geometry) };
    let config = SessionConfig { map_from_start: drive.truth(), sensors: vec![sensor] };
    map.open_session(KEY, config);
    let lasers = vec![TravelLaser { robot_from_sensor, geometry }];
    let mut driven =
        Driven { travel: LaserTravel { lasers, scans: Vec::new() }, truths: Vec::new() };
    for Tick { stamp_ns, truth, odometry, scan } in drive {
        map.apply(KEY, &Observation { stamp_ns, kind: ObservationKind::OdometryPose(odometry) });
        let Some(ranges_m) = scan else { continue };
        let kind = ObservationKind::LaserScan { sensor: 0, ranges_m: ranges_m.clone() };
        let estimate = map.apply(KEY, &Observation { stamp_ns, kind }).expect("a laser's scan");
        driven.truths.push(truth);
        driven.travel.scans.push(DrivenScan {
            stamp_ns,
            laser: 0,
            ranges_m: ranges_m.into(),
            odometry_from_robot: Some(odometry),
            map_from_robot: estimate.map_from_robot,
            is_lost: estimate.lost,
        });
    }
    driven
}

pub(crate) fn relaxed_together(
    params: &LaserRelaxationParams,
    placed: Vec<PlacedTravel>,
    refused: &[ClosureKey],
) -> LaserOutcome {
    let mut relaxation = LaserRelaxation::new(placed, *params, refused).expect("a resolution");
    let mut share = 0.0;
    while let Some(progress) = relaxation.advance() {
        assert!(share <= progress.share && progress.share <= 1.0, "{progress:?} after {share}");
        share = progress.share;
    }
    relaxation.into_outcome()
}

/// Those of a single travel.
pub(crate) fn poses(outcome: &LaserOutcome) -> &[Pose] {
    &outcome.travels[0].poses
}

/// The largest distance from the truth, in metres.
pub(crate) fn error_max_m(poses: &[Pose], truths: &[Pose]) -> f64 {
    let errors = poses.iter().zip(truths).map(|(pose, truth)| truth.step_to(*pose).distance_m());
    errors.fold(0.0, f64::max)
}

pub(crate) fn accepted(outcome: &LaserOutcome) -> impl Iterator<Item = &Closure> {
    outcome.closures.iter().filter(|closure| closure.verdict == Verdict::Accepted)
}
