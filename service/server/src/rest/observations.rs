//! What a robot noticed, in JSON.

use meetpoint_proto::v1;
use serde::de::{self, Deserialize, Deserializer, Visitor};
use utoipa::openapi::schema::{OneOfBuilder, Type};
use utoipa::openapi::{ObjectBuilder, RefOr, Schema};
use utoipa::{PartialSchema, ToSchema};
use v1::observation::Kind;

use super::geometry::Pose;
use super::integer::Signed64;
use super::request::only_one;
use crate::error::Error;

/// Anything a robot noticed at one time. One of `odometry_pose`, `odometry_velocity`, `laser_scan`,
/// `sonar_scan`, `landmark_sighting`, `mark` and `place_visit` is wanted; an observation without is
/// rejected.
#[derive(Debug, serde::Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({
    "stamp_ns": "1763840000010000000",
    "sensor_id": "front_laser",
    "laser_scan": {"ranges_m": [2.5, 2.51, null, "inf"]}
}))]
pub(crate) struct Observation {
    /// The robot's wall clock, nanoseconds since 1970 (or since any fixed moment). A stamp is unique
    /// within a sensor of a session: it identifies a scan.
    stamp_ns: Signed64,
    /// The robot's monotonic clock in nanoseconds, where it has one.
    #[serde(default)]
    monotonic_ns: Option<Signed64>,
    /// The declared sensor that it comes from. Absent or empty for odometry, marks and
    /// visits.
    #[serde(default)]
    #[schema(example = "front_laser")]
    sensor_id: String,
    #[serde(default)]
    odometry_pose: Option<OdometryPose>,
    #[serde(default)]
    odometry_velocity: Option<OdometryVelocity>,
    #[serde(default)]
    laser_scan: Option<LaserScan>,
    #[serde(default)]
    sonar_scan: Option<SonarScan>,
    #[serde(default)]
    landmark_sighting: Option<LandmarkSighting>,
    #[serde(default)]
    mark: Option<Mark>,
    #[serde(default)]
    place_visit: Option<PlaceVisit>,
}

impl Observation {
    /// The message; `path` is where the observation stands in the request.
    ///
    /// # Errors
    /// [`Error::InvalidField`] if it is of two kinds.
    pub(super) fn into_wire(self, path: &str) -> Result<v1::Observation, Error> {
        let Self {
            stamp_ns,
            monotonic_ns,
            sensor_id,
            odometry_pose,
            odometry_velocity,
            laser_scan,
            sonar_scan,
            landmark_sighting,
            mark,
            place_visit,
        } = self;
        let kind = only_one(
            path,
            [
                ("odometry_pose", odometry_pose.map(Kind::from)),
                ("odometry_velocity", odometry_velocity.map(Kind::from)),
                ("laser_scan", laser_scan.map(Kind::from)),
                ("sonar_scan", sonar_scan.map(Kind::from)),
                ("landmark_sighting", landmark_sighting.map(Kind::from)),
                ("mark", mark.map(Kind::from)),
                ("place_visit", place_visit.map(Kind::from)),
            ],
        )?;
        let monotonic_ns = monotonic_ns.map(|Signed64(ns)| ns);
        Ok(v1::Observation { stamp_ns: stamp_ns.0, monotonic_ns, sensor_id, kind })
    }
}

/// Dead reckoning as a pose in the robot's odometry frame, whose origin does not matter.
#[derive(Debug, serde::Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct OdometryPose {
    odometry_from_robot: Pose,
}

impl From<OdometryPose> for Kind {
    fn from(odometry: OdometryPose) -> Self {
        let OdometryPose { odometry_from_robot } = odometry;
        Self::OdometryPose(v1::OdometryPose {
            odometry_from_robot: Some(odometry_from_robot.into()),
        })
    }
}

/// Dead reckoning as velocities in the robot's frame, in force from this stamp until the next one.
#[derive(Debug, serde::Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct OdometryVelocity {
    /// Metres a second, forward; at most 50 either way.
    forward_m_per_s: f64,
    /// Metres a second, to the left; absent for robots that cannot.
    #[serde(default)]
    left_m_per_s: f64,
    /// Radians a second, counter-clockwise; at most 50 either way.
    turn_rad_per_s: f64,
}

impl From<OdometryVelocity> for Kind {
    fn from(odometry: OdometryVelocity) -> Self {
        let OdometryVelocity { forward_m_per_s, left_m_per_s, turn_rad_per_s } = odometry;
        Self::OdometryVelocity(v1::OdometryVelocity {
            forward_m_per_s,
            left_m_per_s,
            turn_rad_per_s,
        })
    }
}

