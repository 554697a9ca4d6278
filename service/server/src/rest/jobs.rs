//! `/v1/jobs`.

use axum::extract::State;
use axum::http::StatusCode;
use axum::response::Response;
use meetpoint_proto::v1;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::Rest;
use super::idempotency::{Creation, IdempotencyKey, Reply, once};
use super::integer::{Signed64, Unsigned64};
use super::merge_job::{MergeParams, MergeResult};
use super::openapi::{CreationProblems, ListProblems, ReadProblems};
use super::problem::Refusal;
use super::relaxation::{RelaxFigures, RelaxParams, RelaxResult};
use super::reply::{filled, ok};
use super::request::{JsonBody, Path, Query, only_one};
use super::sse::Watcher;
use crate::error::Error;

const CREATION: Creation =
    Creation { route: "POST /v1/jobs", collection: Some("/v1/jobs"), id: "/id" };

/// Work in the background.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Job {
    /// A version 7 UUID.
    #[schema(example = "0199d3a6-6ac5-7c4e-9d51-2d9a3f1f3c11")]
    id: String,
    /// Id of the map.
    map: String,
    kind: JobKind,
    state: JobState,
    /// Share done, 0 to 1.
    #[schema(minimum = 0, maximum = 1, example = 0.5)]
    progress: f64,
    /// Lines for people and programs, oldest first, the last 1000.
    log: Vec<JobLogLine>,
    /// True in the three end states.
    done: bool,
    /// The version that it made; absent if none.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    result_version: Option<Unsigned64>,
    /// Why it failed; absent otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    error: Option<JobError>,
    /// By the service's clock, nanoseconds since 1970.
    create_time_ns: Signed64,
    /// By the service's clock, nanoseconds since 1970.
    update_time_ns: Signed64,
    /// The end as estimated from the progress so far; absent if unknown.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    estimated_end_time_ns: Option<Signed64>,
    /// True once cancelling was asked for. A job that has come to its end does not heed it any more.
    cancel_requested: bool,
    /// Higher goes first.
    priority: i32,
    /// How a relax job was to be done; absent from others.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    relax: Option<RelaxParams>,
    /// What came of a relax job; absent until it has succeeded.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    relax_result: Option<RelaxResult>,
    /// How a merge job was to be done; absent from others.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    merge: Option<MergeParams>,
    /// What came of a merge job; absent until it has succeeded.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    merge_result: Option<MergeResult>,
}

impl From<v1::Job> for Job {
    fn from(wire: v1::Job) -> Self {
        let v1::Job {
            id,
            map,
            kind,
            state,
            progress,
            log,
            done,
            result_version,
            error,
            create_time_ns,
            update_time_ns,
            estimated_end_time_ns,
            cancel_requested,
            priority,
            params,
            result,
        } = wire;
        let (relax, merge) = match params {
            Some(v1::job::Params::Relax(params)) => (Some(params.into()), None),
            Some(v1::job::Params::Merge(params)) => (None, Some(params.into())),
            None => (None, None),
        };
        let (relax_result, merge_result) = match result {
            Some(v1::job::Result::RelaxResult(result)) => (Some(result.into()), None),
            Some(v1::job::Result::MergeResult(result)) => (None, Some(result.into())),
            None => (None, None),
        };
        Self {
            id,
            map,
            kind: v1::JobKind::try_from(kind).unwrap_or_default().into(),
            state: v1::JobState::try_from(state).unwrap_or_default().into(),
            progress,
            log: log.into_iter().map(JobLogLine::from).collect(),
            done,
            result_version: Unsigned64::above_zero(result_version),
            error: error.map(JobError::from),
            create_time_ns: Signed64(create_time_ns),
            update_time_ns: Signed64(update_time_ns),
            estimated_end_time_ns: estimated_end_time_ns.map(Signed64),
            cancel_requested,
            priority,
            relax,
            relax_result,
            merge,
            merge_result,
        }
    }
}

/// What a job does.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub(crate) enum JobKind {
    /// Not told by the service of that version; not taken in requests.
    Unspecified,
    /// Computes all that is derived again from the journal, into a new version.
    Rebuild,
    /// Finds out where robots had been and where the landmarks are that they saw, and draws the map
    /// again by it, into a new version.
    Relax,
    /// Finds out where sessions of unknown start lie, and draws the map with those that rules accept,
    /// into a new version.
    Merge,
}

