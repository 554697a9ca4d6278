//! Sessions past landmarks, each relaxed by itself before, fitted with the landmarks that they share; then
//! one expectation maximisation over all of them, which tells anew what each saw.

use std::ops::ControlFlow;

use meetpoint_geometry::{Pose, Rotation2};
use meetpoint_proto::v1;
use meetpoint_relaxation::{
    AlignmentParams, Figures, JointLandmark, JointOutcome, LandmarkKind, MappedLandmark, OneEm,
    Outcome, Placed, StartBelief, Started, Travel, joint, one_em,
};
use meetpoint_storage::{JobId, SessionRecord};

use super::super::running::Stopped;
use super::super::workbench::Next;
use super::course::Course;
use super::finding::{count, finding, place};
use super::landmark_travel::relaxed_alone;
use super::merged_starts::covariance_of;
use super::names::LandmarkNames;
use super::saved::{Method, Planned, Saved};
use super::solver::Reckoning;
use super::stations::{Stations, stations};
use super::way::way;
use super::{Found, Relaxing, SHARE_RELAXED, cannot_relax};

/// A session past landmarks, and what follows from it alone.
#[derive(Debug)]
pub(super) struct Past {
    pub(super) record: SessionRecord,
    pub(super) course: Course,
    pub(super) stations: Stations,
    pub(super) outcome: Outcome,
}

impl Relaxing<'_> {
    /// Fits the sessions that were relaxed by landmarks together, and leaves what was found in `saved`.
    /// `past` are those that this run has relaxed; of others it is found out again, with the same result.
    pub(super) async fn fit_together(
        &self,
        saved: &mut Saved,
        mut past: Vec<Past>,
    ) -> Result<(), Stopped> {
        let is_found =
            |planned: &&Planned| saved.found.iter().any(|found| found.session == planned.session);
        let by_landmarks = saved.sessions.iter().filter(|it| it.method == Method::Landmarks);
        let planned: Vec<Planned> = by_landmarks.filter(is_found).copied().collect();
        if planned.len() < 2 {
            return Ok(());
        }
        let place = |past: &Past| planned.iter().position(|it| it.session == past.record.id);
        for planned in &planned {
            if !past.iter().any(|past| past.record.id == planned.session) {
                past.push(self.gone_past(planned).await?);
            }
        }
        past.sort_by_key(place);
        let n_sessions = planned.len();
        let Some(Fitted { found, told, n_shared }) = self.fitted(past).await? else {
            let text = format!(
                "{n_sessions} sessions past landmarks do not fit together: each stays as its own \
                 landmarks put it"
            );
            return self.running.progress(SHARE_RELAXED, Some(&text)).await;
        };
        for (kept, told) in found {
            let at = saved.found.iter().position(|before| before.session == kept.session);
            let Some(at) = at else { continue };
            (saved.found[at], saved.told[at]) = (kept, told);
        }
        let OneEm { outcome, n_iterations, n_told_otherwise, log_odds } = told;
        let n_landmarks = outcome.landmarks.len();
        let text = format!(
            "{n_sessions} sessions past landmarks fitted together: {n_landmarks} landmarks, {n_shared} \
             of them seen by several"
        );
        self.running.progress(SHARE_RELAXED, Some(&text)).await?;
        let text = match n_told_otherwise {
            0 => format!(
                "one EM over {n_sessions} sessions, {n_iterations} iterations on a grid: it tells no \
                 sighting otherwise (log odds {log_odds:.1} of the best that it found)"
            ),
            n => format!(
                "one EM over {n_sessions} sessions, {n_iterations} iterations on a grid: {n} sightings \
                 are of another landmark than each session by itself took them for (log odds \
                 {log_odds:.1})"
            ),
        };
        self.running.progress(SHARE_RELAXED, Some(&text)).await
    }

    /// Fits the sessions, and tells of each iteration of the EM over them; `None` if they do not fit.
    async fn fitted(&self, past: Vec<Past>) -> Result<Option<Fitted>, Stopped> {
        let mut starts = Vec::new();
        for past in &past {
            starts.push(self.start(&past.record).await?);
        }
        let (job, n_sessions) = (self.job.id, past.len());
        let mut pieces = self
            .bench
            .pieces(move |teller| fitted(job, &past, &starts, |figures| teller.tell(*figures)))?;
        loop {
            let Figures { iteration, log_likelihood, .. } = match pieces.next().await? {
                Next::Piece(figures) => figures,
                Next::Done(ControlFlow::Continue(fitted)) => return Ok(fitted),
                Next::Done(ControlFlow::Break(())) => return Err(Stopped::Left),
            };
            let log_likelihood = log_likelihood.unwrap_or_default();
            let text = format!(
                "one EM over {n_sessions} sessions, iteration {iteration}: log-likelihood \
                 {log_likelihood:.3}"
            );
            self.running.progress(SHARE_RELAXED, Some(&text)).await?;
        }
    }

    /// Where a session begins, alpha(0): as it was told, or as surely as its alignment says.
    async fn start(&self, record: &SessionRecord) -> Result<StartBelief, Stopped> {
        let pose = place(record);
        let frames = self.unsure_frames(record.id).await?;
        let told = StartBelief::At(pose);
        let about = |covariance| StartBelief::About { pose, covariance };
        Ok(covariance_of(pose, &frames).map_or(told, about))
    }

    /// What a session went past, relaxed again as it was before the service was killed.
    async fn gone_past(&self, planned: &Planned) -> Result<Past, Stopped> {
        let record = self.service.session_record(&planned.session.0.to_string()).await?;
        let way = way((self.service, self.bench), &record, planned.through, None).await?;
        let course = way.map_err(|problem| cannot_relax(&record, problem))?.course;
        let stations = stations(&course, self.params.forget_identities);
        let reckoning = Reckoning::of(planned.method, self.params.estimate_odometry);
        let (at_work, shares) = ((self.running, self.bench), [SHARE_RELAXED, 0.0]);
        let outcome = relaxed_alone(&stations.travel, reckoning, at_work, shares).await?;
        let outcome = outcome
            .ok_or_else(|| cannot_relax(&record, "nothing fits what was seen".to_owned()))?;
        Ok(Past { record, course, stations, outcome })
    }
}

