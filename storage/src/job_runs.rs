//! Running a job: claimed by one process at a time, held by heartbeats, continued after a crash.

use sqlx::SqliteConnection;
use uuid::Uuid;

use crate::jobs::{JobRecord, JobState, LOG_LINES_MAX, Row, log, require_job};
use crate::number::to_sql;
use crate::{Error, JobId, Store};

/// A job that the claimer is to do now.
#[derive(Clone, Debug, PartialEq)]
pub struct ClaimedJob {
    /// The job, with the checkpoint of whoever had it before.
    pub job: JobRecord,
    /// What the claimer's writes must carry.
    pub fence: u64,
}

/// What a running job reports.
#[derive(Clone, Copy, Debug)]
pub struct JobReport<'a> {
    /// Share done; cut to 0 to 1, and NaN counts as 0.
    pub progress: f64,
    /// Where to go on after a crash; `None` leaves the last one.
    pub checkpoint: Option<&'a [u8]>,
    /// A line for the log.
    pub log_line: Option<NewLogLine<'a>>,
}

/// A line to be written to a job's log.
#[derive(Clone, Copy, Debug)]
pub struct NewLogLine<'a> {
    /// For people.
    pub text: &'a str,
    /// For programs, opaque; `None` if there are none.
    pub figures: Option<&'a [u8]>,
}

/// What a running job is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JobHeartbeat {
    /// Whether to stop.
    pub cancel_requested: bool,
}

/// How a job ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum JobOutcome {
    /// Done.
    Succeeded {
        /// The version it made; 0 if none.
        version: u64,
        /// What came of it beside a version, opaque.
        result: Option<Vec<u8>>,
    },
    /// Not done.
    Failed {
        /// Stable, for programs.
        code: String,
        /// For people.
        message: String,
    },
    /// Stopped because somebody asked for it.
    Cancelled,
}

impl Store {
    /// Takes the next job that nobody does until `now_ns + ttl_ns`, both in nanoseconds: queued,
    /// or running with a lease that ran out. Higher priority goes first, then age. A map's jobs
    /// are done one after the other: one that was begun is ended before another one begins.
    /// `None` if there is nothing to do.
    ///
    /// # Errors
    /// Those of writing.
    pub async fn claim_job(
        &self,
        owner: Uuid,
        now_ns: i64,
        ttl_ns: i64,
    ) -> Result<Option<ClaimedJob>, Error> {
        let mut write = self.write().await?;
        let result = claim(&mut write.connection, owner, now_ns, ttl_ns).await;
        write.end(result).await
    }

    /// Holds a job until `now_ns + ttl_ns`, in nanoseconds, and keeps what it reports.
    ///
    /// # Errors
    /// [`Error::LeaseLost`] if the fence is not the one in force or the job has ended.
    pub async fn heartbeat_job(
        &self,
        id: JobId,
        fence: u64,
        now_ns: i64,
        ttl_ns: i64,
        report: JobReport<'_>,
    ) -> Result<JobHeartbeat, Error> {
        let mut write = self.write().await?;
        let result = heartbeat(&mut write.connection, id, fence, [now_ns, ttl_ns], report).await;
        write.end(result).await
    }

    /// Ends a job.
    ///
    /// # Errors
    /// [`Error::LeaseLost`] if the fence is not the one in force or the job has ended.
    pub async fn finish_job(
        &self,
        id: JobId,
        fence: u64,
        now_ns: i64,
        outcome: &JobOutcome,
    ) -> Result<JobRecord, Error> {
        let mut write = self.write().await?;
        let result = finish(&mut write.connection, id, fence, now_ns, outcome).await;
        write.end(result).await
    }
}

async fn claim(
    connection: &mut SqliteConnection,
    owner: Uuid,
    now_ns: i64,
    ttl_ns: i64,
) -> Result<Option<ClaimedJob>, Error> {
    let row: Option<Row> = sqlx::query_as(
        "update jobs set state = 2, owner = $1, fence = fence + 1, lease_expire_time_ns = $3,
             start_time_ns = coalesce(start_time_ns, $2), update_time_ns = $2
         where id = (
             select first.id from jobs as first
             where first.state in (1, 2)
                 and (first.state = 1 or first.lease_expire_time_ns <= $2)
                 and not exists (
                     select 1 from jobs as other
                     where other.map_id = first.map_id and other.state in (1, 2)
                         and (other.state, other.priority, -other.position)
                             > (first.state, first.priority, -first.position)
                 )
             order by first.priority desc, first.position limit 1
         )
         returning *",
    )
    .bind(owner)
    .bind(now_ns)
    .bind(now_ns.saturating_add(ttl_ns))
    .fetch_optional(&mut *connection)
    .await?;
    let Some(row) = row else { return Ok(None) };
    let (fence, log) = (row.fence, log(connection, row.id).await?);
    Ok(Some(ClaimedJob { job: row.into_record(log), fence }))
}

