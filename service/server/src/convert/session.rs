//! Sessions on the wire and in records.

use meetpoint_geometry::Pose;
use meetpoint_proto::v1;
use meetpoint_storage::{RejectionRecord, SessionId, SessionRecord, SessionState};
use prost::Message;
use uuid::Uuid;

use super::{pose, sensor, slug};
use crate::{error::Error, settings::Limits};

/// Characters of a client key.
const CLIENT_KEY_LEN_MAX: usize = 128;

/// A request to open a session, checked.
pub(crate) struct Opening {
    pub(crate) map: String,
    pub(crate) robot: String,
    pub(crate) client_key: String,
    /// `None` lets the service count.
    pub(crate) epoch: Option<u64>,
    /// What is kept, and compared when the same key comes again.
    pub(crate) declaration: Vec<u8>,
    /// `None` for an unknown start.
    pub(crate) map_from_session: Option<Pose>,
}

/// Checks a request to open a session.
pub(crate) fn opening(wire: v1::OpenSessionRequest) -> Result<Opening, Error> {
    let v1::OpenSessionRequest { map, robot, client_key, epoch, start, sensors, delivery } = wire;
    slug::slug("map", &map)?;
    slug::slug("robot", &robot)?;
    if client_key.is_empty() {
        return Err(Error::field("client_key", "missing"));
    }
    slug::text("client_key", &client_key, CLIENT_KEY_LEN_MAX)?;
    sensor::sensors(&sensors)?;
    let delivery = match v1::Delivery::try_from(delivery) {
        Ok(v1::Delivery::Unspecified | v1::Delivery::Complete) => v1::Delivery::Complete,
        Ok(v1::Delivery::BoundedLag) => v1::Delivery::BoundedLag,
        Err(_) => {
            return Err(Error::field("delivery", format!("{delivery} is none of its values")));
        }
    };
    let map_from_session = start_pose(start.as_ref())?;
    let declaration = v1::OpenSessionRequest {
        map: map.clone(),
        robot: robot.clone(),
        client_key: client_key.clone(),
        epoch: 0,
        start,
        sensors,
        delivery: delivery.into(),
    };
    Ok(Opening {
        map,
        robot,
        client_key,
        epoch: (epoch != 0).then_some(epoch),
        declaration: declaration.encode_to_vec(),
        map_from_session,
    })
}

fn start_pose(start: Option<&v1::Start>) -> Result<Option<Pose>, Error> {
    match start {
        None => Ok(Some(Pose::IDENTITY)),
        Some(v1::Start { kind: None }) => Err(Error::field("start.kind", "missing")),
        Some(v1::Start { kind: Some(v1::start::Kind::Unknown(v1::UnknownStart {})) }) => Ok(None),
        Some(v1::Start { kind: Some(v1::start::Kind::Known(wire)) }) => {
            pose::pose("start.known", *wire).map(Some)
        }
    }
}

/// What a session declared when it was opened.
pub(crate) fn declaration(bytes: &[u8]) -> Result<v1::OpenSessionRequest, Error> {
    v1::OpenSessionRequest::decode(bytes).map_err(Error::internal)
}

/// A session's id.
pub(crate) fn id(field: &str, text: &str) -> Result<SessionId, Error> {
    Uuid::parse_str(text).map(SessionId).map_err(|_| Error::field(field, "not a UUID"))
}

/// What a record does not hold of a session.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Present {
    pub(crate) mapped_through: u64,
    pub(crate) lost: bool,
    pub(crate) complete_in_version: u64,
}

/// A session for the wire.
pub(crate) fn to_wire(record: SessionRecord, present: Present) -> Result<v1::Session, Error> {
    let v1::OpenSessionRequest { start, sensors, delivery, .. } = declaration(&record.declaration)?;
    let warnings = warnings(&record, &sensors, delivery);
    let SessionRecord {
        id,
        map,
        robot,
        epoch,
        client_key,
        state,
        declaration: _,
        map_from_session,
        frame,
        frame_from_session,
        acked_through,
        n_scans,
        n_rejected,
        first_time_ns,
        last_time_ns,
        create_time_ns,
        end_seq: _,
    } = record;
    let Present { mapped_through, lost, complete_in_version } = present;
    Ok(v1::Session {
        id: id.0.to_string(),
        map: map.0,
        robot: robot.0,
        epoch,
        client_key,
        state: match state {
            SessionState::Open => v1::SessionState::Open,
            SessionState::Closed => v1::SessionState::Closed,
            SessionState::Fenced => v1::SessionState::Fenced,
        }
        .into(),
        start,
        map_from_session: map_from_session.map(pose::from_record).map(pose::to_wire),
        sensors,
        delivery,
        acked_through,
        mapped_through,
        scans: n_scans,
        rejected: n_rejected,
        first_time_ns,
        last_time_ns,
        create_time_ns,
        warnings,
        lost,
        complete_in_version,
        frame_session: frame.map(|frame| frame.0.to_string()).unwrap_or_default(),
        frame_from_session: Some(pose::to_wire(pose::from_record(frame_from_session))),
    })
}

/// What the service does not do with a session's data, in words.
fn warnings(record: &SessionRecord, sensors: &[v1::Sensor], delivery: i32) -> Vec<String> {
    let mut warnings = Vec::new();
    if record.map_from_session.is_none() {
        warnings.push(
            "the start is unknown: the session is mapped in a frame of its own and shows in the map once it \
             is merged"
                .to_owned(),
        );
    }
    for sensor in sensors {
        let id = &sensor.id;
        match sensor.kind {
            Some(v1::sensor::Kind::LandmarkDetector(_)) => warnings.push(format!(
                "landmark sightings of `{id}` are kept and get a pose; a relax job corrects it by them"
            )),
            Some(v1::sensor::Kind::Laser(_) | v1::sensor::Kind::SonarRing(_)) | None => {}
        }
    }
    if delivery == i32::from(v1::Delivery::BoundedLag) {
        warnings.push("BOUNDED_LAG is noted; every scan is mapped all the same".to_owned());
    }
    warnings
}

/// The limits that a client is told.
pub(crate) fn limits(limits: &Limits) -> v1::IngestLimits {
    v1::IngestLimits {
        n_in_flight_max: limits.n_in_flight_max,
        batch_bytes_max: limits.batch_bytes_max,
        observations_max: limits.observations_max,
    }
}

/// The observations of a batch that were rejected.
pub(crate) fn rejections(batch_number: u64, records: Vec<RejectionRecord>) -> Vec<v1::Rejection> {
    let rejection = |record| {
        let RejectionRecord { index, code, detail } = record;
        v1::Rejection { batch_number, index, code, detail }
    };
    records.into_iter().map(rejection).collect()
}

/// A correction for those who watch the map.
pub(crate) fn correction_event(
    session: SessionId,
    correction: v1::PoseCorrection,
) -> v1::SessionCorrection {
    v1::SessionCorrection { session: session.0.to_string(), correction: Some(correction) }
}
