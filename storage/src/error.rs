//! What can go wrong, in the words of whoever asked.

use std::error::Error as StdError;

use crate::{JobId, MapId, RobotId, SessionId};

/// Why the store did not do what it was asked to. Nothing was changed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The map's id is taken.
    #[error("a map `{0}` exists")]
    MapExists(MapId),
    /// The robot's id is taken.
    #[error("a robot `{0}` exists")]
    RobotExists(RobotId),
    /// No map has that id.
    #[error("no map `{0}`")]
    NoSuchMap(MapId),
    /// No session has that id.
    #[error("no session {0}")]
    NoSuchSession(SessionId),
    /// The map has no version of that number.
    #[error("no version {number} of map `{map}`")]
    NoSuchVersion {
        /// The map.
        map: MapId,
        /// The number asked for.
        number: u64,
    },
    /// No job has that id.
    #[error("no job {0}")]
    NoSuchJob(JobId),
    /// The robot used that key for a session with another map or declaration.
    #[error("robot `{robot}` used the key `{client_key}` for another session")]
    SessionKeyTaken {
        /// The robot.
        robot: RobotId,
        /// Its name for the run.
        client_key: String,
    },
    /// The epoch is not above the robot's newest, or a newer one ended the session.
    #[error("the robot's newest epoch is {newest}")]
    SessionFenced {
        /// The robot's newest epoch.
        newest: u64,
    },
    /// The session is closed.
    #[error("session {0} is closed")]
    SessionClosed(SessionId),
    /// An epoch that no later one could follow.
    #[error("epoch {epoch} is above the limit of {epoch_max}")]
    EpochTooLarge {
        /// The epoch given.
        epoch: u64,
        /// The largest allowed.
        epoch_max: u64,
    },
    /// The map has observations or was imported from other files.
    #[error("map `{0}` is not empty")]
    MapNotEmpty(MapId),
    /// The map's cells have another size.
    #[error("the cells of map `{map}` have {resolution_m} m a side")]
    OtherResolution {
        /// The map.
        map: MapId,
        /// Edge of its cells, in metres.
        resolution_m: f64,
    },
    /// The costs of the map were changed by somebody else meanwhile.
    #[error("the costs of map `{map}` are at revision {revision} by now")]
    CostsChanged {
        /// The map.
        map: MapId,
        /// Its revision.
        revision: u64,
    },
    /// Merges of the map were decided about by somebody else meanwhile.
    #[error("merges of map `{0}` were decided about meanwhile")]
    MergesChanged(MapId),
    /// Poses were to be put behind the end of a trajectory.
    #[error("session {session} has {n_poses} poses, the next cannot have index {first_index}")]
    TrajectoryGap {
        /// Whose trajectory.
        session: SessionId,
        /// Poses that are there.
        n_poses: u64,
        /// Where the new ones were to begin.
        first_index: u64,
    },
    /// Somebody else holds the lease by now.
    #[error("the lease was taken over by another holder")]
    LeaseLost,
    /// The disk is full. The store works again when there is room.
    #[error("the disk is full")]
    Full,
    /// Another process or a long transaction holds the database. Trying again helps.
    #[error("the database is locked")]
    Busy,
    /// What is stored is not what was written. Says where, as far as is known.
    #[error("the database is damaged: {0}")]
    Damaged(String),
    /// The database, its folder or its file system refuses writing.
    #[error("the database is read-only")]
    ReadOnly,
    /// The database was written by a newer program.
    #[error("the database has migration {0}, which this program does not know")]
    UnknownMigration(i64),
    /// Not the caller's fault. The source is for the log.
    #[error("internal error")]
    Internal(#[source] Box<dyn StdError + Send + Sync>),
}

/// Primary result codes of SQLite, the low byte of what it reports:
/// <https://www.sqlite.org/rescode.html>.
mod code {
    pub(super) const BUSY: i32 = 5;
    pub(super) const LOCKED: i32 = 6;
    pub(super) const READONLY: i32 = 8;
    pub(super) const IOERR: i32 = 10;
    pub(super) const CORRUPT: i32 = 11;
    pub(super) const FULL: i32 = 13;
    pub(super) const NOTADB: i32 = 26;
    /// Extended: the shared-memory file of the WAL could not grow, for which there is no other
    /// reason than a full disk.
    pub(super) const IOERR_SHMSIZE: i32 = IOERR | (19 << 8);
    /// Extended: the file system itself found damage.
    pub(super) const IOERR_CORRUPTFS: i32 = IOERR | (33 << 8);
}

impl From<sqlx::Error> for Error {
    fn from(error: sqlx::Error) -> Self {
        match &error {
            sqlx::Error::Database(database) => {
                let code = database.code().and_then(|code| code.parse().ok()).unwrap_or(0);
                Self::from_code(code, database.message()).unwrap_or(Self::Internal(error.into()))
            }
            sqlx::Error::PoolTimedOut => Self::Busy,
            sqlx::Error::ColumnDecode { index, source } => {
                Self::Damaged(format!("column {index}: {source}"))
            }
            _ => Self::Internal(error.into()),
        }
    }
}

impl Error {
    /// Reads an extended result code; `None` if it is nothing that the caller could act on.
    fn from_code(extended: i32, message: &str) -> Option<Self> {
        match (extended, extended & 0xff) {
            (code::IOERR_SHMSIZE, _) | (_, code::FULL) => Some(Self::Full),
            (code::IOERR_CORRUPTFS, _) | (_, code::CORRUPT | code::NOTADB) => {
                Some(Self::Damaged(message.to_owned()))
            }
            (_, code::BUSY | code::LOCKED) => Some(Self::Busy),
            (_, code::READONLY) => Some(Self::ReadOnly),
            _ => None,
        }
    }
}

/// The constraint that a statement violated: the name given in `migrations/`, or `table.column`
/// for a key, which SQLite does not report by name.
pub(crate) fn violated(error: &sqlx::Error) -> Option<&str> {
    let message = error.as_database_error()?.message();
    message.split_once("constraint failed: ").map(|(_, constraint)| constraint)
}
