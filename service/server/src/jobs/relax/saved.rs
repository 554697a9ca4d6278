//! Where a relax job goes on after a crash: which sessions it relaxes and how much of each, what of
//! them is done, and the one under way, bit for bit.

use meetpoint_proto::v1;
use meetpoint_storage::SessionId;
use prost::Message;
use uuid::Uuid;

use crate::convert::relaxation::{self, RelaxedSession};
use crate::error::Error;

/// The layout of [`Written`]; a checkpoint of another one is not gone on from, the job begins anew.
const FORMAT: u32 = 2;

/// By what a session is relaxed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Method {
    /// Landmarks that its detectors saw.
    Landmarks,
    /// Its scans.
    Scans,
    /// Landmarks of the grid that its scans draw, and those that its detectors saw.
    GridLandmarks,
}

/// A session that is to be relaxed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Planned {
    pub(super) session: SessionId,
    pub(super) method: Method,
    /// Its batches up to this number, however many come while the job runs.
    pub(super) through: u64,
}

/// How far a job is.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Saved {
    pub(super) sessions: Vec<Planned>,
    /// Sessions gone through, in their order.
    pub(super) n_done: usize,
    /// What was found of them.
    pub(super) found: Vec<RelaxedSession>,
    /// What there is to tell of them.
    pub(super) told: Vec<v1::RelaxedSession>,
    /// The closures that were considered in them and between them.
    pub(super) closures: Vec<v1::Closure>,
    /// The relaxation of the next session, as it left its last milestone.
    pub(super) under_way: Option<UnderWay>,
    /// Of sessions that expectation maximisation ran on, its last state before the end.
    pub(super) tables: Vec<Kept>,
    /// Whether what was found is in the journal.
    pub(super) is_decided: bool,
}

/// A state that is kept to be looked at.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Kept {
    pub(super) session: SessionId,
    pub(super) state: Vec<u8>,
}

/// A relaxation at a milestone.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct UnderWay {
    /// Iterations and other milestones reached.
    pub(super) n_milestones: u32,
    /// Whether tables of expectation maximisation can be made from it.
    pub(super) has_tables: bool,
    pub(super) state: Vec<u8>,
}

#[derive(Clone, PartialEq, Message)]
struct Written {
    #[prost(uint32, tag = "1")]
    format: u32,
    #[prost(message, repeated, tag = "2")]
    sessions: Vec<WrittenPlan>,
    #[prost(uint64, tag = "3")]
    n_done: u64,
    #[prost(bytes = "vec", tag = "4")]
    found: Vec<u8>,
    #[prost(message, repeated, tag = "5")]
    told: Vec<v1::RelaxedSession>,
    #[prost(message, optional, tag = "6")]
    under_way: Option<WrittenState>,
    #[prost(bool, tag = "7")]
    is_decided: bool,
    #[prost(message, repeated, tag = "8")]
    tables: Vec<WrittenTables>,
    #[prost(message, repeated, tag = "9")]
    closures: Vec<v1::Closure>,
}

#[derive(Clone, PartialEq, Message)]
struct WrittenTables {
    #[prost(bytes = "vec", tag = "1")]
    session: Vec<u8>,
    #[prost(bytes = "vec", tag = "2")]
    state: Vec<u8>,
}

#[derive(Clone, PartialEq, Message)]
struct WrittenPlan {
    #[prost(bytes = "vec", tag = "1")]
    session: Vec<u8>,
    #[prost(uint64, tag = "2")]
    through: u64,
    /// 0 landmarks, 1 scans, 2 landmarks of the grid.
    #[prost(uint32, tag = "3")]
    method: u32,
}

#[derive(Clone, PartialEq, Message)]
struct WrittenState {
    #[prost(uint32, tag = "1")]
    n_milestones: u32,
    #[prost(bytes = "vec", tag = "2")]
    state: Vec<u8>,
    #[prost(bool, tag = "3")]
    has_tables: bool,
}

impl Saved {
    /// A job that has not begun.
    pub(super) fn first(sessions: Vec<Planned>) -> Self {
        Self { sessions, ..Self::default() }
    }

    /// The sessions that are relaxed next: one, or those that are relaxed together by their scans.
    pub(super) fn together(&self) -> &[Planned] {
        let left = &self.sessions[self.n_done.min(self.sessions.len())..];
        let by_scans = |planned: &&Planned| planned.method == Method::Scans;
        let n_by_scans = left.iter().take_while(by_scans).count();
        &left[..n_by_scans.max(1).min(left.len())]
    }

