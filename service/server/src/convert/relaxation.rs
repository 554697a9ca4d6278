//! What a relax job found, as the journal keeps it.

use meetpoint_geometry::{Point2, Pose};
use meetpoint_storage::SessionId;
use prost::Message;
use uuid::Uuid;

use super::pose;
use crate::error::Error;

/// The layout of [`Recorded`]; field numbers are kept for ever.
const FORMAT: u32 = 1;

/// Where a robot had been, as a relax job found out.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RelaxedSession {
    /// The session.
    pub(crate) session: SessionId,
    /// Its place in the map when it was relaxed.
    pub(crate) map_from_session: Pose,
    /// The robot's pose in the session's frame at each of the session's first observations that
    /// have one: scans, sightings and marks, in the order of the journal.
    pub(crate) poses: Vec<Pose>,
    /// What it saw.
    pub(crate) landmarks: Vec<RelaxedLandmark>,
}

/// A landmark of one session.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RelaxedLandmark {
    /// Never used again.
    pub(crate) id: Uuid,
    /// As its sightings name it; empty where all look alike.
    pub(crate) landmark_type: String,
    /// What it is called, where that could be told.
    pub(crate) identity: Option<String>,
    /// In the session's frame, in metres.
    pub(crate) position: Point2<f64>,
    /// xx, xy and yy in the session's frame, in square metres.
    pub(crate) covariance_m2: [f64; 3],
    /// How probable it is that it is one and not two, 0 to 1.
    pub(crate) certainty: f64,
    /// How often it was seen.
    pub(crate) n_sightings: u32,
    /// Whether the service found it in the grid about the robot.
    pub(crate) is_of_grid: bool,
}

#[derive(Clone, PartialEq, Message)]
struct Recorded {
    #[prost(uint32, tag = "1")]
    format: u32,
    #[prost(message, repeated, tag = "2")]
    sessions: Vec<RecordedSession>,
}

#[derive(Clone, PartialEq, Message)]
struct RecordedSession {
    #[prost(bytes = "vec", tag = "1")]
    session: Vec<u8>,
    #[prost(double, repeated, tag = "2")]
    map_from_session: Vec<f64>,
    /// x, y, theta, x, y, theta...
    #[prost(double, repeated, tag = "3")]
    poses: Vec<f64>,
    #[prost(message, repeated, tag = "4")]
    landmarks: Vec<RecordedLandmark>,
}

#[derive(Clone, PartialEq, Message)]
struct RecordedLandmark {
    #[prost(bytes = "vec", tag = "1")]
    id: Vec<u8>,
    #[prost(string, tag = "2")]
    landmark_type: String,
    #[prost(string, optional, tag = "3")]
    identity: Option<String>,
    /// x and y.
    #[prost(double, repeated, tag = "4")]
    position: Vec<f64>,
    /// xx, xy, yy.
    #[prost(double, repeated, tag = "5")]
    covariance_m2: Vec<f64>,
    #[prost(double, tag = "6")]
    certainty: f64,
    #[prost(uint32, tag = "7")]
    n_sightings: u32,
    #[prost(bool, tag = "8")]
    is_of_grid: bool,
}

/// The bytes of what a job found.
pub(crate) fn to_bytes(sessions: &[RelaxedSession]) -> Vec<u8> {
    let sessions = sessions.iter().map(recorded).collect();
    Recorded { format: FORMAT, sessions }.encode_to_vec()
}

/// What a job found, out of its bytes.
///
/// # Errors
/// [`Error::Internal`] if they are of another format or no relaxation.
pub(crate) fn from_bytes(bytes: &[u8]) -> Result<Vec<RelaxedSession>, Error> {
    let Recorded { format, sessions } = Recorded::decode(bytes).map_err(Error::internal)?;
    if format != FORMAT {
        return Err(Error::internal(format!("a relaxation of format {format}, not {FORMAT}")));
    }
    let read = |session| read_session(session).ok_or_else(|| Error::internal("no relaxation"));
    sessions.into_iter().map(read).collect()
}

fn recorded(session: &RelaxedSession) -> RecordedSession {
    let RelaxedSession { session, map_from_session, poses, landmarks } = session;
    let landmarks = landmarks.iter().cloned().map(|landmark| RecordedLandmark {
        id: landmark.id.as_bytes().to_vec(),
        landmark_type: landmark.landmark_type,
        identity: landmark.identity,
        position: vec![landmark.position.x, landmark.position.y],
        covariance_m2: landmark.covariance_m2.to_vec(),
        certainty: landmark.certainty,
        n_sightings: landmark.n_sightings,
        is_of_grid: landmark.is_of_grid,
    });
    RecordedSession {
        session: session.0.as_bytes().to_vec(),
        map_from_session: pose::to_record(*map_from_session).to_vec(),
        poses: poses.iter().flat_map(|&pose| pose::to_record(pose)).collect(),
        landmarks: landmarks.collect(),
    }
}

fn read_session(recorded: RecordedSession) -> Option<RelaxedSession> {
    let RecordedSession { session, map_from_session, poses, landmarks } = recorded;
    let (poses, rest) = poses.as_chunks::<3>();
    rest.is_empty().then_some(())?;
    Some(RelaxedSession {
        session: SessionId(Uuid::from_slice(&session).ok()?),
        map_from_session: pose::from_record(<[f64; 3]>::try_from(map_from_session).ok()?),
        poses: poses.iter().map(|&pose| pose::from_record(pose)).collect(),
        landmarks: landmarks.into_iter().map(read_landmark).collect::<Option<_>>()?,
    })
}

fn read_landmark(recorded: RecordedLandmark) -> Option<RelaxedLandmark> {
    let RecordedLandmark {
        id,
        landmark_type,
        identity,
        position,
        covariance_m2,
        certainty,
        n_sightings,
        is_of_grid,
    } = recorded;
    let [x_m, y_m] = <[f64; 2]>::try_from(position).ok()?;
    Some(RelaxedLandmark {
        id: Uuid::from_slice(&id).ok()?,
        landmark_type,
        identity,
        position: Point2::new(x_m, y_m),
        covariance_m2: <[f64; 3]>::try_from(covariance_m2).ok()?,
        certainty,
        n_sightings,
        is_of_grid,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_bit_for_bit() {
        let landmark = RelaxedLandmark {
            id: Uuid::from_u128(9),
            landmark_type: "door".into(),
            identity: Some("17".into()),
            position: Point2::new(0.1 + 0.2, -7.0),
            covariance_m2: [0.01, -0.002, 0.03],
            certainty: 0.9,
            n_sightings: 4,
            is_of_grid: true,
        };
        let session = RelaxedSession {
            session: SessionId(Uuid::from_u128(5)),
            map_from_session: Pose::new(1.0, 2.0, 0.5),
            poses: vec![Pose::IDENTITY, Pose::new(1.0 / 3.0, -0.0, 3.0)],
            landmarks: vec![landmark],
        };
        let bytes = to_bytes(std::slice::from_ref(&session));
        let read = from_bytes(&bytes).expect("just written");
        assert_eq!(read, std::slice::from_ref(&session), "as it was");
        let mut short = recorded(&session);
        short.poses.pop();
        let damaged = Recorded { format: FORMAT, sessions: vec![short] }.encode_to_vec();
        assert!(from_bytes(&damaged).is_err(), "a pose lacks its heading");
        let newer = Recorded { format: 2, sessions: Vec::new() }.encode_to_vec();
        assert!(from_bytes(&newer).is_err(), "an unknown format");
    }
}
