//! Group commit: what many robots sent is written in one transaction with one fsync.
//!
//! Every request is judged on its own, against its session as the requests before it left it; a
//! refused one leaves no trace and does not disturb the others. Then all accepted entries go to
//! the journal in their order, a few statements for the whole group.

use std::collections::HashMap;

use serde::{Deserialize, Serialize};
use sqlx::types::Json;
use sqlx::{QueryBuilder, Sqlite, SqliteConnection};

use crate::admission::{Admitted, Head, admit, load_heads};
use crate::journal::Kind;
use crate::number::to_sql;
use crate::travels::record_visits;
use crate::{ContentHash, Error, JournalSeq, MapId, SessionId, Store};

/// Something a session wants kept.
#[derive(Clone, Debug)]
pub struct AppendRequest {
    /// The session.
    pub session: SessionId,
    /// The sender's epoch, which must be the session's own.
    pub epoch: u64,
    /// When it came in, by the service's clock, nanoseconds since 1970.
    pub receive_time_ns: i64,
    /// What it is.
    pub entry: NewEntry,
}

/// What a session may add to the journal.
#[derive(Clone, Debug)]
pub enum NewEntry {
    /// A batch.
    Batch {
        /// The next number expected, or an old one again.
        number: u64,
        /// The batch, opaque.
        payload: Vec<u8>,
        /// [`ContentHash::of`] the payload: computed by the caller, who has more threads.
        content_hash: ContentHash,
        /// Observations of the batch that are not to be used.
        rejections: Vec<RejectionRecord>,
        /// Laser scans in it, without rejected ones.
        n_scans: u32,
        /// Visits to places in it, without rejected ones.
        n_visits: u32,
        /// Smallest and largest stamp in it, the robot's clock in nanoseconds; `None` if there is
        /// no stamp.
        stamps_ns: Option<(i64, i64)>,
    },
    /// Batches that will never come.
    Skip {
        /// The next number expected.
        from: u64,
        /// The last number skipped.
        through: u64,
        /// For people.
        reason: String,
    },
}

/// An observation that was kept but is not to be used, and why.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RejectionRecord {
    /// Index into the batch's observations, from 0.
    pub index: u32,
    /// Stable, for programs.
    pub code: String,
    /// For people.
    pub detail: String,
}

/// An accepted request. It is durable.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Appended {
    /// Its place in the journal; `None` if it was there before.
    pub seq: Option<JournalSeq>,
    /// Every number up to this one is durable.
    pub acked_through: u64,
    /// What of the batch is not to be used, as it was recorded when the batch first came.
    pub rejections: Vec<RejectionRecord>,
}

/// A refused request, of which nothing is kept.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// No session has that id.
    #[error("no such session")]
    NoSuchSession,
    /// The epoch is not the session's own, or a newer one ended the session.
    #[error("the session was fenced by a newer epoch of its robot")]
    SessionFenced,
    /// The session is closed.
    #[error("the session is closed")]
    SessionClosed,
    /// A number is missing before this one.
    #[error("expected number {expected}")]
    SequenceGap {
        /// The number to send next.
        expected: u64,
    },
    /// The number is taken by other content, or was skipped.
    #[error("number {number} was sent before with other content")]
    ContentMismatch {
        /// The number.
        number: u64,
    },
    /// A skip of nothing, of far too much, or over numbers that are there.
    #[error("cannot skip from {from} through {through}: expected number {expected}")]
    InvalidSkip {
        /// The first number.
        from: u64,
        /// The last number.
        through: u64,
        /// The number to send next, where a skip would have to begin.
        expected: u64,
    },
}

/// Rows a statement inserts or updates at most. A group needs a sixteenth of the statements, and
/// the connection prepares no more than sixteen texts of each kind.
pub(crate) const ROWS_PER_STATEMENT: usize = 16;

impl Store {
    /// Appends what many sessions sent, in the order given, with one fsync. The answers stand in
    /// the order of the requests. When this returns `Ok`, all that was accepted is durable.
    ///
    /// # Errors
    /// Nothing was accepted. [`Error::Full`] and [`Error::Busy`] pass: try again.
    pub async fn append(
        &self,
        requests: &[AppendRequest],
    ) -> Result<Vec<Result<Appended, Refusal>>, Error> {
        let mut write = self.write().await?;
        let result = append_group(&mut write.connection, requests).await;
        write.end(result).await
    }
}

