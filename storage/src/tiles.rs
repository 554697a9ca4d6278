//! Pieces of grids, addressed by their content and never changed.

use std::collections::HashMap;

use sqlx::{QueryBuilder, Sqlite, SqliteConnection};

use crate::{ContentHash, Error, Store, TileKey};

/// A tile of a snapshot.
#[derive(Clone, Debug)]
pub struct NewTile {
    /// Where it lies.
    pub key: TileKey,
    /// [`ContentHash::of`] its content.
    pub hash: ContentHash,
    /// Its content; `None` if it is stored already.
    pub bytes: Option<Vec<u8>>,
}

/// Content as it is.
const FORMAT_PLAIN: u8 = 0;
/// Content compressed by zstd.
const FORMAT_ZSTD: u8 = 1;

/// The fastest level of zstd proper; higher ones gain little on grids.
const ZSTD_LEVEL: i32 = 1;

/// Above this size stored content is not believed, in bytes. Tiles have well below a megabyte, the
/// topology of the largest map some ten.
const CONTENT_BYTES_MAX: usize = 64 << 20;

/// Rows a statement reads or writes at most.
const ROWS_PER_STATEMENT: usize = 16;

impl Store {
    /// The contents of tiles, in the order asked for.
    ///
    /// # Errors
    /// [`Error::Damaged`] if one is missing or does not have its hash any more.
    pub async fn tiles(
        &self,
        hashes: &[ContentHash],
    ) -> Result<Vec<(ContentHash, Vec<u8>)>, Error> {
        let mut found = HashMap::with_capacity(hashes.len());
        for chunk in hashes.chunks(ROWS_PER_STATEMENT) {
            let mut query =
                QueryBuilder::<Sqlite>::new("select hash, bytes from tiles where hash in (");
            let mut list = query.separated(", ");
            for hash in chunk {
                list.push_bind(hash.0.to_vec());
            }
            query.push(")");
            let rows: Vec<(Vec<u8>, Vec<u8>)> =
                query.build_query_as().fetch_all(self.readers()).await?;
            for (hash, bytes) in rows {
                let hash = ContentHash::from_column(&hash)?;
                found.insert(hash, unpack(hash, &bytes)?);
            }
        }
        let content = |hash: &ContentHash| {
            let bytes = found.get(hash).cloned();
            let missing = || Error::Damaged(format!("tile {hash} is missing"));
            bytes.map(|bytes| (*hash, bytes)).ok_or_else(missing)
        };
        hashes.iter().map(content).collect()
    }
}

/// Stores the contents of tiles. What is there already under the same hash is written again: it is
/// the same, unless the file was damaged.
pub(crate) async fn insert_tiles(
    connection: &mut SqliteConnection,
    tiles: &[PackedContent],
) -> Result<(), Error> {
    for chunk in tiles.chunks(ROWS_PER_STATEMENT) {
        let mut query = QueryBuilder::<Sqlite>::new("insert into tiles (hash, bytes) ");
        query.push_values(chunk, |mut row, tile| {
            row.push_bind(tile.hash.0.to_vec()).push_bind(tile.bytes.clone());
        });
        query.push(" on conflict (hash) do update set bytes = excluded.bytes");
        query.build().execute(&mut *connection).await?;
    }
    Ok(())
}

/// A tile, or other content with a hash, as it is stored.
pub(crate) struct PackedContent {
    pub(crate) hash: ContentHash,
    pub(crate) bytes: Vec<u8>,
}

/// The bytes to store: a format byte and the content, compressed if that makes it shorter.
pub(crate) fn pack(hash: ContentHash, content: &[u8]) -> PackedContent {
    let compressed = zstd::bulk::compress(content, ZSTD_LEVEL).ok();
    let (format, body) = match &compressed {
        Some(shorter) if shorter.len() < content.len() => (FORMAT_ZSTD, shorter.as_slice()),
        _ => (FORMAT_PLAIN, content),
    };
    let mut bytes = Vec::with_capacity(1 + body.len());
    bytes.push(format);
    bytes.extend_from_slice(body);
    PackedContent { hash, bytes }
}

/// The content of a stored tile or other content, which must have its hash.
///
/// # Errors
/// [`Error::Damaged`] if it does not.
pub(crate) fn unpack(hash: ContentHash, bytes: &[u8]) -> Result<Vec<u8>, Error> {
    let content = match bytes.split_first() {
        Some((&FORMAT_PLAIN, body)) => Some(body.to_vec()),
        Some((&FORMAT_ZSTD, body)) => zstd::bulk::decompress(body, CONTENT_BYTES_MAX).ok(),
        _ => None,
    };
    content
        .filter(|content| ContentHash::of(content) == hash)
        .ok_or_else(|| Error::Damaged(format!("content {hash} does not have its hash any more")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_are_compressed_where_it_pays() {
        let (flat, rough) = ([0_u8; 4096], ContentHash::of(b"noise").0);
        let packed = [pack(ContentHash::of(&flat), &flat), pack(ContentHash::of(&rough), &rough)];
        let formats = packed.each_ref().map(|tile| tile.bytes[0]);
        assert_eq!(formats, [FORMAT_ZSTD, FORMAT_PLAIN], "noise does not get shorter");
        assert!(packed[0].bytes.len() < 64, "a flat tile is short");
        for (tile, content) in packed.iter().zip([&flat[..], &rough]) {
            assert_eq!(unpack(tile.hash, &tile.bytes).expect("it is whole"), content, "as it was");
        }
    }

    #[test]
    fn damage_is_noticed() {
        let hash = ContentHash::of(b"tile");
        for bytes in [&b""[..], b"\x00tilt", b"\x01tile", b"\x02tile"] {
            let unpacked = unpack(hash, bytes);
            assert!(matches!(unpacked, Err(Error::Damaged(_))), "{bytes:?} is no tile");
        }
    }
}
