//! Sessions in JSON.

use meetpoint_proto::v1;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::geometry::Pose;
use super::integer::{Signed64, Unsigned64};
use super::sensors::Sensor;
use crate::error::Error;

/// One unbroken run of a robot on a map.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Session {
    /// A version 7 UUID, given by the service.
    #[schema(example = "0199d3a6-6ac5-7c4e-9d51-2d9a3f1f3c11")]
    id: String,
    /// Id of the map.
    map: String,
    /// Id of the robot.
    robot: String,
    /// Counts the robot's cold starts. A session of a newer epoch fences all older ones.
    epoch: Unsigned64,
    /// The client's own name for this run.
    client_key: String,
    state: SessionState,
    /// Where it begins; absent: at the map's origin, heading along x.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    start: Option<Start>,
    /// The session's place in the map; absent while a session of unknown start is not placed. Merging
    /// sets it, and undoing takes it away.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    map_from_session: Option<Pose>,
    sensors: Vec<Sensor>,
    delivery: Delivery,
    /// Batches received, skipped ones included: the same number as `acked_through`.
    batches: Unsigned64,
    /// Batches up to this number are durable (skipped ones included): a robot may forget them.
    acked_through: Unsigned64,
    /// Batches up to this number are in the trajectory and the live grid.
    mapped_through: Unsigned64,
    /// Laser scans received, without rejected ones.
    scans: Unsigned64,
    /// Observations rejected.
    rejected: Unsigned64,
    /// Smallest stamp received, nanoseconds of the robot's clock; absent before the first.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    first_time_ns: Option<Signed64>,
    /// Largest stamp received, nanoseconds of the robot's clock; absent before the first.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    last_time_ns: Option<Signed64>,
    /// When it was opened, by the service's clock, nanoseconds since 1970.
    create_time_ns: Signed64,
    /// What the service will not do with this session's data, for people.
    warnings: Vec<String>,
    /// True while the tracker does not know where the robot is.
    lost: bool,
    /// Of an ended session: the newest map version, once that holds all that the session sent.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    complete_in_version: Option<Unsigned64>,
    /// The session in whose frame it is mapped; absent for the map's frame. A session of unknown start has
    /// a frame of its own until a merge places it.
    #[serde(skip_serializing_if = "String::is_empty")]
    #[schema(required = false)]
    frame_session: String,
    /// Its own frame seen from the one that it is mapped in: `map_from_session` once it is placed.
    frame_from_session: Pose,
}

impl From<v1::Session> for Session {
    fn from(wire: v1::Session) -> Self {
        let v1::Session {
            id,
            map,
            robot,
            epoch,
            client_key,
            state,
            start,
            map_from_session,
            sensors,
            delivery,
            acked_through,
            mapped_through,
            scans,
            rejected,
            first_time_ns,
            last_time_ns,
            create_time_ns,
            warnings,
            lost,
            complete_in_version,
            frame_session,
            frame_from_session,
        } = wire;
        Self {
            id,
            map,
            robot,
            epoch: Unsigned64(epoch),
            client_key,
            state: v1::SessionState::try_from(state).unwrap_or_default().into(),
            start: start.and_then(|v1::Start { kind }| kind).map(Start::from),
            map_from_session: map_from_session.map(Pose::from),
            sensors: sensors.into_iter().map(Sensor::from).collect(),
            delivery: v1::Delivery::try_from(delivery).unwrap_or_default().into(),
            batches: Unsigned64(acked_through),
            acked_through: Unsigned64(acked_through),
            mapped_through: Unsigned64(mapped_through),
            scans: Unsigned64(scans),
            rejected: Unsigned64(rejected),
            first_time_ns: first_time_ns.map(Signed64),
            last_time_ns: last_time_ns.map(Signed64),
            create_time_ns: Signed64(create_time_ns),
            warnings,
            lost,
            complete_in_version: Unsigned64::above_zero(complete_in_version),
            frame_session,
            frame_from_session: frame_from_session.unwrap_or_default().into(),
        }
    }
}

/// Whether a session takes batches.
#[derive(Clone, Copy, Debug, Serialize, ToSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub(crate) enum SessionState {
    /// Not told by the service of that version.
    Unspecified,
    /// Takes batches.
    Open,
    /// Closed by its robot.
    Closed,
    /// Ended by a newer epoch of the same robot.
    Fenced,
}

impl From<v1::SessionState> for SessionState {
    fn from(wire: v1::SessionState) -> Self {
        match wire {
            v1::SessionState::Unspecified => Self::Unspecified,
            v1::SessionState::Open => Self::Open,
            v1::SessionState::Closed => Self::Closed,
            v1::SessionState::Fenced => Self::Fenced,
        }
    }
}

/// Whether live mapping may leave out scans when it falls behind. They stay in the journal.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub(crate) enum Delivery {
    /// Every scan is mapped, however late. The default.
    #[default]
    Complete,
    /// Live mapping may skip scans to keep up.
    BoundedLag,
}

impl From<v1::Delivery> for Delivery {
    fn from(wire: v1::Delivery) -> Self {
        match wire {
            v1::Delivery::Unspecified | v1::Delivery::Complete => Self::Complete,
            v1::Delivery::BoundedLag => Self::BoundedLag,
        }
    }
}

impl From<Delivery> for v1::Delivery {
    fn from(delivery: Delivery) -> Self {
        match delivery {
            Delivery::Complete => Self::Complete,
            Delivery::BoundedLag => Self::BoundedLag,
        }
    }
}

/// Where a session begins: `{"known": pose}` or `{"unknown": {}}`.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum Start {
    /// The robot's pose in the map at the session's first observation.
    Known(Pose),
    /// Nobody knows. The session is mapped in a frame of its own.
    Unknown {},
}

