//! What relax jobs found out about the sessions of a map.

use std::collections::BTreeMap;
use std::sync::Arc;

use meetpoint_geometry::Pose;
use meetpoint_storage::SessionId;

use crate::convert::landmark;
use crate::convert::relaxation::RelaxedSession;

/// The relaxations that a map is drawn by: of each session the newest.
#[derive(Clone, Debug, Default)]
pub(super) struct Relaxations(BTreeMap<SessionId, Arc<RelaxedSession>>);

impl Relaxations {
    /// Takes in what a job found out, in place of what was known of the same sessions.
    pub(super) fn add(&mut self, found: Vec<RelaxedSession>) {
        self.0.extend(found.into_iter().map(|session| (session.session, Arc::new(session))));
    }

    /// Forgets what is known of a session.
    pub(super) fn remove(&mut self, session: SessionId) {
        self.0.remove(&session);
    }

    /// True if a job has told where the robot had been.
    pub(super) fn has(&self, session: SessionId) -> bool {
        self.0.contains_key(&session)
    }

    /// Of how many first observations of a session a job has told.
    pub(super) fn n_poses(&self, session: SessionId) -> usize {
        self.0.get(&session).map_or(0, |relaxed| relaxed.poses.len())
    }

    /// The robot's pose in the session's frame at the observation of that index among those that
    /// have a pose; `None` where no job has told.
    pub(super) fn pose(&self, session: SessionId, index: u64) -> Option<Pose> {
        let relaxed = self.0.get(&session)?;
        relaxed.poses.get(usize::try_from(index).ok()?).copied()
    }

    /// All landmarks, for a version; `None` if there are none.
    pub(super) fn landmark_set(&self) -> Option<Vec<u8>> {
        landmark::set_to_bytes(self.0.values().map(|session| &**session))
    }
}
