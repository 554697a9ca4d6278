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

use meetpoint_geometry::Pose;
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

/// Why a line is no pose.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: `t x y z qx qy qz qw` are wanted, finite numbers with blanks between")]
pub(crate) struct InvalidLine {
    /// From 1.
    line: usize,
}

/// The poses of such lines, in the plane; blank lines and those that begin with `#` are none.
///
/// # Errors
/// [`InvalidLine`], the first.
pub(crate) fn poses(text: &str) -> Result<Vec<Pose>, InvalidLine> {
    let is_pose = |line: &&str| !line.trim().is_empty() && !line.trim_start().starts_with('#');
    let lines = (1..).zip(text.lines()).filter(|(_, line)| is_pose(line));
    lines.map(|(number, line)| pose(line).ok_or(InvalidLine { line: number })).collect()
}

fn pose(line: &str) -> Option<Pose> {
    let words: Result<Vec<f64>, _> = line.split_whitespace().map(str::parse::<f64>).collect();
    let [_, x_m, y_m, _, qx, qy, qz, qw] = <[f64; 8]>::try_from(words.ok()?).ok()?;
    let theta_rad = (2.0 * (qw * qz + qx * qy)).atan2(1.0 - 2.0 * (qy * qy + qz * qz));
    Some(Pose::new(x_m, y_m, theta_rad)).filter(|pose| pose.is_finite())
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
    fn what_is_written_is_read() {
        let pose = Some(v1::Pose { x_m: 1.25, y_m: -0.5, theta_rad: -2.5 });
        let text = lines(&[v1::TrajectoryPose { pose, ..Default::default() }]);
        let read = poses(&format!("# a comment\n\n{text}")).expect("a pose");
        assert_eq!(read.len(), 1, "one line");
        assert!(
            (read[0].x_m - 1.25).abs() < 1e-12 && (read[0].y_m + 0.5).abs() < 1e-12,
            "{read:?}"
        );
        assert!((read[0].theta_rad + 2.5).abs() < 1e-9, "{read:?}");
        for wrong in ["1 2 3", "0 1 1 0 0 0 0 x", "0 nan 1 0 0 0 0 1"] {
            assert_eq!(poses(&format!("#\n{wrong}")), Err(InvalidLine { line: 2 }), "{wrong}");
        }
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
