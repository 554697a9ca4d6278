//! `relax`: where robots had been and where the landmarks are that they saw.
//!
//! Sessions with a laser are relaxed together, by their scans and the named landmarks that they saw; each of
//! the others is relaxed by the landmarks along it, and then all of these are fitted with the landmarks that
//! they share. What is found of a session, the robot's pose at each of its observations and the landmarks,
//! becomes one entry of the journal: from there on it is a decision like those of people, and the map is
//! drawn by it now and whenever it is drawn again. Until that entry is written the job can be cancelled;
//! after it the job only draws.

mod bending;
mod by_landmarks;
mod by_scans;
mod choice;
mod course;
mod driven;
mod finding;
mod fitted_landmarks;
mod fitted_together;
mod grid_landmarks;
pub(super) mod landmark_travel;
mod live_poses;
mod merged_starts;
mod named_sightings;
pub(super) mod named_sums;
mod nameless_sums;
pub(super) mod names;
mod saved;
mod several;
mod solver;
mod spread;
mod stations;
pub(crate) mod tables;
mod way;
pub(crate) mod whereabouts;

use std::time::Duration;

use meetpoint_proto::v1;
use meetpoint_storage::{
    JobRecord, JobReport, MapRecord, NewClosure, NewLogLine, NewRelaxation, SessionRecord,
};
use v1::job_log_line::Figures as LineFigures;

use super::Done;
use super::drawing::drawn_again;
use super::running::{Running, Stopped};
use super::workbench::Workbench;
use crate::convert::job::{self, RELAX};
use crate::convert::relaxation::RelaxedSession;
use crate::convert::{closure, relaxation};
use crate::{clock, error::Error, service::Service};
use choice::choice;
use fitted_together::Past;
use saved::{Method, Saved};
use way::way;

/// Share of the progress that relaxing is; the rest is drawing.
const SHARE_RELAXED: f64 = 0.8;
/// How often the job says how far it is between milestones.
pub(super) const REPORT_EVERY: Duration = Duration::from_secs(1);

/// Relaxes the sessions that were asked for, and draws the map by it.
pub(super) async fn run(
    service: &Service,
    job: &JobRecord,
    running: &Running<'_>,
    bench: &Workbench,
) -> Result<Done, Stopped> {
    let map = service.map_record(&job.map.0).await?;
    let params = job::relax_params(&job.params)?;
    let relaxing = Relaxing { service, job, map: &map, params: &params, running, bench };
    let (mut saved, mut past) = (relaxing.begun().await?, Vec::new());
    while saved.n_done < saved.sessions.len() {
        relaxing.relax_next(&mut saved, &mut past).await?;
    }
    if !saved.is_decided {
        relaxing.fit_together(&mut saved, past).await?;
    }
    if saved.found.is_empty() {
        return Err(Error::NothingToRelax(map.id.0).into());
    }
    running.decide();
    if !saved.is_decided {
        relaxing.record(&mut saved).await?;
    }
    let drawn = drawn_again(service, &map, (running, bench), SHARE_RELAXED).await?;
    let version = service.actors.replace(&map.id, drawn.into_replacement(RELAX)).await?;
    let result = v1::RelaxResult { sessions: saved.told };
    Ok(Done { version, result: Some(v1::job::Result::RelaxResult(result)) })
}

/// A job at work.
struct Relaxing<'a> {
    service: &'a Service,
    job: &'a JobRecord,
    map: &'a MapRecord,
    params: &'a v1::RelaxParams,
    running: &'a Running<'a>,
    bench: &'a Workbench,
}

/// What was found of a session: for the journal, and for those who asked.
type Found = (RelaxedSession, v1::RelaxedSession);

impl Relaxing<'_> {
    /// Where the job goes on, or what it is to do.
    async fn begun(&self) -> Result<Saved, Stopped> {
        match self.job.checkpoint.as_deref().map(Saved::from_bytes) {
            Some(Ok(saved)) => return Ok(saved),
            Some(Err(error)) => error.log(),
            None => {}
        }
        let choice = choice(self.service, &self.map.id, self.params).await?;
        for session in choice.following {
            let session = session.0;
            let text = format!(
                "session {session} was tracked in the imported map and stays in it; named, it is \
                 relaxed without it"
            );
            self.running.progress(0.0, Some(&text)).await?;
        }
        Ok(Saved::first(choice.planned))
    }

    /// Relaxes the next sessions, or goes on with them, and leaves what was found in `saved`.
    async fn relax_next(&self, saved: &mut Saved, past: &mut Vec<Past>) -> Result<(), Stopped> {
        let together = saved.together();
        let n_together = together.len();
        let planned = together[0];
        let found = if planned.method == Method::Scans {
            self.relax_by_scans(saved).await?
        } else {
            let record = self.service.session_record(&planned.session.0.to_string()).await?;
            let keeps_scans = planned.method != Method::Landmarks;
            let limit = keeps_scans.then_some(self.service.settings.jobs.scans_bytes_max);
            let reader = (self.service, self.bench);
            let way = way(reader, &record, planned.through, limit).await?;
            let way = way.map_err(|problem| cannot_relax(&record, problem))?;
            self.relax_by_landmarks(&record, way, saved, past).await?.into_iter().collect()
        };
        for (kept, told) in found {
            saved.found.push(kept);
            saved.told.push(told);
        }
        saved.under_way = None;
        saved.n_done += n_together;
        let checkpoint = saved.to_bytes();
        let progress = share(saved, 0.0);
        let report = JobReport { progress, checkpoint: Some(&checkpoint), log_line: None };
        self.running.report(report).await
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
        let closures = saved.closures.iter().map(closure::to_record);
        let closures = closures.collect::<Result<Vec<NewClosure>, Error>>()?;
        let new = NewRelaxation {
            map: self.job.map.clone(),
            job: self.job.id,
            fence: self.running.fence(),
            payload: relaxation::to_bytes(&saved.found),
            sessions: saved.found.iter().map(|found| found.session).collect(),
            closures,
            checkpoint: saved.to_bytes(),
            time_ns: clock::now_ns(),
        };
        self.service.store.record_relaxation(&new).await?;
        // The journal has grown by this decision.
        self.service.actors.wake(&self.job.map);
        Ok(())
    }
}

fn cannot_relax(record: &SessionRecord, problem: String) -> Stopped {
    Error::CannotRelax { session: record.id.0.to_string(), problem }.into()
}

/// The share of the whole job, when so much of the next sessions is relaxed.
fn share(saved: &Saved, of_next: f64) -> f64 {
    let n_sessions = saved.sessions.len().max(1) as f64;
    let n_next = saved.together().len() as f64;
    let n_done = saved.n_done as f64 + n_next * of_next.clamp(0.0, 1.0);
    SHARE_RELAXED * (n_done / n_sessions).min(1.0)
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