impl From<v1::JobKind> for JobKind {
    fn from(wire: v1::JobKind) -> Self {
        match wire {
            v1::JobKind::Unspecified => Self::Unspecified,
            v1::JobKind::Rebuild => Self::Rebuild,
            v1::JobKind::Relax => Self::Relax,
            v1::JobKind::Merge => Self::Merge,
        }
    }
}

impl From<JobKind> for v1::JobKind {
    fn from(kind: JobKind) -> Self {
        match kind {
            JobKind::Unspecified => Self::Unspecified,
            JobKind::Rebuild => Self::Rebuild,
            JobKind::Relax => Self::Relax,
            JobKind::Merge => Self::Merge,
        }
    }
}

/// How far a job is.
#[derive(Clone, Copy, Debug, Serialize, ToSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub(crate) enum JobState {
    /// Not told by the service of that version.
    Unspecified,
    /// Waits for a worker.
    Queued,
    /// Under way.
    Running,
    /// Ended well.
    Succeeded,
    /// Ended with `error`.
    Failed,
    /// Ended as asked.
    Cancelled,
}

impl From<v1::JobState> for JobState {
    fn from(wire: v1::JobState) -> Self {
        match wire {
            v1::JobState::Unspecified => Self::Unspecified,
            v1::JobState::Queued => Self::Queued,
            v1::JobState::Running => Self::Running,
            v1::JobState::Succeeded => Self::Succeeded,
            v1::JobState::Failed => Self::Failed,
            v1::JobState::Cancelled => Self::Cancelled,
        }
    }
}

/// A line of a job's log.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct JobLogLine {
    /// By the service's clock, nanoseconds since 1970.
    time_ns: Signed64,
    text: String,
    /// The same in numbers, where a relaxation has made a step.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    relax: Option<RelaxFigures>,
}

impl From<v1::JobLogLine> for JobLogLine {
    fn from(wire: v1::JobLogLine) -> Self {
        let v1::JobLogLine { time_ns, text, figures } = wire;
        let relax = figures.map(|v1::job_log_line::Figures::Relax(figures)| figures.into());
        Self { time_ns: Signed64(time_ns), text, relax }
    }
}

/// Why a job failed.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct JobError {
    /// Stable, for programs.
    code: String,
    /// For people.
    message: String,
}

impl From<v1::JobError> for JobError {
    fn from(wire: v1::JobError) -> Self {
        let v1::JobError { code, message } = wire;
        Self { code, message }
    }
}

/// A job to be started.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct NewJob {
    /// Id of a map that exists.
    #[schema(example = "intel")]
    map: String,
    kind: JobKind,
    /// Higher goes first; 0 is usual.
    #[serde(default)]
    #[schema(minimum = -100, maximum = 100, example = 0)]
    priority: i32,
    /// How a relax job is to be done; absent for the defaults. Not taken with other kinds.
    #[serde(default)]
    relax: Option<RelaxParams>,
    /// How a merge job is to be done; absent for the defaults. Not taken with other kinds.
    #[serde(default)]
    merge: Option<MergeParams>,
}

impl TryFrom<NewJob> for v1::CreateJobRequest {
    type Error = Error;

    fn try_from(job: NewJob) -> Result<Self, Error> {
        use v1::create_job_request::Params;
        let NewJob { map, kind, priority, relax, merge } = job;
        let relax = relax.map(|params| Params::Relax(params.into()));
        let merge = merge.map(|params| Params::Merge(params.into()));
        let params = only_one("params", [("relax", relax), ("merge", merge)])?;
        Ok(Self { map, kind: v1::JobKind::from(kind).into(), priority, params })
    }
}

/// A page of jobs.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct JobList {
    jobs: Vec<Job>,
    /// Empty on the last page.
    next_page_token: String,
}

/// Names a job.
#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub(crate) struct JobPath {
    /// Id of the job.
    #[param(format = "uuid", example = "0199d3a6-6ac5-7c4e-9d51-2d9a3f1f3c11")]
    job: String,
}

/// Which jobs are asked for.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct JobsQuery {
    /// Only this map's; absent or empty for all.
    #[serde(default)]
    map: String,
    /// Rows wanted: 0 or absent for the default of 100; cut at 1000.
    #[serde(default)]
    #[param(minimum = 0, maximum = 4_294_967_295_u32, example = 100)]
    page_size: u32,
    /// The previous reply's `next_page_token`; absent or empty for the first page.
    #[serde(default)]
    #[param(example = "")]
    page_token: String,
}