/// One sweep of a declared laser. The stamp is the time of beam 0.
#[derive(Debug, serde::Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct LaserScan {
    /// One a beam.
    ranges_m: Vec<Reading>,
    /// Strength of the echo, in the sensor's own unit: one a beam, or absent. Kept, not used yet.
    #[serde(default)]
    intensities: Vec<f32>,
}

impl From<LaserScan> for Kind {
    fn from(scan: LaserScan) -> Self {
        let LaserScan { ranges_m, intensities } = scan;
        let ranges_m = ranges_m.into_iter().map(|Reading(range_m)| range_m).collect();
        Self::LaserScan(v1::LaserScan { ranges_m, intensities })
    }
}

/// One firing of a declared sonar ring.
#[derive(Debug, serde::Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct SonarScan {
    /// One a transducer.
    ranges_m: Vec<Reading>,
}

impl From<SonarScan> for Kind {
    fn from(scan: SonarScan) -> Self {
        let SonarScan { ranges_m } = scan;
        let ranges_m = ranges_m.into_iter().map(|Reading(range_m)| range_m).collect();
        Self::SonarScan(v1::SonarScan { ranges_m })
    }
}

/// A landmark seen by a declared detector.
#[derive(Debug, serde::Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct LandmarkSighting {
    /// What the landmark is called, where the detector can tell (a tag's number, say).
    #[serde(default)]
    identity: Option<String>,
    /// What kind of landmark it looks like; absent where all look alike.
    #[serde(default)]
    landmark_type: String,
    /// Direction seen from the sensor, radians counter-clockwise. Not needed to relax a session where
    /// the landmark is within half a metre.
    #[serde(default)]
    bearing_rad: Option<f64>,
    /// Distance in metres. Not needed to relax a session where the sensor sees no farther than half
    /// a metre.
    #[serde(default)]
    range_m: Option<f64>,
}

impl From<LandmarkSighting> for Kind {
    fn from(sighting: LandmarkSighting) -> Self {
        let LandmarkSighting { identity, landmark_type, bearing_rad, range_m } = sighting;
        Self::LandmarkSighting(v1::LandmarkSighting {
            identity,
            landmark_type,
            bearing_rad,
            range_m,
        })
    }
}

/// A moment that a person or program wants kept.
#[derive(Debug, serde::Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Mark {
    /// 1 to 200 characters.
    #[schema(example = "lift door")]
    label: String,
}

impl From<Mark> for Kind {
    fn from(mark: Mark) -> Self {
        let Mark { label } = mark;
        Self::Mark(v1::Mark { label })
    }
}

/// The robot has come to a place. The maps of places that fit a session's visits are told under
/// `/v1/maps/{map}/hypotheses`; they need no odometry, no sensors and no place in the map.
#[derive(Debug, serde::Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct PlaceVisit {
    /// Counts the visits of a session: 0 where its travel begins, then 1, 2, 3... One whose number is
    /// not the next is left out, so that a visit can be sent again that was rejected or left out.
    number: u32,
    /// The gateway through which the robot left the place before, counted clockwise from the one where
    /// it had come in: 0 is back. At the place of visit 0, from the one that its star is read from.
    #[serde(default)]
    turn: u32,
    /// The gateways of the place in clockwise order, from the one where the robot came in: a letter
    /// each, the same for the two through which one path passes; then `<` or `>` where one leaves along
    /// the wall on the left or right and not in the middle, `^` where one goes straight on with no wall
    /// near. 1 to 32 gateways.
    #[schema(example = "aba")]
    star: String,
    /// What else is known of the looks of the place, as a name: places with other names are others,
    /// those with the same may be one. Absent where nobody compared it. Up to 64 characters.
    #[serde(default)]
    #[schema(example = "hall")]
    view: String,
    /// Whether no two places have this view: a place that is marked, "home".
    #[serde(default)]
    view_is_unique: bool,
    /// Length of the way from the place before, in metres; at most 10000.
    #[serde(default)]
    length_m: Option<f64>,
    /// By how much the robot's heading changed on that way, radians counter-clockwise; at most 100.
    #[serde(default)]
    turned_rad: Option<f64>,
    /// Where odometry has the robot at this visit, seen from its pose at the visit before: x forward, y
    /// left. Absent where there is no odometry, and in visit 0. What makes a tree `metrical`.
    #[serde(default)]
    moved: Option<Pose>,
}

impl From<PlaceVisit> for Kind {
    fn from(visit: PlaceVisit) -> Self {
        let PlaceVisit { number, turn, star, view, view_is_unique, length_m, turned_rad, moved } =
            visit;
        Self::PlaceVisit(v1::PlaceVisit {
            number,
            turn,
            star,
            view,
            view_is_unique,
            length_m,
            turned_rad,
            moved: moved.map(v1::Pose::from),
        })
    }
}