impl From<v1::start::Kind> for Start {
    fn from(wire: v1::start::Kind) -> Self {
        match wire {
            v1::start::Kind::Known(pose) => Self::Known(pose.into()),
            v1::start::Kind::Unknown(v1::UnknownStart {}) => Self::Unknown {},
        }
    }
}

impl From<Start> for v1::Start {
    fn from(start: Start) -> Self {
        let kind = match start {
            Start::Known(pose) => v1::start::Kind::Known(pose.into()),
            Start::Unknown {} => v1::start::Kind::Unknown(v1::UnknownStart {}),
        };
        Self { kind: Some(kind) }
    }
}

/// A session to be opened, or to be found again by robot and client key.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({
    "map": "intel",
    "robot": "rover-1",
    "client_key": "2026-11-22-morning",
    "start": {"known": {"x_m": 0.0, "y_m": 0.0, "theta_rad": 0.0}},
    "sensors": [{
        "id": "front_laser",
        "laser": {"angle_min_rad": -1.5, "angle_increment_rad": 0.0166,
                  "n_beams": 181, "range_min_m": 0.1, "range_max_m": 30.0}
    }]
}))]
pub(crate) struct NewSession {
    /// Id of a map that exists.
    #[schema(example = "intel")]
    map: String,
    /// Id of the robot. Registered on the way if it is new.
    #[schema(example = "rover-1")]
    robot: String,
    /// The client's name for this run: 1 to 128 characters, unique for the robot. Opening again with
    /// the same key returns the same session, whatever its state; with other content it is refused.
    #[schema(min_length = 1, max_length = 128, example = "2026-11-22-morning")]
    client_key: String,
    /// Kept by the robot and raised at each cold start; 0 or absent lets the service count.
    #[serde(default)]
    epoch: Unsigned64,
    /// Absent: at the map's origin, heading along x.
    #[serde(default)]
    start: Option<Start>,
    /// At most 16.
    #[serde(default)]
    sensors: Vec<Sensor>,
    #[serde(default)]
    delivery: Delivery,
}

impl NewSession {
    /// # Errors
    /// [`Error::InvalidField`] if a sensor is of two kinds.
    pub(super) fn into_wire(self) -> Result<v1::OpenSessionRequest, Error> {
        let Self { map, robot, client_key, epoch, start, sensors, delivery } = self;
        let numbered = sensors.into_iter().enumerate();
        let sensors = numbered
            .map(|(index, sensor)| sensor.into_wire(&format!("sensors[{index}]")))
            .collect::<Result<_, _>>()?;
        Ok(v1::OpenSessionRequest {
            map,
            robot,
            client_key,
            epoch: epoch.0,
            start: start.map(v1::Start::from),
            sensors,
            delivery: v1::Delivery::from(delivery).into(),
        })
    }
}

/// What a client may have under way.
#[derive(Clone, Copy, Debug, Serialize, ToSchema)]
pub(crate) struct IngestLimits {
    /// Batches sent and not acknowledged.
    n_in_flight_max: u32,
    /// Size of a batch in bytes, as the binary protocol encodes it.
    batch_bytes_max: u32,
    /// Observations a batch.
    observations_max: u32,
}

impl From<v1::IngestLimits> for IngestLimits {
    fn from(wire: v1::IngestLimits) -> Self {
        let v1::IngestLimits { n_in_flight_max, batch_bytes_max, observations_max } = wire;
        Self { n_in_flight_max, batch_bytes_max, observations_max }
    }
}

/// A session that was opened or found.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct OpenedSession {
    pub(super) session: Session,
    /// True if it was there before.
    pub(super) resumed: bool,
    pub(super) limits: IngestLimits,
}

/// A page of sessions.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct SessionList {
    pub(super) sessions: Vec<Session>,
    /// Empty on the last page.
    pub(super) next_page_token: String,
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn opening(body: serde_json::Value) -> Result<v1::OpenSessionRequest, String> {
        let new: NewSession = serde_json::from_value(body).map_err(|error| error.to_string())?;
        new.into_wire().map_err(|error| error.to_string())
    }

    #[test]
    fn little_is_needed() {
        let wire = opening(json!({"map": "m", "robot": "r", "client_key": "k"})).expect("enough");
        assert_eq!(wire.epoch, 0, "the service counts");
        assert_eq!(wire.start, None, "at the origin");
        assert_eq!(wire.delivery, i32::from(v1::Delivery::Complete), "every scan");
    }

    #[test]
    fn starts_and_words() {
        let with = |start| json!({"map": "m", "robot": "r", "client_key": "k", "start": start});
        let known = opening(with(json!({"known": {"x_m": 1, "y_m": 2, "theta_rad": 0}})));
        let pose = v1::Pose { x_m: 1.0, y_m: 2.0, theta_rad: 0.0 };
        let start = v1::Start { kind: Some(v1::start::Kind::Known(pose)) };
        assert_eq!(known.expect("a pose").start, Some(start), "as given");
        assert!(opening(with(json!({"unknown": {}}))).is_ok(), "unknown");
        assert!(opening(with(json!({"unknown": {"x_m": 1}}))).is_err(), "nothing is known of it");
        assert!(opening(with(json!({"somewhere": {}}))).is_err(), "no such word");
        let fenced = serde_json::to_value(SessionState::Fenced).expect("a word");
        assert_eq!(fenced, json!("FENCED"), "in capitals");
        let lag = serde_json::to_value(Delivery::BoundedLag).expect("a word");
        assert_eq!(lag, json!("BOUNDED_LAG"), "in capitals");
    }
}
