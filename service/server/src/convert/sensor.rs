//! Declared sensors.

use std::sync::Arc;

use meetpoint_geometry::Pose;
use meetpoint_occupancy::{LaserGeometry, SonarRing};
use meetpoint_proto::v1;
use meetpoint_tracking as tracking;

use super::pose;
use crate::error::Error;

/// Sensors a session.
const N_SENSORS_MAX: usize = 16;
/// Beams a scan.
const N_BEAMS_MAX: u32 = 8192;
/// Transducers of a ring.
const N_TRANSDUCERS_MAX: usize = 256;
/// Metres; nothing indoors sees farther.
const RANGE_MAX_M: f64 = 1000.0;

/// A sensor that a session declared.
#[derive(Clone, Debug)]
pub(crate) struct DeclaredSensor {
    /// Its name within the session.
    pub(crate) id: String,
    /// What the tracker knows of it.
    pub(crate) sensor: tracking::Sensor,
    /// Readings that belong to one observation: beams or transducers; 0 for landmark detectors.
    pub(crate) n_readings: usize,
    /// Readings beyond it mean that nothing was hit, in metres.
    pub(crate) range_max_m: f64,
    /// Shorter readings are invalid, in metres.
    pub(crate) range_min_m: f64,
}

/// The sensors of a session, checked.
pub(crate) fn sensors(wire: &[v1::Sensor]) -> Result<Vec<DeclaredSensor>, Error> {
    if wire.len() > N_SENSORS_MAX {
        return Err(Error::field(
            "sensors",
            format!("{} sensors, at most {N_SENSORS_MAX} are taken", wire.len()),
        ));
    }
    let mut declared: Vec<DeclaredSensor> = Vec::with_capacity(wire.len());
    for (index, sensor) in wire.iter().enumerate() {
        let field = format!("sensors[{index}]");
        let sensor = declared_sensor(&field, sensor.clone())?;
        if declared.iter().any(|other| other.id == sensor.id) {
            return Err(Error::field(
                format!("{field}.id"),
                format!("`{}` is declared twice", sensor.id),
            ));
        }
        declared.push(sensor);
    }
    Ok(declared)
}

fn declared_sensor(field: &str, wire: v1::Sensor) -> Result<DeclaredSensor, Error> {
    let v1::Sensor { id, robot_from_sensor, kind } = wire;
    let id = super::slug::slug(&format!("{field}.id"), &id)?;
    let robot_from_sensor = match robot_from_sensor {
        Some(wire) => pose::pose(&format!("{field}.robot_from_sensor"), wire)?,
        None => Pose::IDENTITY,
    };
    let declared = |kind, n_readings, range_min_m, range_max_m| DeclaredSensor {
        id,
        sensor: tracking::Sensor { robot_from_sensor, kind },
        n_readings,
        range_max_m,
        range_min_m,
    };
    match kind {
        None => Err(Error::field(format!("{field}.kind"), "missing")),
        Some(v1::sensor::Kind::Laser(wire)) => {
            let laser = laser_geometry(&format!("{field}.laser"), wire)?;
            let n_beams = laser.n_beams as usize;
            let (range_min_m, range_max_m) = (laser.range_min_m, laser.range_max_m);
            Ok(declared(tracking::SensorKind::Laser(laser), n_beams, range_min_m, range_max_m))
        }
        Some(v1::sensor::Kind::SonarRing(wire)) => {
            let ring = sonar_ring(&format!("{field}.sonar_ring"), robot_from_sensor, wire)?;
            let n_transducers = ring.robot_from_transducer.len();
            let (range_min_m, range_max_m) = (ring.range_min_m, ring.range_max_m);
            let kind = tracking::SensorKind::SonarRing(Arc::new(ring));
            Ok(declared(kind, n_transducers, range_min_m, range_max_m))
        }
        Some(v1::sensor::Kind::LandmarkDetector(wire)) => {
            let v1::LandmarkDetector { range_max_m, half_field_of_view_rad } = wire;
            let field = format!("{field}.landmark_detector");
            angle(&format!("{field}.half_field_of_view_rad"), half_field_of_view_rad)?;
            reach(&field, range_max_m)?;
            Ok(declared(tracking::SensorKind::LandmarkDetector, 0, 0.0, range_max_m))
        }
    }
}

