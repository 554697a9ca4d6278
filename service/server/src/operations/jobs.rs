//! Jobs: start, look at, list, cancel, watch.

use meetpoint_proto::v1;
use meetpoint_storage::{JobId, JobRecord, MapId, NewJob};
use tokio::sync::broadcast;
use tokio::sync::broadcast::error::RecvError;
use uuid::Uuid;

use super::maps::shortened;
use super::page;
use crate::convert::job::{self, Asked};
use crate::live::Event;
use crate::{clock, error::Error, service::Service};

impl Service {
    /// Starts a job.
    pub(crate) async fn create_job(
        &self,
        request: v1::CreateJobRequest,
    ) -> Result<v1::CreateJobResponse, Error> {
        let v1::CreateJobRequest { map, kind, priority, params } = request;
        let asked = job::asked(kind, params)?;
        let priority = job::priority(priority)?;
        let map = self.map_record(&map).await?.id;
        match &asked {
            Asked::Rebuild => {}
            Asked::Relax(params) => {
                for (index, session) in params.sessions.iter().enumerate() {
                    let field = format!("relax.sessions[{index}]");
                    self.require_session_of(&map, session, &field, true).await?;
                }
            }
            Asked::Merge(params) => {
                for (index, session) in params.sessions.iter().enumerate() {
                    let field = format!("merge.sessions[{index}]");
                    self.require_session_of(&map, session, &field, false).await?;
                }
            }
        }
        let new = NewJob {
            id: JobId(Uuid::now_v7()),
            map: map.clone(),
            kind: asked.kind().to_owned(),
            params: asked.params(),
            priority,
            time_ns: clock::now_ns(),
        };
        let record = self.store.create_job(&new).await?;
        self.live.announce(map, Event::Job(record.id));
        Ok(v1::CreateJobResponse { job: Some(job::to_wire(record)) })
    }

    /// One job.
    pub(crate) async fn get_job(
        &self,
        request: v1::GetJobRequest,
    ) -> Result<v1::GetJobResponse, Error> {
        let v1::GetJobRequest { job: id } = request;
        let record = self.job_record(&id).await?;
        Ok(v1::GetJobResponse { job: Some(job::to_wire(record)) })
    }

    /// Jobs, newest first.
    pub(crate) async fn list_jobs(
        &self,
        request: v1::ListJobsRequest,
    ) -> Result<v1::ListJobsResponse, Error> {
        let v1::ListJobsRequest { map, page_size, page_token } = request;
        let map = (!map.is_empty()).then_some(MapId(map));
        let size = page::size(page_size, &self.settings.limits);
        let before = page::after(&page_token, |token| job::id(token).ok())?;
        let records = self.store.jobs(map.as_ref(), before, size).await?;
        let next_page_token = page::token(&records, size, |record| record.id.0.to_string());
        Ok(v1::ListJobsResponse {
            jobs: records.into_iter().map(job::to_wire).collect(),
            next_page_token,
        })
    }

    /// Asks a job to stop.
    pub(crate) async fn cancel_job(
        &self,
        request: v1::CancelJobRequest,
    ) -> Result<v1::CancelJobResponse, Error> {
        let v1::CancelJobRequest { job: id } = request;
        let id = self.job_record(&id).await?.id;
        let record = self.store.cancel_job(id, clock::now_ns()).await?;
        self.live.announce(record.map.clone(), Event::Job(record.id));
        Ok(v1::CancelJobResponse { job: Some(job::to_wire(record)) })
    }

    /// Follows a job from now to its end.
    pub(crate) async fn watch_job(&self, id: &str) -> Result<JobChanges, Error> {
        let events = self.live.watch();
        let id = self.job_record(id).await?.id;
        Ok(JobChanges { service: self.clone(), id, events, is_first: true, is_over: false })
    }

    /// A session that is to be relaxed is one of the map and has a place in it; one that is to be merged has
    /// none.
    async fn require_session_of(
        &self,
        map: &MapId,
        id: &str,
        field: &str,
        is_to_be_placed: bool,
    ) -> Result<(), Error> {
        let record = self.session_record(id).await?;
        if record.map != *map {
            let problem = format!("a session of map `{}`", record.map.0);
            return Err(Error::field(field, problem));
        }
        match (record.map_from_session.is_some(), is_to_be_placed) {
            (false, true) => Err(Error::SessionNotPlaced(shortened(id))),
            (true, false) => Err(Error::SessionPlaced(shortened(id))),
            (true, true) | (false, false) => Ok(()),
        }
    }

    pub(super) async fn job_record(&self, id: &str) -> Result<JobRecord, Error> {
        let record = self.store.job(job::id(id)?).await?;
        record.ok_or_else(|| Error::NoSuchJob(shortened(id)))
    }
}

/// The states of a job, one after the other.
pub(crate) struct JobChanges {
    service: Service,
    id: JobId,
    events: broadcast::Receiver<(MapId, Event)>,
    is_first: bool,
    is_over: bool,
}

impl JobChanges {
    /// The job now, then at every change; `None` after its end.
    pub(crate) async fn next(&mut self) -> Option<Result<v1::Job, Error>> {
        if self.is_over {
            return None;
        }
        while !std::mem::take(&mut self.is_first) {
            match self.events.recv().await {
                Ok((_, Event::Job(id))) if id == self.id => break,
                // Left out events may have been ours: look.
                Err(RecvError::Lagged(_)) => break,
                Ok(_) => {}
                Err(RecvError::Closed) => return None,
            }
        }
        let found = self.service.job_record(&self.id.0.to_string()).await.map(job::to_wire);
        self.is_over = found.as_ref().map_or(true, |job| job.done);
        Some(found)
    }
}
