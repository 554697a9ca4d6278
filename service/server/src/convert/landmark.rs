//! Landmarks in versions and on the wire.

use meetpoint_geometry::{Point2, Pose};
use meetpoint_proto::v1;
use prost::Message;

use super::relaxation::{RelaxedLandmark, RelaxedSession};
use crate::error::Error;

/// The layout of [`Saved`].
const FORMAT: u32 = 1;

/// The landmarks of a version, in the map's frame. Field numbers are kept for ever.
#[derive(Clone, PartialEq, Message)]
struct Saved {
    #[prost(uint32, tag = "1")]
    format: u32,
    #[prost(message, repeated, tag = "2")]
    landmarks: Vec<v1::Landmark>,
}

/// The landmarks of sessions as a version keeps them; `None` if there are none.
pub(crate) fn set_to_bytes<'a>(
    sessions: impl Iterator<Item = &'a RelaxedSession>,
) -> Option<Vec<u8>> {
    let of = |session: &'a RelaxedSession| {
        session.landmarks.iter().map(move |landmark| to_wire(session, landmark))
    };
    let landmarks: Vec<v1::Landmark> = sessions.flat_map(of).collect();
    (!landmarks.is_empty()).then(|| Saved { format: FORMAT, landmarks }.encode_to_vec())
}

/// Where a landmark is, in metres, with xx, xy and yy of its covariance in square metres.
pub(crate) fn place(landmark: &v1::Landmark) -> (Point2<f64>, [f64; 3]) {
    let v1::Point { x_m, y_m } = landmark.position.unwrap_or_default();
    let v1::Covariance { xx_m2, xy_m2, yy_m2 } = landmark.covariance.unwrap_or_default();
    (Point2::new(x_m, y_m), [xx_m2, xy_m2, yy_m2])
}

/// The landmarks that a version keeps.
///
/// # Errors
/// [`Error::Internal`] if the bytes are of another format or no landmarks.
pub(crate) fn set_from_bytes(bytes: &[u8]) -> Result<Vec<v1::Landmark>, Error> {
    let Saved { format, landmarks } = Saved::decode(bytes).map_err(Error::internal)?;
    if format == FORMAT {
        Ok(landmarks)
    } else {
        Err(Error::internal(format!("landmarks of format {format}, not {FORMAT}")))
    }
}

fn to_wire(session: &RelaxedSession, landmark: &RelaxedLandmark) -> v1::Landmark {
    let RelaxedLandmark {
        id,
        landmark_type,
        identity,
        position,
        covariance_m2,
        certainty,
        n_sightings,
        is_of_grid,
    } = landmark;
    let source = if *is_of_grid { v1::LandmarkSource::Grid } else { v1::LandmarkSource::Detector };
    let map_from_session = session.map_from_session;
    let at = map_from_session * *position;
    let [xx_m2, xy_m2, yy_m2] = turned(map_from_session, *covariance_m2);
    v1::Landmark {
        id: id.to_string(),
        landmark_type: landmark_type.clone(),
        identity: identity.clone(),
        position: Some(v1::Point { x_m: at.x, y_m: at.y }),
        covariance: Some(v1::Covariance { xx_m2, xy_m2, yy_m2 }),
        sightings: *n_sightings,
        confidence: *certainty,
        session: session.session.0.to_string(),
        source: source.into(),
    }
}

/// A covariance (xx, xy, yy) seen from the frame that `outer_from_inner` leads to: R C R^T.
pub(crate) fn turned(outer_from_inner: Pose, [xx, xy, yy]: [f64; 3]) -> [f64; 3] {
    let (sin, cos) = outer_from_inner.theta_rad.sin_cos();
    [
        cos * cos * xx - 2.0 * sin * cos * xy + sin * sin * yy,
        sin * cos * (xx - yy) + (cos * cos - sin * sin) * xy,
        sin * sin * xx + 2.0 * sin * cos * xy + cos * cos * yy,
    ]
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use meetpoint_geometry::Point2;
    use meetpoint_storage::SessionId;
    use uuid::Uuid;

    use super::*;

    #[test]
    fn a_session_that_lies_across_turns_its_landmarks() {
        let landmark = RelaxedLandmark {
            id: Uuid::from_u128(9),
            landmark_type: String::new(),
            identity: None,
            position: Point2::new(3.0, 1.0),
            covariance_m2: [0.04, 0.01, 0.09],
            certainty: 1.0,
            n_sightings: 2,
            is_of_grid: false,
        };
        let session = RelaxedSession {
            session: SessionId(Uuid::from_u128(5)),
            map_from_session: Pose::new(10.0, 0.0, FRAC_PI_2),
            poses: Vec::new(),
            landmarks: vec![landmark],
        };
        let bytes = set_to_bytes([&session].into_iter()).expect("there is one");
        let found = set_from_bytes(&bytes).expect("just written");
        let at = found[0].position.expect("a position");
        assert!((at.x_m - 9.0).abs() < 1e-12 && (at.y_m - 3.0).abs() < 1e-12, "{at:?}");
        let v1::Covariance { xx_m2, xy_m2, yy_m2 } = found[0].covariance.expect("a covariance");
        let off = (xx_m2 - 0.09).abs() + (xy_m2 + 0.01).abs() + (yy_m2 - 0.04).abs();
        assert!(off < 1e-12, "a quarter turn: {xx_m2} {xy_m2} {yy_m2}");
        let bare = RelaxedSession { landmarks: Vec::new(), ..session };
        assert_eq!(set_to_bytes([&bare].into_iter()), None, "none");
    }
}
