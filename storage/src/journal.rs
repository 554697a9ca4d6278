//! Reading the journal: everything that happened, in commit order.

use sqlx::SqliteConnection;

use crate::append::RejectionRecord;
use crate::number::to_sql;
use crate::sessions::place;
use crate::{ContentHash, Error, JournalEntry, JournalEvent, JournalSeq, MapId, SessionId, Store};

/// What an entry is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, sqlx::Type)]
#[repr(i64)]
pub(crate) enum Kind {
    MapCreated = 1,
    SessionOpened = 2,
    Batch = 3,
    Skip = 4,
    SessionClosed = 5,
    SessionFenced = 6,
    VersionPublished = 7,
    MapImported = 8,
    CostDecided = 9,
    SessionsRelaxed = 10,
    ClosureSwitched = 11,
    MergeDecided = 12,
    HypothesisDecided = 13,
    MappingParametersDecided = 14,
    ExplorationDecided = 15,
}

/// A batch as it was received.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BatchPayload {
    /// 1, 2, 3... within the session.
    pub number: u64,
    /// The batch, opaque.
    pub payload: Vec<u8>,
    /// Indices of observations that are not to be used.
    pub rejected: Vec<u32>,
}

/// An entry to be written that is neither a batch nor a skip.
pub(crate) struct NewEvent<'a> {
    pub(crate) map: &'a MapId,
    pub(crate) kind: Kind,
    pub(crate) session: Option<SessionId>,
    pub(crate) number: Option<u64>,
    pub(crate) time_ns: i64,
}

/// Appends an entry inside a transaction.
pub(crate) async fn record_event(
    connection: &mut SqliteConnection,
    event: &NewEvent<'_>,
) -> Result<JournalSeq, Error> {
    let seq = sqlx::query_scalar(
        "insert into journal (map_id, kind, session_id, number, receive_time_ns)
         values ($1, $2, $3, $4, $5) returning seq",
    )
    .bind(event.map)
    .bind(event.kind)
    .bind(event.session)
    .bind(event.number.map(to_sql))
    .bind(event.time_ns)
    .fetch_one(connection)
    .await?;
    Ok(seq)
}

/// Appends a decision on a map inside a transaction.
pub(crate) async fn record_decision(
    connection: &mut SqliteConnection,
    map: &MapId,
    kind: Kind,
    time_ns: i64,
    payload: &[u8],
) -> Result<JournalSeq, Error> {
    let seq = sqlx::query_scalar(
        "insert into journal (map_id, kind, receive_time_ns, content_hash, payload)
         values ($1, $2, $3, $4, $5) returning seq",
    )
    .bind(map)
    .bind(kind)
    .bind(time_ns)
    .bind(ContentHash::of(payload).0.as_slice())
    .bind(payload)
    .fetch_one(connection)
    .await?;
    Ok(seq)
}

#[derive(sqlx::FromRow)]
pub(crate) struct Row {
    seq: JournalSeq,
    kind: Kind,
    session_id: Option<SessionId>,
    number: Option<i64>,
    through: Option<i64>,
    receive_time_ns: i64,
    content_hash: Option<Vec<u8>>,
    rejections: Option<sqlx::types::Json<Vec<RejectionRecord>>>,
    payload: Option<Vec<u8>>,
    declaration: Option<Vec<u8>>,
    map_from_session_x_m: Option<f64>,
    map_from_session_y_m: Option<f64>,
    map_from_session_theta_rad: Option<f64>,
}

impl Store {
    /// The entries of a map behind `after`, in order: at most `n_entries_max` of them, with
    /// payloads of at most `n_bytes_max` together, but at least one if there is any.
    ///
    /// # Errors
    /// [`Error::Damaged`] if a payload does not have its hash any more.
    pub async fn journal(
        &self,
        map: &MapId,
        after: JournalSeq,
        n_entries_max: u32,
        n_bytes_max: usize,
    ) -> Result<Vec<JournalEntry>, Error> {
        let Some(last) = self.journal_page_end(map, after, n_entries_max, n_bytes_max).await?
        else {
            return Ok(Vec::new());
        };
        let rows: Vec<Row> = sqlx::query_as(
            "select journal.*, declaration, map_from_session_x_m, map_from_session_y_m,
                 map_from_session_theta_rad
             from journal left join sessions on kind = $1 and sessions.id = session_id
             where journal.map_id = $2 and $3 < seq and seq <= $4 order by seq",
        )
        .bind(Kind::SessionOpened)
        .bind(map)
        .bind(after)
        .bind(last)
        .fetch_all(self.readers())
        .await?;
        rows.into_iter().map(entry).collect()
    }

