//! A job while it runs: it says how far it is, and asks whether to go on.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use meetpoint_storage::{ClaimedJob, JobReport, NewLogLine};

use crate::live::Event;
use crate::{clock, error::Error, service::Service};

/// A job whose process says nothing for so long is taken over: half a minute.
pub(super) const LEASE_NS: i64 = 30_000_000_000;
/// How often a job is held on to while it computes, and asks whether to stop.
const KEEP_ALIVE: Duration = Duration::from_secs(3);

/// A job that this process holds.
pub(super) struct Running<'a> {
    service: &'a Service,
    claimed: &'a ClaimedJob,
    /// Bits of the share done that was told last.
    share: AtomicU64,
    /// Whether it is too late to cancel.
    is_decided: AtomicBool,
}

/// Why a job ended without a result.
pub(super) enum Stopped {
    /// Somebody asked for it.
    Cancelled,
    /// The process goes down, or another one has taken the job over: it stays as it is.
    Left,
    /// It could not be done.
    Failed(Error),
}

impl From<Error> for Stopped {
    fn from(error: Error) -> Self {
        match error {
            Error::Stopping => Self::Left,
            other => Self::Failed(other),
        }
    }
}

impl From<meetpoint_storage::Error> for Stopped {
    fn from(error: meetpoint_storage::Error) -> Self {
        match error {
            meetpoint_storage::Error::LeaseLost => Self::Left,
            other => Error::from(other).into(),
        }
    }
}

impl<'a> Running<'a> {
    pub(super) fn new(service: &'a Service, claimed: &'a ClaimedJob) -> Self {
        let share = AtomicU64::new(claimed.job.progress.to_bits());
        Self { service, claimed, share, is_decided: AtomicBool::new(false) }
    }

    /// The fence that its writes carry.
    pub(super) fn fence(&self) -> u64 {
        self.claimed.fence
    }

    /// From here on the job is brought to its end, whoever asks it to stop.
    pub(super) fn decide(&self) {
        self.is_decided.store(true, Ordering::Relaxed);
    }

    /// Tells how far the job is, from 0 to 1, with a line for its log if there is news.
    pub(super) async fn progress(&self, share: f64, text: Option<&str>) -> Result<(), Stopped> {
        let log_line = text.map(|text| NewLogLine { text, figures: None });
        self.report(JobReport { progress: share, checkpoint: None, log_line }).await
    }

    /// Tells how far the job is, and where it goes on after a crash.
    pub(super) async fn report(&self, report: JobReport<'_>) -> Result<(), Stopped> {
        self.share.store(report.progress.to_bits(), Ordering::Relaxed);
        self.beat(report).await?;
        self.service.live.announce(self.claimed.job.map.clone(), Event::Job(self.claimed.job.id));
        Ok(())
    }

    /// Holds on to the job until it is to stop, or another process has it.
    pub(super) async fn keep_alive(&self) -> Stopped {
        loop {
            tokio::select! {
                () = tokio::time::sleep(KEEP_ALIVE) => {}
                () = self.service.stop.cancelled() => return Stopped::Left,
            }
            let progress = f64::from_bits(self.share.load(Ordering::Relaxed));
            let report = JobReport { progress, checkpoint: None, log_line: None };
            match self.beat(report).await {
                Ok(()) => {}
                // A database that cannot be written now may be in time.
                Err(Stopped::Failed(error)) => error.log(),
                Err(stopped) => return stopped,
            }
        }
    }

    async fn beat(&self, report: JobReport<'_>) -> Result<(), Stopped> {
        if self.service.stop.is_cancelled() {
            return Err(Stopped::Left);
        }
        let (id, fence) = (self.claimed.job.id, self.claimed.fence);
        let beat = self.service.store.heartbeat_job(id, fence, clock::now_ns(), LEASE_NS, report);
        let is_cancelled = beat.await?.cancel_requested;
        if is_cancelled && !self.is_decided.load(Ordering::Relaxed) {
            return Err(Stopped::Cancelled);
        }
        Ok(())
    }
}