/// What was found of sessions together.
struct Fitted {
    found: Vec<Found>,
    told: OneEm,
    /// Landmarks that several sessions saw.
    n_shared: usize,
}

/// Fits the sessions where they lie in the map, and lets one EM over all tell anew what they saw; `None` if
/// that cannot be solved. Breaks if it is told to.
fn fitted(
    job: JobId,
    past: &[Past],
    starts: &[StartBelief],
    tell: impl FnMut(&Figures) -> ControlFlow<()>,
) -> ControlFlow<(), Option<Fitted>> {
    let mut names = LandmarkNames::default();
    let travels: Vec<Travel> = past
        .iter()
        .map(|past| names.renamed(&past.stations.travel, &past.stations.names))
        .collect();
    let both = past.iter().zip(&travels);
    let alone: Vec<Outcome> = both.map(|(past, travel)| renamed(&past.outcome, travel)).collect();
    let placed = past.iter().zip(&travels).zip(&alone);
    let placed: Vec<Placed<'_>> = placed
        .map(|((past, travel), outcome)| {
            let site_from_travel = place(&past.record);
            Placed { travel, outcome, site_from_travel }
        })
        .collect();
    let nothing = ControlFlow::Continue(None);
    let before = joint(&placed, &AlignmentParams::of_travels(&travels));
    let Some(before) = before else { return nothing };
    let started = placed.iter().zip(starts);
    let started: Vec<Started<'_>> =
        started.map(|(&placed, &start)| Started { placed, start }).collect();
    let Some(told) = one_em(&started, before, tell)? else { return nothing };
    let outcome = &told.outcome;
    let found = (0..past.len()).map(|index| found(job, past, index, outcome)).collect();
    let is_shared = |landmark: &&JointLandmark| {
        landmark.sightings.iter().any(|(travel, ..)| *travel != landmark.sightings[0].0)
    };
    let n_shared = outcome.landmarks.iter().filter(is_shared).count();
    ControlFlow::Continue(Some(Fitted { found, told, n_shared }))
}

/// What was found of a travel, with what its landmarks are called by now.
fn renamed(outcome: &Outcome, travel: &Travel) -> Outcome {
    let kind = |landmark: &MappedLandmark| {
        let &(step, within) = landmark.sightings.first()?;
        Some(LandmarkKind::of(travel.steps.get(step)?.sightings.get(within)?))
    };
    let landmarks = outcome.landmarks.iter().map(|landmark| MappedLandmark {
        kind: kind(landmark).unwrap_or(landmark.kind),
        ..landmark.clone()
    });
    Outcome { landmarks: landmarks.collect(), ..outcome.clone() }
}

/// What was found of one of the sessions. A landmark that several saw is told of the first that did, with
/// the sightings of all.
fn found(job: JobId, past: &[Past], index: usize, all: &JointOutcome) -> Found {
    let Past { record, course, stations, outcome: alone } = &past[index];
    let session_from_map = place(record).inverse();
    let seen: Vec<&JointLandmark> = all.landmarks.iter().filter(|it| sees(it, index)).collect();
    let outcome = Outcome {
        poses: all.poses[index].iter().map(|&pose| session_from_map * pose).collect(),
        calibration: all.calibrations[index],
        landmarks: seen.iter().map(|it| mapped(it, index, session_from_map)).collect(),
        ..alone.clone()
    };
    let (mut kept, told) = finding(job, record, (course, stations), &outcome);
    let own = kept.landmarks.into_iter().zip(seen).filter(|(_, it)| is_first(it, index));
    kept.landmarks = own
        .map(|(mut landmark, it)| {
            landmark.n_sightings = count(it.sightings.len());
            landmark
        })
        .collect();
    let others = past.iter().map(|other| other.record.id).filter(|&other| other != record.id);
    let together_with = others.map(|other| other.0.to_string()).collect();
    (kept, v1::RelaxedSession { together_with, ..told })
}

fn sees(landmark: &JointLandmark, travel: usize) -> bool {
    landmark.sightings.iter().any(|sighting| sighting.0 == travel)
}

fn is_first(landmark: &JointLandmark, travel: usize) -> bool {
    landmark.sightings.iter().map(|sighting| sighting.0).min() == Some(travel)
}

/// A landmark as one of those who saw it has it, in its frame.
fn mapped(landmark: &JointLandmark, travel: usize, session_from_map: Pose) -> MappedLandmark {
    let turn = Rotation2::new(session_from_map.theta_rad).into_inner();
    let own = landmark.sightings.iter().filter(|sighting| sighting.0 == travel);
    MappedLandmark {
        position: session_from_map * landmark.position,
        covariance_m2: turn * landmark.covariance_m2 * turn.transpose(),
        shape_covariance_m2: turn * landmark.shape_covariance_m2 * turn.transpose(),
        kind: landmark.kind,
        certainty: landmark.certainty,
        sightings: own.map(|&(_, step, within)| (step, within)).collect(),
    }
}
