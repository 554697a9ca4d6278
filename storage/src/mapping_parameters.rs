//! What readings of a map's sensors are taken to mean, each decision an entry of its journal: the newest counts.

use sqlx::SqliteConnection;

use crate::journal::Kind;
use crate::maps::require_map;
use crate::{ContentHash, Error, JournalSeq, MapId, Store};

/// A decision to be recorded.
#[derive(Clone, Debug)]
pub struct NewMappingParameters {
    /// The map.
    pub map: MapId,
    /// What was decided, opaque.
    pub payload: Vec<u8>,
    /// The service's clock, nanoseconds since 1970.
    pub time_ns: i64,
}

#[derive(sqlx::FromRow)]
struct Row {
    seq: JournalSeq,
    content_hash: Vec<u8>,
    payload: Vec<u8>,
}

impl Store {
    /// Records a decision.
    ///
    /// # Errors
    /// [`Error::NoSuchMap`].
    pub async fn decide_mapping_parameters(&self, new: &NewMappingParameters) -> Result<(), Error> {
        let hash = ContentHash::of(&new.payload);
        let mut write = self.write().await?;
        let result = insert(&mut write.connection, new, hash).await;
        write.end(result).await
    }

    /// What was decided last, up to a place in the journal; `None` if nothing was.
    ///
    /// # Errors
    /// [`Error::Damaged`] if it does not have its hash any more.
    pub async fn mapping_parameters(
        &self,
        map: &MapId,
        through: JournalSeq,
    ) -> Result<Option<Vec<u8>>, Error> {
        let row: Option<Row> = sqlx::query_as(
            "select seq, content_hash, payload from journal
             where map_id = $1 and 8 <= kind and kind = $2 and seq <= $3
             order by seq desc limit 1",
        )
        .bind(map)
        .bind(Kind::MappingParametersDecided)
        .bind(through)
        .fetch_optional(self.readers())
        .await?;
        let Some(Row { seq, content_hash, payload }) = row else { return Ok(None) };
        let hash = ContentHash::from_column(&content_hash)?;
        if ContentHash::of(&payload) != hash {
            return Err(Error::Damaged(format!("entry {seq} does not have the hash {hash}")));
        }
        Ok(Some(payload))
    }
}

async fn insert(
    connection: &mut SqliteConnection,
    new: &NewMappingParameters,
    content_hash: ContentHash,
) -> Result<(), Error> {
    require_map(&mut *connection, &new.map).await?;
    sqlx::query(
        "insert into journal (map_id, kind, receive_time_ns, content_hash, payload)
         values ($1, $2, $3, $4, $5)",
    )
    .bind(&new.map)
    .bind(Kind::MappingParametersDecided)
    .bind(new.time_ns)
    .bind(content_hash.0.as_slice())
    .bind(new.payload.as_slice())
    .execute(connection)
    .await?;
    Ok(())
}
