//! What relax jobs found out about the sessions of a map: decisions of the journal that a map is
//! drawn by.
//!
//! They say where a robot had been before they were made, so they are known before the first entry
//! is applied: a map's state is a function of the journal up to one place and of the relaxations up to
//! another, and both are kept with it.

use std::collections::BTreeMap;
use std::sync::Arc;

use meetpoint_geometry::Pose;
use meetpoint_storage::{JournalSeq, MapId, SessionId, Store};

use crate::convert::landmark;
use crate::convert::relaxation::{self, RelaxedSession};
use crate::error::Error;

/// The relaxations that a map is drawn by: of each session the newest.
#[derive(Clone, Debug)]
pub(crate) struct Relaxations {
    through: JournalSeq,
    sessions: BTreeMap<SessionId, Arc<RelaxedSession>>,
}

impl Relaxations {
    /// Those of a map up to a place in its journal.
    ///
    /// # Errors
    /// The store's; [`Error::Internal`] if one cannot be read.
    pub(crate) async fn load(
        store: &Store,
        map: &MapId,
        through: JournalSeq,
    ) -> Result<Self, Error> {
        let mut sessions = BTreeMap::new();
        for record in store.relaxations(map, through).await? {
            for session in relaxation::from_bytes(&record.payload)? {
                sessions.insert(session.session, Arc::new(session));
            }
        }
        Ok(Self { through, sessions })
    }

    /// The same with what a job found out besides, before it is decided.
    pub(crate) fn with(mut self, found: &[RelaxedSession]) -> Self {
        let found = found.iter().map(|session| (session.session, Arc::new(session.clone())));
        self.sessions.extend(found);
        self
    }

    /// The same without what is known of a session.
    pub(crate) fn without(mut self, session: SessionId) -> Self {
        self.sessions.remove(&session);
        self
    }

    /// The place in the journal up to which relaxations are in.
    pub(super) fn through(&self) -> JournalSeq {
        self.through
    }

    /// True if a job has told where the robot had been.
    pub(super) fn has(&self, session: SessionId) -> bool {
        self.sessions.contains_key(&session)
    }

    /// The robot's pose in the session's frame at the observation of that index among those that
    /// have a pose; `None` where no job has told.
    pub(super) fn pose(&self, session: SessionId, index: u64) -> Option<Pose> {
        let relaxed = self.sessions.get(&session)?;
        relaxed.poses.get(usize::try_from(index).ok()?).copied()
    }

    /// All landmarks, for a version; `None` if there are none.
    pub(super) fn landmark_set(&self) -> Option<Vec<u8>> {
        let sessions = self.sessions.values().map(|session| &**session);
        landmark::set_to_bytes(sessions)
    }
}
