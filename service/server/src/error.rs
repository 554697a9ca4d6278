//! What can go wrong, in the domain's words.

mod code;
mod conversions;

use std::time::Duration;

pub use code::{Code, status};

/// Why an operation was refused or failed.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A field of the request holds what it must not.
    #[error("{field}: {problem}")]
    InvalidField {
        /// Path of the field, as in `sensors[0].laser.n_beams`.
        field: String,
        /// What is wrong: the value and the limit.
        problem: String,
    },
    /// The first message of a stream must attach to a session, and only the first.
    #[error("the first message of a stream is `attach`, and no other is")]
    NotAttached,
    /// The request is larger than is taken.
    #[error("the message has {n_bytes} bytes, at most {limit_bytes} are taken")]
    MessageTooLarge {
        /// Size of what was sent.
        n_bytes: usize,
        /// The limit.
        limit_bytes: usize,
    },
    /// The version has no landmarks to find a robot by.
    #[error("version {number} of map `{map}` has no landmarks that others saw")]
    LandmarksUnknown {
        /// The map.
        map: String,
        /// The version.
        number: u64,
    },
    /// The session saw nothing that a robot could be found by.
    #[error("session `{0}` has seen no landmark, or has no odometry between them")]
    NothingSeen(String),
    /// No map has that id.
    #[error("no map `{0}`")]
    NoSuchMap(String),
    /// No robot has that id.
    #[error("no robot `{0}`")]
    NoSuchRobot(String),
    /// No session has that id.
    #[error("no session `{0}`")]
    NoSuchSession(String),
    /// The session declared no such sensor.
    #[error("the session has no sensor `{0}`")]
    NoSuchSensor(String),
    /// The map has no such version.
    #[error("map `{map}` has no version {number}")]
    NoSuchVersion {
        /// The map.
        map: String,
        /// The version asked for.
        number: u64,
    },
    /// Nothing of the map is published yet.
    #[error("map `{0}` has no published version yet")]
    NothingPublished(String),
    /// The version has no observed cell there.
    #[error("nothing was observed there")]
    NothingObserved,
    /// The session has no place in the map.
    #[error("session `{0}` has no place in the map yet: its start was unknown")]
    SessionNotPlaced(String),
    /// The session is drawn into the map, and has no grid of its own.
    #[error("session `{0}` lies in the map: it is drawn there, and has no grid of its own")]
    SessionPlaced(String),
    /// Nothing of the map could lie on anything.
    #[error(
        "map `{0}` has no session of unknown start that has drawn anything in a frame of its own"
    )]
    NothingToMerge(String),
    /// No session of that merge was looked at.
    #[error("no merge `{0}`")]
    NoSuchMerge(String),
    /// The merge has no such alignment, or not any more.
    #[error("merge `{merge}` has no alignment `{alignment}`: it may have been looked at again")]
    NoSuchAlignment {
        /// The merge.
        merge: String,
        /// The alignment asked for; empty for the first.
        alignment: String,
    },
    /// The session lies where an alignment says.
    #[error("merge `{0}` is accepted: undo it first")]
    MergeAccepted(String),
    /// Nobody has accepted the merge.
    #[error("merge `{0}` was never accepted")]
    MergeNotAccepted(String),
    /// Two sessions would lie in one another.
    #[error("session `{onto}` lies in session `{session}` already: undo that merge first")]
    MergeCycle {
        /// The session that was to be placed.
        session: String,
        /// The session that it was to lie in.
        onto: String,
    },
    /// No session of the map has scans or sightings that a relaxation could use.
    #[error(
        "no session of map `{0}` with a place in it has two scans or saw landmarks twice; those that \
         were tracked in what others had drawn are relaxed only if they are named"
    )]
    NothingToRelax(String),
    /// What a session saw and drove cannot be relaxed.
    #[error("session `{session}` cannot be relaxed: {problem}")]
    CannotRelax {
        /// The session.
        session: String,
        /// Why.
        problem: String,
    },
    /// No relax job considered such a closure on the map, or the newest one did not.
    #[error("map `{map}` has no closure `{closure}`")]
    NoSuchClosure {
        /// The map.
        map: String,
        /// The closure asked for.
        closure: String,
    },
    /// Nobody told of a visit to a place.
    #[error("nothing was told of visits to places on map `{0}`, or by that session")]
    NothingTravelled(String),
    /// No map of that id fits the travel, or not any more.
    #[error("no hypothesis `{0}` fits the travel: it may have gone on, or have been refuted")]
    NoSuchHypothesis(String),
    /// Visits are without odometry, so that there are no metres.
    #[error("visits of this travel are without `moved`: its places have no common frame")]
    TravelNotMeasured,
    /// Too many visits, places and maps to lay out in one frame each.
    #[error(
        "{work} visits times places squared over all maps, at most {limit_work} are laid out by odometry"
    )]
    TravelTooLarge {
        /// Visits times places squared, summed over the maps.
        work: u64,
        /// The limit.
        limit_work: u64,
    },
    /// Nobody has said that it is true.
    #[error("nobody has asserted hypothesis `{0}`")]
    HypothesisNotAsserted(String),
    /// The session has nothing that sees all around.
    #[error("session `{0}` declares no ring of sonars and no laser that looks all around")]
    NotAllAround(String),
    /// The session has not fired yet, or told of no odometry before.
    #[error("session `{0}` has not fired yet with odometry: nothing can be told from nothing")]
    NothingFired(String),
    /// The exploration has found no place of that number, or the hypothesis has none.
    #[error("no place {0} has been found")]
    NoSuchPlace(u32),
    /// No laser has looked around there.
    #[error("no laser scan with odometry was taken around that visit to place {0}")]
    PlaceNotScanned(u32),
    /// No job has that id.
    #[error("no job `{0}`")]
    NoSuchJob(String),
    /// The job found nothing that could be drawn, or has not found it yet.
    #[error(
        "job `{0}` has no such picture: it is no relax job that has succeeded with that session"
    )]
    NoPicture(String),
    /// The id is taken.
    #[error("a map `{0}` exists")]
    MapExists(String),
    /// The id is taken.
    #[error("a robot `{0}` exists")]
    RobotExists(String),
    /// The robot's client key names a session that was opened with other content.
    #[error("the client key names another session of this robot, opened with other content")]
    SessionKeyTaken,
    /// A newer epoch of the robot has taken over, or the epoch is not the session's own.
    #[error("the epoch is not in force: the robot has opened a session of a newer one")]
    SessionFenced {
        /// The robot's newest epoch, where it is at hand.
        newest: Option<u64>,
    },
    /// The session takes no more batches.
    #[error("the session is closed")]
    SessionClosed,
    /// Batches are missing in between.
    #[error("batch {expected} is expected next")]
    SequenceGap {
        /// The number to send.
        expected: u64,
    },
    /// A number was sent again with other content.
    #[error("batch {number} was received before with other content")]
    BatchContentMismatch {
        /// The batch.
        number: u64,
    },
    /// More was asked for than one reply holds.
    #[error("{n_cells} cells, at most {limit_cells}: ask for less by a bounding box")]
    GridTooLarge {
        /// Cells asked for.
        n_cells: u64,
        /// The limit.
        limit_cells: u64,
    },
    /// The map has observations, or came from other files.
    #[error("map `{0}` is not empty: import into a new one")]
    MapNotEmpty(String),
    /// The map has more cells than can be worked on.
    #[error("a map of {n_cells} cells; at most {limit_cells} are taken")]
    MapTooLarge {
        /// Cells of the map.
        n_cells: u64,
        /// The limit.
        limit_cells: u64,
    },
    /// An older program made the version, which has no graph.
    #[error(
        "version {version} of map `{map}` was made without a graph: `meetpoint rebuild {map}` makes \
         one that has it"
    )]
    NoGraph {
        /// The map.
        map: String,
        /// The version.
        version: u64,
    },
    /// The map never had a region of that id, or not in versions up to this one.
    #[error("map `{map}` has no region {region} in version {version} and had none before")]
    NoSuchRegion {
        /// The map.
        map: String,
        /// The region asked for.
        region: u64,
        /// The version asked for.
        version: u64,
    },
    /// The map has no profile of that name.
    #[error("map `{map}` has no profile `{name}`")]
    NoSuchProfile {
        /// The map.
        map: String,
        /// The name asked for.
        name: String,
    },
    /// The map's published version has no arc of that id.
    #[error("map `{map}` has no arc {arc} in version {version}")]
    NoSuchArc {
        /// The map.
        map: String,
        /// The arc asked for.
        arc: u64,
        /// The published version.
        version: u64,
    },
    /// Nothing of that id is in force on the map.
    #[error("no cost `{0}` is in force")]
    NoSuchCost(String),
    /// The client key made another cost.
    #[error("the client key names another cost of this map, made with other content")]
    CostKeyTaken,
    /// No more costs are taken.
    #[error("{limit} costs are in force on the map, no more are taken: take some back")]
    TooManyCosts {
        /// The limit.
        limit: usize,
    },
    /// More paths were asked for than one reply holds.
    #[error("{n_pairs} pairs of start and goal, at most {limit_pairs} are taken")]
    MatrixTooLarge {
        /// Pairs asked for.
        n_pairs: u64,
        /// The limit.
        limit_pairs: u64,
    },
    /// The tables that were asked for are still being made.
    #[error("the plan tables are still being made")]
    PlanTablesNotReady,
    /// The same Idempotency-Key came with another request.
    #[error("this Idempotency-Key was used for another request")]
    IdempotencyKeyReused,
    /// The disk is full: nothing was kept of this request, everything acknowledged is.
    #[error("the service's disk is full; nothing of this request was kept")]
    StorageFull,
    /// Another process holds the database.
    #[error("the service's database is locked; nothing of this request was kept")]
    StorageBusy,
    /// The database file does not say what was written.
    #[error(
        "the service's database is damaged; its operator has to rebuild the map or restore a copy"
    )]
    StorageDamaged,
    /// The service is going down.
    #[error("the service is stopping")]
    Stopping,
    /// Not the caller's fault. The source is logged and never sent.
    #[error("internal error")]
    Internal(#[source] Box<dyn std::error::Error + Send + Sync>),
}

