//! What a relaxation found of one session, for the journal and for those who asked.

use meetpoint_geometry::{Point2, Pose};
use meetpoint_proto::v1;
use meetpoint_relaxation::{Calibration, MappedLandmark, Outcome, Travel};
use meetpoint_storage::{JobId, SessionId, SessionRecord};
use uuid::{Builder, Uuid};

use super::bending::bent;
use super::course::Course;
use super::grid_landmarks;
use super::spread::spread_m;
use super::stations::Stations;
use crate::convert::pose;
use crate::convert::relaxation::{RelaxedLandmark, RelaxedSession};

/// What the journal keeps, and what there is to tell.
pub(super) fn finding(
    job: JobId,
    record: &SessionRecord,
    (course, stations): (&Course, &Stations),
    found: &Outcome,
) -> (RelaxedSession, v1::RelaxedSession) {
    let Outcome { poses, calibration, landmarks, log_evidence, confidence, alternatives, .. } =
        found;
    let reckoned = stations.travel.dead_reckoning(&Calibration::NONE);
    let bent = bent(course, &stations.places, poses, *calibration);
    let moved = course.moments.iter().zip(&bent);
    let moved_m =
        moved.map(|(moment, pose)| (pose.position() - moment.place.odometry.position()).norm());
    let map_from_session = place(record);
    let told = v1::RelaxedSession {
        session: record.id.0.to_string(),
        steps: count(stations.travel.steps.len()),
        sightings: count(stations.travel.n_sightings()),
        sightings_left_out: course.n_left_out,
        landmarks: count(landmarks.len()),
        log_likelihood: *log_evidence,
        confidence: *confidence,
        method: v1::RelaxMethod::Landmarks.into(),
        scans: None,
        grid_sightings: count(grid_landmarks::n_sightings(course)),
        spread_before_m: spread_m(points(&stations.travel, &reckoned, landmarks)),
        spread_after_m: spread_m(points(&stations.travel, poses, landmarks)),
        correction_max_m: moved_m.fold(0.0, f64::max),
        calibration: Some(v1::OdometryCalibration {
            scale: calibration.scale,
            turn_per_m: calibration.turn_per_m,
            turn_per_rad: calibration.turn_per_rad,
        }),
        alternatives: alternatives
            .iter()
            .map(|other| v1::RelaxAlternative {
                log_odds: other.log_odds,
                decided_by: decided_by(map_from_session, poses, &other.in_doubt),
            })
            .collect(),
        together_with: Vec::new(),
    };
    let landmarks = landmarks.iter().enumerate();
    let kept = RelaxedSession {
        session: record.id,
        map_from_session,
        poses: bent,
        landmarks: landmarks
            .map(|(index, found)| kept(job, record, index, stations, found))
            .collect(),
    };
    (kept, told)
}

/// Where the sightings of each landmark put it.
fn points<'a>(
    travel: &'a Travel,
    poses: &'a [Pose],
    landmarks: &'a [MappedLandmark],
) -> impl Iterator<Item = Vec<Point2<f64>>> + 'a {
    let seen = |&(step, index): &(usize, usize)| {
        let sighting = travel.steps.get(step)?.sightings.get(index)?;
        Some(*poses.get(step)? * sighting.offset_m())
    };
    landmarks.iter().map(move |landmark| landmark.sightings.iter().filter_map(seen).collect())
}

/// Where a session lies in the map.
pub(super) fn place(record: &SessionRecord) -> Pose {
    record.map_from_session.map_or(Pose::IDENTITY, pose::from_record)
}

pub(super) fn count(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}

fn kept(
    job: JobId,
    record: &SessionRecord,
    index: usize,
    stations: &Stations,
    found: &MappedLandmark,
) -> RelaxedLandmark {
    let sighting = found
        .sightings
        .first()
        .and_then(|&(step, index)| stations.travel.steps.get(step)?.sightings.get(index));
    let names = &stations.names;
    let landmark_type = sighting.and_then(|seen| names.type_name(seen.landmark_type));
    let landmark_type = landmark_type.unwrap_or_default().to_owned();
    let identity = sighting.and_then(|seen| names.identity(seen.identity?)).map(str::to_owned);
    let covariance = &found.covariance_m2;
    RelaxedLandmark {
        id: landmark_id((job, record.id), &landmark_type, identity.as_deref(), index),
        is_of_grid: grid_landmarks::is_type(&landmark_type),
        landmark_type,
        identity,
        position: found.position,
        covariance_m2: [covariance[(0, 0)], covariance[(0, 1)], covariance[(1, 1)]],
        certainty: found.certainty,
        n_sightings: count(found.sightings.len()),
    }
}

/// The same name for the same thing, whoever computes it and however often: by what it is called, or as
/// the landmark of that index that a job found in a session.
pub(super) fn landmark_id(
    (job, session): (JobId, SessionId),
    landmark_type: &str,
    identity: Option<&str>,
    index: usize,
) -> Uuid {
    let mut hash = blake3::Hasher::new();
    hash.update(session.0.as_bytes());
    match identity {
        Some(identity) => {
            hash.update(landmark_type.as_bytes()).update(&[0]).update(identity.as_bytes());
        }
        None => {
            hash.update(job.0.as_bytes()).update(&count(index).to_le_bytes());
        }
    }
    let mut id = [0; 16];
    id.copy_from_slice(&hash.finalize().as_bytes()[..16]);
    Builder::from_custom_bytes(id).into_uuid()
}

/// Places told at most: who goes to one of them again knows more.
const N_PLACES_MAX: usize = 3;

/// What would tell another reading from the one that was taken, for people.
fn decided_by(map_from_session: Pose, poses: &[Pose], in_doubt: &[(usize, usize)]) -> String {
    let mut places: Vec<String> = Vec::new();
    for (step, _) in in_doubt {
        let Some(&pose) = poses.get(*step) else { continue };
        let at = (map_from_session * pose).position();
        let place = format!("({:.1}, {:.1}) m", at.x, at.y);
        if !places.contains(&place) && places.len() < N_PLACES_MAX {
            places.push(place);
        }
    }
    format!("seeing again what was seen at {}", places.join(" or "))
}
