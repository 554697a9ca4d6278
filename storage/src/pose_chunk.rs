//! A stretch of a trajectory, as bytes.
//!
//! ```text
//! u8   format, 1
//! 34 bytes each pose:
//!   i64 stamp_ns
//!   u8  flags: 1 lost, 2 drawn, 4 has a sensor
//!   u8  sensor, 0 if there is none
//!   f64 x_m, f64 y_m, f64 theta_rad
//! ```
//!
//! Little-endian; every bit of a float is kept.

use crate::Error;

const FORMAT: u8 = 1;
const POSE_BYTES: usize = 34;

const LOST: u8 = 1;
const DRAWN: u8 = 2;
const HAS_SENSOR: u8 = 4;

/// Where the robot was at one observation, in the session's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseRecord {
    /// The observation's stamp, the robot's clock in nanoseconds.
    pub stamp_ns: i64,
    /// Index of the sensor in the session's declaration; `None` for odometry.
    pub sensor: Option<u8>,
    /// Whether the tracker did not trust the pose.
    pub lost: bool,
    /// Whether the observation was drawn into the grid.
    pub drawn: bool,
    /// Metres.
    pub x_m: f64,
    /// Metres.
    pub y_m: f64,
    /// Radians, counter-clockwise.
    pub theta_rad: f64,
}

/// The bytes of poses.
pub(crate) fn encode(poses: &[PoseRecord]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(1 + poses.len() * POSE_BYTES);
    bytes.push(FORMAT);
    for pose in poses {
        let flags = u8::from(pose.lost) * LOST
            | u8::from(pose.drawn) * DRAWN
            | u8::from(pose.sensor.is_some()) * HAS_SENSOR;
        bytes.extend_from_slice(&pose.stamp_ns.to_le_bytes());
        bytes.extend_from_slice(&[flags, pose.sensor.unwrap_or(0)]);
        for value in [pose.x_m, pose.y_m, pose.theta_rad] {
            bytes.extend_from_slice(&value.to_le_bytes());
        }
    }
    bytes
}

/// The poses in bytes.
///
/// # Errors
/// [`Error::Damaged`] if the bytes are not poses.
pub(crate) fn decode(bytes: &[u8]) -> Result<Vec<PoseRecord>, Error> {
    parse(bytes).ok_or_else(|| Error::Damaged("a stretch of a trajectory is not readable".into()))
}

fn parse(bytes: &[u8]) -> Option<Vec<PoseRecord>> {
    let (poses, rest) = bytes.strip_prefix(&[FORMAT])?.as_chunks::<POSE_BYTES>();
    if !rest.is_empty() {
        return None;
    }
    poses.iter().map(|pose| parse_pose(pose)).collect()
}

fn parse_pose(bytes: &[u8]) -> Option<PoseRecord> {
    let (stamp_ns, bytes) = bytes.split_first_chunk()?;
    let ([flags, sensor], bytes) = bytes.split_first_chunk()?;
    let (values, _) = bytes.as_chunks::<8>();
    let &[x_m, y_m, theta_rad] = values else { return None };
    Some(PoseRecord {
        stamp_ns: i64::from_le_bytes(*stamp_ns),
        sensor: (flags & HAS_SENSOR != 0).then_some(*sensor),
        lost: flags & LOST != 0,
        drawn: flags & DRAWN != 0,
        x_m: f64::from_le_bytes(x_m),
        y_m: f64::from_le_bytes(y_m),
        theta_rad: f64::from_le_bytes(theta_rad),
    })
}
