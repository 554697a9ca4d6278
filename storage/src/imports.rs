//! Imports: maps that were made elsewhere, each one entry of a map's journal.

use sqlx::SqliteConnection;

use crate::journal::Kind;
use crate::maps::{find_or_create, require_map};
use crate::{ContentHash, Error, JournalSeq, MapId, MapRecord, NewMap, Store};

/// A map to be imported.
#[derive(Clone, Debug)]
pub struct NewImport {
    /// The map, made on the way if there is none of its id. The time is that of the entry too.
    pub map: NewMap,
    /// What was imported, opaque.
    pub payload: Vec<u8>,
    /// [`ContentHash::of`] the payload: computed by the caller, who has more threads.
    pub content_hash: ContentHash,
}

/// What came of an import. It is durable.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportRecord {
    /// The map.
    pub map: MapRecord,
    /// Its place in the journal.
    pub seq: JournalSeq,
    /// False if the same content was there before.
    pub is_new: bool,
}

impl Store {
    /// Records an import, and makes the map if there is none. The same content again changes
    /// nothing.
    ///
    /// # Errors
    /// [`Error::MapNotEmpty`] if the map has batches or another import; [`Error::OtherResolution`]
    /// if its cells have another size.
    pub async fn import_map(&self, new: &NewImport) -> Result<ImportRecord, Error> {
        let mut write = self.write().await?;
        let result = import(&mut write.connection, new).await;
        write.end(result).await
    }

    /// Whether a map that was made elsewhere became this one.
    ///
    /// # Errors
    /// Those of reading.
    pub async fn is_imported(&self, map: &MapId) -> Result<bool, Error> {
        let found = sqlx::query_scalar(
            "select exists (
                 select 1 from journal where map_id = $1 and 8 <= kind and kind = $2
             )",
        )
        .bind(map)
        .bind(Kind::MapImported)
        .fetch_one(self.readers())
        .await?;
        Ok(found)
    }

    /// The first version of a map that tells what stands at `seq` in its journal, or `None`.
    ///
    /// # Errors
    /// Those of reading.
    pub async fn first_version_with(
        &self,
        map: &MapId,
        seq: JournalSeq,
    ) -> Result<Option<u64>, Error> {
        let number: Option<i64> = sqlx::query_scalar(
            "select min(number) from map_versions where map_id = $1 and $2 <= journal_seq",
        )
        .bind(map)
        .bind(seq)
        .fetch_one(self.readers())
        .await?;
        Ok(number.and_then(|number| u64::try_from(number).ok()))
    }
}

async fn import(connection: &mut SqliteConnection, new: &NewImport) -> Result<ImportRecord, Error> {
    let map = find_or_create(&mut *connection, &new.map).await?;
    if let Some(seq) = find_same(&mut *connection, new).await? {
        return Ok(ImportRecord { map, seq, is_new: false });
    }
    if map.resolution_m.to_bits() != new.map.resolution_m.to_bits() {
        let resolution_m = map.resolution_m;
        return Err(Error::OtherResolution { map: map.id, resolution_m });
    }
    if has_observations(&mut *connection, &map.id).await? {
        return Err(Error::MapNotEmpty(map.id));
    }
    let seq = sqlx::query_scalar(
        "insert into journal (map_id, kind, receive_time_ns, content_hash, payload)
         values ($1, $2, $3, $4, $5) returning seq",
    )
    .bind(&map.id)
    .bind(Kind::MapImported)
    .bind(new.map.time_ns)
    .bind(new.content_hash.0.as_slice())
    .bind(new.payload.as_slice())
    .fetch_one(&mut *connection)
    .await?;
    let map = require_map(connection, &map.id).await?;
    Ok(ImportRecord { map, seq, is_new: true })
}

/// The entry that imported the same content into the map.
async fn find_same(
    connection: &mut SqliteConnection,
    new: &NewImport,
) -> Result<Option<JournalSeq>, Error> {
    let seq = sqlx::query_scalar(
        "select seq from journal
         where map_id = $1 and 8 <= kind and kind = $2 and content_hash = $3",
    )
    .bind(&new.map.id)
    .bind(Kind::MapImported)
    .bind(new.content_hash.0.as_slice())
    .fetch_optional(connection)
    .await?;
    Ok(seq)
}

/// Whether anything was ever observed on the map or imported into it.
async fn has_observations(connection: &mut SqliteConnection, map: &MapId) -> Result<bool, Error> {
    let found = sqlx::query_scalar(
        "select exists (select 1 from journal where map_id = $1 and kind in ($2, $3))",
    )
    .bind(map)
    .bind(Kind::Batch)
    .bind(Kind::MapImported)
    .fetch_one(connection)
    .await?;
    Ok(found)
}
