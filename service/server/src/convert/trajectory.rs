//! Trajectories: from poses of the robot in the session's frame to what was asked for.

use meetpoint_geometry::Pose;
use meetpoint_proto::v1;
use meetpoint_storage::{PoseRecord, TrajectoryOrigin};

use super::{pose, sensor::DeclaredSensor};
use crate::error::Error;

/// The pose of `frame` (`robot`, empty for the same, or a sensor's id) on the robot.
pub(crate) fn robot_from_frame(frame: &str, sensors: &[DeclaredSensor]) -> Result<Pose, Error> {
    if frame.is_empty() || frame == "robot" {
        return Ok(Pose::IDENTITY);
    }
    sensors
        .iter()
        .find(|declared| declared.id == frame)
        .map(|declared| declared.sensor.robot_from_sensor)
        .ok_or_else(|| Error::NoSuchSensor(frame.to_owned()))
}

/// A stored pose for the wire.
pub(crate) fn pose_to_wire(
    record: &PoseRecord,
    reference_from_session: Pose,
    robot_from_frame: Pose,
    sensors: &[DeclaredSensor],
) -> v1::TrajectoryPose {
    let PoseRecord { stamp_ns, sensor, lost, drawn: _, x_m, y_m, theta_rad } = *record;
    let session_from_robot = pose::from_record([x_m, y_m, theta_rad]);
    let declared = sensor.and_then(|index| sensors.get(usize::from(index)));
    v1::TrajectoryPose {
        stamp_ns,
        sensor_id: declared.map_or_else(String::new, |declared| declared.id.clone()),
        pose: Some(pose::to_wire(reference_from_session * session_from_robot * robot_from_frame)),
        lost,
    }
}

/// Where a trajectory comes from.
pub(crate) fn origin_to_wire(origin: TrajectoryOrigin) -> v1::TrajectoryOrigin {
    match origin {
        TrajectoryOrigin::Odometry => v1::TrajectoryOrigin::Odometry,
        TrajectoryOrigin::Tracking => v1::TrajectoryOrigin::Tracking,
        TrajectoryOrigin::Relaxation => v1::TrajectoryOrigin::Relaxation,
    }
}
