//! Whether a request to append fits its session: the rules of numbers, duplicates and fences.

use std::collections::{BTreeMap, HashMap};

use sqlx::types::Json;
use sqlx::{QueryBuilder, Sqlite, SqliteConnection};

use crate::append::{AppendRequest, NewEntry, ROWS_PER_STATEMENT, Refusal, RejectionRecord};
use crate::journal::Kind;
use crate::number::{COUNT_MAX, to_sql};
use crate::sessions::SessionState;
use crate::{ContentHash, Error, MapId, SessionId};

/// A session as the requests judged so far leave it.
#[derive(Debug)]
pub(crate) struct Head {
    pub(crate) map: MapId,
    epoch: u64,
    state: SessionState,
    pub(crate) acked_through: u64,
    pub(crate) n_scans: u64,
    pub(crate) n_rejected: u64,
    /// Smallest and largest.
    pub(crate) stamps_ns: Option<(i64, i64)>,
    /// The requests of this group that were accepted, by their first number.
    accepted: BTreeMap<u64, usize>,
}

/// What becomes of a request that is not refused.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Admitted {
    /// It is to be written.
    New,
    /// It is there already.
    Again { rejections: Vec<RejectionRecord> },
}

/// What stands at a number of a session.
#[derive(Debug)]
enum Known {
    Batch { content_hash: ContentHash, rejections: Vec<RejectionRecord> },
    Skip { from: u64, through: u64 },
}

#[derive(sqlx::FromRow)]
struct HeadRow {
    id: SessionId,
    map_id: MapId,
    #[sqlx(try_from = "i64")]
    epoch: u64,
    state: SessionState,
    #[sqlx(try_from = "i64")]
    acked_through: u64,
    #[sqlx(try_from = "i64")]
    n_scans: u64,
    #[sqlx(try_from = "i64")]
    n_rejected: u64,
    first_time_ns: Option<i64>,
    last_time_ns: Option<i64>,
}

impl Head {
    fn new(row: HeadRow) -> Self {
        Self {
            map: row.map_id,
            epoch: row.epoch,
            state: row.state,
            acked_through: row.acked_through,
            n_scans: row.n_scans,
            n_rejected: row.n_rejected,
            stamps_ns: row.first_time_ns.zip(row.last_time_ns),
            accepted: BTreeMap::new(),
        }
    }

    /// Whether anything was accepted.
    pub(crate) fn is_changed(&self) -> bool {
        !self.accepted.is_empty()
    }

    fn accept(&mut self, index: usize, entry: &NewEntry) {
        match entry {
            NewEntry::Batch { number, rejections, n_scans, stamps_ns, .. } => {
                self.accepted.insert(*number, index);
                self.acked_through = *number;
                self.n_scans += u64::from(*n_scans);
                self.n_rejected += rejections.len() as u64;
                self.stamps_ns = match (self.stamps_ns, *stamps_ns) {
                    (Some((a, b)), Some((c, d))) => Some((a.min(c), b.max(d))),
                    (before, now) => now.or(before),
                };
            }
            NewEntry::Skip { from, through, .. } => {
                self.accepted.insert(*from, index);
                self.acked_through = *through;
            }
        }
    }
}

