//! Jobs: work in the background, claimed by one process at a time and continued after a crash.

use sqlx::{SqliteConnection, SqliteExecutor};
use uuid::Uuid;

use crate::maps::require_map;
use crate::number::to_sql;
use crate::{Error, JobId, MapId, Store};

/// A job to be done.
#[derive(Clone, Debug)]
pub struct NewJob {
    /// Its id.
    pub id: JobId,
    /// The map it is about.
    pub map: MapId,
    /// What it does, for example `rebuild`.
    pub kind: String,
    /// How, opaque.
    pub params: Vec<u8>,
    /// The service's clock, nanoseconds since 1970.
    pub time_ns: i64,
}

/// How far a job has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, sqlx::Type)]
#[repr(i64)]
pub enum JobState {
    /// Nobody has begun.
    Queued = 1,
    /// Somebody has begun.
    Running = 2,
    /// Done.
    Succeeded = 3,
    /// Not done, and never will be.
    Failed = 4,
    /// Stopped because somebody asked for it.
    Cancelled = 5,
}

/// A job as it is stored.
#[derive(Clone, Debug, PartialEq)]
pub struct JobRecord {
    /// Its id.
    pub id: JobId,
    /// The map it is about.
    pub map: MapId,
    /// What it does.
    pub kind: String,
    /// How, opaque.
    pub params: Vec<u8>,
    /// How far it has come.
    pub state: JobState,
    /// Share done, 0 to 1.
    pub progress: f64,
    /// When (nanoseconds since 1970) and what, oldest first: the last [`LOG_LINES_MAX`] lines.
    pub log: Vec<(i64, String)>,
    /// The version it made; 0 if none.
    pub result_version: u64,
    /// Why it failed: a code for programs and a message for people.
    pub error: Option<(String, String)>,
    /// When it was asked for, nanoseconds since 1970.
    pub create_time_ns: i64,
    /// When its row changed last, nanoseconds since 1970.
    pub update_time_ns: i64,
    /// When it was first begun, nanoseconds since 1970.
    pub start_time_ns: Option<i64>,
    /// Whether somebody asked it to stop.
    pub cancel_requested: bool,
    /// Where to go on after a crash, opaque.
    pub checkpoint: Option<Vec<u8>>,
}

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
    pub log_line: Option<&'a str>,
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

/// Lines of a job's log that are kept.
pub const LOG_LINES_MAX: u32 = 1000;

#[derive(sqlx::FromRow)]
struct Row {
    id: JobId,
    map_id: MapId,
    kind: String,
    params: Vec<u8>,
    state: JobState,
    progress: f64,
    #[sqlx(try_from = "i64")]
    result_version: u64,
    error_code: Option<String>,
    error_message: Option<String>,
    create_time_ns: i64,
    update_time_ns: i64,
    start_time_ns: Option<i64>,
    cancel_requested: bool,
    checkpoint: Option<Vec<u8>>,
    #[sqlx(try_from = "i64")]
    fence: u64,
}

impl Row {
    fn into_record(self, log: Vec<(i64, String)>) -> JobRecord {
        JobRecord {
            id: self.id,
            map: self.map_id,
            kind: self.kind,
            params: self.params,
            state: self.state,
            progress: self.progress,
            log,
            result_version: self.result_version,
            error: self.error_code.zip(self.error_message),
            create_time_ns: self.create_time_ns,
            update_time_ns: self.update_time_ns,
            start_time_ns: self.start_time_ns,
            cancel_requested: self.cancel_requested,
            checkpoint: self.checkpoint,
        }
    }
}

impl Store {
    /// Queues a job.
    ///
    /// # Errors
    /// [`Error::NoSuchMap`].
    pub async fn create_job(&self, new: &NewJob) -> Result<JobRecord, Error> {
        let mut write = self.write().await?;
        let result = insert(&mut write.connection, new).await;
        write.end(result).await
    }

    /// One job with its log, or `None`.
    ///
    /// # Errors
    /// Those of reading.
    pub async fn job(&self, id: JobId) -> Result<Option<JobRecord>, Error> {
        let mut connection = self.readers().acquire().await?;
        find(&mut connection, id).await
    }

