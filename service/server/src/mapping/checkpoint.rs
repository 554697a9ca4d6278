//! A map's state as bytes, from which mapping goes on bit for bit.
//!
//! The tiles are stored by content beside it; this is the rest.

use std::collections::BTreeMap;
use std::sync::Arc;

use meetpoint_occupancy::{Tile, TileIndex};
use meetpoint_storage::{JournalSeq, SessionId, TileKey};
use meetpoint_tracking::{LiveMap, MappingParams};
use prost::Message;
use uuid::Uuid;

use super::map_state::{MapState, OpenSession};
use super::relaxations::Relaxations;
use crate::convert::{pose, sensor, session};
use crate::error::Error;

/// The layout of [`Saved`]; another number is refused and the map is made anew from the journal.
const FORMAT: u32 = 1;

/// What is written. Field numbers are kept for ever.
#[derive(Clone, PartialEq, Message)]
struct Saved {
    #[prost(uint32, tag = "1")]
    format: u32,
    #[prost(bytes = "vec", tag = "2")]
    site: Vec<u8>,
    #[prost(message, repeated, tag = "3")]
    unplaced: Vec<SavedFrame>,
    #[prost(message, repeated, tag = "4")]
    sessions: Vec<SavedSession>,
    /// The place in the journal up to which relaxations are in.
    #[prost(int64, tag = "5")]
    relaxed_through: i64,
}

#[derive(Clone, PartialEq, Message)]
struct SavedFrame {
    #[prost(bytes = "vec", tag = "1")]
    session: Vec<u8>,
    #[prost(bytes = "vec", tag = "2")]
    state: Vec<u8>,
}

#[derive(Clone, PartialEq, Message)]
struct SavedSession {
    #[prost(bytes = "vec", tag = "1")]
    session: Vec<u8>,
    #[prost(bytes = "vec", tag = "2")]
    declaration: Vec<u8>,
    #[prost(double, repeated, tag = "3")]
    map_from_session: Vec<f64>,
    #[prost(uint64, tag = "4")]
    mapped_through: u64,
    #[prost(uint64, tag = "5")]
    n_poses: u64,
}

/// The state without its tiles.
pub(super) fn to_bytes(state: &MapState) -> Vec<u8> {
    let unplaced = state.unplaced.iter().map(|(id, map)| SavedFrame {
        session: id.0.as_bytes().to_vec(),
        state: map.state_bytes(),
    });
    let sessions = state.sessions.iter().map(|(id, open)| SavedSession {
        session: id.0.as_bytes().to_vec(),
        declaration: open.declaration.clone(),
        map_from_session: open
            .map_from_session
            .map(pose::to_record)
            .into_iter()
            .flatten()
            .collect(),
        mapped_through: open.mapped_through,
        n_poses: open.n_poses,
    });
    Saved {
        format: FORMAT,
        site: state.site.state_bytes(),
        unplaced: unplaced.collect(),
        sessions: sessions.collect(),
        relaxed_through: state.relaxations.through().0,
    }
    .encode_to_vec()
}

/// The place in the journal up to which the state's relaxations are in.
///
/// # Errors
/// [`Error::Internal`] if the bytes are damaged.
pub(super) fn relaxed_through(bytes: &[u8]) -> Result<JournalSeq, Error> {
    Ok(JournalSeq(Saved::decode(bytes).map_err(Error::internal)?.relaxed_through))
}

/// The state back again, with its relaxations.
///
/// # Errors
/// [`Error::Internal`] if the bytes are of another format or damaged.
pub(super) fn restore(
    params: &MappingParams,
    resolution_m: f64,
    position: JournalSeq,
    bytes: &[u8],
    tiles: Vec<(TileKey, Arc<Tile>)>,
    relaxations: Relaxations,
) -> Result<MapState, Error> {
    let Saved { format, site, unplaced, sessions, relaxed_through: _ } =
        Saved::decode(bytes).map_err(Error::internal)?;
    if format != FORMAT {
        return Err(Error::internal(format!("a checkpoint of format {format}, not {FORMAT}")));
    }
    let mut by_frame: BTreeMap<Option<SessionId>, Vec<(TileIndex, Arc<Tile>)>> = BTreeMap::new();
    for (key, tile) in tiles {
        by_frame.entry(key.frame).or_default().push((TileIndex { x: key.x, y: key.y }, tile));
    }
    let mut live = |frame: Option<SessionId>, state: &[u8]| {
        let tiles = by_frame.remove(&frame).unwrap_or_default();
        LiveMap::restore(*params, resolution_m, tiles, state)
            .map_err(|error| Error::internal(format!("a checkpoint cannot be read: {error:?}")))
    };
    let site = live(None, &site)?;
    let mut frames = BTreeMap::new();
    for SavedFrame { session, state } in unplaced {
        let id = session_id(&session)?;
        frames.insert(id, live(Some(id), &state)?);
    }
    let sessions = sessions.into_iter().map(open_session).collect::<Result<_, Error>>()?;
    Ok(MapState {
        params: *params,
        resolution_m,
        relaxations,
        site,
        unplaced: frames,
        sessions,
        poses: BTreeMap::new(),
        position,
        n_scans_since_snapshot: 0,
    })
}

fn session_id(bytes: &[u8]) -> Result<SessionId, Error> {
    Ok(SessionId(Uuid::from_slice(bytes).map_err(Error::internal)?))
}

fn open_session(saved: SavedSession) -> Result<(SessionId, OpenSession), Error> {
    let SavedSession { session: id, declaration, map_from_session, mapped_through, n_poses } =
        saved;
    let sensors = sensor::sensors(&session::declaration(&declaration)?.sensors)?;
    let map_from_session =
        <[f64; 3]>::try_from(map_from_session.as_slice()).ok().map(pose::from_record);
    let open = OpenSession { declaration, sensors, map_from_session, mapped_through, n_poses };
    Ok((session_id(&id)?, open))
}