impl Error {
    /// A field at fault and what is wrong with it.
    pub fn field(field: impl Into<String>, problem: impl Into<String>) -> Self {
        Self::InvalidField { field: field.into(), problem: problem.into() }
    }

    /// Something that should not happen, kept for the log.
    pub fn internal(source: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> Self {
        Self::Internal(source.into())
    }

    /// What the caller can do.
    #[must_use]
    pub fn code(&self) -> Code {
        self.row().0
    }

    /// The stable name that programs switch on.
    #[must_use]
    pub fn reason(&self) -> &'static str {
        self.row().1
    }

    fn row(&self) -> (Code, &'static str) {
        match self {
            Self::InvalidField { .. } => (Code::Invalid, "INVALID_FIELD"),
            Self::NotAttached => (Code::Invalid, "NOT_ATTACHED"),
            Self::MessageTooLarge { .. } => (Code::TooLarge, "MESSAGE_TOO_LARGE"),
            Self::NoSuchMap(_) => (Code::NotFound, "MAP_NOT_FOUND"),
            Self::NoSuchRobot(_) => (Code::NotFound, "ROBOT_NOT_FOUND"),
            Self::NoSuchSession(_) => (Code::NotFound, "SESSION_NOT_FOUND"),
            Self::NoSuchSensor(_) => (Code::NotFound, "SENSOR_NOT_FOUND"),
            Self::NoSuchVersion { .. } => (Code::NotFound, "VERSION_NOT_FOUND"),
            Self::NothingPublished(_) => (Code::NotFound, "NOTHING_PUBLISHED"),
            Self::NothingObserved => (Code::NotFound, "NOTHING_OBSERVED"),
            Self::SessionNotPlaced(_) => (Code::WrongState, "SESSION_NOT_PLACED"),
            Self::SessionPlaced(_) => (Code::WrongState, "SESSION_PLACED"),
            Self::NothingToMerge(_) => (Code::WrongState, "NOTHING_TO_MERGE"),
            Self::NoSuchMerge(_) => (Code::NotFound, "MERGE_NOT_FOUND"),
            Self::NoSuchAlignment { .. } => (Code::NotFound, "ALIGNMENT_NOT_FOUND"),
            Self::MergeAccepted(_) => (Code::WrongState, "MERGE_ACCEPTED"),
            Self::MergeNotAccepted(_) => (Code::WrongState, "MERGE_NOT_ACCEPTED"),
            Self::MergeCycle { .. } => (Code::WrongState, "MERGE_CYCLE"),
            Self::NothingToRelax(_) => (Code::WrongState, "NOTHING_TO_RELAX"),
            Self::CannotRelax { .. } => (Code::WrongState, "CANNOT_RELAX"),
            Self::NoSuchClosure { .. } => (Code::NotFound, "CLOSURE_NOT_FOUND"),
            Self::LandmarksUnknown { .. } => (Code::WrongState, "LANDMARKS_UNKNOWN"),
            Self::NothingSeen(_) => (Code::WrongState, "NOTHING_SEEN"),
            Self::NothingTravelled(_) => (Code::NotFound, "NOTHING_TRAVELLED"),
            Self::NoSuchHypothesis(_) => (Code::NotFound, "HYPOTHESIS_NOT_FOUND"),
            Self::TravelNotMeasured => (Code::WrongState, "TRAVEL_NOT_MEASURED"),
            Self::TravelTooLarge { .. } => (Code::TooLarge, "TRAVEL_TOO_LARGE"),
            Self::HypothesisNotAsserted(_) => (Code::WrongState, "HYPOTHESIS_NOT_ASSERTED"),
            Self::NotAllAround(_) => (Code::WrongState, "NOT_ALL_AROUND"),
            Self::NothingFired(_) => (Code::NotFound, "NOTHING_FIRED"),
            Self::NoSuchPlace(_) => (Code::NotFound, "PLACE_NOT_FOUND"),
            Self::PlaceNotScanned(_) => (Code::NotFound, "PLACE_NOT_SCANNED"),
            Self::NoSuchJob(_) => (Code::NotFound, "JOB_NOT_FOUND"),
            Self::NoPicture(_) => (Code::NotFound, "PICTURE_NOT_MADE"),
            Self::MapExists(_) => (Code::AlreadyExists, "MAP_EXISTS"),
            Self::RobotExists(_) => (Code::AlreadyExists, "ROBOT_EXISTS"),
            Self::SessionKeyTaken => (Code::AlreadyExists, "SESSION_KEY_TAKEN"),
            Self::SessionFenced { .. } => (Code::WrongState, "SESSION_FENCED"),
            Self::SessionClosed => (Code::WrongState, "SESSION_CLOSED"),
            Self::SequenceGap { .. } => (Code::SequenceGap, "SEQUENCE_GAP"),
            Self::BatchContentMismatch { .. } => (Code::AlreadyExists, "BATCH_CONTENT_MISMATCH"),
            Self::GridTooLarge { .. } => (Code::TooLarge, "GRID_TOO_LARGE"),
            Self::MapNotEmpty(_) => (Code::WrongState, "MAP_NOT_EMPTY"),
            Self::MapTooLarge { .. } => (Code::TooLarge, "MAP_TOO_LARGE"),
            Self::NoGraph { .. } => (Code::NotFound, "GRAPH_NOT_MADE"),
            Self::NoSuchRegion { .. } => (Code::NotFound, "REGION_NOT_FOUND"),
            Self::NoSuchProfile { .. } => (Code::NotFound, "PROFILE_NOT_FOUND"),
            Self::NoSuchArc { .. } => (Code::NotFound, "ARC_NOT_FOUND"),
            Self::NoSuchCost(_) => (Code::NotFound, "COST_NOT_FOUND"),
            Self::CostKeyTaken => (Code::AlreadyExists, "COST_KEY_TAKEN"),
            Self::TooManyCosts { .. } => (Code::WrongState, "TOO_MANY_COSTS"),
            Self::MatrixTooLarge { .. } => (Code::TooLarge, "MATRIX_TOO_LARGE"),
            Self::PlanTablesNotReady => (Code::Busy, "PLAN_TABLES_NOT_READY"),
            Self::IdempotencyKeyReused => (Code::Conflict, "IDEMPOTENCY_KEY_REUSED"),
            Self::StorageFull => (Code::Full, "STORAGE_FULL"),
            Self::StorageBusy => (Code::Busy, "STORAGE_BUSY"),
            Self::StorageDamaged => (Code::Damaged, "STORAGE_DAMAGED"),
            Self::Stopping => (Code::Busy, "STOPPING"),
            Self::Internal(_) => (Code::Internal, "INTERNAL"),
        }
    }