/// The sessions that the requests name, as far as they exist.
pub(crate) async fn load_heads(
    connection: &mut SqliteConnection,
    requests: &[AppendRequest],
) -> Result<HashMap<SessionId, Head>, Error> {
    let mut ids: Vec<SessionId> = requests.iter().map(|request| request.session).collect();
    ids.sort_unstable();
    ids.dedup();
    let mut heads = HashMap::with_capacity(ids.len());
    for chunk in ids.chunks(ROWS_PER_STATEMENT) {
        let mut query = QueryBuilder::<Sqlite>::new(
            "select id, map_id, epoch, state, acked_through, n_scans, n_rejected,
                 first_time_ns, last_time_ns
             from sessions where id in (",
        );
        let mut list = query.separated(", ");
        for id in chunk {
            list.push_bind(*id);
        }
        query.push(")");
        let rows: Vec<HeadRow> = query.build_query_as().fetch_all(&mut *connection).await?;
        heads.extend(rows.into_iter().map(|row| (row.id, Head::new(row))));
    }
    Ok(heads)
}

/// Judges `requests[index]` and, if it is new, brings `head` forward.
pub(crate) async fn admit(
    connection: &mut SqliteConnection,
    head: &mut Head,
    requests: &[AppendRequest],
    index: usize,
) -> Result<Result<Admitted, Refusal>, Error> {
    let request = &requests[index];
    if request.epoch != head.epoch || head.state == SessionState::Fenced {
        return Ok(Err(Refusal::SessionFenced));
    }
    let first = match &request.entry {
        NewEntry::Batch { number, .. } => *number,
        NewEntry::Skip { from, .. } => *from,
    };
    if head.acked_through < first || first == 0 {
        let judged = judge_new(head, first, &request.entry);
        if judged.is_ok() {
            head.accept(index, &request.entry);
        }
        return Ok(judged.map(|()| Admitted::New));
    }
    let known = match head.accepted.range(..=first).next_back() {
        Some((_, earlier)) => Some(Known::from_entry(&requests[*earlier].entry)),
        None => stored(connection, request.session, first).await?,
    };
    Ok(judge_again(known, &request.entry, head.acked_through + 1))
}

/// What was not there before must begin at the number that is expected.
fn judge_new(head: &Head, first: u64, entry: &NewEntry) -> Result<(), Refusal> {
    let expected = head.acked_through + 1;
    if head.state == SessionState::Closed {
        return Err(Refusal::SessionClosed);
    }
    if first != expected {
        return Err(Refusal::SequenceGap { expected });
    }
    match *entry {
        NewEntry::Skip { from, through, .. } if through < from || COUNT_MAX < through => {
            Err(Refusal::InvalidSkip { from, through, expected })
        }
        _ => Ok(()),
    }
}

/// What begins at an old number must be what was there.
fn judge_again(known: Option<Known>, entry: &NewEntry, expected: u64) -> Result<Admitted, Refusal> {
    match (known, entry) {
        (
            Some(Known::Batch { content_hash: before, rejections }),
            NewEntry::Batch { content_hash, .. },
        ) if before == *content_hash => Ok(Admitted::Again { rejections }),
        (Some(Known::Skip { from: a, through: b }), NewEntry::Skip { from, through, .. })
            if (a, b) == (*from, *through) =>
        {
            Ok(Admitted::Again { rejections: Vec::new() })
        }
        (_, NewEntry::Batch { number, .. }) => Err(Refusal::ContentMismatch { number: *number }),
        (_, NewEntry::Skip { from, through, .. }) => {
            Err(Refusal::InvalidSkip { from: *from, through: *through, expected })
        }
    }
}

impl Known {
    fn from_entry(entry: &NewEntry) -> Self {
        match entry {
            NewEntry::Batch { content_hash, rejections, .. } => {
                Self::Batch { content_hash: *content_hash, rejections: rejections.clone() }
            }
            NewEntry::Skip { from, through, .. } => Self::Skip { from: *from, through: *through },
        }
    }
}

#[derive(sqlx::FromRow)]
struct KnownRow {
    kind: Kind,
    #[sqlx(try_from = "i64")]
    number: u64,
    #[sqlx(try_from = "i64")]
    through: u64,
    content_hash: Option<Vec<u8>>,
    rejections: Option<Json<Vec<RejectionRecord>>>,
}

/// The entry of the journal that covers `number`.
async fn stored(
    connection: &mut SqliteConnection,
    session: SessionId,
    number: u64,
) -> Result<Option<Known>, Error> {
    let row: Option<KnownRow> = sqlx::query_as(
        "select kind, number, through, content_hash, rejections from journal
         where session_id = $1 and kind in (3, 4) and number <= $2
         order by number desc limit 1",
    )
    .bind(session)
    .bind(to_sql(number))
    .fetch_optional(connection)
    .await?;
    let Some(row) = row else { return Ok(None) };
    if row.kind == Kind::Skip {
        return Ok(Some(Known::Skip { from: row.number, through: row.through }));
    }
    let content_hash = ContentHash::from_column(&row.content_hash.unwrap_or_default())?;
    let rejections = row.rejections.map(|json| json.0).unwrap_or_default();
    Ok(Some(Known::Batch { content_hash, rejections }))
}
