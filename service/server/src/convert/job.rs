//! Jobs on the wire and in records.

use meetpoint_proto::v1;
use meetpoint_storage::{JobId, JobRecord, JobState};
use uuid::Uuid;

use crate::error::Error;

/// The kinds of jobs, as records name them.
pub(crate) const REBUILD: &str = "rebuild";

/// Lines of a job's log in a reply.
const N_LOG_LINES_MAX: usize = 1000;

/// What a request asks to be done.
pub(crate) fn kind(wire: i32) -> Result<&'static str, Error> {
    match v1::JobKind::try_from(wire) {
        Ok(v1::JobKind::Rebuild) => Ok(REBUILD),
        Ok(v1::JobKind::Unspecified) => Err(Error::field("kind", "missing")),
        Err(_) => Err(Error::field("kind", format!("{wire} is none of its values"))),
    }
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
        state,
        progress,
        log,
        result_version,
        error,
        create_time_ns,
        update_time_ns,
        start_time_ns: _,
        cancel_requested,
        checkpoint: _,
        ..
    } = record;
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
        kind: if kind == REBUILD { v1::JobKind::Rebuild } else { v1::JobKind::Unspecified }.into(),
        state: state.into(),
        progress,
        log: lines.map(|(time_ns, text)| v1::JobLogLine { time_ns, text }).collect(),
        done,
        result_version,
        error: error.map(|(code, message)| v1::JobError { code, message }),
        create_time_ns,
        update_time_ns,
        estimated_end_time_ns,
        cancel_requested,
    }
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
