//! Sessions of a map that are relaxed in one graph.

use std::num::NonZero;
use std::ops::ControlFlow;

use meetpoint_geometry::Pose;
use meetpoint_proto::v1;
use meetpoint_storage::{JobId, SessionId, SessionRecord};
use meetpoint_tracking::{
    Closure, ClosureKey, ClosureMoment, LaserOutcome, LaserProgress, LaserRelaxation,
    LaserRelaxationParams, LaserStage, PlacedTravel,
};

use super::Found;
use super::driven::{self, Driven};
use super::finding::count;
use super::live_poses::KnownPoses;
use super::merged_starts::UnsureFrame;
use super::names::LandmarkNames;
use super::way::Way;
use crate::convert::closure;
use crate::error::Error;

/// Scans without which there is nothing to hold against another.
const N_SCANS_MIN: usize = 2;

/// The sessions, in the order in which they were opened.
#[derive(Debug)]
pub(super) struct Several(Vec<(SessionRecord, Driven)>);

impl Several {
    /// Sessions with their ways and, in the same order, what is known of their poses. Those with too few
    /// scans are left out.
    pub(super) fn new(ways: Vec<(SessionRecord, Way)>, known: Vec<KnownPoses>) -> Self {
        let both = ways.into_iter().zip(known);
        let driven = both.map(|((record, way), known)| (record, Driven::new(way, known)));
        Self(driven.filter(|(_, driven)| N_SCANS_MIN <= driven.n_scans()).collect())
    }

    /// What is relaxed, in the map's frame. Landmarks with the same name are one, whoever saw them,
    /// unless names are to be forgotten. `frames` are, of each session, those by whose errors its place is
    /// wrong.
    pub(super) fn travels(
        &self,
        forgets_identities: bool,
        frames: &[Vec<UnsureFrame>],
    ) -> Vec<PlacedTravel> {
        let mut names = LandmarkNames::default();
        let placed = |((record, driven), frames): (&(SessionRecord, Driven), &Vec<UnsureFrame>)| {
            let sightings = (!forgets_identities).then(|| driven.named_sightings(&mut names));
            driven.placed(record, sightings.unwrap_or_default(), frames)
        };
        self.0.iter().zip(frames).map(placed).collect()
    }

    pub(super) fn sessions(&self) -> Vec<SessionId> {
        self.0.iter().map(|(record, _)| record.id).collect()
    }
}

/// What is known of closures when a relaxation begins.
#[derive(Debug, Default)]
pub(super) struct KnownClosures {
    /// Those that people switched off.
    pub(super) off: Vec<ClosureKey>,
    /// What the newest relaxation judged, if this one goes on from it.
    pub(super) judged: Option<Vec<Closure>>,
}

/// Relaxes travels slice by slice on `n_threads` threads and tells how far it is; is told in return how
/// many the next slice may have, or to stop, which gives `None`.
///
/// # Errors
/// [`Error::Internal`] for parameters that nobody can draw by.
pub(super) fn relaxed(
    travels: Vec<PlacedTravel>,
    known: KnownClosures,
    n_threads: NonZero<usize>,
    mut tell: impl FnMut(LaserProgress) -> ControlFlow<(), NonZero<usize>>,
) -> Result<Option<LaserOutcome>, Error> {
    let params = LaserRelaxationParams::INDOOR;
    let relaxation = match known.judged {
        Some(judged) => LaserRelaxation::going_on(travels, params, &known.off, judged),
        None => LaserRelaxation::new(travels, params, &known.off),
    };
    let mut relaxation = relaxation.map_err(|error| Error::internal(format!("{error:?}")))?;
    relaxation.use_threads(n_threads);
    while let Some(progress) = relaxation.advance() {
        match tell(progress) {
            ControlFlow::Continue(n_threads) => relaxation.use_threads(n_threads),
            ControlFlow::Break(()) => return Ok(None),
        }
    }
    Ok(Some(relaxation.into_outcome()))
}

/// What a stage is called.
pub(super) fn stage(stage: LaserStage) -> &'static str {
    match stage {
        LaserStage::Before => "the map by live poses",
        LaserStage::Chain => "scans against those before",
        LaserStage::Closures => "closures",
        LaserStage::Sweeps => "scans against all near them",
        LaserStage::MapMatching => "scans against the map of all",
        LaserStage::Placing => "scans between key scans",
        LaserStage::After => "the map by relaxed poses",
    }
}

/// What was found of the sessions, in their order, and the closures for the ledger.
pub(super) fn found(
    job: JobId,
    several: &Several,
    outcome: &LaserOutcome,
    forgets_identities: bool,
) -> (Vec<Found>, Vec<v1::Closure>) {
    let sessions = several.sessions();
    let closures = closures(several, outcome);
    let of_session = |(index, (record, driven)): (usize, &(SessionRecord, Driven))| {
        let of_travel = &outcome.travels[index];
        let (kept, told) = driven::found((job, record), driven, of_travel, forgets_identities);
        let others = sessions.iter().filter(|&&other| other != record.id);
        let told = v1::RelaxedSession {
            together_with: others.map(|other| other.0.to_string()).collect(),
            scans: told.scans.map(|scans| with_figures(&scans, &told.session, outcome, &closures)),
            ..told
        };
        (kept, told)
    };
    let found = several.0.iter().enumerate().map(of_session).collect();
    (found, closures)
}

fn closures(several: &Several, outcome: &LaserOutcome) -> Vec<v1::Closure> {
    let sessions = several.sessions();
    let at = |ClosureMoment { travel, stamp_ns }: ClosureMoment| -> Option<Pose> {
        let scan = several.0.get(travel)?.1.scan_at(stamp_ns)?;
        outcome.travels.get(travel)?.poses.get(scan).copied()
    };
    outcome.closures.iter().filter_map(|found| closure::found(&sessions, found, at)).collect()
}

/// What the whole graph says of itself, and the closures that a session is part of.
fn with_figures(
    scans: &v1::ScanRelaxation,
    session: &str,
    outcome: &LaserOutcome,
    closures: &[v1::Closure],
) -> v1::ScanRelaxation {
    let is_own = |one: &&v1::Closure| one.from_session == session || one.to_session == session;
    let accepted = i32::from(v1::ClosureVerdict::Accepted);
    let n_own = closures.iter().filter(is_own).count();
    let n_accepted = closures.iter().filter(is_own).filter(|one| one.verdict == accepted).count();
    let LaserOutcome { before, after, .. } = outcome;
    v1::ScanRelaxation {
        closures_accepted: count(n_accepted),
        closures_refused: count(n_own - n_accepted),
        chi2_before: before.chi2,
        chi2_after: after.chi2,
        before: before.sharpness.map(closure::sharpness),
        after: after.sharpness.map(closure::sharpness),
        ..*scans
    }
}
