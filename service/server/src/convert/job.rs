//! Jobs on the wire and in records.

use meetpoint_proto::v1;
use meetpoint_storage::{JobId, JobRecord, JobState, LogLine};
use prost::Message;
use uuid::Uuid;

use crate::error::Error;

/// The kinds of jobs, as records name them.
pub(crate) const REBUILD: &str = "rebuild";
pub(crate) const RELAX: &str = "relax";
pub(crate) const MERGE: &str = "merge";

/// Priorities lie within this of 0, so that there is always room above and below.
const PRIORITY_MAX: i32 = 100;
/// What people ask for, unless they say otherwise.
pub(crate) const PRIORITY_USUAL: i32 = 0;

/// Lines of a job's log in a reply.
const N_LOG_LINES_MAX: usize = 1000;

/// What a request asks to be done, checked as far as it can be without the database.
pub(crate) enum Asked {
    /// All that is derived is computed again.
    Rebuild,
    /// Sessions are relaxed.
    Relax(v1::RelaxParams),
    /// Sessions of unknown start are looked for.
    Merge(v1::MergeParams),
}

impl Asked {
    /// As records name it.
    pub(crate) fn kind(&self) -> &'static str {
        match self {
            Self::Rebuild => REBUILD,
            Self::Relax(_) => RELAX,
            Self::Merge(_) => MERGE,
        }
    }

    /// How it is to be done, for a record.
    pub(crate) fn params(&self) -> Vec<u8> {
        match self {
            Self::Rebuild => Vec::new(),
            Self::Relax(params) => params.encode_to_vec(),
            Self::Merge(params) => params.encode_to_vec(),
        }
    }
}

/// What a request asks to be done.
pub(crate) fn asked(
    kind: i32,
    params: Option<v1::create_job_request::Params>,
) -> Result<Asked, Error> {
    use v1::create_job_request::Params;
    match (v1::JobKind::try_from(kind), params) {
        (Ok(v1::JobKind::Rebuild), None) => Ok(Asked::Rebuild),
        (Ok(v1::JobKind::Relax), Some(Params::Relax(params))) => Ok(Asked::Relax(params)),
        (Ok(v1::JobKind::Relax), None) => Ok(Asked::Relax(v1::RelaxParams::default())),
        (Ok(v1::JobKind::Merge), Some(Params::Merge(params))) => Ok(Asked::Merge(params)),
        (Ok(v1::JobKind::Merge), None) => Ok(Asked::Merge(v1::MergeParams::default())),
        (Ok(v1::JobKind::Unspecified), _) => Err(Error::field("kind", "missing")),
        (Ok(_), Some(Params::Relax(_))) => Err(of_another_kind("relax")),
        (Ok(_), Some(Params::Merge(_))) => Err(of_another_kind("merge")),
        (Err(_), _) => Err(Error::field("kind", format!("{kind} is none of its values"))),
    }
}

fn of_another_kind(field: &str) -> Error {
    Error::field(field, "parameters of another kind of job")
}

/// A priority as it is taken.
pub(crate) fn priority(wire: i32) -> Result<i32, Error> {
    if (-PRIORITY_MAX..=PRIORITY_MAX).contains(&wire) {
        Ok(wire)
    } else {
        let problem = format!("{wire}, must be -{PRIORITY_MAX} to {PRIORITY_MAX}");
        Err(Error::field("priority", problem))
    }
}

/// How a relax job is to be done, out of its record.
pub(crate) fn relax_params(params: &[u8]) -> Result<v1::RelaxParams, Error> {
    v1::RelaxParams::decode(params).map_err(Error::internal)
}

/// How a merge job is to be done, out of its record.
pub(crate) fn merge_params(params: &[u8]) -> Result<v1::MergeParams, Error> {
    v1::MergeParams::decode(params).map_err(Error::internal)
}

/// A job's id.
pub(crate) fn id(text: &str) -> Result<JobId, Error> {
    Uuid::parse_str(text).map(JobId).map_err(|_| Error::field("job", "not a UUID"))
}

/// A job for the wire.
pub(crate) fn to_wire(record: JobRecord) -> v1::Job {
    let estimated_end_time_ns = estimated_end_ns(&record);
    let JobRecord {
        id,
        map,
        kind,
        params,
        priority,
        state,
        progress,
        log,
        result_version,
        result,
        error,
        create_time_ns,
        update_time_ns,
        start_time_ns: _,
        cancel_requested,
        checkpoint: _,
    } = record;
    let (kind, params) = match kind.as_str() {
        REBUILD => (v1::JobKind::Rebuild, None),
        RELAX => (v1::JobKind::Relax, relax_params(&params).ok().map(v1::job::Params::Relax)),
        MERGE => (v1::JobKind::Merge, merge_params(&params).ok().map(v1::job::Params::Merge)),
        _ => (v1::JobKind::Unspecified, None),
    };
    let (state, done) = match state {
        JobState::Queued => (v1::JobState::Queued, false),
        JobState::Running => (v1::JobState::Running, false),
        JobState::Succeeded => (v1::JobState::Succeeded, true),
        JobState::Failed => (v1::JobState::Failed, true),
        JobState::Cancelled => (v1::JobState::Cancelled, true),
    };
    let n_lines_before = log.len().saturating_sub(N_LOG_LINES_MAX);
    let lines = log.into_iter().skip(n_lines_before);
    v1::Job {
        id: id.0.to_string(),
        map: map.0,
        kind: kind.into(),
        state: state.into(),
        progress,
        log: lines.map(line_to_wire).collect(),
        done,
        result_version,
        error: error.map(|(code, message)| v1::JobError { code, message }),
        create_time_ns,
        update_time_ns,
        estimated_end_time_ns,
        cancel_requested,
        priority,
        params,
        result: result.and_then(|bytes| told(&bytes)),
    }
}

/// What a job keeps of its result: a message that holds nothing else.
pub(crate) fn result_to_bytes(result: v1::job::Result) -> Vec<u8> {
    v1::Job { result: Some(result), ..v1::Job::default() }.encode_to_vec()
}

/// The result of a job; a record of a newer program may hold one that is not known here.
fn told(bytes: &[u8]) -> Option<v1::job::Result> {
    v1::Job::decode(bytes).ok()?.result
}

/// What a line of the log keeps of its figures: a message that holds nothing else.
pub(crate) fn figures_to_bytes(figures: v1::job_log_line::Figures) -> Vec<u8> {
    v1::JobLogLine { figures: Some(figures), ..v1::JobLogLine::default() }.encode_to_vec()
}

fn line_to_wire(line: LogLine) -> v1::JobLogLine {
    let LogLine { time_ns, text, figures } = line;
    let figures = figures.and_then(|bytes| v1::JobLogLine::decode(bytes.as_slice()).ok()?.figures);
    v1::JobLogLine { time_ns, text, figures }
}

/// The end, if the rest takes as long as the share done.
#[expect(clippy::cast_possible_truncation, reason = "an estimate; saturating is fine")]
fn estimated_end_ns(record: &JobRecord) -> Option<i64> {
    let start_ns = record.start_time_ns.filter(|_| record.state == JobState::Running)?;
    if record.progress <= 0.0 {
        return None;
    }
    let spent_ns = (record.update_time_ns - start_ns) as f64;
    Some(start_ns.saturating_add((spent_ns / record.progress) as i64))
}
