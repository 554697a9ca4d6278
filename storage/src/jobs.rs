//! Jobs: work in the background, queued, looked at and cancelled.

use sqlx::{SqliteConnection, SqliteExecutor};

use crate::maps::require_map;
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
    /// Higher goes first; among equals the older.
    pub priority: i32,
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
    /// Higher goes first; among equals the older.
    pub priority: i32,
    /// How far it has come.
    pub state: JobState,
    /// Share done, 0 to 1.
    pub progress: f64,
    /// Oldest first: the last [`LOG_LINES_MAX`] lines.
    pub log: Vec<LogLine>,
    /// The version it made; 0 if none.
    pub result_version: u64,
    /// What came of it beside a version, opaque; `None` if nothing did.
    pub result: Option<Vec<u8>>,
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
    /// Where to go on after a crash, opaque; of a job that has succeeded, where it was at last.
    pub checkpoint: Option<Vec<u8>>,
}

/// A line of a job's log.
#[derive(Clone, Debug, PartialEq, Eq, sqlx::FromRow)]
pub struct LogLine {
    /// When it was written, nanoseconds since 1970.
    pub time_ns: i64,
    /// For people.
    pub text: String,
    /// For programs, opaque; `None` if there are none.
    pub figures: Option<Vec<u8>>,
}

/// Lines of a job's log that are kept.
pub const LOG_LINES_MAX: u32 = 1000;

#[derive(sqlx::FromRow)]
pub(crate) struct Row {
    pub(crate) id: JobId,
    map_id: MapId,
    kind: String,
    params: Vec<u8>,
    priority: i32,
    state: JobState,
    progress: f64,
    #[sqlx(try_from = "i64")]
    result_version: u64,
    result: Option<Vec<u8>>,
    error_code: Option<String>,
    error_message: Option<String>,
    create_time_ns: i64,
    update_time_ns: i64,
    start_time_ns: Option<i64>,
    cancel_requested: bool,
    checkpoint: Option<Vec<u8>>,
    #[sqlx(try_from = "i64")]
    pub(crate) fence: u64,
}

impl Row {
    pub(crate) fn into_record(self, log: Vec<LogLine>) -> JobRecord {
        JobRecord {
            id: self.id,
            map: self.map_id,
            kind: self.kind,
            params: self.params,
            priority: self.priority,
            state: self.state,
            progress: self.progress,
            log,
            result_version: self.result_version,
            result: self.result,
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
        let result = insert_job(&mut write.connection, new).await;
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

    /// At most `limit` jobs with their logs and without their checkpoints, newest first, those created before `before`. None if
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
            "select id, map_id, kind, params, priority, state, progress, result_version, result,
                 error_code, error_message, create_time_ns, update_time_ns, start_time_ns,
                 cancel_requested, null as checkpoint, fence
             from jobs
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

/// The job inside a transaction.
///
/// # Errors
/// [`Error::NoSuchJob`].
pub(crate) async fn require_job(
    connection: &mut SqliteConnection,
    id: JobId,
) -> Result<JobRecord, Error> {
    find(connection, id).await?.ok_or(Error::NoSuchJob(id))
}

/// The lines of a job's log, oldest first.
pub(crate) async fn log(
    executor: impl SqliteExecutor<'_>,
    id: JobId,
) -> Result<Vec<LogLine>, Error> {
    let lines = sqlx::query_as(
        "select time_ns, text, figures from job_log where job_id = $1 order by position",
    )
    .bind(id)
    .fetch_all(executor)
    .await?;
    Ok(lines)
}

/// Queues a job inside a transaction.
///
/// # Errors
/// [`Error::NoSuchMap`].
pub(crate) async fn insert_job(
    connection: &mut SqliteConnection,
    new: &NewJob,
) -> Result<JobRecord, Error> {
    require_map(&mut *connection, &new.map).await?;
    sqlx::query(
        "insert into jobs (id, map_id, kind, params, priority, state, create_time_ns, update_time_ns)
         values ($1, $2, $3, $4, $5, $6, $7, $7)",
    )
    .bind(new.id)
    .bind(&new.map)
    .bind(&new.kind)
    .bind(new.params.as_slice())
    .bind(new.priority)
    .bind(JobState::Queued)
    .bind(new.time_ns)
    .execute(&mut *connection)
    .await?;
    require_job(connection, new.id).await
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
