//! The travels asked for lately, so that the next question costs what came since.

use std::convert::Infallible;

use meetpoint_storage::SessionId;
use tokio::sync::Semaphore;

use super::travelled::Travelled;
use crate::session_cache::{SessionCache, Shared};
use crate::settings::HypothesisSettings;

/// Travels that are kept: of a building of a hundred places some megabytes each.
const N_KEPT: usize = 8;

/// A cache over the journal.
pub(crate) struct Travels {
    kept: SessionCache<Travelled>,
    /// One permit for each tree that is grown or searched at the same time: a long travel takes seconds
    /// after a start, and paths are to be planned meanwhile.
    pub(crate) growing: Semaphore,
}

impl Default for Travels {
    fn default() -> Self {
        Self { kept: SessionCache::new(N_KEPT), growing: Semaphore::new(1) }
    }
}

impl Travels {
    /// The travel of a session as far as it was read.
    pub(crate) fn of(&self, session: SessionId, limits: &HypothesisSettings) -> Shared<Travelled> {
        let Ok::<_, Infallible>(shared) =
            self.kept.of(session, || Ok(Travelled::new(session, limits)));
        shared
    }

    /// Forgets the travel of a session, which is read again when it is asked for.
    pub(crate) fn forget(&self, session: SessionId) {
        self.kept.forget(session);
    }
}
