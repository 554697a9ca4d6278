//! Costs: what people and rules decide on top of a map, each an entry of its journal and one count
//! of its cost revision. What is in force is what all entries come to, in order.

use sqlx::SqliteConnection;

use crate::journal::Kind;
use crate::maps::require_map;
use crate::number::to_sql;
use crate::{ContentHash, Error, JournalSeq, MapId, Store};

/// A decision to be recorded.
#[derive(Clone, Debug)]
pub struct NewCostDecision {
    /// The map.
    pub map: MapId,
    /// The revision that it was decided on top of.
    pub revision: u64,
    /// What was decided, opaque.
    pub payload: Vec<u8>,
    /// The service's clock, nanoseconds since 1970.
    pub time_ns: i64,
}

/// A decision as it is stored.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CostDecisionRecord {
    /// Its place in the journal.
    pub seq: JournalSeq,
    /// When it came in, by the service's clock, nanoseconds since 1970.
    pub time_ns: i64,
    /// What was decided, opaque.
    pub payload: Vec<u8>,
}

#[derive(sqlx::FromRow)]
struct Row {
    seq: JournalSeq,
    receive_time_ns: i64,
    content_hash: Vec<u8>,
    payload: Vec<u8>,
}

impl Store {
    /// Records a decision: the revision that it makes.
    ///
    /// # Errors
    /// [`Error::NoSuchMap`]; [`Error::CostsChanged`] if the map's revision is another by now.
    pub async fn decide_cost(&self, new: &NewCostDecision) -> Result<u64, Error> {
        let content_hash = ContentHash::of(&new.payload);
        let mut write = self.write().await?;
        let result = decide(&mut write.connection, new, content_hash).await;
        write.end(result).await
    }

    /// The decisions of a map behind `after`, in order; all from [`JournalSeq::START`] on are as many
    /// as its revision counts.
    ///
    /// # Errors
    /// [`Error::Damaged`] if one does not have its hash any more.
    pub async fn cost_decisions(
        &self,
        map: &MapId,
        after: JournalSeq,
    ) -> Result<Vec<CostDecisionRecord>, Error> {
        let rows: Vec<Row> = sqlx::query_as(
            "select seq, receive_time_ns, content_hash, payload from journal
             where map_id = $1 and 8 <= kind and kind = $2 and $3 < seq order by seq",
        )
        .bind(map)
        .bind(Kind::CostDecided)
        .bind(after)
        .fetch_all(self.readers())
        .await?;
        rows.into_iter().map(record).collect()
    }
}

async fn decide(
    connection: &mut SqliteConnection,
    new: &NewCostDecision,
    content_hash: ContentHash,
) -> Result<u64, Error> {
    let map = require_map(&mut *connection, &new.map).await?;
    let revision = map.cost_revision;
    if revision != new.revision {
        return Err(Error::CostsChanged { map: map.id, revision });
    }
    sqlx::query(
        "insert into journal (map_id, kind, receive_time_ns, content_hash, payload)
         values ($1, $2, $3, $4, $5)",
    )
    .bind(&new.map)
    .bind(Kind::CostDecided)
    .bind(new.time_ns)
    .bind(content_hash.0.as_slice())
    .bind(new.payload.as_slice())
    .execute(&mut *connection)
    .await?;
    sqlx::query("update maps set cost_revision = $1 where id = $2")
        .bind(to_sql(revision + 1))
        .bind(&new.map)
        .execute(connection)
        .await?;
    Ok(revision + 1)
}

fn record(row: Row) -> Result<CostDecisionRecord, Error> {
    let Row { seq, receive_time_ns, content_hash, payload } = row;
    let hash = ContentHash::from_column(&content_hash)?;
    if ContentHash::of(&payload) != hash {
        return Err(Error::Damaged(format!("entry {seq} does not have the hash {hash}")));
    }
    Ok(CostDecisionRecord { seq, time_ns: receive_time_ns, payload })
}
