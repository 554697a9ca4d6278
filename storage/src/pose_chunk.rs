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
        let flag = |is_set: bool, bit: u8| if is_set { bit } else { 0 };
        let flags = flag(pose.lost, LOST)
            | flag(pose.drawn, DRAWN)
            | flag(pose.sensor.is_some(), HAS_SENSOR);
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn pose() -> impl Strategy<Value = PoseRecord> {
        let finite = || any::<f64>().prop_filter("comparable", |value| !value.is_nan());
        let flags = (any::<bool>(), any::<bool>());
        (any::<i64>(), any::<Option<u8>>(), flags, finite(), finite(), finite()).prop_map(
            |(stamp_ns, sensor, (lost, drawn), x_m, y_m, theta_rad)| PoseRecord {
                stamp_ns,
                sensor,
                lost,
                drawn,
                x_m,
                y_m,
                theta_rad,
            },
        )
    }

    proptest! {
        #[test]
        fn what_is_written_is_read(poses in prop::collection::vec(pose(), 0..20)) {
            let bytes = encode(&poses);
            prop_assert_eq!(decode(&bytes).expect("it was just written"), poses);
            prop_assert!(decode(&bytes[..bytes.len() - 1]).is_err(), "a byte is missing");
        }
    }

    /// Format 1, byte by byte: what is stored must stay readable.
    #[test]
    fn format_1_is_read() {
        let mut bytes = vec![1];
        bytes.extend([0xff; 8]);
        bytes.extend([1 | 4, 3]);
        bytes.extend(1.5_f64.to_le_bytes());
        bytes.extend([0, 0, 0, 0, 0, 0, 0, 0x80]);
        bytes.extend(0.25_f64.to_le_bytes());
        let [pose] = decode(&bytes).expect("it is whole")[..] else { panic!("not one pose") };
        let flags = (pose.stamp_ns, pose.sensor, pose.lost, pose.drawn);
        assert_eq!(flags, (-1, Some(3), true, false), "stamp and flags");
        assert_eq!((pose.x_m, pose.theta_rad), (1.5, 0.25), "floats");
        assert!(pose.y_m.is_sign_negative(), "minus zero stays minus zero");
        assert_eq!(encode(&[pose]), bytes, "written as it is read");
        bytes[0] = 9;
        assert!(matches!(decode(&bytes), Err(Error::Damaged(_))), "an unknown format");
    }
}
