//! What a relaxation found of one session, for the journal and for those who asked.

use meetpoint_geometry::{Point2, Pose};
use meetpoint_proto::v1;
use meetpoint_relaxation::{Calibration, MappedLandmark, Outcome, Travel};
use meetpoint_storage::{JobId, SessionRecord};
use uuid::Builder;

use super::bending::bent;
use super::course::Course;
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
    let map_from_session = record.map_from_session.map_or(Pose::IDENTITY, pose::from_record);
    let sightings = || landmarks.iter().map(|landmark| landmark.sightings.as_slice());
    let told = v1::RelaxedSession {
        session: record.id.0.to_string(),
        steps: count(stations.travel.steps.len()),
        sightings: count(stations.travel.n_sightings()),
        sightings_left_out: course.n_left_out,
        landmarks: count(landmarks.len()),
        log_likelihood: *log_evidence,
        confidence: *confidence,
        spread_before_m: spread_m(&stations.travel, &reckoned, sightings()),
        spread_after_m: spread_m(&stations.travel, poses, sightings()),
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

fn count(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}

fn kept(
    job: JobId,
    record: &SessionRecord,
    index: usize,
    stations: &Stations,
    found: &MappedLandmark,
) -> RelaxedLandmark {
    let name = |names: &[String], number: u32| {
        usize::try_from(number).ok().and_then(|index| names.get(index)).cloned()
    };
    let sighting = found
        .sightings
        .first()
        .and_then(|&(step, index)| stations.travel.steps.get(step)?.sightings.get(index));
    let landmark_type = sighting.and_then(|seen| name(&stations.types, seen.landmark_type));
    let landmark_type = landmark_type.unwrap_or_default();
    let identity = sighting.and_then(|seen| name(&stations.identities, seen.identity?));
    // The same name for the same thing, whoever computes it and however often.
    let mut hash = blake3::Hasher::new();
    hash.update(record.id.0.as_bytes());
    match &identity {
        Some(identity) => {
            hash.update(landmark_type.as_bytes()).update(&[0]).update(identity.as_bytes());
        }
        None => {
            hash.update(job.0.as_bytes()).update(&count(index).to_le_bytes());
        }
    }
    let covariance = &found.covariance_m2;
    let mut id = [0; 16];
    id.copy_from_slice(&hash.finalize().as_bytes()[..16]);
    RelaxedLandmark {
        id: Builder::from_custom_bytes(id).into_uuid(),
        landmark_type,
        identity,
        position: found.position,
        covariance_m2: [covariance[(0, 0)], covariance[(0, 1)], covariance[(1, 1)]],
        certainty: found.certainty,
        n_sightings: count(found.sightings.len()),
    }
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

/// Root mean square of the distance of sightings from the mean of their landmark, in metres; 0 where
/// nothing was seen twice.
fn spread_m<'a>(
    travel: &Travel,
    poses: &[Pose],
    landmarks: impl Iterator<Item = &'a [(usize, usize)]>,
) -> f64 {
    let seen = |&(step, index): &(usize, usize)| {
        let sighting = travel.steps.get(step)?.sightings.get(index)?;
        Some(*poses.get(step)? * sighting.offset_m())
    };
    let landmarks = landmarks.map(|all| all.iter().filter_map(seen).collect::<Vec<_>>());
    let (mut sum_m2, mut n) = (0.0, 0_u32);
    for points in landmarks.filter(|points| 1 < points.len()) {
        let mean = points.iter().fold(Point2::origin(), |sum, point| sum + point.coords);
        let mean = mean / points.len() as f64;
        sum_m2 += points.iter().map(|point| (point - mean).norm_squared()).sum::<f64>();
        n += count(points.len());
    }
    if n == 0 { 0.0 } else { (sum_m2 / f64::from(n)).sqrt() }
}

#[cfg(test)]
mod tests {
    use meetpoint_relaxation::{Detector, Motion, Sighting, Step};

    use super::*;

    #[test]
    fn sightings_that_meet_have_no_spread() {
        let sighting =
            Sighting { identity: None, landmark_type: 0, range_m: 1.0, bearing_rad: 0.0 };
        let step = Step { motion: Motion::NONE, sightings: vec![sighting] };
        let detector = Detector { range_max_m: 2.0, half_field_of_view_rad: 3.0 };
        let travel = Travel { detector, steps: vec![step; 3] };
        let landmark = [(0, 0), (1, 0)];
        let poses = [0.0, 2.0, 9.0].map(|x_m| Pose::new(x_m, 0.0, 0.0));
        let spread =
            |poses: &[Pose]| spread_m(&travel, poses, std::iter::once(landmark.as_slice()));
        assert!((spread(&poses) - 1.0).abs() < 1e-12, "a metre to either side of the middle");
        assert!(spread(&[poses[0]; 3]) < 1e-12, "they meet");
        assert!(spread_m(&travel, &poses, std::iter::empty()) < 1e-12, "nothing was seen twice");
    }
}
