//! The travels asked for lately, so that the next question costs what came since.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use meetpoint_storage::SessionId;
use tokio::sync::Semaphore;

use super::travelled::Travelled;
use crate::settings::HypothesisSettings;

/// Travels that are kept: of a building of a hundred places some megabytes each.
const N_KEPT: usize = 8;

/// A travel that questions share, one after the other.
pub(crate) type KeptTravel = Arc<tokio::sync::Mutex<Travelled>>;

/// A cache over the journal.
pub(crate) struct Travels {
    /// Newest last.
    kept: Mutex<VecDeque<(SessionId, KeptTravel)>>,
    /// One permit for each tree that is grown or searched at the same time: a long travel takes seconds
    /// after a start, and paths are to be planned meanwhile.
    pub(crate) growing: Semaphore,
}

impl Default for Travels {
    fn default() -> Self {
        Self { kept: Mutex::default(), growing: Semaphore::new(1) }
    }
}

impl Travels {
    /// The travel of a session as far as it was read.
    pub(crate) fn of(&self, session: SessionId, limits: &HypothesisSettings) -> KeptTravel {
        let mut kept = self.kept();
        let place = kept.iter().position(|(other, _)| *other == session);
        let found = place.and_then(|place| kept.remove(place)).unwrap_or_else(|| {
            (session, Arc::new(tokio::sync::Mutex::new(Travelled::new(session, limits))))
        });
        let travel = found.1.clone();
        kept.push_back(found);
        while N_KEPT < kept.len() {
            kept.pop_front();
        }
        travel
    }

    /// Forgets the travel of a session, which is read again when it is asked for.
    pub(crate) fn forget(&self, session: SessionId) {
        self.kept().retain(|(other, _)| *other != session);
    }

    /// A panic while the lock was held cannot leave the table half changed.
    fn kept(&self) -> MutexGuard<'_, VecDeque<(SessionId, KeptTravel)>> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