    /// Where a page of the journal ends: its last entry, or `None` if there is nothing more.
    async fn journal_page_end(
        &self,
        map: &MapId,
        after: JournalSeq,
        n_entries_max: u32,
        n_bytes_max: usize,
    ) -> Result<Option<JournalSeq>, Error> {
        let sizes: Vec<(JournalSeq, i64)> = sqlx::query_as(
            "select seq, coalesce(length(payload), 0) from journal
             where map_id = $1 and $2 < seq order by seq limit $3",
        )
        .bind(map)
        .bind(after)
        .bind(n_entries_max.max(1))
        .fetch_all(self.readers())
        .await?;
        let n_bytes_max = i64::try_from(n_bytes_max).unwrap_or(i64::MAX);
        let mut n_bytes = 0_i64;
        let fits = sizes.iter().take_while(|(_, size)| {
            n_bytes = n_bytes.saturating_add(*size);
            n_bytes <= n_bytes_max
        });
        let last = fits.last().or(sizes.first());
        Ok(last.map(|(seq, _)| *seq))
    }

    /// The payloads of a map's decisions of one kind up to `through`, in order.
    ///
    /// # Errors
    /// [`Error::Damaged`] if one does not have its hash any more.
    pub(crate) async fn decisions(
        &self,
        map: &MapId,
        kind: Kind,
        through: JournalSeq,
    ) -> Result<Vec<(JournalSeq, Vec<u8>)>, Error> {
        let rows: Vec<(JournalSeq, Vec<u8>, Vec<u8>)> = sqlx::query_as(
            "select seq, content_hash, payload from journal
             where map_id = $1 and 8 <= kind and kind = $2 and seq <= $3 order by seq",
        )
        .bind(map)
        .bind(kind)
        .bind(through)
        .fetch_all(self.readers())
        .await?;
        let checked = |(seq, hash, payload): (JournalSeq, Vec<u8>, Vec<u8>)| {
            let hash = ContentHash::from_column(&hash)?;
            if ContentHash::of(&payload) == hash {
                return Ok((seq, payload));
            }
            Err(Error::Damaged(format!("entry {seq} does not have the hash {hash}")))
        };
        rows.into_iter().map(checked).collect()
    }

    /// The newest entry of a map; [`JournalSeq::START`] if there is none.
    ///
    /// # Errors
    /// Those of reading.
    pub async fn journal_end(&self, map: &MapId) -> Result<JournalSeq, Error> {
        let seq = sqlx::query_scalar("select coalesce(max(seq), 0) from journal where map_id = $1")
            .bind(map)
            .fetch_one(self.readers())
            .await?;
        Ok(seq)
    }

    /// At most `limit` batches of a session from `from_number` on, in order. Skipped numbers are
    /// left out.
    ///
    /// # Errors
    /// [`Error::Damaged`] if a payload does not have its hash any more.
    pub async fn session_batches(
        &self,
        session: SessionId,
        from_number: u64,
        limit: u32,
    ) -> Result<Vec<BatchPayload>, Error> {
        let rows: Vec<Row> = sqlx::query_as(
            "select *, null as declaration, null as map_from_session_x_m,
                 null as map_from_session_y_m, null as map_from_session_theta_rad
             from journal
             where session_id = $1 and kind in (3, 4) and kind = $2 and $3 <= number
             order by number limit $4",
        )
        .bind(session)
        .bind(Kind::Batch)
        .bind(to_sql(from_number))
        .bind(limit)
        .fetch_all(self.readers())
        .await?;
        rows.into_iter().map(|row| batch(row).map(|(_, batch)| batch)).collect()
    }

    /// A digest of the map's journal that two runs share if the same happened in them: over kind,
    /// robot and client key, numbers and content hash of every entry, in order. Ids and times are
    /// left out.
    ///
    /// # Errors
    /// Those of reading.
    pub async fn journal_digest(&self, map: &MapId) -> Result<ContentHash, Error> {
        let mut digest = blake3::Hasher::new();
        let mut after = JournalSeq::START;
        loop {
            let rows: Vec<DigestRow> = sqlx::query_as(
                "select seq, kind, number, through, content_hash, robot_id, client_key
                 from journal left join sessions on sessions.id = session_id
                 where journal.map_id = $1 and $2 < seq order by seq limit $3",
            )
            .bind(map)
            .bind(after)
            .bind(DIGEST_PAGE_ENTRIES)
            .fetch_all(self.readers())
            .await?;
            let Some(last) = rows.last() else { break };
            after = last.seq;
            for row in &rows {
                row.feed(&mut digest);
            }
        }
        Ok(ContentHash(*digest.finalize().as_bytes()))
    }
}

/// Entries read at once for a digest: some hundred kilobytes.
const DIGEST_PAGE_ENTRIES: u32 = 4096;

