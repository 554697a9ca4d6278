//! `relax`: where robots had been and where the landmarks are that they saw.
//!
//! Each session that saw landmarks is a travel of its own. What is found of it, the robot's pose at
//! each of its observations and the landmarks, becomes one entry of the journal: from there on it is
//! a decision like those of people, and the map is drawn by it now and whenever it is drawn again.
//! Until that entry is written the job can be cancelled; after it the job only draws.

mod bending;
mod course;
mod finding;
mod saved;
mod solver;
mod stations;
pub(crate) mod tables;

use std::time::{Duration, Instant};

use meetpoint_proto::v1;
use meetpoint_relaxation::Outcome;
use meetpoint_storage::{
    JobRecord, JobReport, MapId, MapRecord, NewLogLine, NewRelaxation, SessionFilter, SessionId,
    SessionRecord,
};
use prost::Message;
use v1::job_log_line::Figures as LineFigures;
use v1::sensor::Kind;

use super::Done;
use super::drawing::drawn_again;
use super::running::{Running, Stopped};
use super::workbench::{Next, Workbench};
use crate::convert::job::{self, RELAX};
use crate::convert::{relaxation, session};
use crate::{clock, error::Error, service::Service};
use course::{Course, CourseReader};
use finding::finding;
use saved::{Kept, Planned, Saved, UnderWay};
use solver::{Milestone, Piece, relaxed};
use stations::{Stations, stations};

/// Share of the progress that relaxing is; the rest is drawing.
const SHARE_RELAXED: f64 = 0.8;
/// How often the job says how far it is between milestones.
const REPORT_EVERY: Duration = Duration::from_secs(1);
/// Batches of a session read at a time: at most 16 MiB.
const N_BATCHES_READ: u32 = 16;
/// Sessions of a map read at a time.
const N_SESSIONS_READ: u32 = 100;
/// Sightings without which there is nothing to hold a way against.
const N_SIGHTINGS_MIN: usize = 2;

/// Relaxes the sessions that were asked for, and draws the map by it.
pub(super) async fn run(
    service: &Service,
    job: &JobRecord,
    running: &Running<'_>,
    bench: &Workbench,
) -> Result<Done, Stopped> {
    let record = service.map_record(&job.map.0).await?;
    let params = job::relax_params(&job.params)?;
    let relaxing = Relaxing { service, job, params: &params, running, bench };
    let mut saved = relaxing.begun(&record).await?;
    while saved.n_done < saved.sessions.len() {
        relaxing.relax_next(&mut saved).await?;
    }
    if saved.found.is_empty() {
        return Err(Error::NothingToRelax(record.id.0).into());
    }
    running.decide();
    if !saved.is_decided {
        relaxing.record(&mut saved).await?;
    }
    let drawn = drawn_again(service, &record, (running, bench), SHARE_RELAXED).await?;
    let version = service.actors.replace(&record.id, drawn.into_replacement(RELAX)).await?;
    let result = v1::RelaxResult { sessions: saved.told };
    Ok(Done { version, result: Some(v1::job::Result::RelaxResult(result)) })
}

/// A job at work.
struct Relaxing<'a> {
    service: &'a Service,
    job: &'a JobRecord,
    params: &'a v1::RelaxParams,
    running: &'a Running<'a>,
    bench: &'a Workbench,
}

