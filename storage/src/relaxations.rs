//! Relaxations: what jobs found out about the past of sessions, each a decision that the journal
//! keeps. Maps are drawn by them from then on.

use sqlx::SqliteConnection;

use crate::closures::replace_closures;
use crate::job_runs::hold_checkpoint;
use crate::journal::{Kind, record_decision};
use crate::maps::require_map;
use crate::{Error, JobId, JournalSeq, MapId, NewClosure, SessionId, Store};

/// What a job found, to be recorded.
#[derive(Clone, Debug)]
pub struct NewRelaxation {
    /// The map.
    pub map: MapId,
    /// The job.
    pub job: JobId,
    /// The right to write for it.
    pub fence: u64,
    /// What was found, opaque.
    pub payload: Vec<u8>,
    /// The sessions that were relaxed.
    pub sessions: Vec<SessionId>,
    /// The closures that were considered in them and between them, in the order in which they are listed.
    pub closures: Vec<NewClosure>,
    /// Where the job goes on after a crash, opaque: kept if and only if the decision is.
    pub checkpoint: Vec<u8>,
    /// The service's clock, nanoseconds since 1970.
    pub time_ns: i64,
}

/// A relaxation as it is stored.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RelaxationRecord {
    /// Its place in the journal.
    pub seq: JournalSeq,
    /// What was found, opaque.
    pub payload: Vec<u8>,
}

impl Store {
    /// Records what a job found, together with the job's checkpoint and the closures: its place in the journal.
    ///
    /// # Errors
    /// [`Error::NoSuchMap`]; [`Error::LeaseLost`] if the fence is not the one in force or the job
    /// has ended.
    pub async fn record_relaxation(&self, new: &NewRelaxation) -> Result<JournalSeq, Error> {
        let mut write = self.write().await?;
        let result = record(&mut write.connection, new).await;
        write.end(result).await
    }

    /// The relaxations of a map up to `through`, in order.
    ///
    /// # Errors
    /// [`Error::Damaged`] if one does not have its hash any more.
    pub async fn relaxations(
        &self,
        map: &MapId,
        through: JournalSeq,
    ) -> Result<Vec<RelaxationRecord>, Error> {
        let decisions = self.decisions(map, Kind::SessionsRelaxed, through).await?;
        let record = |(seq, payload)| RelaxationRecord { seq, payload };
        Ok(decisions.into_iter().map(record).collect())
    }
}

async fn record(
    connection: &mut SqliteConnection,
    new: &NewRelaxation,
) -> Result<JournalSeq, Error> {
    require_map(&mut *connection, &new.map).await?;
    hold_checkpoint(&mut *connection, new.job, new.fence, &new.checkpoint).await?;
    let considered = (new.sessions.as_slice(), new.closures.as_slice());
    replace_closures(&mut *connection, &new.map, new.job, considered).await?;
    let (kind, time_ns) = (Kind::SessionsRelaxed, new.time_ns);
    record_decision(connection, &new.map, kind, time_ns, &new.payload).await
}
