//! What happened on a map, as it is read from the journal.

use crate::{JournalSeq, SessionId};

/// Something that happened, with its place in the journal.
#[derive(Clone, Debug, PartialEq)]
pub struct JournalEntry {
    /// Its place.
    pub seq: JournalSeq,
    /// When it came in, by the service's clock, nanoseconds since 1970.
    pub receive_time_ns: i64,
    /// What happened.
    pub event: JournalEvent,
}

/// What happened on a map.
#[derive(Clone, Debug, PartialEq)]
pub enum JournalEvent {
    /// The map was made.
    MapCreated,
    /// A session was opened.
    SessionOpened {
        /// The session.
        session: SessionId,
        /// What its robot declared, opaque.
        declaration: Vec<u8>,
        /// Its place in the map: x and y in metres, theta in radians; `None` if unknown.
        map_from_session: Option<[f64; 3]>,
    },
    /// A batch was received.
    Batch {
        /// The session.
        session: SessionId,
        /// 1, 2, 3... within the session.
        number: u64,
        /// The batch, opaque.
        payload: Vec<u8>,
        /// Indices of observations that are not to be used, ascending as they were given.
        rejected: Vec<u32>,
    },
    /// Batches that will never come.
    Skipped {
        /// The session.
        session: SessionId,
        /// The first number.
        from: u64,
        /// The last number.
        through: u64,
    },
    /// A session was closed by its robot.
    SessionClosed {
        /// The session.
        session: SessionId,
    },
    /// A session was ended by a newer epoch of its robot.
    SessionFenced {
        /// The session.
        session: SessionId,
    },
    /// A person moved the pointer to a version.
    VersionPublished {
        /// The version.
        number: u64,
    },
    /// A map that was made elsewhere became this one.
    MapImported {
        /// What was imported, opaque.
        payload: Vec<u8>,
    },
    /// Something was closed, priced, drawn or taken back on top of the map.
    CostDecided {
        /// What was decided, opaque.
        payload: Vec<u8>,
    },
    /// A job found out where robots had been.
    SessionsRelaxed {
        /// What it found, opaque.
        payload: Vec<u8>,
    },
    /// A person switched a closure off, or on again.
    ClosureSwitched {
        /// What was decided, opaque.
        payload: Vec<u8>,
    },
    /// A person decided what readings of the map's sensors are taken to mean.
    MappingParametersDecided {
        /// What was decided, opaque.
        payload: Vec<u8>,
    },
    /// A session of unknown start was put somewhere, or was not, or was taken back.
    MergeDecided {
        /// What was decided, opaque.
        payload: Vec<u8>,
    },
    /// A person decided how a robot explores that is told step by step, or what it found.
    ExplorationDecided {
        /// What was decided, opaque.
        payload: Vec<u8>,
    },
    /// A person said which topological map is true, or took that back.
    HypothesisDecided {
        /// What was decided, opaque.
        payload: Vec<u8>,
    },
}
