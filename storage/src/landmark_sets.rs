//! Landmarks of versions: opaque bytes, addressed by their content.

use sqlx::SqliteConnection;

use crate::number::to_sql;
use crate::tiles::{PackedContent, unpack};
use crate::{ContentHash, Error, MapId, Store};

/// Hash and bytes, both absent where a version has no landmarks.
type ContentRow = (Option<Vec<u8>>, Option<Vec<u8>>);

impl Store {
    /// The landmarks of a version as they were saved; `None` if it has none.
    ///
    /// # Errors
    /// [`Error::NoSuchVersion`]; [`Error::Damaged`] if they are missing or do not have their hash
    /// any more.
    pub async fn landmarks(&self, map: &MapId, number: u64) -> Result<Option<Vec<u8>>, Error> {
        let row: Option<ContentRow> = sqlx::query_as(
            "select landmarks_hash, bytes from map_versions
             left join landmark_sets on hash = landmarks_hash
             where map_id = $1 and number = $2",
        )
        .bind(map)
        .bind(to_sql(number))
        .fetch_optional(self.readers())
        .await?;
        let missing = || Error::NoSuchVersion { map: map.clone(), number };
        let (Some(hash), bytes) = row.ok_or_else(missing)? else { return Ok(None) };
        let hash = ContentHash::from_column(&hash)?;
        let bytes = bytes.ok_or_else(|| Error::Damaged(format!("landmarks {hash} are missing")))?;
        unpack(hash, &bytes).map(Some)
    }
}

/// Stores landmarks. What is there already under the same hash is written again: it is the same,
/// unless the file was damaged.
pub(crate) async fn insert_landmarks(
    connection: &mut SqliteConnection,
    landmarks: &PackedContent,
) -> Result<(), Error> {
    sqlx::query(
        "insert into landmark_sets (hash, bytes) values ($1, $2)
         on conflict (hash) do update set bytes = excluded.bytes",
    )
    .bind(landmarks.hash.0.as_slice())
    .bind(landmarks.bytes.as_slice())
    .execute(connection)
    .await?;
    Ok(())
}
