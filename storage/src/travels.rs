//! Travels from place to place: which batches tell of visits, and what people decided about the
//! topological maps that fit them.

use sqlx::{QueryBuilder, Sqlite, SqliteConnection};

use crate::append::{AppendRequest, NewEntry, ROWS_PER_STATEMENT};
use crate::journal::{BatchPayload, Kind, Row, batch, record_decision};
use crate::maps::require_map;
use crate::number::to_sql;
use crate::{Error, JournalSeq, MapId, SessionId, Store};

/// A decision about a topological map, to be recorded.
#[derive(Clone, Debug)]
pub struct NewHypothesisDecision {
    /// The map.
    pub map: MapId,
    /// What was decided, opaque.
    pub payload: Vec<u8>,
    /// The service's clock, nanoseconds since 1970.
    pub time_ns: i64,
}

impl Store {
    /// At most `limit` batches of a session behind number `after` that tell of visits, in order.
    ///
    /// # Errors
    /// [`Error::Damaged`] if a payload does not have its hash any more.
    pub async fn visit_batches(
        &self,
        session: SessionId,
        after: u64,
        limit: u32,
    ) -> Result<Vec<BatchPayload>, Error> {
        let rows: Vec<Row> = sqlx::query_as(
            "select journal.*, null as declaration, null as map_from_session_x_m,
                 null as map_from_session_y_m, null as map_from_session_theta_rad
             from visit_batches join journal
                 on journal.session_id = visit_batches.session_id
                 and journal.number = visit_batches.number
             where journal.kind in (3, 4) and journal.kind = $1
                 and visit_batches.session_id = $2 and $3 < visit_batches.number
             order by visit_batches.number limit $4",
        )
        .bind(Kind::Batch)
        .bind(session)
        .bind(to_sql(after))
        .bind(limit)
        .fetch_all(self.readers())
        .await?;
        rows.into_iter().map(|row| batch(row).map(|(_, batch)| batch)).collect()
    }

    /// The session of a map that was opened last of those that told of visits.
    ///
    /// # Errors
    /// Those of reading.
    pub async fn travelled_session(&self, map: &MapId) -> Result<Option<SessionId>, Error> {
        let session = sqlx::query_scalar(
            "select id from sessions where map_id = $1
                 and id in (select session_id from visit_batches)
             order by position desc limit 1",
        )
        .bind(map)
        .fetch_optional(self.readers())
        .await?;
        Ok(session)
    }

    /// Records a decision about a topological map: its place in the journal.
    ///
    /// # Errors
    /// [`Error::NoSuchMap`].
    pub async fn decide_hypothesis(
        &self,
        new: &NewHypothesisDecision,
    ) -> Result<JournalSeq, Error> {
        let mut write = self.write().await?;
        let result = decide(&mut write.connection, new).await;
        write.end(result).await
    }

    /// The decisions about the topological maps of a map, in order.
    ///
    /// # Errors
    /// [`Error::Damaged`] if one does not have its hash any more.
    pub async fn hypothesis_decisions(&self, map: &MapId) -> Result<Vec<Vec<u8>>, Error> {
        let through = self.journal_end(map).await?;
        let decisions = self.decisions(map, Kind::HypothesisDecided, through).await?;
        Ok(decisions.into_iter().map(|(_, payload)| payload).collect())
    }
}

async fn decide(
    connection: &mut SqliteConnection,
    new: &NewHypothesisDecision,
) -> Result<JournalSeq, Error> {
    let NewHypothesisDecision { map, payload, time_ns } = new;
    require_map(&mut *connection, map).await?;
    record_decision(connection, map, Kind::HypothesisDecided, *time_ns, payload).await
}

/// Notes which of the accepted batches tell of visits, inside the transaction that keeps them.
pub(crate) async fn record_visits(
    connection: &mut SqliteConnection,
    accepted: &[(MapId, &AppendRequest)],
) -> Result<(), Error> {
    let telling = |(_, request): &(MapId, &AppendRequest)| match request.entry {
        NewEntry::Batch { number, n_visits, .. } if 0 < n_visits => Some((request.session, number)),
        _ => None,
    };
    let telling: Vec<(SessionId, u64)> = accepted.iter().filter_map(telling).collect();
    for chunk in telling.chunks(ROWS_PER_STATEMENT) {
        let mut query =
            QueryBuilder::<Sqlite>::new("insert into visit_batches (session_id, number) ");
        query.push_values(chunk, |mut row, (session, number)| {
            row.push_bind(*session).push_bind(to_sql(*number));
        });
        query.build().execute(&mut *connection).await?;
    }
    Ok(())
}
