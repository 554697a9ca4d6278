//! What is going on now, for whoever watches: where sessions are, and what happens on maps.

use std::collections::HashMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use meetpoint_proto::v1;
use meetpoint_storage::{JobId, MapId, SessionId};
use tokio::sync::{broadcast, watch};

/// Events that a slow watcher may fall behind before it is told that some were left out.
const N_EVENTS_KEPT: usize = 1024;

/// How far the mapping of a session is.
#[derive(Clone, Debug, Default)]
pub(crate) struct SessionProgress {
    /// Batches up to this number are mapped.
    pub(crate) mapped_through: u64,
    /// The newest pose.
    pub(crate) correction: Option<v1::PoseCorrection>,
}

/// `None` until its map has told.
type Told = Option<SessionProgress>;

/// Something that happened on a map.
#[derive(Clone, Debug)]
pub(crate) enum Event {
    /// A version was made, or the pointer moved.
    Version(v1::MapVersion),
    /// A session opened or ended.
    Session(Box<v1::Session>),
    /// A robot's pose was corrected.
    Correction(v1::SessionCorrection),
    /// A job moved on.
    Job(JobId),
    /// A cost or a profile was changed.
    Costs(v1::CostsChanged),
}

/// The present, shared by actors, streams and queries.
#[derive(Clone, Debug)]
pub(crate) struct Live(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    sessions: Mutex<HashMap<SessionId, watch::Sender<Told>>>,
    events: broadcast::Sender<(MapId, Event)>,
    /// Versions and costs announced.
    n_changes: AtomicU64,
}

impl Live {
    /// Nothing is going on yet.
    pub(crate) fn new() -> Self {
        let (events, _) = broadcast::channel(N_EVENTS_KEPT);
        let n_changes = AtomicU64::new(0);
        Self(Arc::new(Inner { sessions: Mutex::default(), events, n_changes }))
    }

    /// Tells how far a session is. Only the newest is kept.
    pub(crate) fn progress(&self, session: SessionId, progress: SessionProgress) {
        self.sessions().entry(session).or_default().send_replace(Some(progress));
    }

    /// How far a session is, if its map is in memory.
    pub(crate) fn session(&self, session: SessionId) -> Option<SessionProgress> {
        self.sessions().get(&session).and_then(|sender| sender.borrow().clone())
    }

    /// Follows a session.
    pub(crate) fn follow(&self, session: SessionId) -> watch::Receiver<Told> {
        self.sessions().entry(session).or_default().subscribe()
    }

    /// Forgets a session that nobody follows.
    pub(crate) fn forget(&self, session: SessionId) {
        let mut sessions = self.sessions();
        if sessions.get(&session).is_some_and(|sender| sender.receiver_count() == 0) {
            sessions.remove(&session);
        }
    }

    /// How often something was announced that changes what queries are answered from.
    pub(crate) fn n_changes(&self) -> u64 {
        self.0.n_changes.load(Ordering::Acquire)
    }

    /// Tells watchers, once it is so.
    pub(crate) fn announce(&self, map: MapId, event: Event) {
        if matches!(event, Event::Version(_) | Event::Costs(_)) {
            self.0.n_changes.fetch_add(1, Ordering::Release);
        }
        // Nobody watching is fine.
        let _ = self.0.events.send((map, event));
    }

    /// Watches all maps from now on.
    pub(crate) fn watch(&self) -> broadcast::Receiver<(MapId, Event)> {
        self.0.events.subscribe()
    }

    /// A panic while the lock was held cannot leave the table half changed.
    fn sessions(&self) -> MutexGuard<'_, HashMap<SessionId, watch::Sender<Told>>> {
        self.0.sessions.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
