//! What every request works with.

use std::sync::Arc;

use meetpoint_storage::Store;
use tokio::sync::Semaphore;
use tokio_util::sync::CancellationToken;

use crate::activity::Activity;
use crate::hypotheses::Travels;
use crate::ingest::{JournalWriter, KnownSessions};
use crate::live::Live;
use crate::mapping::Actors;
use crate::operations::graphs::TopologyCache;
use crate::operations::grids::GridCache;
use crate::planning::Planner;
use crate::qualitative::Explored;
use crate::session_cache::SessionCache;
use crate::settings::Settings;

/// The service: operations are its methods, in `operations/`.
#[derive(Clone)]
pub struct Service(pub(crate) Arc<Parts>);

/// What the service is made of.
pub struct Parts {
    pub(crate) settings: Settings,
    pub(crate) store: Store,
    pub(crate) live: Live,
    pub(crate) activity: Activity,
    pub(crate) actors: Actors,
    pub(crate) journal: JournalWriter,
    pub(crate) known_sessions: KnownSessions,
    pub(crate) grids: GridCache,
    pub(crate) topologies: TopologyCache,
    pub(crate) planner: Planner,
    pub(crate) travels: Travels,
    pub(crate) explorations: SessionCache<Explored>,
    /// One permit for each import that may be under way.
    pub(crate) importing: Arc<Semaphore>,
    /// Cancelled when the service stops: long streams end with it.
    pub(crate) stop: CancellationToken,
}

impl std::ops::Deref for Service {
    type Target = Parts;

    fn deref(&self) -> &Parts {
        &self.0
    }
}
