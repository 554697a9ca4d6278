//! Landmarks of a way whose poses are known: each where its sightings put it.
//!
//! A sighting with an identity is of the landmark of that name. Another one is of the nearest landmark
//! of its type that lies within [`GATE_M`], or of a new one. The position is the mean of where sightings
//! put it; its covariance that of the mean, by how far they lie apart and what a sighting may be off.

use std::collections::BTreeMap;

use meetpoint_geometry::{Point2, Pose};
use meetpoint_storage::{JobId, SessionId};

use super::course::{Moment, Seen};
use super::finding::{count, landmark_id};
use super::grid_landmarks;
use super::spread::{mean, spread_m};
use crate::convert::relaxation::RelaxedLandmark;

/// A sighting of a landmark that looks like others is of one that is at most so far from it, in metres:
/// what a detector is off, three times. Poses by scans are off by centimetres.
const GATE_M: f64 = 0.6;
/// What a single sighting is off, in metres, before others say so.
const SIGHTING_STD_M: f64 = 0.2;

/// Landmarks, and how well their sightings meet.
#[derive(Debug)]
pub(super) struct FittedLandmarks {
    landmarks: Vec<Fitted>,
    /// Sightings that said enough.
    pub(super) n_sightings: usize,
}

#[derive(Debug)]
struct Fitted {
    landmark_type: String,
    identity: Option<String>,
    /// Its sightings: their moments, and their places among what was seen then.
    sightings: Vec<(usize, usize)>,
    points: Vec<Point2<f64>>,
}

/// The landmarks seen at moments with these poses.
pub(super) fn fitted_landmarks(
    moments: &[Moment],
    poses: &[Pose],
    forgets_identities: bool,
) -> FittedLandmarks {
    let mut landmarks: Vec<Fitted> = Vec::new();
    let mut named: BTreeMap<(String, String), usize> = BTreeMap::new();
    let mut n_sightings = 0;
    for (index, (moment, &pose)) in moments.iter().zip(poses).enumerate() {
        for (place, seen) in moment.seen.iter().enumerate() {
            let Seen { identity, landmark_type, robot_from_landmark } = seen;
            n_sightings += 1;
            let point = pose * *robot_from_landmark;
            let identity = identity.clone().filter(|_| !forgets_identities);
            let known = match &identity {
                Some(name) => named.get(&(landmark_type.clone(), name.clone())).copied(),
                None => nearest(&landmarks, landmark_type, point),
            };
            let number = known.unwrap_or(landmarks.len());
            if known.is_none() {
                if let Some(name) = &identity {
                    named.insert((landmark_type.clone(), name.clone()), number);
                }
                let landmark_type = landmark_type.clone();
                let (sightings, points) = (Vec::new(), Vec::new());
                landmarks.push(Fitted { landmark_type, identity, sightings, points });
            }
            landmarks[number].sightings.push((index, place));
            landmarks[number].points.push(point);
        }
    }
    FittedLandmarks { landmarks, n_sightings }
}

/// The landmark without a name that is of that type and near enough.
fn nearest(landmarks: &[Fitted], landmark_type: &str, point: Point2<f64>) -> Option<usize> {
    let alike = landmarks.iter().enumerate().filter(|(_, landmark)| {
        landmark.identity.is_none() && landmark.landmark_type == landmark_type
    });
    let off_m =
        |(index, landmark): (usize, &Fitted)| (index, (mean(&landmark.points) - point).norm());
    let near = alike.map(off_m).filter(|&(_, off_m)| off_m <= GATE_M);
    near.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(index, _)| index)
}

impl FittedLandmarks {
    /// How well the sightings meet at other poses of the same moments: root mean square, in metres.
    pub(super) fn spread_m(&self, moments: &[Moment], poses: &[Pose]) -> f64 {
        let point = |&(index, place): &(usize, usize)| {
            let seen = moments.get(index)?.seen.get(place)?;
            Some(*poses.get(index)? * seen.robot_from_landmark)
        };
        let points = |fitted: &Fitted| fitted.sightings.iter().filter_map(point).collect();
        spread_m(self.landmarks.iter().map(points))
    }

    /// Number of landmarks.
    pub(super) fn len(&self) -> usize {
        self.landmarks.len()
    }

