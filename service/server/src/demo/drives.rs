//! What the robots of the demo do, simulated beforehand.

use std::collections::BTreeMap;
use std::sync::Arc;

use meetpoint_client::v1;
use meetpoint_geometry::Pose;
use meetpoint_sim::{ChaCha8Rng, Drive, Laser, Robot, Tick, office};
use rand::SeedableRng;

use crate::convert;

/// Name of the laser within a session.
const LASER: &str = "laser";
/// Ticks a batch: two seconds of driving, as a robot on a good link would send.
const N_TICKS_A_BATCH: usize = 40;
/// Places of the office that the newcomer goes by.
const NEWCOMERS_WAY: &str = "UATCG";
/// The clock of the robots when they start: 2026-01-01 00:00 UTC, in nanoseconds. Fixed, so that
/// the same seed gives the same bits.
pub(super) const START_NS: i64 = 1_767_225_600_000_000_000;

/// One robot's drive: what it sends, and the truth that only the simulator knows.
pub(crate) struct SimulatedDrive {
    /// The robot's id.
    pub(super) robot: String,
    /// Where it starts. The map's origin is where the first robot starts, its axes are the
    /// building's.
    pub(super) map_from_start: Pose,
    /// Whether it knows.
    is_start_known: bool,
    /// Metres that it truly drives.
    pub(crate) length_m: f64,
    /// Seconds that it takes.
    pub(crate) duration_s: f64,
    /// The laser, as the session declares it.
    pub(super) sensor: v1::Sensor,
    /// What it sends, numbered from 1.
    pub(crate) batches: Arc<[v1::Batch]>,
    /// What is true at each scan, by the scan's stamp.
    pub(super) moments: BTreeMap<i64, Moment>,
}

impl SimulatedDrive {
    /// The same of a robot that does not know where it starts.
    pub(crate) fn of_unknown_start(self) -> Self {
        Self { is_start_known: false, ..self }
    }

    /// Where the robot truly was at a scan, by its stamp in nanoseconds.
    pub(crate) fn truth(&self, stamp_ns: i64) -> Option<Pose> {
        self.moments.get(&stamp_ns).map(|moment| moment.map_from_robot)
    }

    /// Opens the session that the drive belongs to.
    pub(crate) fn open_request(&self, map: &str, client_key: &str) -> v1::OpenSessionRequest {
        let kind = if self.is_start_known {
            v1::start::Kind::Known(convert::pose::to_wire(self.map_from_start))
        } else {
            v1::start::Kind::Unknown(v1::UnknownStart {})
        };
        v1::OpenSessionRequest {
            map: map.to_owned(),
            robot: self.robot.clone(),
            client_key: client_key.to_owned(),
            epoch: 0,
            start: Some(v1::Start { kind: Some(kind) }),
            sensors: vec![self.sensor.clone()],
            delivery: v1::Delivery::Complete.into(),
        }
    }
}

/// Where the robot was at a scan.
pub(super) struct Moment {
    /// In truth.
    pub(super) map_from_robot: Pose,
    /// By odometry alone from its known start.
    pub(super) by_odometry: Pose,
}

/// Drives all tours of the office, one robot each.
pub(crate) fn simulate(seed: u64) -> Vec<SimulatedDrive> {
    let office = office();
    let robot = Robot::INDOOR;
    let drives: Vec<Drive> = (0..)
        .zip(&office.tours)
        .filter_map(|(stream, tour)| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(stream);
            Drive::new(&office.building, robot, tour, START_NS, rng)
        })
        .collect();
    let origin = drives.first().map_or(Pose::IDENTITY, Drive::truth);
    let map_from_building = Pose::new(origin.x_m, origin.y_m, 0.0).inverse();
    let named = (1..).zip(drives);
    named.map(|(number, drive)| simulated(number, &robot, drive, map_from_building)).collect()
}

