//! What Meetpoint keeps: the journal, which is the only truth, and what was computed from it.
//!
//! This crate alone knows SQL. It has no clock: every time is an argument. Payloads, tracker states
//! and tiles are opaque bytes.

mod admission;
mod append;
mod closures;
mod connection;
mod content_hash;
mod costs;
mod error;
mod explorations;
mod ids;
mod imports;
mod job_runs;
mod jobs;
mod journal;
mod journal_event;
mod landmark_sets;
mod leases;
mod manifest;
mod mapping_parameters;
mod maps;
mod merges;
mod number;
mod placements;
mod pose_chunk;
mod relaxations;
mod replies;
mod robots;
mod sessions;
mod tiles;
mod topologies;
mod trajectories;
mod travels;
mod versions;

pub use append::{AppendRequest, Appended, NewEntry, Refusal, RejectionRecord};
pub use closures::{ClosureEnds, ClosureFilter, ClosureRecord, ClosureSwitch, NewClosure};
pub use connection::{Store, StoreSettings};
pub use content_hash::ContentHash;
pub use costs::{CostDecisionRecord, NewCostDecision};
pub use error::Error;
pub use explorations::NewExplorationDecision;
pub use ids::{ClosureId, JobId, JournalSeq, MapId, MergeId, RobotId, SessionId};
pub use imports::{ImportRecord, NewImport};
pub use job_runs::{ClaimedJob, JobHeartbeat, JobOutcome, JobReport, NewLogLine};
pub use jobs::{JobRecord, JobState, LOG_LINES_MAX, LogLine, NewJob};
pub use journal::BatchPayload;
pub use journal_event::{JournalEntry, JournalEvent};
pub use leases::MapLease;
pub use manifest::TileKey;
pub use mapping_parameters::NewMappingParameters;
pub use maps::{MapRecord, NewMap};
pub use merges::{
    FoundMerges, MergeDecision, MergeDecisionRecord, MergeFilter, MergeRecord, MergeState,
    NewMerge, NewMergeDecisions,
};
pub use placements::Placement;
pub use pose_chunk::PoseRecord;
pub use relaxations::{NewRelaxation, RelaxationRecord};
pub use replies::RememberedReply;
pub use robots::{NewRobot, RobotRecord};
pub use sessions::{NewSession, OpenedSession, SessionFilter, SessionRecord, SessionState};
pub use tiles::NewTile;
pub use topologies::{EndedRegion, NewTopology, NextIds};
pub use trajectories::{NewPoses, TrajectoryOrigin, TrajectoryPage};
pub use travels::NewHypothesisDecision;
pub use versions::{Checkpoint, NewSnapshot, VersionRecord};