async fn heartbeat(
    connection: &mut SqliteConnection,
    id: JobId,
    fence: u64,
    [now_ns, ttl_ns]: [i64; 2],
    report: JobReport<'_>,
) -> Result<JobHeartbeat, Error> {
    let cancel_requested: Option<bool> = sqlx::query_scalar(
        "update jobs set lease_expire_time_ns = $1, update_time_ns = $2, progress = $3,
             checkpoint = coalesce($4, checkpoint)
         where id = $5 and fence = $6 and state = 2
         returning cancel_requested",
    )
    .bind(now_ns.saturating_add(ttl_ns))
    .bind(now_ns)
    .bind(share(report.progress))
    .bind(report.checkpoint)
    .bind(id)
    .bind(to_sql(fence))
    .fetch_optional(&mut *connection)
    .await?;
    let cancel_requested = cancel_requested.ok_or(Error::LeaseLost)?;
    if let Some(line) = report.log_line {
        push_log_line(connection, id, now_ns, line).await?;
    }
    Ok(JobHeartbeat { cancel_requested })
}

/// Keeps a job's checkpoint inside a transaction that holds more.
///
/// # Errors
/// [`Error::LeaseLost`].
pub(crate) async fn hold_checkpoint(
    connection: &mut SqliteConnection,
    id: JobId,
    fence: u64,
    checkpoint: &[u8],
) -> Result<(), Error> {
    let held =
        sqlx::query("update jobs set checkpoint = $1 where id = $2 and fence = $3 and state = 2")
            .bind(checkpoint)
            .bind(id)
            .bind(to_sql(fence))
            .execute(connection)
            .await?;
    if held.rows_affected() == 0 { Err(Error::LeaseLost) } else { Ok(()) }
}

async fn push_log_line(
    connection: &mut SqliteConnection,
    id: JobId,
    time_ns: i64,
    line: NewLogLine<'_>,
) -> Result<(), Error> {
    sqlx::query("insert into job_log (job_id, time_ns, text, figures) values ($1, $2, $3, $4)")
        .bind(id)
        .bind(time_ns)
        .bind(line.text)
        .bind(line.figures)
        .execute(&mut *connection)
        .await?;
    sqlx::query(
        "delete from job_log where job_id = $1 and position <= (
             select position from job_log where job_id = $1
             order by position desc limit 1 offset $2
         )",
    )
    .bind(id)
    .bind(LOG_LINES_MAX)
    .execute(connection)
    .await?;
    Ok(())
}

async fn finish(
    connection: &mut SqliteConnection,
    id: JobId,
    fence: u64,
    now_ns: i64,
    outcome: &JobOutcome,
) -> Result<JobRecord, Error> {
    let (state, version, error) = match outcome {
        JobOutcome::Succeeded { version, .. } => (JobState::Succeeded, *version, None),
        JobOutcome::Failed { code, message } => (JobState::Failed, 0, Some((code, message))),
        JobOutcome::Cancelled => (JobState::Cancelled, 0, None),
    };
    let result = match outcome {
        JobOutcome::Succeeded { result, .. } => result.as_deref(),
        JobOutcome::Failed { .. } | JobOutcome::Cancelled => None,
    };
    let done = sqlx::query(
        "update jobs set state = $1, result_version = $2, error_code = $3, error_message = $4,
             update_time_ns = $5, owner = null, result = $8,
             checkpoint = case when $1 = 3 then checkpoint else null end,
             progress = case when $1 = 3 then 1.0 else progress end
         where id = $6 and fence = $7 and state = 2",
    )
    .bind(state)
    .bind(to_sql(version))
    .bind(error.map(|(code, _)| code))
    .bind(error.map(|(_, message)| message))
    .bind(now_ns)
    .bind(id)
    .bind(to_sql(fence))
    .bind(result)
    .execute(&mut *connection)
    .await?;
    if done.rows_affected() == 0 {
        return Err(Error::LeaseLost);
    }
    require_job(connection, id).await
}

/// A share of 0 to 1. NaN is no progress.
fn share(progress: f64) -> f64 {
    if progress.is_nan() { 0.0 } else { progress.clamp(0.0, 1.0) }
}
