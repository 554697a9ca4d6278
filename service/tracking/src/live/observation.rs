//! What a session says of itself, what it observes, and what is estimated of it.

use std::sync::Arc;

use meetpoint_geometry::Pose;
use meetpoint_occupancy::{LaserGeometry, SonarRing};

/// Which session; unique within a map, chosen by the caller. Sessions are stored in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SessionKey(
    /// Any number: the bits of a UUID, say.
    pub u128,
);

/// A sensor on a robot.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensor {
    /// Where it sits and looks.
    pub robot_from_sensor: Pose,
    /// What it is.
    pub kind: SensorKind,
}

/// What a sensor is, as far as tracking uses it.
#[derive(Clone, Debug, PartialEq)]
pub enum SensorKind {
    /// A planar laser range finder: matched and drawn.
    Laser(LaserGeometry),
    /// A ring of sonar transducers, seen from the robot: drawn where no laser has looked. On a robot without a
    /// laser it corrects the pose too.
    SonarRing(Arc<SonarRing>),
    /// A detector of landmarks: its sightings get a pose.
    LandmarkDetector,
}

/// What is known of a session when it opens.
#[derive(Clone, Debug, PartialEq)]
pub struct SessionConfig {
    /// Where the robot stands at its first observation, give or take some decimetres and degrees.
    pub map_from_start: Pose,
    /// Its sensors; observations name them by their place in this list.
    pub sensors: Vec<Sensor>,
}

/// One thing that a robot observed.
#[derive(Clone, Debug, PartialEq)]
pub struct Observation {
    /// When, in nanoseconds of the robot's clock. The order of arrival counts, not the stamp;
    /// stamps may run backwards a little.
    pub stamp_ns: i64,
    /// What.
    pub kind: ObservationKind,
}

/// What was observed.
#[derive(Clone, Debug, PartialEq)]
pub enum ObservationKind {
    /// Pose of the robot by its own reckoning, in a frame of its own that stays put.
    OdometryPose(Pose),
    /// Velocity of the robot in its own frame, in force until the next.
    OdometryVelocity {
        /// Metres a second along the robot's x axis.
        forward_m_per_s: f64,
        /// Metres a second along the robot's y axis.
        left_m_per_s: f64,
        /// Radians a second, counter-clockwise.
        turn_rad_per_s: f64,
    },
    /// One scan of a laser.
    LaserScan {
        /// Which sensor.
        sensor: usize,
        /// One range a beam in metres, as REP 117 reads them: +inf or beyond the maximum is
        /// "nothing hit"; NaN, -inf or below the minimum is invalid.
        ranges_m: Vec<f32>,
    },
    /// One firing of a sonar ring.
    SonarScan {
        /// Which sensor.
        sensor: usize,
        /// One range a transducer in metres, as a laser's.
        ranges_m: Vec<f32>,
    },
    /// One sighting of a landmark.
    LandmarkSighting {
        /// Which sensor.
        sensor: usize,
    },
    /// A person or program marked this moment.
    Mark,
}

/// Where a robot was when it observed something.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Stamp of the observation, in nanoseconds of the robot's clock.
    pub stamp_ns: i64,
    /// Sensor of the observation; `None` for a mark.
    pub sensor: Option<usize>,
    /// The robot's pose. Finite.
    pub map_from_robot: Pose,
    /// The correction of the odometry's frame; the robot's own pose if it has no odometry. Finite.
    pub map_from_odometry: Pose,
    /// True while scans do not agree with the map: the pose is then a guess.
    pub lost: bool,
    /// True if the scan was drawn into the grid.
    pub drawn: bool,
}
