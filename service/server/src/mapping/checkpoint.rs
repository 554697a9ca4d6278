//! A map's state as bytes, from which mapping goes on bit for bit.
//!
//! The tiles are stored by content beside it; this is the rest.

use std::collections::BTreeMap;
use std::sync::Arc;

use meetpoint_occupancy::{Tile, TileIndex};
use meetpoint_storage::{JournalSeq, SessionId, TileKey};
use prost::Message;
use uuid::Uuid;

use super::decisions::Decisions;
use super::map_state::{MapState, OpenSession};
use super::placements::Place;
use super::sensing::Sensing;
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
    /// The place in the journal up to which decisions are in.
    #[prost(int64, tag = "5")]
    decided_through: i64,
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
    /// Empty for a session in a frame of its own.
    #[prost(double, repeated, tag = "3")]
    frame_from_session: Vec<f64>,
    #[prost(uint64, tag = "4")]
    mapped_through: u64,
    #[prost(uint64, tag = "5")]
    n_poses: u64,
    /// The other session in whose frame it lies; empty for the map's, or its own.
    #[prost(bytes = "vec", tag = "6")]
    frame: Vec<u8>,
}

/// The state without its tiles.
pub(super) fn to_bytes(state: &MapState) -> Vec<u8> {
    let unplaced = state.unplaced.iter().map(|(id, map)| SavedFrame {
        session: id.0.as_bytes().to_vec(),
        state: map.state_bytes(),
    });
    let sessions = state.sessions.iter().map(|(&id, open)| saved_session(id, open));
    Saved {
        format: FORMAT,
        site: state.site.state_bytes(),
        unplaced: unplaced.collect(),
        sessions: sessions.collect(),
        decided_through: state.decisions.through().0,
    }
    .encode_to_vec()
}

fn saved_session(id: SessionId, open: &OpenSession) -> SavedSession {
    let Place { frame, frame_from_session } = open.place;
    let is_on_its_own = frame == Some(id);
    let pose = (!is_on_its_own).then(|| pose::to_record(frame_from_session).to_vec());
    let frame = frame.filter(|_| !is_on_its_own).map(|frame| frame.0.as_bytes().to_vec());
    SavedSession {
        session: id.0.as_bytes().to_vec(),
        declaration: open.declaration.clone(),
        frame_from_session: pose.unwrap_or_default(),
        mapped_through: open.mapped_through,
        n_poses: open.n_poses,
        frame: frame.unwrap_or_default(),
    }
}

/// The place in the journal up to which the state's decisions are in.
///
/// # Errors
/// [`Error::Internal`] if the bytes are damaged.
pub(super) fn decided_through(bytes: &[u8]) -> Result<JournalSeq, Error> {
    Ok(JournalSeq(Saved::decode(bytes).map_err(Error::internal)?.decided_through))
}

/// The state back again, with its decisions.
///
/// # Errors
/// [`Error::Internal`] if the bytes are of another format or damaged.
pub(super) fn restore(
    service_sensing: &Arc<Sensing>,
    resolution_m: f64,
    position: JournalSeq,
    bytes: &[u8],
    tiles: Vec<(TileKey, Arc<Tile>)>,
    decisions: Decisions,
) -> Result<MapState, Error> {
    let Saved { format, site, unplaced, sessions, decided_through: _ } =
        Saved::decode(bytes).map_err(Error::internal)?;
    if format != FORMAT {
        return Err(Error::internal(format!("a checkpoint of format {format}, not {FORMAT}")));
    }
    let mut by_frame: BTreeMap<Option<SessionId>, Vec<(TileIndex, Arc<Tile>)>> = BTreeMap::new();
    for (key, tile) in tiles {
        by_frame.entry(key.frame).or_default().push((TileIndex { x: key.x, y: key.y }, tile));
    }
    let sensing = decisions.sensing(service_sensing)?;
    let mut live = |frame: Option<SessionId>, state: &[u8]| {
        let tiles = by_frame.remove(&frame).unwrap_or_default();
        sensing.restored_map(resolution_m, tiles, state)
    };
    let site = live(None, &site)?;
    let mut frames = BTreeMap::new();
    for SavedFrame { session, state } in unplaced {
        let id = session_id(&session)?;
        frames.insert(id, live(Some(id), &state)?);
    }
    let sessions = sessions.into_iter().map(open_session).collect::<Result<_, Error>>()?;
    Ok(MapState {
        sensing,
        service_sensing: service_sensing.clone(),
        resolution_m,
        decisions,
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
    let SavedSession { session, declaration, frame_from_session, mapped_through, n_poses, frame } =
        saved;
    let id = session_id(&session)?;
    let sensors = sensor::sensors(&session::declaration(&declaration)?.sensors)?;
    let frame = if frame.is_empty() { None } else { Some(session_id(&frame)?) };
    let pose = <[f64; 3]>::try_from(frame_from_session.as_slice()).ok().map(pose::from_record);
    let place = match pose {
        Some(frame_from_session) => Place { frame, frame_from_session },
        None => Place::own(id),
    };
    Ok((id, OpenSession { declaration, sensors, place, mapped_through, n_poses }))
}
