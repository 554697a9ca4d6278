//! Background jobs: claimed from the database under a lease, one a map at a time.

mod rebuild;

use std::time::Duration;

use meetpoint_storage::{ClaimedJob, JobOutcome, JobReport, MapId};

use crate::convert::job::REBUILD;
use crate::live::Event;
use crate::{clock, error::Error, service::Service};

/// How often the table is looked at when no job is announced.
const POLL: Duration = Duration::from_secs(2);
/// A job whose process says nothing for so long is taken over.
const LEASE: Duration = Duration::from_secs(30);

/// What a job may do while it runs: say how far it is, and ask whether to stop.
pub(crate) struct Running<'a> {
    service: &'a Service,
    claimed: &'a ClaimedJob,
}

/// Why a job ended without a result.
pub(crate) enum Stopped {
    /// Somebody asked for it.
    Cancelled,
    /// The process goes down, or another one has taken the job over: it stays as it is.
    Left,
    /// It could not be done.
    Failed(Error),
}

impl From<Error> for Stopped {
    fn from(error: Error) -> Self {
        Self::Failed(error)
    }
}

/// Runs jobs, one after the other, until the service stops.
pub(crate) async fn work(service: Service) {
    let mut events = service.live.watch();
    while !service.stop.is_cancelled() {
        let now_ns = clock::now_ns();
        match service.store.claim_job(service.actors.owner(), now_ns, lease_ns()).await {
            Ok(Some(claimed)) => run(&service, &claimed).await,
            Ok(None) => wait(&service, &mut events).await,
            Err(error) => {
                Error::from(error).log();
                wait(&service, &mut events).await;
            }
        }
    }
}

async fn wait(service: &Service, events: &mut tokio::sync::broadcast::Receiver<(MapId, Event)>) {
    let announced =
        async { while !matches!(events.recv().await, Ok((_, Event::Job(_))) | Err(_)) {} };
    tokio::select! {
        () = announced => {}
        () = tokio::time::sleep(POLL) => {}
        () = service.stop.cancelled() => {}
    }
}

async fn run(service: &Service, claimed: &ClaimedJob) {
    let running = Running { service, claimed };
    let result = match claimed.job.kind.as_str() {
        REBUILD => rebuild::run(service, &claimed.job, &running).await,
        other => Err(Error::internal(format!("no job is called `{other}`")).into()),
    };
    let outcome = match result {
        Ok(version) => JobOutcome::Succeeded { version },
        Err(Stopped::Cancelled) => JobOutcome::Cancelled,
        Err(Stopped::Left) => return,
        Err(Stopped::Failed(error)) => {
            error.log();
            JobOutcome::Failed { code: error.reason().to_owned(), message: error.to_string() }
        }
    };
    let (id, fence) = (claimed.job.id, claimed.fence);
    if let Err(error) = service.store.finish_job(id, fence, clock::now_ns(), &outcome).await {
        Error::from(error).log();
    }
    service.live.announce(claimed.job.map.clone(), Event::Job(id));
}

impl Running<'_> {
    /// Tells how far the job is, from 0 to 1, with a line for its log if there is news.
    pub(crate) async fn progress(&self, share: f64, line: Option<&str>) -> Result<(), Stopped> {
        if self.service.stop.is_cancelled() {
            return Err(Stopped::Left);
        }
        let (id, fence) = (self.claimed.job.id, self.claimed.fence);
        let now_ns = clock::now_ns();
        let report = JobReport { progress: share, checkpoint: None, log_line: line };
        let beat = self.service.store.heartbeat_job(id, fence, now_ns, lease_ns(), report);
        let cancelled = match beat.await {
            Ok(beat) => beat.cancel_requested,
            Err(meetpoint_storage::Error::LeaseLost) => return Err(Stopped::Left),
            Err(error) => return Err(Error::from(error).into()),
        };
        self.service.live.announce(self.claimed.job.map.clone(), Event::Job(id));
        if cancelled { Err(Stopped::Cancelled) } else { Ok(()) }
    }
}

fn lease_ns() -> i64 {
    i64::try_from(LEASE.as_nanos()).unwrap_or(i64::MAX)
}