    pub(super) fn to_bytes(&self) -> Vec<u8> {
        let plan = |planned: &Planned| WrittenPlan {
            session: planned.session.0.as_bytes().to_vec(),
            through: planned.through,
            method: match planned.method {
                Method::Landmarks => 0,
                Method::Scans => 1,
                Method::GridLandmarks => 2,
            },
        };
        let state = |under_way: &UnderWay| WrittenState {
            n_milestones: under_way.n_milestones,
            has_tables: under_way.has_tables,
            state: under_way.state.clone(),
        };
        let kept = |kept: &Kept| WrittenTables {
            session: kept.session.0.as_bytes().to_vec(),
            state: kept.state.clone(),
        };
        Written {
            format: FORMAT,
            sessions: self.sessions.iter().map(plan).collect(),
            n_done: self.n_done as u64,
            found: relaxation::to_bytes(&self.found),
            told: self.told.clone(),
            under_way: self.under_way.as_ref().map(state),
            is_decided: self.is_decided,
            tables: self.tables.iter().map(kept).collect(),
            closures: self.closures.clone(),
        }
        .encode_to_vec()
    }

    /// # Errors
    /// [`Error::Internal`] if the bytes are of another format or no checkpoint.
    pub(super) fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        let written = Written::decode(bytes).map_err(Error::internal)?;
        let Written {
            format,
            sessions,
            n_done,
            found,
            told,
            under_way,
            is_decided,
            tables,
            closures,
        } = written;
        if format != FORMAT {
            return Err(Error::internal(format!("a job's checkpoint of format {format}")));
        }
        let plan = |WrittenPlan { session, through, method }: WrittenPlan| {
            let session = Uuid::from_slice(&session).map_err(Error::internal)?;
            let method = match method {
                0 => Method::Landmarks,
                1 => Method::Scans,
                2 => Method::GridLandmarks,
                other => return Err(Error::internal(format!("no method is called {other}"))),
            };
            Ok(Planned { session: SessionId(session), method, through })
        };
        let state = |WrittenState { n_milestones, state, has_tables }| UnderWay {
            n_milestones,
            has_tables,
            state,
        };
        let kept = |WrittenTables { session, state }: WrittenTables| {
            let session = Uuid::from_slice(&session).map_err(Error::internal)?;
            Ok(Kept { session: SessionId(session), state })
        };
        Ok(Self {
            sessions: sessions.into_iter().map(plan).collect::<Result<_, Error>>()?,
            n_done: usize::try_from(n_done).map_err(Error::internal)?,
            found: relaxation::from_bytes(&found)?,
            told,
            closures,
            under_way: under_way.map(state),
            tables: tables.into_iter().map(kept).collect::<Result<_, Error>>()?,
            is_decided,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sessions_with_scans_are_relaxed_together() {
        let session = SessionId(Uuid::from_u128(3));
        let planned = |method| Planned { session, method, through: 1 };
        let methods = [Method::Scans, Method::Scans, Method::Landmarks, Method::Landmarks];
        let mut saved = Saved::first(methods.map(planned).to_vec());
        for (n_done, n_next) in [(0, 2), (1, 1), (2, 1), (3, 1), (4, 0)] {
            saved.n_done = n_done;
            assert_eq!(saved.together().len(), n_next, "after {n_done}");
        }
    }

    #[test]
    fn what_is_written_is_read() {
        let session = SessionId(Uuid::from_u128(3));
        let sessions = vec![Planned { session, method: Method::GridLandmarks, through: 17 }];
        let saved = Saved {
            n_done: 1,
            told: vec![v1::RelaxedSession { landmarks: 4, ..v1::RelaxedSession::default() }],
            under_way: Some(UnderWay { n_milestones: 5, has_tables: true, state: vec![1, 2, 3] }),
            closures: vec![v1::Closure { score: 0.5, ..v1::Closure::default() }],
            tables: vec![Kept { session: sessions[0].session, state: vec![4] }],
            is_decided: true,
            ..Saved::first(sessions)
        };
        let read = Saved::from_bytes(&saved.to_bytes()).expect("just written");
        assert_eq!(read, saved, "all of it");
        assert!(Saved::from_bytes(b"\x08\x07").is_err(), "an unknown format");
    }
}
