//! Trajectories as text, in the format of the TUM RGB-D benchmark.
//!
//! One pose a line, `t x y z qx qy qz qw`: seconds, metres, a unit quaternion. In the plane z, qx and
//! qy are 0, and a heading theta gives
//!
//! ```text
//! qz = sin(theta / 2),   qw = cos(theta / 2)
//! ```
//!
//! J. Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", IROS 2012.

use std::fmt::Write;

use meetpoint_proto::v1;

/// Bytes of a line, about.
const LINE_BYTES: usize = 100;

/// A line for each pose. Times are exact to the nanosecond.
pub(crate) fn lines(poses: &[v1::TrajectoryPose]) -> String {
    let mut text = String::with_capacity(poses.len() * LINE_BYTES);
    for stamped in poses {
        let v1::TrajectoryPose { stamp_ns, pose, .. } = stamped;
        let v1::Pose { x_m, y_m, theta_rad } = pose.unwrap_or_default();
        let (qz, qw) = (theta_rad / 2.0).sin_cos();
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{} {x_m} {y_m} 0 0 0 {qz} {qw}", seconds(*stamp_ns));
    }
    text
}

/// Nanoseconds as seconds with nine decimals, exactly.
fn seconds(stamp_ns: i64) -> String {
    let sign = if stamp_ns < 0 { "-" } else { "" };
    let magnitude_ns = stamp_ns.unsigned_abs();
    format!("{sign}{}.{:09}", magnitude_ns / 1_000_000_000, magnitude_ns % 1_000_000_000)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_to_the_nanosecond() {
        assert_eq!(seconds(1_763_840_000_000_000_001), "1763840000.000000001", "no rounding");
        assert_eq!(seconds(-1), "-0.000000001", "before the beginning");
        assert_eq!(seconds(i64::MIN), "-9223372036.854775808", "the smallest");
    }

    #[test]
    fn a_quarter_turn() {
        let theta_rad = std::f64::consts::FRAC_PI_2;
        let pose = Some(v1::Pose { x_m: 1.25, y_m: -0.5, theta_rad });
        let stamped = v1::TrajectoryPose { stamp_ns: 10_000_000, pose, ..Default::default() };
        assert_eq!(
            lines(&[stamped]),
            "0.010000000 1.25 -0.5 0 0 0 0.7071067811865475 0.7071067811865476\n",
            "eight numbers"
        );
    }
}
