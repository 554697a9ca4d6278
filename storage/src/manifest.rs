//! The complete list of a version's tiles, as bytes.
//!
//! ```text
//! u8   format, 1
//! u32  number of frames;  16 bytes each: the session whose frame it is
//! u32  number of tiles;   44 bytes each:
//!        u32 frame: 0 the map's, n the n-th of the list
//!        i32 x, i32 y
//!        32 bytes BLAKE3 of the tile's content
//! ```
//!
//! Little-endian. Tiles are in ascending order of their keys, so that equal lists are equal bytes.

use std::collections::{BTreeMap, BTreeSet};

use uuid::Uuid;

use crate::{ContentHash, Error, SessionId};

const FORMAT: u8 = 1;
const FRAME_BYTES: usize = 16;
const TILE_BYTES: usize = 44;

/// Where a tile lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TileKey {
    /// The session in whose frame the grid is; `None` for the map's frame.
    pub frame: Option<SessionId>,
    /// Index along +x, in tiles.
    pub x: i32,
    /// Index along +y, in tiles.
    pub y: i32,
}

/// The bytes of a list of tiles. Of two tiles with one key the last counts.
pub(crate) fn encode(tiles: impl IntoIterator<Item = (TileKey, ContentHash)>) -> Vec<u8> {
    let tiles: BTreeMap<TileKey, ContentHash> = tiles.into_iter().collect();
    let frames: Vec<SessionId> =
        tiles.keys().filter_map(|key| key.frame).collect::<BTreeSet<_>>().into_iter().collect();
    let mut bytes = Vec::with_capacity(9 + frames.len() * FRAME_BYTES + tiles.len() * TILE_BYTES);
    bytes.push(FORMAT);
    push_count(&mut bytes, frames.len());
    for frame in &frames {
        bytes.extend_from_slice(frame.0.as_bytes());
    }
    push_count(&mut bytes, tiles.len());
    for (key, hash) in &tiles {
        let frame = key.frame.and_then(|frame| frames.binary_search(&frame).ok());
        push_count(&mut bytes, frame.map_or(0, |index| index + 1));
        bytes.extend_from_slice(&key.x.to_le_bytes());
        bytes.extend_from_slice(&key.y.to_le_bytes());
        bytes.extend_from_slice(&hash.0);
    }
    bytes
}

/// The list of tiles, in ascending order of their keys.
///
/// # Errors
/// [`Error::Damaged`] if the bytes are not a manifest.
pub(crate) fn decode(bytes: &[u8]) -> Result<Vec<(TileKey, ContentHash)>, Error> {
    parse(bytes).ok_or_else(|| Error::Damaged("a version's list of tiles is not readable".into()))
}

fn parse(bytes: &[u8]) -> Option<Vec<(TileKey, ContentHash)>> {
    let rest = bytes.strip_prefix(&[FORMAT])?;
    let (n_frames, rest) = take_count(rest)?;
    let (frames, rest) = rest.split_at_checked(n_frames.checked_mul(FRAME_BYTES)?)?;
    let (n_tiles, rest) = take_count(rest)?;
    if rest.len() != n_tiles.checked_mul(TILE_BYTES)? {
        return None;
    }
    let (frames, _) = frames.as_chunks::<FRAME_BYTES>();
    let (tiles, _) = rest.as_chunks::<TILE_BYTES>();
    tiles.iter().map(|tile| parse_tile(tile, frames)).collect()
}

fn parse_tile(tile: &[u8; TILE_BYTES], frames: &[[u8; 16]]) -> Option<(TileKey, ContentHash)> {
    let (frame, rest) = take_count(tile)?;
    let (x, rest) = rest.split_first_chunk()?;
    let (y, hash) = rest.split_first_chunk()?;
    let frame = match frame.checked_sub(1) {
        None => None,
        Some(index) => Some(SessionId(Uuid::from_bytes(*frames.get(index)?))),
    };
    let key = TileKey { frame, x: i32::from_le_bytes(*x), y: i32::from_le_bytes(*y) };
    Some((key, ContentHash(hash.try_into().ok()?)))
}

/// Counts above 2³² would need terabytes of tiles.
fn push_count(bytes: &mut Vec<u8>, count: usize) {
    bytes.extend_from_slice(&u32::try_from(count).unwrap_or(u32::MAX).to_le_bytes());
}

fn take_count(bytes: &[u8]) -> Option<(usize, &[u8])> {
    let (count, rest) = bytes.split_first_chunk()?;
    Some((usize::try_from(u32::from_le_bytes(*count)).ok()?, rest))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn tile() -> impl Strategy<Value = (TileKey, ContentHash)> {
        let frame = prop::option::of((0..3_u128).prop_map(|id| SessionId(Uuid::from_u128(id))));
        (frame, any::<i32>(), -2..2_i32, any::<[u8; 32]>())
            .prop_map(|(frame, x, y, hash)| (TileKey { frame, x, y }, ContentHash(hash)))
    }

    proptest! {
        #[test]
        fn what_is_written_is_read(tiles in prop::collection::vec(tile(), 0..30)) {
            let listed: BTreeMap<_, _> = tiles.iter().copied().collect();
            let read = decode(&encode(tiles)).expect("it was just written");
            prop_assert_eq!(read, listed.into_iter().collect::<Vec<_>>());
        }

        #[test]
        fn any_bytes_are_read_or_refused(
            tiles in prop::collection::vec(tile(), 0..5),
            place in any::<prop::sample::Index>(),
            byte in any::<u8>(),
            n_kept in any::<prop::sample::Index>(),
        ) {
            let mut bytes = encode(tiles);
            let place = place.index(bytes.len());
            bytes[place] = byte;
            bytes.truncate(n_kept.index(bytes.len() + 1));
            // An answer of either kind is fine; a panic is not.
            let _: Result<_, _> = decode(&bytes);
        }
    }

    /// Format 1, byte by byte: what is stored must stay readable.
    #[test]
    fn format_1_is_read() {
        let session = SessionId(Uuid::from_bytes([7; 16]));
        let mut bytes = vec![1, 1, 0, 0, 0];
        bytes.extend([7; 16]);
        bytes.extend([1, 0, 0, 0]);
        bytes.extend([1, 0, 0, 0, 0xfe, 0xff, 0xff, 0xff, 3, 0, 0, 0]);
        bytes.extend([9; 32]);
        let expected = (TileKey { frame: Some(session), x: -2, y: 3 }, ContentHash([9; 32]));
        assert_eq!(decode(&bytes).expect("it is whole"), [expected], "one tile");
        assert_eq!(encode([expected]), bytes, "written as it is read");
        bytes[0] = 2;
        assert!(matches!(decode(&bytes), Err(Error::Damaged(_))), "an unknown format");
    }
}