/// Drives one more robot, which does not know where it starts: in a room that the others have not seen, into
/// the corridor and another such room, and back to where they have been.
pub(super) fn simulate_newcomer(seed: u64) -> Option<SimulatedDrive> {
    let (office, robot) = (office(), Robot::INDOOR);
    let number = u32::try_from(office.tours.len()).ok()? + 1;
    let rng = || {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(u64::from(number));
        rng
    };
    let first = Drive::new(&office.building, robot, office.tours.first()?, START_NS, rng())?;
    let origin = first.truth();
    let map_from_building = Pose::new(origin.x_m, origin.y_m, 0.0).inverse();
    let places = office.building.places(NEWCOMERS_WAY)?;
    let drive = Drive::new(&office.building, robot, &places, START_NS, rng())?;
    let drive = simulated(number, &robot, drive, map_from_building);
    Some(drive.of_unknown_start())
}

/// What a robot of that number does on a drive; it knows where it starts.
pub(crate) fn simulated(
    number: u32,
    robot: &Robot,
    drive: Drive,
    map_from_building: Pose,
) -> SimulatedDrive {
    let length_m = drive.length_m();
    let map_from_start = map_from_building * drive.truth();
    let ticks: Vec<Tick> = drive.collect();
    let moment = |tick: &Tick| Moment {
        map_from_robot: map_from_building * tick.truth,
        by_odometry: map_from_start * tick.odometry,
    };
    let scans = ticks.iter().filter(|tick| tick.scan.is_some());
    SimulatedDrive {
        robot: format!("robot-{number}"),
        map_from_start,
        is_start_known: true,
        length_m,
        duration_s: ticks.len() as f64 * robot.tick_ns as f64 * 1e-9,
        sensor: sensor(&robot.laser),
        moments: scans.map(|tick| (tick.stamp_ns, moment(tick))).collect(),
        batches: (1..).zip(ticks.chunks(N_TICKS_A_BATCH)).map(batch).collect(),
    }
}

fn batch((number, ticks): (u64, &[Tick])) -> v1::Batch {
    v1::Batch { number, observations: ticks.iter().flat_map(observations).collect() }
}

/// The odometry of a tick, and its scan if it has one.
pub(super) fn observations(tick: &Tick) -> impl Iterator<Item = v1::Observation> {
    let Tick { stamp_ns, truth: _, odometry, scan } = tick;
    let at = |sensor_id: &str, kind| v1::Observation {
        stamp_ns: *stamp_ns,
        monotonic_ns: None,
        sensor_id: sensor_id.to_owned(),
        kind: Some(kind),
    };
    let odometry_from_robot = Some(convert::pose::to_wire(*odometry));
    let pose = v1::OdometryPose { odometry_from_robot };
    let scan = scan
        .as_ref()
        .map(|ranges_m| v1::LaserScan { ranges_m: ranges_m.clone(), intensities: Vec::new() });
    std::iter::once(at("", v1::observation::Kind::OdometryPose(pose)))
        .chain(scan.map(|scan| at(LASER, v1::observation::Kind::LaserScan(scan))))
}

pub(super) fn sensor(laser: &Laser) -> v1::Sensor {
    let Laser {
        robot_from_laser,
        angle_min_rad,
        angle_increment_rad,
        n_beams,
        range_min_m,
        range_max_m,
        noise: _,
    } = *laser;
    let geometry =
        v1::LaserGeometry { angle_min_rad, angle_increment_rad, n_beams, range_min_m, range_max_m };
    v1::Sensor {
        id: LASER.to_owned(),
        robot_from_sensor: Some(convert::pose::to_wire(robot_from_laser)),
        kind: Some(v1::sensor::Kind::Laser(geometry)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn same_seed_same_batches() {
        let (drives, again, others) = (simulate(3), simulate(3), simulate(4));
        assert_eq!(drives.len(), 2, "a robot a tour");
        for (drive, other) in drives.iter().zip(&others) {
            assert_ne!(drive.batches, other.batches, "another seed, other errors");
        }
        for (drive, same) in drives.iter().zip(&again) {
            assert_eq!(drive.batches, same.batches, "nothing random but the seed");
            let numbers = drive.batches.iter().map(|batch| batch.number);
            assert!(numbers.eq(1..=drive.batches.len() as u64), "numbered without gaps");
            let observations = drive.batches.iter().flat_map(|batch| &batch.observations);
            let scans = observations.filter(|observation| observation.sensor_id == LASER);
            let stamps = scans.map(|scan| scan.stamp_ns);
            assert!(stamps.eq(drive.moments.keys().copied()), "a truth for each scan");
        }
    }
}
