//! What a relaxation found, and how sure it is.

use meetpoint_geometry::{Point2, Pose};
use nalgebra::Matrix2;

use crate::calibration::Calibration;
use crate::constellation::exists;
use crate::error_model::ErrorModel;
use crate::hypothesis::Hypothesis;
use crate::key_steps::KeySteps;
use crate::landmark::{Landmark, LandmarkKind};
use crate::shape::shape_covariance;
use crate::travel::Travel;
use crate::whole::Whole;

/// Alternatives told at most.
const N_ALTERNATIVES_MAX: usize = 5;

/// A map with the path that it was made from.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// Where the robot was at every step, in the frame of its first pose.
    pub poses: Vec<Pose>,
    /// What undoes the odometry's steady errors.
    pub calibration: Calibration,
    /// In the order in which the search first saw them.
    pub landmarks: Vec<MappedLandmark>,
    /// By sighting: index of its landmark, `None` if it was a false one.
    pub association: Vec<Option<u32>>,
    /// Logarithm of the density of the data, integrated over paths and maps.
    pub log_evidence: f64,
    /// Probability of this association among all that were kept, in (0, 1].
    pub confidence: f64,
    /// Other associations that fit, the most probable first.
    pub alternatives: Vec<Alternative>,
    /// Half of the weighted sum of squares that is left.
    pub cost: f64,
    /// By how far poses and places moved in the last fit, on average, in metres.
    pub moved_m: f64,
}

/// A landmark with what was seen of it.
#[derive(Clone, Debug, PartialEq)]
pub struct MappedLandmark {
    /// In the frame of the first pose, in metres.
    pub position: Point2<f64>,
    /// How wrong that may be, in square metres.
    pub covariance_m2: Matrix2<f64>,
    /// The same seen from all landmarks together, so that what the first pose is wrong by, which
    /// moves and turns all of them alike, is not in it ([`crate::shape`]).
    pub shape_covariance_m2: Matrix2<f64>,
    /// What it is.
    pub kind: LandmarkKind,
    /// Probability that exactly these sightings are of it: that it is one landmark and not two, and
    /// not a part of another.
    pub certainty: f64,
    /// The sightings that are of it: step, and index within the step.
    pub sightings: Vec<(usize, usize)>,
}

/// Another association.
#[derive(Clone, Debug, PartialEq)]
pub struct Alternative {
    /// Logarithm of its odds against the one that was chosen; at most 0.
    pub log_odds: f64,
    /// The sightings that it tells otherwise: step, and index within the step. Whoever goes there
    /// again finds out.
    pub in_doubt: Vec<(usize, usize)>,
}

impl Outcome {
    /// The map for those who want to find themselves on it ([`crate::localization`]): how wrong places are
    /// among each other, since nobody asks where the first pose was.
    pub fn known_map(&self) -> Vec<Landmark> {
        let known = |landmark: &MappedLandmark| Landmark {
            position: landmark.position,
            covariance_m2: landmark.shape_covariance_m2,
            kind: landmark.kind,
            certainty: exists(landmark.sightings.len()),
        };
        self.landmarks.iter().map(known).collect()
    }
}

/// What follows from hypotheses about the key steps, the best first. `None` if there is none, or it
/// cannot be fitted.
pub(crate) fn outcome(
    (travel, keys): (&Travel, &KeySteps),
    model: &ErrorModel,
    hypotheses: &[Hypothesis],
) -> Option<Outcome> {
    let best = hypotheses.first()?;
    let Whole { association, fit: refined, moved_m } = Whole::of(travel, keys, model, best)?;
    let weights = weights(hypotheses);
    let key_groups: Vec<Vec<Vec<usize>>> =
        hypotheses.iter().map(|hypothesis| groups(&hypothesis.association)).collect();
    let places = sighting_places(travel);
    let shape = shape_covariance(&refined.landmarks, &refined.landmark_covariance);
    let landmarks = groups(&association)
        .iter()
        .enumerate()
        .map(|(landmark, group)| {
            let holds = |groups: &Vec<Vec<usize>>| groups.contains(&key_groups[0][landmark]);
            let certainty = weights.iter().zip(&key_groups).filter(|(_, all)| holds(all));
            let (step, within) = places[group[0]];
            MappedLandmark {
                position: refined.landmarks[landmark],
                covariance_m2: refined
                    .landmark_covariance
                    .fixed_view::<2, 2>(2 * landmark, 2 * landmark)
                    .into_owned(),
                shape_covariance_m2: shape
                    .fixed_view::<2, 2>(2 * landmark, 2 * landmark)
                    .into_owned(),
                kind: LandmarkKind::of(&travel.steps[step].sightings[within]),
                certainty: certainty.map(|(weight, _)| weight).sum(),
                sightings: group.iter().map(|&sighting| places[sighting]).collect(),
            }
        })
        .collect();
    let alternatives = hypotheses
        .iter()
        .zip(&key_groups)
        .skip(1)
        .take(N_ALTERNATIVES_MAX)
        .map(|(other, other_groups)| Alternative {
            log_odds: other.log_evidence - best.log_evidence,
            in_doubt: in_doubt(&key_groups[0], other_groups)
                .into_iter()
                .map(|sighting| places[keys.sightings[sighting]])
                .collect(),
        })
        .collect();
    Some(Outcome {
        poses: refined.poses,
        calibration: refined.calibration,
        landmarks,
        association,
        log_evidence: best.log_evidence,
        confidence: weights[0],
        alternatives,
        cost: refined.cost,
        moved_m,
    })
}

/// Probabilities of hypotheses, the first of which is the best.
fn weights(hypotheses: &[Hypothesis]) -> Vec<f64> {
    let best = hypotheses[0].log_evidence;
    let odds: Vec<f64> =
        hypotheses.iter().map(|hypothesis| (hypothesis.log_evidence - best).exp()).collect();
    let sum: f64 = odds.iter().sum();
    odds.into_iter().map(|odds| odds / sum).collect()
}

/// Sightings by landmark, both in order.
fn groups(association: &[Option<u32>]) -> Vec<Vec<usize>> {
    let n_landmarks = association.iter().flatten().max().map_or(0, |last| *last as usize + 1);
    let mut groups = vec![Vec::new(); n_landmarks];
    for (sighting, landmark) in association.iter().enumerate() {
        if let Some(landmark) = landmark {
            groups[*landmark as usize].push(sighting);
        }
    }
    groups
}

/// Sightings whose landmark has other sightings in the one than in the other.
fn in_doubt(ours: &[Vec<usize>], theirs: &[Vec<usize>]) -> Vec<usize> {
    let mut sightings: Vec<usize> =
        ours.iter().filter(|group| !theirs.contains(group)).flatten().copied().collect();
    sightings.extend(theirs.iter().filter(|group| !ours.contains(group)).flatten());
    sightings.sort_unstable();
    sightings.dedup();
    sightings
}

/// Step and index within it, by sighting.
fn sighting_places(travel: &Travel) -> Vec<(usize, usize)> {
    let steps = travel.steps.iter().enumerate();
    steps.flat_map(|(step, at)| (0..at.sightings.len()).map(move |within| (step, within))).collect()
}