    /// At most `limit` jobs with their logs, newest first, those created before `before`. None if
    /// there is no job `before`.
    ///
    /// # Errors
    /// Those of reading.
    pub async fn jobs(
        &self,
        map: Option<&MapId>,
        before: Option<JobId>,
        limit: u32,
    ) -> Result<Vec<JobRecord>, Error> {
        let rows: Vec<Row> = sqlx::query_as(
            "select * from jobs
             where ($1 is null or map_id = $1)
                 and ($2 is null or position < (select position from jobs where id = $2))
             order by position desc limit $3",
        )
        .bind(map)
        .bind(before)
        .bind(limit)
        .fetch_all(self.readers())
        .await?;
        let mut jobs = Vec::with_capacity(rows.len());
        for row in rows {
            let log = log(self.readers(), row.id).await?;
            jobs.push(row.into_record(log));
        }
        Ok(jobs)
    }

    /// Takes the next job that nobody does until `now_ns + ttl_ns`, both in nanoseconds: queued,
    /// or running with a lease that ran out. A map's jobs are done one after the other, in the
    /// order of their creation. `None` if there is nothing to do.
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

    /// Cancels a queued job, asks a running one to stop, and leaves an ended one as it is.
    ///
    /// # Errors
    /// [`Error::NoSuchJob`].
    pub async fn cancel_job(&self, id: JobId, now_ns: i64) -> Result<JobRecord, Error> {
        let mut write = self.write().await?;
        let result = cancel(&mut write.connection, id, now_ns).await;
        write.end(result).await
    }
}

async fn find(connection: &mut SqliteConnection, id: JobId) -> Result<Option<JobRecord>, Error> {
    let row: Option<Row> = sqlx::query_as("select * from jobs where id = $1")
        .bind(id)
        .fetch_optional(&mut *connection)
        .await?;
    let Some(row) = row else { return Ok(None) };
    let log = log(connection, id).await?;
    Ok(Some(row.into_record(log)))
}

async fn require_job(connection: &mut SqliteConnection, id: JobId) -> Result<JobRecord, Error> {
    find(connection, id).await?.ok_or(Error::NoSuchJob(id))
}

async fn log(executor: impl SqliteExecutor<'_>, id: JobId) -> Result<Vec<(i64, String)>, Error> {
    let lines =
        sqlx::query_as("select time_ns, text from job_log where job_id = $1 order by position")
            .bind(id)
            .fetch_all(executor)
            .await?;
    Ok(lines)
}

async fn insert(connection: &mut SqliteConnection, new: &NewJob) -> Result<JobRecord, Error> {
    require_map(&mut *connection, &new.map).await?;
    sqlx::query(
        "insert into jobs (id, map_id, kind, params, state, create_time_ns, update_time_ns)
         values ($1, $2, $3, $4, $5, $6, $6)",
    )
    .bind(new.id)
    .bind(&new.map)
    .bind(&new.kind)
    .bind(new.params.as_slice())
    .bind(JobState::Queued)
    .bind(new.time_ns)
    .execute(&mut *connection)
    .await?;
    require_job(connection, new.id).await
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
                     select 1 from jobs as earlier
                     where earlier.map_id = first.map_id and earlier.state in (1, 2)
                         and earlier.position < first.position
                 )
             order by first.position limit 1
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
    .bind(report.progress.max(0.0).min(1.0))
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

async fn push_log_line(
    connection: &mut SqliteConnection,
    id: JobId,
    time_ns: i64,
    line: &str,
) -> Result<(), Error> {
    sqlx::query("insert into job_log (job_id, time_ns, text) values ($1, $2, $3)")
        .bind(id)
        .bind(time_ns)
        .bind(line)
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
        JobOutcome::Succeeded { version } => (JobState::Succeeded, *version, None),
        JobOutcome::Failed { code, message } => (JobState::Failed, 0, Some((code, message))),
        JobOutcome::Cancelled => (JobState::Cancelled, 0, None),
    };
    let done = sqlx::query(
        "update jobs set state = $1, result_version = $2, error_code = $3, error_message = $4,
             update_time_ns = $5, owner = null,
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
    .execute(&mut *connection)
    .await?;
    if done.rows_affected() == 0 {
        return Err(Error::LeaseLost);
    }
    require_job(connection, id).await
}

async fn cancel(
    connection: &mut SqliteConnection,
    id: JobId,
    now_ns: i64,
) -> Result<JobRecord, Error> {
    sqlx::query(
        "update jobs set cancel_requested = 1, update_time_ns = $2,
             state = case when state = 1 then 5 else state end
         where id = $1 and state in (1, 2)",
    )
    .bind(id)
    .bind(now_ns)
    .execute(&mut *connection)
    .await?;
    require_job(connection, id).await
}