/// A range in metres: a number, null for an erroneous reading (NaN), `"inf"` where nothing lies
/// within range, `"-inf"` for too close (REP 117).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reading(f32);

impl<'de> Deserialize<'de> for Reading {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ReadingVisitor)
    }
}

struct ReadingVisitor;

#[expect(
    clippy::cast_possible_truncation,
    reason = "ranges are 32-bit on the wire; what does not fit becomes infinite: nothing within range"
)]
impl Visitor<'_> for ReadingVisitor {
    type Value = Reading;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a number of metres, null, \"inf\" or \"-inf\"")
    }

    fn visit_f64<E>(self, range_m: f64) -> Result<Reading, E> {
        Ok(Reading(range_m as f32))
    }

    fn visit_i64<E>(self, range_m: i64) -> Result<Reading, E> {
        Ok(Reading(range_m as f32))
    }

    fn visit_u64<E>(self, range_m: u64) -> Result<Reading, E> {
        Ok(Reading(range_m as f32))
    }

    fn visit_unit<E>(self) -> Result<Reading, E> {
        Ok(Reading(f32::NAN))
    }

    fn visit_str<E: de::Error>(self, word: &str) -> Result<Reading, E> {
        match word {
            "inf" => Ok(Reading(f32::INFINITY)),
            "-inf" => Ok(Reading(f32::NEG_INFINITY)),
            _ => Err(E::invalid_value(de::Unexpected::Str(word), &self)),
        }
    }
}

impl ToSchema for Reading {}

impl PartialSchema for Reading {
    fn schema() -> RefOr<Schema> {
        OneOfBuilder::new()
            .item(ObjectBuilder::new().schema_type(Type::Number))
            .item(ObjectBuilder::new().schema_type(Type::Null))
            .item(ObjectBuilder::new().schema_type(Type::String).enum_values(Some(["inf", "-inf"])))
            .description(Some(
                "A range in metres: a number, null for an erroneous reading, \"inf\" where nothing \
                 lies within range, \"-inf\" for too close (REP 117).",
            ))
            .examples([serde_json::json!(2.5)])
            .into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn observation(json: &str) -> Result<v1::Observation, String> {
        let read: Observation = serde_json::from_str(json).map_err(|error| error.to_string())?;
        read.into_wire("batch.observations[0]").map_err(|error| error.to_string())
    }

    fn ranges_m(json: &str) -> Vec<f32> {
        let body =
            format!(r#"{{"stamp_ns": 1, "sensor_id": "l", "laser_scan": {{"ranges_m": {json}}}}}"#);
        match observation(&body).expect("a scan").kind {
            Some(Kind::LaserScan(scan)) => scan.ranges_m,
            other => panic!("no scan: {other:?}"),
        }
    }

    #[test]
    fn what_json_has_no_number_for() {
        let read = ranges_m(r#"[1.5, 2, -1, null, "inf", "-inf", 1e39]"#);
        assert_eq!(&read[..3], &[1.5, 2.0, -1.0], "numbers");
        assert!(read[3].is_nan(), "null is NaN");
        assert_eq!(read[4..], [f32::INFINITY, f32::NEG_INFINITY, f32::INFINITY], "REP 117");
        let word = observation(r#"{"stamp_ns": 1, "laser_scan": {"ranges_m": ["far"]}}"#);
        assert!(word.expect_err("no range").contains("\"-inf\""), "says what is taken");
    }

    #[test]
    fn stamps_in_both_forms() {
        for stamp in ["1763840000000000001", "\"1763840000000000001\""] {
            let body = format!(r#"{{"stamp_ns": {stamp}, "mark": {{"label": "lift door"}}}}"#);
            let read = observation(&body).expect("a mark");
            assert_eq!(read.stamp_ns, 1_763_840_000_000_000_001, "to the nanosecond");
        }
    }

    #[test]
    fn of_one_kind() {
        let two = r#"{"stamp_ns": 1, "mark": {"label": "a"}, "sonar_scan": {"ranges_m": []}}"#;
        assert_eq!(
            observation(two).expect_err("two kinds"),
            "batch.observations[0]: `sonar_scan` and `mark`, one is taken",
            "where and which"
        );
        let none = observation(r#"{"stamp_ns": 1}"#).expect("rejected later, by name");
        assert_eq!(none.kind, None, "of no kind");
        let unknown = observation(r#"{"stamp_ns": 1, "camera": {}}"#).expect_err("unknown");
        assert!(unknown.contains("unknown field `camera`"), "named");
    }
}
