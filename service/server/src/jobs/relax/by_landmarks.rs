//! The relaxation of one session by landmarks: from the journal to what the journal keeps.

use std::time::Instant;

use meetpoint_proto::v1;
use meetpoint_relaxation::Outcome;
use meetpoint_storage::SessionRecord;

use super::super::running::Stopped;
use super::super::workbench::{Next, Teller};
use super::course::Course;
use super::finding::finding;
use super::fitted_together::Past;
use super::grid_landmarks::{self, Told, with_grid_landmarks};
use super::saved::{Kept, Method, Saved, UnderWay};
use super::solver::{Milestone, Piece, Reckoning, relaxed};
use super::stations::{Stations, stations};
use super::way::Way;
use super::{Found, REPORT_EVERY, Relaxing, cannot_relax, share};

/// Sightings without which there is nothing to hold a way against.
const N_SIGHTINGS_MIN: usize = 2;
/// Share of a session's work that finding landmarks in grids is.
const SHARE_GRIDS: f64 = 0.3;

impl Relaxing<'_> {
    /// Relaxes a session by the landmarks along it; `None` if too little was seen. What it went past is
    /// kept in `past`, unless it was found in grids.
    pub(super) async fn relax_by_landmarks(
        &self,
        record: &SessionRecord,
        way: Way,
        saved: &mut Saved,
        past: &mut Vec<Past>,
    ) -> Result<Option<Found>, Stopped> {
        if !way.course.has_odometry() {
            return Ok(None);
        }
        let is_by_grid = saved.sessions[saved.n_done].method == Method::GridLandmarks;
        let begun = if is_by_grid { SHARE_GRIDS } else { 0.0 };
        let course =
            if is_by_grid { self.seen_in_grids(record, way, saved).await? } else { way.course };
        let stations = stations(&course, self.params.forget_identities);
        if stations.travel.n_sightings() < N_SIGHTINGS_MIN {
            return Ok(None);
        }
        let under_way = saved.under_way.clone();
        let found = self.relax(record, &stations, (under_way, begun), saved).await?;
        let (job, record) = (self.job.id, record.clone());
        let (found, alone) = self
            .bench
            .slice(move || {
                let finding = finding(job, &record, (&course, &stations), &found);
                (finding, Past { record, course, stations, outcome: found })
            })
            .await?;
        if !is_by_grid {
            past.push(alone);
        }
        Ok(Some(found))
    }

    /// The course with what the grid about the robot shows along it.
    async fn seen_in_grids(
        &self,
        record: &SessionRecord,
        way: Way,
        saved: &Saved,
    ) -> Result<Course, Stopped> {
        let work = |teller: &mut Teller<f64>| with_grid_landmarks(way, |done| teller.tell(done));
        let mut pieces = self.bench.pieces(work)?;
        let mut reported = Instant::now();
        let told = loop {
            match pieces.next().await? {
                Next::Piece(done) if REPORT_EVERY <= reported.elapsed() => {
                    self.running.progress(share(saved, SHARE_GRIDS * done), None).await?;
                    reported = Instant::now();
                }
                Next::Piece(_) => {}
                Next::Done(told) => break told?.ok_or(Stopped::Left)?,
            }
        };
        let Told { course, n_stretches, n_doubtful } = told;
        let n_sightings = grid_landmarks::n_sightings(&course);
        let mut text = format!(
            "session {}: {n_sightings} junctions, corners and dead ends passed on {n_stretches} \
             stretches",
            record.id.0
        );
        if 0 < n_doubtful {
            text = format!("{text}, {n_doubtful} of which were left out: scans do not agree");
        }
        self.running.progress(share(saved, SHARE_GRIDS), Some(&text)).await?;
        Ok(course)
    }

    /// Relaxes to the end, and keeps every milestone. `begun` is the share of the session's work that
    /// is done before.
    async fn relax(
        &self,
        record: &SessionRecord,
        stations: &Stations,
        (under_way, begun): (Option<UnderWay>, f64),
        saved: &mut Saved,
    ) -> Result<Outcome, Stopped> {
        let method = saved.sessions[saved.n_done].method;
        let reckoning = Reckoning::of(method, self.params.estimate_odometry);
        let (mut n_milestones, state) =
            under_way.map_or((0, None), |saved| (saved.n_milestones, Some(saved.state)));
        let travel = stations.travel.clone();
        let mut pieces = self.bench.pieces(move |teller| {
            relaxed(&travel, reckoning, state.as_deref(), |piece| teller.tell(piece))
        })?;
        let mut reported = Instant::now();
        loop {
            let Piece { share: of_rest, milestone } = match pieces.next().await? {
                Next::Piece(piece) => piece,
                Next::Done(Ok(Some(outcome))) => return Ok(outcome),
                Next::Done(Ok(None)) => return Err(Stopped::Left),
                Next::Done(Err(problem)) => return Err(cannot_relax(record, problem)),
            };
            let progress = share(saved, begun + (1.0 - begun) * of_rest);
            if let Some(Milestone { stage, log_likelihood, has_tables, state }) = milestone {
                n_milestones += 1;
                let before = saved.under_way.replace(UnderWay { n_milestones, has_tables, state });
                if let Some(before) = before.filter(|before| before.has_tables && !has_tables) {
                    saved.tables.push(Kept { session: record.id, state: before.state });
                }
                let figures = v1::RelaxFigures {
                    session: record.id.0.to_string(),
                    iteration: n_milestones,
                    stage: stage.to_owned(),
                    log_likelihood,
                };
                self.tell(progress, figures, saved).await?;
            } else if REPORT_EVERY <= reported.elapsed() {
                self.running.progress(progress, None).await?;
            } else {
                continue;
            }
            reported = Instant::now();
        }
    }
}
