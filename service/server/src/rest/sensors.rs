//! Sensors that a session declares, in JSON.

use meetpoint_proto::v1;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;
use v1::sensor::Kind;

use super::geometry::Pose;
use super::request::only_one;
use crate::error::Error;

/// A sensor that a session declares before it sends readings of it. One of `laser`, `sonar_ring`
/// and `landmark_detector` is required.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({
    "id": "front_laser",
    "robot_from_sensor": {"x_m": 0.2, "y_m": 0.0, "theta_rad": 0.0},
    "laser": {"angle_min_rad": -1.5, "angle_increment_rad": 0.0166,
              "n_beams": 181, "range_min_m": 0.1, "range_max_m": 30.0}
}))]
pub(crate) struct Sensor {
    /// Name of the sensor within the session: 1 to 63 of a-z, 0-9, `_`, `-`.
    #[schema(example = "front_laser")]
    id: String,
    /// Where the sensor sits on the robot. Absent: at the robot's origin, facing forward.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    robot_from_sensor: Option<Pose>,
    /// A planar laser range finder.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    laser: Option<LaserGeometry>,
    /// A ring of sonar transducers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    sonar_ring: Option<SonarRing>,
    /// Anything that sees landmarks.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    landmark_detector: Option<LandmarkDetector>,
}

impl From<v1::Sensor> for Sensor {
    fn from(wire: v1::Sensor) -> Self {
        let v1::Sensor { id, robot_from_sensor, kind } = wire;
        let robot_from_sensor = robot_from_sensor.map(Pose::from);
        let mut sensor =
            Self { id, robot_from_sensor, laser: None, sonar_ring: None, landmark_detector: None };
        match kind {
            Some(Kind::Laser(laser)) => sensor.laser = Some(laser.into()),
            Some(Kind::SonarRing(ring)) => sensor.sonar_ring = Some(ring.into()),
            Some(Kind::LandmarkDetector(detector)) => {
                sensor.landmark_detector = Some(detector.into());
            }
            None => {}
        }
        sensor
    }
}

impl Sensor {
    /// The message; `path` is where the sensor stands in the request.
    ///
    /// # Errors
    /// [`Error::InvalidField`] if it is of two kinds. One of none is refused by the operation.
    pub(super) fn into_wire(self, path: &str) -> Result<v1::Sensor, Error> {
        let Self { id, robot_from_sensor, laser, sonar_ring, landmark_detector } = self;
        let kind = only_one(
            path,
            [
                ("laser", laser.map(|laser| Kind::Laser(laser.into()))),
                ("sonar_ring", sonar_ring.map(|ring| Kind::SonarRing(ring.into()))),
                (
                    "landmark_detector",
                    landmark_detector.map(|detector| Kind::LandmarkDetector(detector.into())),
                ),
            ],
        )?;
        Ok(v1::Sensor { id, robot_from_sensor: robot_from_sensor.map(v1::Pose::from), kind })
    }
}

/// A planar laser range finder. Beam i points at `angle_min_rad + i * angle_increment_rad`,
/// counter-clockwise from the sensor's x axis.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct LaserGeometry {
    /// Direction of beam 0, in radians.
    #[schema(example = -1.5)]
    angle_min_rad: f64,
    /// From one beam to the next, in radians; negative for a laser that turns clockwise. Not 0.
    #[schema(example = 0.0166)]
    angle_increment_rad: f64,
    /// Beams a scan: 1 to 8192. A scan with another count is rejected.
    #[schema(minimum = 0, maximum = 4_294_967_295_u32, example = 181)]
    n_beams: u32,
    /// Shorter readings are invalid. Metres, 0 or more.
    #[schema(example = 0.1)]
    range_min_m: f64,
    /// Readings at or beyond it mean that nothing was hit. Metres, up to 1000.
    #[schema(example = 30.0)]
    range_max_m: f64,
}

impl From<v1::LaserGeometry> for LaserGeometry {
    fn from(wire: v1::LaserGeometry) -> Self {
        let v1::LaserGeometry {
            angle_min_rad,
            angle_increment_rad,
            n_beams,
            range_min_m,
            range_max_m,
        } = wire;
        Self { angle_min_rad, angle_increment_rad, n_beams, range_min_m, range_max_m }
    }
}

