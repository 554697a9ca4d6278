//! Background jobs: claimed from the database under a lease, one a map at a time, several maps' side
//! by side.

pub(crate) mod closing;
mod drawing;
mod merge;
mod rebuild;
pub(crate) mod relax;
mod running;
mod workbench;

use std::time::Duration;

use meetpoint_proto::v1;
use meetpoint_storage::{ClaimedJob, JobOutcome, MapId};
use tokio::task::JoinSet;

use crate::convert::job::{self, MERGE, REBUILD, RELAX};
use crate::live::Event;
use crate::{clock, error::Error, service::Service};
use running::{LEASE_NS, Running, Stopped};
use workbench::Workbench;

/// How often the table is looked at when no job is announced.
const POLL: Duration = Duration::from_secs(2);

/// What came of a job.
struct Done {
    /// The version that it made.
    version: u64,
    /// What there is to tell beside it.
    result: Option<v1::job::Result>,
}

/// Runs jobs until the service stops: so many at a time as the settings say.
pub(crate) async fn work(service: Service) {
    let mut events = service.live.watch();
    let mut at_work = JoinSet::new();
    while !service.stop.is_cancelled() {
        while at_work.try_join_next().is_some() {}
        let has_room = at_work.len() < service.settings.jobs.n_at_once;
        match if has_room { next(&service).await } else { None } {
            Some(claimed) => {
                let service = service.clone();
                at_work.spawn(async move { run(&service, &claimed).await });
            }
            None => wait(&service, &mut events, &mut at_work).await,
        }
    }
    while at_work.join_next().await.is_some() {}
}

/// The next job to be done, if there is one and the database can be asked.
async fn next(service: &Service) -> Option<ClaimedJob> {
    let claimed = service.store.claim_job(service.actors.owner(), clock::now_ns(), LEASE_NS).await;
    claimed.unwrap_or_else(|error| {
        Error::from(error).log();
        None
    })
}

async fn wait(
    service: &Service,
    events: &mut tokio::sync::broadcast::Receiver<(MapId, Event)>,
    at_work: &mut JoinSet<()>,
) {
    let announced =
        async { while !matches!(events.recv().await, Ok((_, Event::Job(_))) | Err(_)) {} };
    tokio::select! {
        () = announced => {}
        Some(_) = at_work.join_next() => {}
        () = tokio::time::sleep(POLL) => {}
        () = service.stop.cancelled() => {}
    }
}

async fn run(service: &Service, claimed: &ClaimedJob) {
    let running = Running::new(service, claimed);
    let result = tokio::select! {
        result = done(service, claimed, &running) => result,
        stopped = running.keep_alive() => Err(stopped),
    };
    let outcome = match result {
        Ok(Done { version, result }) => {
            JobOutcome::Succeeded { version, result: result.map(job::result_to_bytes) }
        }
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

async fn done(
    service: &Service,
    claimed: &ClaimedJob,
    running: &Running<'_>,
) -> Result<Done, Stopped> {
    let is_in_passing =
        claimed.job.kind == RELAX && job::relax_params(&claimed.job.params)?.going_on;
    let settings = &service.settings.jobs;
    let share = if is_in_passing { settings.closing_cpu_share } else { settings.cpu_share };
    let bench = Workbench::new(service, share, !is_in_passing)?;
    match claimed.job.kind.as_str() {
        REBUILD => rebuild::run(service, &claimed.job, running, &bench).await,
        RELAX => relax::run(service, &claimed.job, running, &bench).await,
        MERGE => merge::run(service, &claimed.job, running, &bench).await,
        other => Err(Error::internal(format!("no job is called `{other}`")).into()),
    }
}
