//! What is to be told of a belief: where a robot most probably is, how surely, and where else.

use meetpoint_geometry::{Point2, Pose, angle_between, wrap_angle};
use nalgebra::Vector2;

use crate::belief::Belief;
use crate::pose_grid::{PoseCell, PoseGrid};

/// Poses within this distance of a peak belong to it, in metres...
const NEAR_M: f64 = 1.0;
/// ...if they are turned by no more than this, in radians: ten degrees.
const NEAR_RAD: f64 = 0.1746;
/// Peaks that are told, the best among them.
const N_PEAKS_MAX: usize = 6;

/// Where a robot may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    /// The mean of what is near the peak.
    pub pose: Pose,
    /// The probability to be within a metre and ten degrees of the peak, in [0, 1].
    pub probability: f64,
    /// The same within twice as much, in [0, 1]: on a grid of a metre and five degrees no pose is known
    /// better, and other peaks lie farther away.
    pub around: f64,
}

/// What is known of where a robot is.
#[derive(Clone, Debug, PartialEq)]
pub struct Whereabouts {
    /// The most probable first; none while it may be anywhere.
    pub peaks: Vec<Peak>,
    /// The probability to be elsewhere, at no pose that is held by itself, in [0, 1].
    pub elsewhere: f64,
    /// How much is unknown, in nats: the logarithm of the number of poses that it might as well be at.
    pub entropy: f64,
    /// `ln P(all that was seen so far | map)`: every sighting counts per square metre.
    pub log_evidence: f64,
}

/// The peaks of a belief, the most probable first.
pub(crate) fn peaks(grid: &PoseGrid, belief: &Belief) -> Vec<Peak> {
    let mut left: Vec<(PoseCell, f32)> = belief.entries().collect();
    let mut peaks = Vec::new();
    while peaks.len() < N_PEAKS_MAX {
        let highest = left.iter().copied().reduce(|a, b| if a.1 < b.1 { b } else { a });
        let Some((cell, _)) = highest else { break };
        let at = grid.pose_of(cell);
        let is_within = |cell: PoseCell, times: f64| {
            let pose = grid.pose_of(cell);
            let turn_rad = angle_between(at.theta_rad, pose.theta_rad);
            let off_m = (pose.position() - at.position()).norm();
            off_m <= times * NEAR_M && turn_rad.abs() <= times * NEAR_RAD
        };
        let (around, rest): (Vec<_>, Vec<_>) =
            left.into_iter().partition(|&(cell, _)| is_within(cell, 2.0));
        left = rest;
        let sum: f64 = around.iter().map(|&(_, weight)| f64::from(weight)).sum();
        let near: Vec<_> = around.into_iter().filter(|&(cell, _)| is_within(cell, 1.0)).collect();
        peaks.push(Peak { around: sum.min(1.0), ..mean(grid, at, &near) });
    }
    peaks.sort_by(|a: &Peak, b| b.around.total_cmp(&a.around));
    peaks
}

fn mean(grid: &PoseGrid, at: Pose, near: &[(PoseCell, f32)]) -> Peak {
    let (mut sum, mut turn_rad, mut off) = (0.0, 0.0, Vector2::zeros());
    for &(cell, weight) in near {
        let (pose, weight) = (grid.pose_of(cell), f64::from(weight));
        sum += weight;
        off += (pose.position() - at.position()) * weight;
        turn_rad += angle_between(at.theta_rad, pose.theta_rad) * weight;
    }
    let position: Point2<f64> = at.position() + off / sum;
    let heading_rad = wrap_angle(at.theta_rad + turn_rad / sum);
    let pose = Pose::new(position.x, position.y, heading_rad);
    Peak { pose, probability: sum.min(1.0), around: sum.min(1.0) }
}