    /// For the journal, as what a job found in a session.
    pub(super) fn relaxed(&self, job: JobId, session: SessionId) -> Vec<RelaxedLandmark> {
        let relaxed = |(index, fitted): (usize, &Fitted)| {
            let Fitted { landmark_type, identity, sightings: _, points } = fitted;
            let position = mean(points);
            RelaxedLandmark {
                id: landmark_id((job, session), landmark_type, identity.as_deref(), index),
                landmark_type: landmark_type.clone(),
                identity: identity.clone(),
                position,
                covariance_m2: covariance_m2(points, position),
                certainty: self.certainty(index, position),
                n_sightings: count(points.len()),
                is_of_grid: grid_landmarks::is_type(landmark_type),
            }
        };
        self.landmarks.iter().enumerate().map(relaxed).collect()
    }

    /// How probable it is that a landmark is not another one of its type seen elsewhere: two of them are
    /// as far apart as sightings are off, or they are two. A name says so by itself.
    fn certainty(&self, index: usize, position: Point2<f64>) -> f64 {
        let own = &self.landmarks[index];
        if own.identity.is_some() {
            return 1.0;
        }
        let others = self.landmarks.iter().enumerate().filter(|&(other, landmark)| {
            other != index && landmark.landmark_type == own.landmark_type
        });
        let nearest_m = others
            .map(|(_, landmark)| (mean(&landmark.points) - position).norm())
            .fold(f64::INFINITY, f64::min);
        let apart = nearest_m / (2.0 * SIGHTING_STD_M);
        1.0 - 0.5 * (-0.5 * apart * apart).exp()
    }
}

/// xx, xy and yy of a mean: the sightings' scatter with one sighting's worth of what was assumed.
fn covariance_m2(points: &[Point2<f64>], mean: Point2<f64>) -> [f64; 3] {
    let assumed_m2 = SIGHTING_STD_M * SIGHTING_STD_M;
    let (mut xx, mut xy, mut yy) = (assumed_m2, 0.0, assumed_m2);
    for point in points {
        let off = point - mean;
        xx += off.x * off.x;
        xy += off.x * off.y;
        yy += off.y * off.y;
    }
    let n = points.len().max(1) as f64;
    [xx, xy, yy].map(|sum| sum / (n * n))
}

#[cfg(test)]
mod tests {
    use super::super::course::Place;
    use super::*;

    fn seen(name: Option<&str>, landmark_type: &str, at_m: [f64; 2]) -> Moment {
        let seen = Seen {
            identity: name.map(str::to_owned),
            landmark_type: landmark_type.to_owned(),
            robot_from_landmark: Point2::new(at_m[0], at_m[1]),
        };
        let place = Place { n_before: 0, odometry: Pose::IDENTITY, travelled_m: 0.0 };
        Moment { stamp_ns: 0, place, seen: vec![seen] }
    }

    #[test]
    fn names_and_places_tell_landmarks_apart() {
        let moments = [
            seen(Some("a"), "door", [1.0, 0.0]),
            seen(None, "door", [1.0, 0.0]),
            seen(None, "door", [1.2, 0.0]),
            seen(None, "lamp", [1.1, 0.0]),
            seen(None, "door", [4.0, 0.0]),
            seen(Some("a"), "door", [3.0, 0.0]),
        ];
        let poses = [Pose::IDENTITY; 6];
        let found = fitted_landmarks(&moments, &poses, false);
        let sizes: Vec<usize> = found.landmarks.iter().map(|one| one.points.len()).collect();
        assert_eq!((sizes, found.n_sightings), (vec![2, 2, 1, 1], 6), "a, a door, a lamp, a door");
        let (job, session) = (JobId(uuid::Uuid::nil()), SessionId(uuid::Uuid::nil()));
        let relaxed = found.relaxed(job, session);
        assert!((relaxed[0].position.x - 2.0).abs() < 1e-12, "the mean: {relaxed:?}");
        assert!((relaxed[0].certainty - 1.0).abs() < 1e-12, "it has a name");
        assert!(relaxed[0].covariance_m2[0] > relaxed[1].covariance_m2[0], "it is less sure");
        assert!(relaxed.iter().all(|one| 0.5 <= one.certainty && one.certainty <= 1.0), "shares");
        let forgotten = fitted_landmarks(&moments, &poses, true);
        assert_eq!(forgotten.landmarks.len(), 4, "two doors near one another, two far, a lamp");
        let shifted: Vec<Pose> = (0..6).map(|n| Pose::new(f64::from(n), 0.0, 0.0)).collect();
        assert!(found.spread_m(&moments, &poses) < found.spread_m(&moments, &shifted), "it meets");
    }
}