#[derive(sqlx::FromRow)]
struct DigestRow {
    seq: JournalSeq,
    kind: Kind,
    number: Option<i64>,
    through: Option<i64>,
    content_hash: Option<Vec<u8>>,
    robot_id: Option<String>,
    client_key: Option<String>,
}

impl DigestRow {
    /// Texts and hashes are preceded by their length, so that no two rows feed the same bytes.
    fn feed(&self, digest: &mut blake3::Hasher) {
        let text = |value: &Option<String>| value.clone().unwrap_or_default().into_bytes();
        digest.update(&(self.kind as i64).to_le_bytes());
        digest.update(&self.number.unwrap_or(0).to_le_bytes());
        digest.update(&self.through.unwrap_or(0).to_le_bytes());
        let hash = self.content_hash.clone().unwrap_or_default();
        for bytes in [text(&self.robot_id), text(&self.client_key), hash] {
            digest.update(&(bytes.len() as u64).to_le_bytes());
            digest.update(&bytes);
        }
    }
}

fn entry(row: Row) -> Result<JournalEntry, Error> {
    let (seq, receive_time_ns) = (row.seq, row.receive_time_ns);
    let event = match row.kind {
        Kind::MapCreated => JournalEvent::MapCreated,
        Kind::VersionPublished => {
            JournalEvent::VersionPublished { number: count(&row, row.number)? }
        }
        Kind::SessionOpened => JournalEvent::SessionOpened {
            session: session(&row)?,
            map_from_session: place([
                row.map_from_session_x_m,
                row.map_from_session_y_m,
                row.map_from_session_theta_rad,
            ]),
            declaration: row.declaration.unwrap_or_default(),
        },
        Kind::Batch => {
            let (session, BatchPayload { number, payload, rejected }) = batch(row)?;
            JournalEvent::Batch { session, number, payload, rejected }
        }
        Kind::Skip => JournalEvent::Skipped {
            session: session(&row)?,
            from: count(&row, row.number)?,
            through: count(&row, row.through)?,
        },
        Kind::SessionClosed => JournalEvent::SessionClosed { session: session(&row)? },
        Kind::SessionFenced => JournalEvent::SessionFenced { session: session(&row)? },
        Kind::MapImported => JournalEvent::MapImported { payload: payload(row, "an import")? },
        Kind::CostDecided => JournalEvent::CostDecided { payload: payload(row, "a cost")? },
        Kind::SessionsRelaxed => {
            JournalEvent::SessionsRelaxed { payload: payload(row, "a relaxation")? }
        }
        Kind::ClosureSwitched => {
            JournalEvent::ClosureSwitched { payload: payload(row, "a closure's switch")? }
        }
        Kind::MappingParametersDecided => {
            JournalEvent::MappingParametersDecided { payload: payload(row, "parameters")? }
        }
        Kind::MergeDecided => JournalEvent::MergeDecided { payload: payload(row, "a merge")? },
        Kind::HypothesisDecided => {
            JournalEvent::HypothesisDecided { payload: payload(row, "a hypothesis")? }
        }
        Kind::ExplorationDecided => {
            JournalEvent::ExplorationDecided { payload: payload(row, "an exploration")? }
        }
    };
    Ok(JournalEntry { seq, receive_time_ns, event })
}

/// Takes a batch out of its row and checks that the payload is what was received.
pub(crate) fn batch(row: Row) -> Result<(SessionId, BatchPayload), Error> {
    let (session, number) = (session(&row)?, count(&row, row.number)?);
    let rejections = row.rejections.as_ref().map_or(&[][..], |json| &json.0);
    let rejected = rejections.iter().map(|rejection| rejection.index).collect();
    let name = format!("batch {number} of session {session}");
    Ok((session, BatchPayload { number, payload: payload(row, &name)?, rejected }))
}

/// What came with an entry, if it still has its hash.
fn payload(row: Row, name: &str) -> Result<Vec<u8>, Error> {
    let payload = row.payload.unwrap_or_default();
    let hash = ContentHash::from_column(&row.content_hash.unwrap_or_default())?;
    if ContentHash::of(&payload) == hash {
        return Ok(payload);
    }
    Err(Error::Damaged(format!("{name} does not have the hash {hash} that it came with")))
}

fn session(row: &Row) -> Result<SessionId, Error> {
    row.session_id.ok_or_else(|| Error::Damaged(format!("entry {} names no session", row.seq)))
}

fn count(row: &Row, column: Option<i64>) -> Result<u64, Error> {
    column
        .and_then(|number| u64::try_from(number).ok())
        .ok_or_else(|| Error::Damaged(format!("entry {} has no number", row.seq)))
}