    /// Facts for programs, by name.
    #[must_use]
    pub fn metadata(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::InvalidField { field, .. } => vec![("field", field.clone())],
            Self::SessionFenced { newest: Some(newest) } => {
                vec![("newest_epoch", newest.to_string())]
            }
            Self::SequenceGap { expected } => vec![("expected_number", expected.to_string())],
            Self::BatchContentMismatch { number } => vec![("number", number.to_string())],
            Self::MessageTooLarge { limit_bytes, .. } => {
                vec![("limit_bytes", limit_bytes.to_string())]
            }
            Self::GridTooLarge { limit_cells, .. } | Self::MapTooLarge { limit_cells, .. } => {
                vec![("limit_cells", limit_cells.to_string())]
            }
            Self::MatrixTooLarge { limit_pairs, .. } => {
                vec![("limit_pairs", limit_pairs.to_string())]
            }
            Self::TravelTooLarge { limit_work, .. } => {
                vec![("limit_work", limit_work.to_string())]
            }
            _ => Vec::new(),
        }
    }

    /// How long to wait before trying the same again, where that makes sense.
    #[must_use]
    pub fn retry_after(&self) -> Option<Duration> {
        match self.code() {
            Code::Full => Some(Duration::from_secs(30)),
            Code::Busy => Some(Duration::from_secs(1)),
            _ => None,
        }
    }

    /// Writes what must not be sent to the caller to the log.
    pub fn log(&self) {
        match self {
            Self::Internal(source) => tracing::error!(error = %chain(&**source), "internal error"),
            Self::StorageFull | Self::StorageBusy | Self::StorageDamaged => {
                tracing::error!("{self}");
            }
            _ => {}
        }
    }
}

/// An error with all its causes, in one line.
fn chain(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        text = format!("{text}: {cause}");
        source = cause.source();
    }
    text
}