impl Relaxing<'_> {
    /// Where the job goes on, or what it is to do.
    async fn begun(&self, record: &MapRecord) -> Result<Saved, Stopped> {
        match self.job.checkpoint.as_deref().map(Saved::from_bytes) {
            Some(Ok(saved)) => return Ok(saved),
            Some(Err(error)) => error.log(),
            None => {}
        }
        let sessions = self.sessions(&record.id).await?;
        Ok(Saved::first(sessions))
    }

    /// The sessions that are to be relaxed, in the order in which they were opened.
    async fn sessions(&self, map: &MapId) -> Result<Vec<Planned>, Error> {
        let store = &self.service.store;
        let asked = self.params.sessions.iter().map(|id| session::id("relax.sessions", id));
        let asked = asked.collect::<Result<Vec<SessionId>, Error>>()?;
        let filter = SessionFilter { map: Some(map.clone()), robot: None };
        let (mut planned, mut after) = (Vec::new(), None);
        loop {
            let page = store.sessions(&filter, after, N_SESSIONS_READ).await?;
            let Some(last) = page.last() else { return Ok(planned) };
            after = Some(last.id);
            for record in page {
                // Scans place a session better than odometry does: nobody's good map gets worse
                // unasked.
                let is_meant = if asked.is_empty() {
                    !has(&record, |kind| matches!(kind, Kind::Laser(_)))?
                } else {
                    asked.contains(&record.id)
                };
                let detects = has(&record, |kind| matches!(kind, Kind::LandmarkDetector(_)))?;
                if is_meant && detects && record.map_from_session.is_some() {
                    let (session, through) = (record.id, record.acked_through);
                    planned.push(Planned { session, through });
                }
            }
        }
    }

    /// Relaxes the next session, or goes on with it, and leaves what was found in `saved`.
    async fn relax_next(&self, saved: &mut Saved) -> Result<(), Stopped> {
        let planned = saved.sessions[saved.n_done];
        let record = self.service.session_record(&planned.session.0.to_string()).await?;
        let under_way = saved.under_way.clone();
        if let Some((course, stations)) = self.way(&record, planned.through).await? {
            let found = self.relax(&record, &stations, under_way, saved).await?;
            let job = self.job.id;
            let finding =
                self.bench.slice(move || finding(job, &record, (&course, &stations), &found));
            let (kept, told) = finding.await?;
            saved.found.push(kept);
            saved.told.push(told);
        }
        saved.under_way = None;
        saved.n_done += 1;
        let checkpoint = saved.to_bytes();
        let progress = share(saved, 0.0);
        let report = JobReport { progress, checkpoint: Some(&checkpoint), log_line: None };
        self.running.report(report).await
    }

    /// The way of a session out of the journal; `None` if too little was seen along it.
    async fn way(
        &self,
        record: &SessionRecord,
        through: u64,
    ) -> Result<Option<(Course, Stations)>, Stopped> {
        let sensors = session::declaration(&record.declaration)?.sensors;
        let mut reader = CourseReader::new(&sensors)?;
        let mut from_number = 1;
        loop {
            let read = self.service.store.session_batches(record.id, from_number, N_BATCHES_READ);
            let mut batches = read.await?;
            batches.retain(|batch| batch.number <= through);
            let Some(last) = batches.last() else { break };
            from_number = last.number + 1;
            let read = self.bench.slice(move || {
                for batch in batches {
                    let wire =
                        v1::Batch::decode(batch.payload.as_slice()).map_err(Error::internal)?;
                    reader.read(wire, &batch.rejected);
                }
                Ok::<_, Error>(reader)
            });
            reader = read.await??;
        }
        let Some(course) = reader.finish() else { return Ok(None) };
        let stations = stations(&course, self.params.forget_identities);
        let is_enough = N_SIGHTINGS_MIN <= stations.travel.n_sightings();
        Ok(is_enough.then_some((course, stations)))
    }

    /// Relaxes to the end, and keeps every milestone.
    async fn relax(
        &self,
        record: &SessionRecord,
        stations: &Stations,
        under_way: Option<UnderWay>,
        saved: &mut Saved,
    ) -> Result<Outcome, Stopped> {
        let estimates_odometry = self.params.estimate_odometry.unwrap_or(true);
        let (mut n_milestones, state) =
            under_way.map_or((0, None), |saved| (saved.n_milestones, Some(saved.state)));
        let travel = stations.travel.clone();
        let mut pieces = self.bench.pieces(move |teller| {
            relaxed(&travel, estimates_odometry, state.as_deref(), |piece| teller.tell(piece))
        })?;
        let mut reported = Instant::now();
        loop {
            let Piece { share: of_next, milestone } = match pieces.next().await? {
                Next::Piece(piece) => piece,
                Next::Done(Ok(Some(outcome))) => return Ok(outcome),
                Next::Done(Ok(None)) => return Err(Stopped::Left),
                Next::Done(Err(problem)) => {
                    let session = record.id.0.to_string();
                    return Err(Error::CannotRelax { session, problem }.into());
                }
            };
            let progress = share(saved, of_next);
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

    /// Keeps a milestone and tells its figures.
    async fn tell(
        &self,
        progress: f64,
        figures: v1::RelaxFigures,
        saved: &Saved,
    ) -> Result<(), Stopped> {
        let checkpoint = saved.to_bytes();
        let text = text(&figures);
        let figures = job::figures_to_bytes(LineFigures::Relax(figures));
        let log_line = Some(NewLogLine { text: &text, figures: Some(&figures) });
        let report = JobReport { progress, checkpoint: Some(&checkpoint), log_line };
        self.running.report(report).await
    }

    /// Makes what was found a decision.
    async fn record(&self, saved: &mut Saved) -> Result<(), Stopped> {
        saved.is_decided = true;
        let new = NewRelaxation {
            map: self.job.map.clone(),
            job: self.job.id,
            fence: self.running.fence(),
            payload: relaxation::to_bytes(&saved.found),
            checkpoint: saved.to_bytes(),
            time_ns: clock::now_ns(),
        };
        self.service.store.record_relaxation(&new).await?;
        // The journal has grown by this decision.
        self.service.actors.wake(&self.job.map);
        Ok(())
    }
}

/// Whether a session has declared a sensor of that kind.
fn has(record: &SessionRecord, is_meant: impl Fn(&Kind) -> bool) -> Result<bool, Error> {
    let sensors = session::declaration(&record.declaration)?.sensors;
    Ok(sensors.iter().any(|sensor| sensor.kind.as_ref().is_some_and(&is_meant)))
}

/// The share of the whole job, when so much of the next session is relaxed.
fn share(saved: &Saved, of_next: f64) -> f64 {
    let n_sessions = saved.sessions.len().max(1) as f64;
    SHARE_RELAXED * ((saved.n_done as f64 + of_next.clamp(0.0, 1.0)) / n_sessions).min(1.0)
}

fn text(figures: &v1::RelaxFigures) -> String {
    let v1::RelaxFigures { session: _, iteration, stage, log_likelihood } = figures;
    match log_likelihood {
        Some(log_likelihood) => {
            format!("{stage}, iteration {iteration}: log-likelihood {log_likelihood:.3}")
        }
        None => format!("{stage}, iteration {iteration}"),
    }
}
