//! A corridor around a block of 60 by 20 m, driven twice with a laser and wheels that nobody calibrated (T98,
//! Fig. 10): closed if no pose of either round is farther than [`CLOSED_M`] from the truth.

use anyhow::Context;
use meetpoint_geometry::Pose;
use meetpoint_sim::{ChaCha8Rng, Drive, Robot, Tick, ring_corridor};
use meetpoint_tracking::{
    DrivenScan, LaserRelaxation, LaserRelaxationParams, LaserTravel, LiveMap, MappingParams,
    Observation, ObservationKind, PlacedTravel, Sensor, SensorKind, SessionConfig, SessionKey,
    TravelLaser,
};
use rand::SeedableRng;

const KEY: SessionKey = SessionKey(0);
/// Edge of a cell, in metres.
const RESOLUTION_M: f64 = 0.05;
/// A map is usable where walls of both rounds lie on one another, to about a wall's thickness, in metres.
const CLOSED_M: f64 = 0.3;

/// A drive as the service hears of it, and the truth at each of its scans.
struct Driven {
    travel: LaserTravel,
    truths: Vec<Pose>,
    length_m: f64,
    odometry: Vec<Pose>,
}

/// Prints a table with a row for every seed.
pub(super) fn print(n_loops: u64) -> anyhow::Result<()> {
    println!("| seed | way, m | odometry, farthest off | live | relaxed | closed |");
    println!("|---|---|---|---|---|---|");
    let mut n_closed = 0;
    for seed in 1..=n_loops {
        let Driven { travel, truths, length_m, odometry } = driven(seed)?;
        let live: Vec<Pose> = travel.scans.iter().map(|scan| scan.map_from_robot).collect();
        let relaxed = relaxed(travel)?;
        let [by_odometry, by_live, by_relaxed] =
            [&odometry, &live, &relaxed].map(|poses| farthest_m(poses, &truths));
        let is_closed = by_relaxed <= CLOSED_M;
        n_closed += u64::from(is_closed);
        let closed = if is_closed { "yes" } else { "no" };
        println!(
            "| {seed} | {length_m:.0} | {by_odometry:.2} m | {by_live:.3} m | {by_relaxed:.3} m | {closed} |"
        );
    }
    println!("\n{n_closed} of {n_loops} loops are closed");
    Ok(())
}

fn driven(seed: u64) -> anyhow::Result<Driven> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (building, waypoints) = ring_corridor(&mut rng)?;
    let robot = Robot::INDOOR;
    let drive = Drive::new(&building, robot, &waypoints, 0, rng).context("no way around")?;
    let length_m = drive.length_m();
    let laser = robot.laser;
    let geometry = laser.geometry();
    let robot_from_sensor = laser.robot_from_laser;
    let sensor = Sensor { robot_from_sensor, kind: SensorKind::Laser(geometry) };
    let config = SessionConfig { map_from_start: drive.truth(), sensors: vec![sensor] };
    let mut map = LiveMap::new(MappingParams::INDOOR, RESOLUTION_M)
        .map_err(|_| anyhow::anyhow!("no length"))?;
    map.open_session(KEY, config);
    let lasers = vec![TravelLaser { robot_from_sensor, geometry }];
    let travel = LaserTravel { lasers, scans: Vec::new() };
    let mut driven = Driven { travel, truths: Vec::new(), length_m, odometry: Vec::new() };
    for Tick { stamp_ns, truth, odometry, scan } in drive {
        map.apply(KEY, &Observation { stamp_ns, kind: ObservationKind::OdometryPose(odometry) });
        let Some(ranges_m) = scan else { continue };
        let kind = ObservationKind::LaserScan { sensor: 0, ranges_m: ranges_m.clone() };
        let estimate = map.apply(KEY, &Observation { stamp_ns, kind }).context("no estimate")?;
        driven.travel.scans.push(DrivenScan {
            stamp_ns,
            laser: 0,
            ranges_m: ranges_m.into(),
            odometry_from_robot: Some(odometry),
            map_from_robot: estimate.map_from_robot,
            is_lost: estimate.lost,
        });
        driven.truths.push(truth);
        driven.odometry.push(odometry);
    }
    Ok(driven)
}

fn relaxed(travel: LaserTravel) -> anyhow::Result<Vec<Pose>> {
    let travels = vec![PlacedTravel::of_known_start(travel)];
    let mut relaxation = LaserRelaxation::new(travels, LaserRelaxationParams::INDOOR, &[])
        .map_err(|_| anyhow::anyhow!("no length"))?;
    while relaxation.advance().is_some() {}
    let mut travels = relaxation.into_outcome().travels;
    Ok(travels.pop().context("one travel")?.poses)
}

/// Largest distance between poses and truth, in metres, both begun at the same pose.
fn farthest_m(poses: &[Pose], truths: &[Pose]) -> f64 {
    let Some((first, truth)) = poses.first().zip(truths.first()) else { return 0.0 };
    let truth_from_poses = *truth * first.inverse();
    let pairs = poses.iter().zip(truths);
    let off_m = pairs.map(|(&pose, truth)| truth.step_to(truth_from_poses * pose).distance_m());
    off_m.fold(0.0, f64::max)
}
