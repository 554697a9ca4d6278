//! How far poses are from the simulated truth.

use anyhow::Context;
use meetpoint_client::v1;
use meetpoint_geometry::Pose;

use super::drives::{Moment, SimulatedDrive};

/// Errors over all scans of a drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Accuracy {
    /// Mean distance, in metres.
    pub(super) mean_m: f64,
    /// Largest distance, in metres.
    pub(super) max_m: f64,
    /// Mean angle, in radians.
    pub(super) mean_rad: f64,
    /// Largest angle, in radians.
    pub(super) max_rad: f64,
}

/// The errors of odometry alone, and of the trajectory, over all scans of the drive.
///
/// # Errors
/// If the trajectory lacks a scan.
pub(super) fn compare(
    drive: &SimulatedDrive,
    trajectory: &v1::Trajectory,
) -> anyhow::Result<(Accuracy, Accuracy)> {
    let poses = trajectory.poses.iter();
    let estimates: std::collections::BTreeMap<i64, v1::Pose> =
        poses.filter_map(|pose| Some((pose.stamp_ns, pose.pose?))).collect();
    let (mut by_odometry, mut by_map) = (Vec::new(), Vec::new());
    for (stamp_ns, moment) in &drive.moments {
        let estimate = estimates
            .get(stamp_ns)
            .with_context(|| format!("{}: no pose for the scan at {stamp_ns}", drive.robot))?;
        let estimate = Pose::new(estimate.x_m, estimate.y_m, estimate.theta_rad);
        let Moment { map_from_robot, by_odometry: odometry } = moment;
        by_odometry.push(map_from_robot.step_to(*odometry));
        by_map.push(map_from_robot.step_to(estimate));
    }
    Ok((accuracy(&by_odometry), accuracy(&by_map)))
}

/// Mean and largest of the errors, each seen from the true pose; zeros for none.
fn accuracy(errors: &[Pose]) -> Accuracy {
    let mean =
        |of: fn(&Pose) -> f64| errors.iter().map(of).sum::<f64>() / errors.len().max(1) as f64;
    let max = |of: fn(&Pose) -> f64| errors.iter().map(of).fold(0.0, f64::max);
    let (distance_m, angle_rad) = (|e: &Pose| e.distance_m(), |e: &Pose| e.theta_rad.abs());
    Accuracy {
        mean_m: mean(distance_m),
        max_m: max(distance_m),
        mean_rad: mean(angle_rad),
        max_rad: max(angle_rad),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_and_worst() {
        let errors = [Pose::new(0.3, 0.4, -0.2), Pose::new(0.0, 0.1, 0.1)];
        let Accuracy { mean_m, max_m, mean_rad, max_rad } = accuracy(&errors);
        assert!((mean_m - 0.3).abs() < 1e-12 && max_m == 0.5, "{mean_m} m, {max_m} m");
        assert!((mean_rad - 0.15).abs() < 1e-12 && max_rad == 0.2, "{mean_rad}, {max_rad} rad");
    }
}
