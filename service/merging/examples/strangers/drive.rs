//! A part of a log, mapped live by itself.

use std::collections::BTreeMap;
use std::error::Error;

use meetpoint_geometry::Pose;
use meetpoint_occupancy::Grid;
use meetpoint_tracking::{
    LiveMap, MappingParams, Observation, ObservationKind, Sensor, SensorKind, SessionConfig,
    SessionKey, TravelLaser,
};

use crate::log::LoggedScan;

const KEY: SessionKey = SessionKey(0);

/// What live mapping made of a part.
pub(crate) struct Mapped {
    pub(crate) grid: Grid,
    /// By stamp.
    pub(crate) poses: BTreeMap<i64, Pose>,
    /// Way driven, in metres.
    pub(crate) way_m: f64,
}

/// Maps some scans from a start.
pub(crate) fn mapped(
    scans: &[LoggedScan],
    laser: TravelLaser,
    start: Pose,
) -> Result<Mapped, Box<dyn Error>> {
    let mut map = LiveMap::new(MappingParams::INDOOR, 0.05).map_err(|_| "no such resolution")?;
    let kind = SensorKind::Laser(laser.geometry);
    let sensor = Sensor { robot_from_sensor: laser.robot_from_sensor, kind };
    map.open_session(KEY, SessionConfig { map_from_start: start, sensors: vec![sensor] });
    let mut poses = BTreeMap::new();
    let (mut way_m, mut before) = (0.0, start);
    for scan in scans {
        let stamp_ns = scan.stamp_ns;
        if let Some(odometry) = scan.odometry {
            let kind = ObservationKind::OdometryPose(odometry);
            map.apply(KEY, &Observation { stamp_ns, kind });
        }
        let kind = ObservationKind::LaserScan { sensor: 0, ranges_m: scan.ranges_m.to_vec() };
        let estimate = map.apply(KEY, &Observation { stamp_ns, kind }).ok_or("no estimate")?;
        way_m += before.step_to(estimate.map_from_robot).distance_m();
        before = estimate.map_from_robot;
        poses.insert(stamp_ns, estimate.map_from_robot);
    }
    Ok(Mapped { grid: map.grid().clone(), poses, way_m })
}