/// Starts a job and returns at once.
///
/// Jobs of one map are done one after the other, those of other maps beside them: higher priority
/// first, then the older. `NOTHING_TO_RELAX` and `NOTHING_TO_MERGE` are found out by the job itself.
#[utoipa::path(
    post,
    path = "/v1/jobs",
    tag = "jobs",
    params(IdempotencyKey),
    request_body = NewJob,
    responses(
        (status = 202, description = "The job, which waits for a worker.", body = Job,
            headers(("Location" = String, description = "Where it is found."))),
        CreationProblems,
    )
)]
pub(super) async fn create_job(
    State(rest): State<Rest>,
    key: IdempotencyKey,
    body: JsonBody<NewJob>,
) -> Result<Response, Refusal> {
    let service = rest.service.clone();
    once(&rest, &CREATION, key, body.fingerprint, async move {
        let v1::CreateJobResponse { job } = service.create_job(body.value.try_into()?).await?;
        Ok(Reply::new(StatusCode::ACCEPTED, &Job::from(filled(job, "job")?))?)
    })
    .await
}

/// Jobs, newest first.
#[utoipa::path(
    get,
    path = "/v1/jobs",
    tag = "jobs",
    params(JobsQuery),
    responses((status = 200, description = "A page of jobs.", body = JobList), ListProblems)
)]
pub(super) async fn list_jobs(
    State(rest): State<Rest>,
    Query(query): Query<JobsQuery>,
) -> Result<Response, Refusal> {
    let JobsQuery { map, page_size, page_token } = query;
    let request = v1::ListJobsRequest { map, page_size, page_token };
    let v1::ListJobsResponse { jobs, next_page_token } = rest.service.list_jobs(request).await?;
    Ok(ok(&JobList { jobs: jobs.into_iter().map(Job::from).collect(), next_page_token }))
}

/// One job.
#[utoipa::path(
    get,
    path = "/v1/jobs/{job}",
    tag = "jobs",
    params(JobPath),
    responses((status = 200, description = "The job.", body = Job), ReadProblems)
)]
pub(super) async fn get_job(
    State(rest): State<Rest>,
    Path(path): Path<JobPath>,
) -> Result<Response, Refusal> {
    let v1::GetJobResponse { job } =
        rest.service.get_job(v1::GetJobRequest { job: path.job }).await?;
    Ok(ok(&Job::from(filled(job, "job")?)))
}

/// Asks a job to stop. A job that has ended stays as it is.
#[utoipa::path(
    post,
    path = "/v1/jobs/{job}/cancel",
    tag = "jobs",
    params(JobPath),
    responses((status = 200, description = "The job.", body = Job), ReadProblems)
)]
pub(super) async fn cancel_job(
    State(rest): State<Rest>,
    Path(path): Path<JobPath>,
) -> Result<Response, Refusal> {
    let v1::CancelJobResponse { job } =
        rest.service.cancel_job(v1::CancelJobRequest { job: path.job }).await?;
    Ok(ok(&Job::from(filled(job, "job")?)))
}

/// Follows a job by server-sent events.
///
/// An event `job` holds the job now, at every change, and at its end, after which the stream ends. An
/// event `error` holds a problem document and ends it too.
#[utoipa::path(
    get,
    path = "/v1/jobs/{job}/events",
    tag = "jobs",
    params(JobPath),
    responses(
        (status = 200, description = "Events `job`, each with a job as JSON.",
            content_type = "text/event-stream", body = String),
        ReadProblems,
    )
)]
pub(super) async fn watch_job(
    State(rest): State<Rest>,
    Path(path): Path<JobPath>,
) -> Result<Response, Refusal> {
    let mut changes = rest.service.watch_job(&path.job).await?;
    let (watcher, response) = Watcher::new();
    let stop = rest.service.stop.clone();
    tokio::spawn(async move {
        loop {
            let state = tokio::select! {
                state = changes.next() => state,
                () = stop.cancelled() => Some(Err(Error::Stopping)),
                () = watcher.gone() => return,
            };
            match state {
                None => return,
                Some(Ok(job)) => {
                    if watcher.send("job", &Job::from(job)).await.is_err() {
                        return;
                    }
                }
                Some(Err(error)) => return watcher.send_error(error).await,
            }
        }
    });
    Ok(response)
}