async fn append_group(
    connection: &mut SqliteConnection,
    requests: &[AppendRequest],
) -> Result<Vec<Result<Appended, Refusal>>, Error> {
    let mut heads = load_heads(&mut *connection, requests).await?;
    let mut answers = Vec::with_capacity(requests.len());
    let mut accepted = Vec::with_capacity(requests.len());
    for (index, request) in requests.iter().enumerate() {
        let Some(head) = heads.get_mut(&request.session) else {
            answers.push(Err(Refusal::NoSuchSession));
            continue;
        };
        let verdict = admit(&mut *connection, head, requests, index).await?;
        if verdict == Ok(Admitted::New) {
            accepted.push((head.map.clone(), request));
        }
        answers.push(verdict.map(|admitted| answer(admitted, head, &request.entry)));
    }
    let mut seqs = insert_entries(&mut *connection, &accepted).await?.into_iter();
    for answer in answers.iter_mut().flatten().filter(|answer| answer.seq.is_some()) {
        answer.seq = seqs.next();
    }
    record_visits(&mut *connection, &accepted).await?;
    update_sessions(connection, &heads).await?;
    Ok(answers)
}

/// What to say if the group commits. The place of a new entry is not known yet.
fn answer(admitted: Admitted, head: &Head, entry: &NewEntry) -> Appended {
    let acked_through = head.acked_through;
    match (admitted, entry) {
        (Admitted::Again { rejections }, _) => Appended { seq: None, acked_through, rejections },
        (Admitted::New, NewEntry::Batch { rejections, .. }) => {
            Appended { seq: Some(JournalSeq::START), acked_through, rejections: rejections.clone() }
        }
        (Admitted::New, NewEntry::Skip { .. }) => {
            Appended { seq: Some(JournalSeq::START), acked_through, rejections: Vec::new() }
        }
    }
}

/// Writes the entries and says where each stands in the journal.
async fn insert_entries(
    connection: &mut SqliteConnection,
    accepted: &[(MapId, &AppendRequest)],
) -> Result<Vec<JournalSeq>, Error> {
    let mut seqs = Vec::with_capacity(accepted.len());
    for chunk in accepted.chunks(ROWS_PER_STATEMENT) {
        let mut query = QueryBuilder::<Sqlite>::new(
            "insert into journal (map_id, kind, session_id, number, through, receive_time_ns,
                 content_hash, rejections, reason, payload) ",
        );
        query.push_values(chunk, |mut row, (map, request)| {
            let (kind, from, through) = match &request.entry {
                NewEntry::Batch { number, .. } => (Kind::Batch, *number, *number),
                NewEntry::Skip { from, through, .. } => (Kind::Skip, *from, *through),
            };
            row.push_bind(map.clone()).push_bind(kind).push_bind(request.session);
            row.push_bind(to_sql(from)).push_bind(to_sql(through));
            row.push_bind(request.receive_time_ns);
            match &request.entry {
                NewEntry::Batch { payload, content_hash, rejections, .. } => {
                    let listed = (!rejections.is_empty()).then(|| Json(rejections.clone()));
                    row.push_bind(content_hash.0.to_vec()).push_bind(listed);
                    row.push_bind(None::<String>).push_bind(payload.clone());
                }
                NewEntry::Skip { reason, .. } => {
                    row.push_bind(None::<Vec<u8>>).push_bind(None::<String>);
                    row.push_bind(reason.clone()).push_bind(None::<Vec<u8>>);
                }
            }
        });
        query.push(" returning seq");
        let chunk_seqs: Vec<JournalSeq> =
            query.build_query_scalar().fetch_all(&mut *connection).await?;
        seqs.extend(chunk_seqs);
    }
    Ok(seqs)
}

/// Brings the rows of all sessions that got something up to date.
async fn update_sessions(
    connection: &mut SqliteConnection,
    heads: &HashMap<SessionId, Head>,
) -> Result<(), Error> {
    let changed: Vec<_> = heads.iter().filter(|(_, head)| head.is_changed()).collect();
    for chunk in changed.chunks(ROWS_PER_STATEMENT) {
        let mut query = QueryBuilder::<Sqlite>::new("with head as (");
        query.push_values(chunk, |mut row, (id, head)| {
            row.push_bind(**id).push_bind(to_sql(head.acked_through));
            row.push_bind(to_sql(head.n_scans)).push_bind(to_sql(head.n_rejected));
            row.push_bind(head.stamps_ns.map(|(first, _)| first));
            row.push_bind(head.stamps_ns.map(|(_, last)| last));
        });
        query.push(
            ") update sessions set acked_through = column2, n_scans = column3,
                 n_rejected = column4, first_time_ns = column5, last_time_ns = column6
             from head where id = column1",
        );
        query.build().execute(&mut *connection).await?;
    }
    Ok(())
}