impl From<LaserGeometry> for v1::LaserGeometry {
    fn from(laser: LaserGeometry) -> Self {
        let LaserGeometry { angle_min_rad, angle_increment_rad, n_beams, range_min_m, range_max_m } =
            laser;
        Self { angle_min_rad, angle_increment_rad, n_beams, range_min_m, range_max_m }
    }
}

/// A ring of sonar transducers.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct SonarRing {
    /// Where each transducer sits and looks, seen from the sensor's frame: 1 to 256.
    sensor_from_transducer: Vec<Pose>,
    /// Full opening of the cone, in radians, in (0, pi].
    #[schema(example = 0.26)]
    cone_angle_rad: f64,
    /// Metres, 0 or more.
    #[schema(example = 0.2)]
    range_min_m: f64,
    /// Metres, up to 1000.
    #[schema(example = 5.0)]
    range_max_m: f64,
}

impl From<v1::SonarRing> for SonarRing {
    fn from(wire: v1::SonarRing) -> Self {
        let v1::SonarRing { sensor_from_transducer, cone_angle_rad, range_min_m, range_max_m } =
            wire;
        let sensor_from_transducer = sensor_from_transducer.into_iter().map(Pose::from).collect();
        Self { sensor_from_transducer, cone_angle_rad, range_min_m, range_max_m }
    }
}

impl From<SonarRing> for v1::SonarRing {
    fn from(ring: SonarRing) -> Self {
        let SonarRing { sensor_from_transducer, cone_angle_rad, range_min_m, range_max_m } = ring;
        let sensor_from_transducer =
            sensor_from_transducer.into_iter().map(v1::Pose::from).collect();
        Self { sensor_from_transducer, cone_angle_rad, range_min_m, range_max_m }
    }
}

/// Anything that sees landmarks: a camera and tags, a reflector finder, a person with a button.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct LandmarkDetector {
    /// How far it sees, in metres, up to 1000: no sighting within it is an observation too. 0 for a
    /// button that is pressed upon landmarks.
    #[schema(example = 4.0)]
    range_max_m: f64,
    /// Half of its field of view, in radians, in (0, pi].
    #[schema(example = 0.6)]
    half_field_of_view_rad: f64,
}

impl From<v1::LandmarkDetector> for LandmarkDetector {
    fn from(wire: v1::LandmarkDetector) -> Self {
        let v1::LandmarkDetector { range_max_m, half_field_of_view_rad } = wire;
        Self { range_max_m, half_field_of_view_rad }
    }
}

impl From<LandmarkDetector> for v1::LandmarkDetector {
    fn from(detector: LandmarkDetector) -> Self {
        let LandmarkDetector { range_max_m, half_field_of_view_rad } = detector;
        Self { range_max_m, half_field_of_view_rad }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sensor(json: &str) -> Result<v1::Sensor, String> {
        let sensor: Sensor = serde_json::from_str(json).map_err(|error| error.to_string())?;
        sensor.into_wire("sensors[0]").map_err(|error| error.to_string())
    }

    #[test]
    fn of_one_kind() {
        let tags = r#""landmark_detector": {"range_max_m": 4, "half_field_of_view_rad": 1}"#;
        let read = sensor(&format!(r#"{{"id": "tags", {tags}}}"#)).expect("a detector");
        let written = serde_json::to_value(Sensor::from(read)).expect("JSON");
        assert_eq!(
            written,
            serde_json::json!({
                "id": "tags",
                "landmark_detector": {"range_max_m": 4.0, "half_field_of_view_rad": 1.0}
            }),
            "what is absent is left out"
        );
        let two = format!(
            r#"{{"id": "a", {tags}, "sonar_ring": {{"sensor_from_transducer": [],
                "cone_angle_rad": 1, "range_min_m": 0, "range_max_m": 1}}}}"#
        );
        assert_eq!(
            sensor(&two).expect_err("two kinds"),
            "sensors[0]: `sonar_ring` and `landmark_detector`, one is taken",
            "both are named"
        );
    }
}
