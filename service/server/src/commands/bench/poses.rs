//! Where a session's robot was, stamp by stamp.

use std::collections::BTreeMap;

use meetpoint_client::{Client, v1};
use meetpoint_geometry::Pose;

/// The poses of a session's robot by stamp, in nanoseconds, as the published version has them: in the map's
/// frame, or in the session's while it is not placed.
pub(super) async fn poses(client: &Client, session: &str) -> anyhow::Result<BTreeMap<i64, Pose>> {
    let trajectory = client.trajectory(session, 0, "robot").await?;
    let stamped = |pose: &v1::TrajectoryPose| {
        let v1::Pose { x_m, y_m, theta_rad } = pose.pose?;
        Some((pose.stamp_ns, Pose::new(x_m, y_m, theta_rad)))
    };
    Ok(trajectory.poses.iter().filter_map(stamped).collect())
}
