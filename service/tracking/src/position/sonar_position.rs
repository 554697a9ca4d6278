//! The pose of a robot at a firing of its sonars.

use meetpoint_geometry::Pose;
use meetpoint_occupancy::{Grid, Interpretation};

use super::gradient_descent::descended;
use super::local_map::local_map;
use super::objective::Objective;
use super::patch::Patch;
use crate::params::PositionParams;

/// Where the descent from the pose by odometry ends, given what was heard and the directions of the walls
/// heard, seen from the robot, each less the building's direction, in radians.
pub(crate) fn sonar_position(
    predicted: Pose,
    grid: &Grid,
    (heard, walls_rad): (&Interpretation, &[f64]),
    params: &PositionParams,
) -> Pose {
    let local = local_map(heard);
    // A descent of all its steps leaves the patch by less than this.
    let spare_m = params.descent.step_m * f64::from(params.descent.n_iterations_max);
    let patch =
        Patch::around(grid, predicted.position(), heard.reach_m() + spare_m.min(SPARE_MAX_M));
    let objective = Objective { predicted, patch: &patch, local: &local, walls_rad, params };
    let pose = descended(predicted, &params.descent, |pose| objective.at(pose));
    if pose.is_finite() { pose } else { predicted }
}

/// More than that no firing shifts a robot, in metres.
const SPARE_MAX_M: f64 = 1.0;
