//! One session's way as its lasers saw it: what is relaxed.

use std::sync::Arc;

use meetpoint_geometry::Pose;
use meetpoint_occupancy::LaserGeometry;

/// A laser on the robot of a travel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TravelLaser {
    /// Where it sits and looks.
    pub robot_from_sensor: Pose,
    /// How it scans.
    pub geometry: LaserGeometry,
}

/// One scan, and what is known of the robot's pose at it.
#[derive(Clone, Debug, PartialEq)]
pub struct DrivenScan {
    /// When, in nanoseconds of the robot's clock.
    pub stamp_ns: i64,
    /// Which of the travel's lasers.
    pub laser: usize,
    /// One range a beam in metres, as REP 117 reads them.
    pub ranges_m: Arc<[f32]>,
    /// The robot's own reckoning at this moment, in a frame of its own; `None` without odometry, and
    /// where it is not chained to the scans before.
    pub odometry_from_robot: Option<Pose>,
    /// Where live mapping had the robot.
    pub map_from_robot: Pose,
    /// True if live mapping did not trust that pose.
    pub is_lost: bool,
}

/// The scans of one session, in the order of arrival.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LaserTravel {
    /// The robot's lasers; scans name them by their place in this list.
    pub lasers: Vec<TravelLaser>,
    /// The scans. One of a laser that is not listed counts as one that saw nothing.
    pub scans: Vec<DrivenScan>,
}
