//! Closures in buildings whose truth is known: `closures offices|loop [SEED...]`.
//!
//! `offices` are forty, all alike, along a corridor of 120 m; a robot visits ten of them in any order.
//! No closure that says otherwise than the truth may be accepted. `loop` is a corridor around a block of
//! 60 m by 20 m, driven twice: every submap of the second round must be joined to the first.

mod building;
mod truth;

use std::error::Error;
use std::time::Instant;

use meetpoint_geometry::Pose;
use meetpoint_sim::{Building, Drive, OdometryError, Robot, Tick, ring_corridor};
use meetpoint_tracking::{
    DrivenScan, LaserOutcome, LaserRelaxation, LaserRelaxationParams, LaserTravel, LiveMap,
    MappingParams, Observation, ObservationKind, PlacedTravel, Sensor, SensorKind, SessionConfig,
    SessionKey, TravelLaser,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const KEY: SessionKey = SessionKey(0);

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [kind, seeds @ ..] = arguments.as_slice() else {
        return Err("usage: closures offices|loop [SEED...]".into());
    };
    let seeds: Vec<u64> = seeds.iter().map(|seed| seed.parse()).collect::<Result<_, _>>()?;
    let mut all = truth::Found::default();
    for seed in if seeds.is_empty() { (1..=10).collect() } else { seeds } {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (building, waypoints) = match kind.as_str() {
            "offices" => {
                let (drawing, waypoints) = building::offices(&mut rng);
                (Building::from_drawing(&drawing, building::CHARACTER_M)?, waypoints)
            }
            "loop" => ring_corridor(&mut rng)?,
            other => return Err(format!("no building `{other}`").into()),
        };
        let mut error = OdometryError::UNCALIBRATED;
        if seed % 2 == 0 {
            (error.scale, error.drift_rad_per_m) = (0.98, -error.drift_rad_per_m);
        }
        let robot = Robot { odometry_error: error, ..Robot::INDOOR };
        let drive = Drive::new(&building, robot, &waypoints, 0, rng).ok_or("no such way")?;
        let length_m = drive.length_m();
        let (travel, truths) = tracked(&robot, drive)?;
        let began = Instant::now();
        let outcome = relaxed(travel.clone())?;
        let took_s = began.elapsed().as_secs_f64();
        println!(
            "{kind} seed {seed}: {length_m:.0} m, {} scans, relaxed in {took_s:.1} s",
            truths.len()
        );
        println!("  {:?}", outcome.travels[0].calibration);
        let found = truth::print(&travel, &truths, &outcome);
        all.n_false += found.n_false;
        all.back_m += found.back_m;
        all.closed_m += found.closed_m;
    }
    let truth::Found { n_false, back_m, closed_m } = all;
    println!("all: {n_false} false, {closed_m:.0} m of {back_m:.0} m closed");
    Ok(())
}

/// What live mapping says of a drive, and where the robot truly was at each scan.
fn tracked(robot: &Robot, drive: Drive<'_>) -> Result<(LaserTravel, Vec<Pose>), Box<dyn Error>> {
    let mut map = LiveMap::new(MappingParams::INDOOR, 0.05).map_err(|_| "no such resolution")?;
    let laser = &robot.laser;
    let geometry = laser.geometry();
    let robot_from_sensor = laser.robot_from_laser;
    let sensor = Sensor { robot_from_sensor, kind: SensorKind::Laser(geometry) };
    let config = SessionConfig { map_from_start: drive.truth(), sensors: vec![sensor] };
    map.open_session(KEY, config);
    let mut travel = LaserTravel {
        lasers: vec![TravelLaser { robot_from_sensor, geometry }],
        scans: Vec::new(),
    };
    let mut truths = Vec::new();
    for Tick { stamp_ns, truth, odometry, scan } in drive {
        map.apply(KEY, &Observation { stamp_ns, kind: ObservationKind::OdometryPose(odometry) });
        let Some(ranges_m) = scan else { continue };
        let kind = ObservationKind::LaserScan { sensor: 0, ranges_m: ranges_m.clone() };
        let estimate = map.apply(KEY, &Observation { stamp_ns, kind }).ok_or("no estimate")?;
        travel.scans.push(DrivenScan {
            stamp_ns,
            laser: 0,
            ranges_m: ranges_m.into(),
            odometry_from_robot: Some(odometry),
            map_from_robot: estimate.map_from_robot,
            is_lost: estimate.lost,
        });
        truths.push(truth);
    }
    Ok((travel, truths))
}

fn relaxed(travel: LaserTravel) -> Result<LaserOutcome, Box<dyn Error>> {
    let params = LaserRelaxationParams::INDOOR;
    let mut relaxation =
        LaserRelaxation::new(vec![PlacedTravel::of_known_start(travel)], params, &[])
            .map_err(|_| "no such resolution")?;
    while relaxation.advance().is_some() {}
    Ok(relaxation.into_outcome())
}
