//! Sessions' ways as their lasers saw them: what is relaxed.

use std::sync::Arc;

use meetpoint_geometry::Pose;
use meetpoint_occupancy::LaserGeometry;

use crate::scans::landmark_sighting::LandmarkSighting;

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

/// A travel on a map that others have driven on too, and how sure its place there is.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedTravel {
    /// The travel, with poses in the map's frame as known so far.
    pub travel: LaserTravel,
    /// Covariance of the pose at its first scan in the map's frame: x and y in metres, theta in radians,
    /// row by row. Numbers that are not finite count as [`PlacedTravel::KNOWN_START`].
    pub start_covariance: [[f64; 3]; 3],
    /// So many of its first scans have the poses that an earlier relaxation found. Asked by
    /// [`LaserRelaxation::going_on`](crate::LaserRelaxation::going_on) only.
    pub n_relaxed: usize,
    /// Named landmarks that were seen along it, in any order. What can say nothing, of scans that are not
    /// there or with numbers that are none, is left out.
    pub sightings: Vec<LandmarkSighting>,
}

impl PlacedTravel {
    /// Of a start that people or docks told: half a metre and 6 degrees, as ROS has it for an initial
    /// pose that a person points out (0.25 m2), with a heading that is better aimed.
    pub const KNOWN_START: [[f64; 3]; 3] = [[0.25, 0.0, 0.0], [0.0, 0.25, 0.0], [0.0, 0.0, 0.01]];

    /// A travel whose start was told, without landmarks.
    #[must_use]
    pub fn of_known_start(travel: LaserTravel) -> Self {
        let start_covariance = Self::KNOWN_START;
        Self { travel, start_covariance, n_relaxed: 0, sightings: Vec::new() }
    }
}