fn laser_geometry(field: &str, wire: v1::LaserGeometry) -> Result<LaserGeometry, Error> {
    let v1::LaserGeometry { angle_min_rad, angle_increment_rad, n_beams, range_min_m, range_max_m } =
        wire;
    within(&format!("{field}.n_beams"), n_beams as usize, N_BEAMS_MAX as usize)?;
    if !angle_min_rad.is_finite() || angle_min_rad.abs() > std::f64::consts::TAU {
        return Err(Error::field(
            format!("{field}.angle_min_rad"),
            format!("{angle_min_rad} rad, must lie within one turn"),
        ));
    }
    let sweep_rad = angle_increment_rad * f64::from(n_beams.saturating_sub(1));
    let one_turn = std::f64::consts::TAU * 1.01;
    if !angle_increment_rad.is_finite() || angle_increment_rad == 0.0 || sweep_rad.abs() > one_turn
    {
        return Err(Error::field(
            format!("{field}.angle_increment_rad"),
            format!("{angle_increment_rad} rad for {n_beams} beams: not 0, at most one turn"),
        ));
    }
    ranges(field, range_min_m, range_max_m)?;
    Ok(LaserGeometry { angle_min_rad, angle_increment_rad, n_beams, range_min_m, range_max_m })
}

fn sonar_ring(
    field: &str,
    robot_from_sensor: Pose,
    wire: v1::SonarRing,
) -> Result<SonarRing, Error> {
    let v1::SonarRing { sensor_from_transducer, cone_angle_rad, range_min_m, range_max_m } = wire;
    let n_transducers = sensor_from_transducer.len();
    within(&format!("{field}.sensor_from_transducer"), n_transducers, N_TRANSDUCERS_MAX)?;
    let transducers = sensor_from_transducer.into_iter().enumerate().map(|(index, wire)| {
        let place = pose::pose(&format!("{field}.sensor_from_transducer[{index}]"), wire)?;
        Ok(robot_from_sensor * place)
    });
    let robot_from_transducer = transducers.collect::<Result<Vec<Pose>, Error>>()?;
    angle(&format!("{field}.cone_angle_rad"), cone_angle_rad)?;
    ranges(field, range_min_m, range_max_m)?;
    Ok(SonarRing { robot_from_transducer, cone_rad: cone_angle_rad, range_min_m, range_max_m })
}

fn within(field: &str, n: usize, n_max: usize) -> Result<(), Error> {
    if (1..=n_max).contains(&n) {
        Ok(())
    } else {
        Err(Error::field(field, format!("{n}, must be 1 to {n_max}")))
    }
}

fn angle(field: &str, angle_rad: f64) -> Result<(), Error> {
    if 0.0 < angle_rad && angle_rad <= std::f64::consts::PI {
        Ok(())
    } else {
        Err(Error::field(field, format!("{angle_rad} rad, must lie in (0, pi]")))
    }
}

/// What a detector sees to: a button is pressed upon its landmark.
fn reach(field: &str, range_max_m: f64) -> Result<(), Error> {
    if (0.0..=RANGE_MAX_M).contains(&range_max_m) {
        return Ok(());
    }
    let problem = format!("{range_max_m} m, must be 0 to {RANGE_MAX_M} m");
    Err(Error::field(format!("{field}.range_max_m"), problem))
}

fn ranges(field: &str, range_min_m: f64, range_max_m: f64) -> Result<(), Error> {
    if 0.0 <= range_min_m && range_min_m < range_max_m && range_max_m <= RANGE_MAX_M {
        Ok(())
    } else {
        Err(Error::field(
            format!("{field}.range_max_m"),
            format!("{range_min_m} to {range_max_m} m, must be 0 <= min < max <= {RANGE_MAX_M}"),
        ))
    }
}
