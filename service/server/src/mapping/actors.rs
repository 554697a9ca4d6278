//! The maps in memory: an actor is started when its map has something to do.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use meetpoint_occupancy::Grid;
use meetpoint_proto::v1;
use meetpoint_storage::{JournalSeq, MapId, SessionId, Store};
use tokio::sync::{Notify, Semaphore, oneshot};
use tokio_util::{sync::CancellationToken, task::TaskTracker};
use uuid::Uuid;

use super::actor;
use super::map_state::MapState;
use super::sensing::Sensing;
use crate::{error::Error, live::Live, settings::MappingSettings};

/// Maps read from the store at a time when looking for work at start.
const N_MAPS_A_PAGE: u32 = 1000;
/// Who wants to see a map waits so long: a stretch of entries is mapped in less.
const LOOK_WAIT: Duration = Duration::from_secs(2);

/// The registry of actors.
#[derive(Clone)]
pub(crate) struct Actors(Arc<Shared>);

/// What every actor uses.
pub(super) struct Shared {
    pub(super) store: Store,
    pub(super) live: Live,
    pub(super) settings: MappingSettings,
    /// By what all maps are drawn.
    pub(super) sensing: Arc<Sensing>,
    /// Names this process in leases.
    pub(super) owner: Uuid,
    /// One for each map that may compute at the same time.
    pub(super) threads: Semaphore,
    pub(super) stop: CancellationToken,
    running: Mutex<HashMap<MapId, Arc<Mailbox>>>,
    tasks: TaskTracker,
}

/// How an actor is reached.
#[derive(Default)]
pub(super) struct Mailbox {
    /// The journal has grown, or there is a replacement.
    pub(super) woken: Notify,
    replacement: Mutex<Option<Awaited>>,
    lookers: Mutex<Vec<Looker>>,
}

/// Somebody who waits to see a grid.
pub(super) struct Looker {
    /// The session in whose frame it is drawn; `None` for the map's.
    pub(super) frame: Option<SessionId>,
    pub(super) show: oneshot::Sender<Grid>,
}

/// A state computed apart, to be taken instead of the actor's own.
pub(crate) struct Replacement {
    pub(crate) state: MapState,
    /// The kind of the job that computed it.
    pub(crate) origin: &'static str,
    /// Where the robots of open sessions are by that state, for those who are online.
    pub(crate) corrections: Vec<(SessionId, v1::PoseCorrection)>,
}

/// A replacement, and who waits for it.
pub(super) struct Awaited {
    pub(super) replacement: Replacement,
    /// Told the version that it became.
    pub(super) done: oneshot::Sender<u64>,
}

impl Mailbox {
    /// The replacement that waits, if there is one.
    pub(super) fn replacement(&self) -> Option<Awaited> {
        self.replacement.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// Who waits to see the map.
    pub(super) fn lookers(&self) -> Vec<Looker> {
        std::mem::take(&mut *self.lookers.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Actors {
    /// No map is in memory yet.
    pub(crate) fn new(
        store: Store,
        live: Live,
        settings: MappingSettings,
        sensing: Arc<Sensing>,
    ) -> Self {
        let n_processors = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        let n_threads =
            if settings.n_maps_at_once == 0 { n_processors } else { settings.n_maps_at_once };
        Self(Arc::new(Shared {
            store,
            live,
            settings,
            sensing,
            owner: Uuid::now_v7(),
            threads: Semaphore::new(n_threads),
            stop: CancellationToken::new(),
            running: Mutex::default(),
            tasks: TaskTracker::new(),
        }))
    }

    /// By what all maps are drawn.
    pub(crate) fn sensing(&self) -> &Arc<Sensing> {
        &self.0.sensing
    }

    /// Names this process in leases.
    pub(crate) fn owner(&self) -> Uuid {
        self.0.owner
    }

    /// Starts the actors of all maps whose journal goes beyond their last version.
    ///
    /// # Errors
    /// The store's.
    pub(crate) async fn start_unfinished(&self) -> Result<(), Error> {
        let store = &self.0.store;
        let mut after: Option<MapId> = None;
        loop {
            let maps = store.maps(after.as_ref(), N_MAPS_A_PAGE).await?;
            let Some(last) = maps.last() else { return Ok(()) };
            after = Some(last.id.clone());
            for map in maps {
                let newest = store.versions(&map.id, None, 1).await?;
                let saved = newest.first().map_or(JournalSeq::START, |version| version.journal_seq);
                if saved < store.journal_end(&map.id).await? {
                    self.wake(&map.id);
                }
            }
        }
    }

    /// Tells a map that its journal has grown.
    pub(crate) fn wake(&self, map: &MapId) {
        if self.0.stop.is_cancelled() {
            return;
        }
        self.mailbox(map).woken.notify_one();
    }

    /// Has a map take a state, computed from the same journal, in place of its own; the number of
    /// the version that it becomes.
    ///
    /// # Errors
    /// [`Error::Stopping`] if the service stops before that.
    pub(crate) async fn replace(
        &self,
        map: &MapId,
        replacement: Replacement,
    ) -> Result<u64, Error> {
        let (done, version) = oneshot::channel();
        if self.0.stop.is_cancelled() {
            return Err(Error::Stopping);
        }
        let mailbox = self.mailbox(map);
        *mailbox.replacement.lock().unwrap_or_else(PoisonError::into_inner) =
            Some(Awaited { replacement, done });
        mailbox.woken.notify_one();
        version.await.map_err(|_| Error::Stopping)
    }

    /// The site's grid as it is now, or that of a session's frame; `None` if the map is not in memory,
    /// where its newest version is all there is, has nothing in that frame, or is too busy to show it soon.
    pub(crate) async fn live_grid(&self, map: &MapId, frame: Option<SessionId>) -> Option<Grid> {
        let (show, shown) = oneshot::channel();
        {
            let running = self.0.running();
            let mailbox = running.get(map)?;
            let looker = Looker { frame, show };
            mailbox.lookers.lock().unwrap_or_else(PoisonError::into_inner).push(looker);
            mailbox.woken.notify_one();
        }
        tokio::time::timeout(LOOK_WAIT, shown).await.ok()?.ok()
    }

    /// The mailbox of a map's actor, which is started if it does not run.
    fn mailbox(&self, map: &MapId) -> Arc<Mailbox> {
        let mut running = self.0.running();
        let mailbox = running.entry(map.clone()).or_insert_with(|| {
            let mailbox = Arc::new(Mailbox::default());
            self.0.tasks.spawn(actor::run(self.0.clone(), map.clone(), mailbox.clone()));
            mailbox
        });
        mailbox.clone()
    }

    /// True while the map is in memory.
    pub(crate) fn is_running(&self, map: &MapId) -> bool {
        self.0.running().contains_key(map)
    }

    /// Lets every actor save its map, and waits for it.
    pub(crate) async fn stop(&self) {
        self.0.stop.cancel();
        self.0.tasks.close();
        self.0.tasks.wait().await;
    }
}

impl Shared {
    /// Takes an idle actor off the registry, unless it was woken meanwhile.
    pub(super) fn retire(&self, map: &MapId, mailbox: &Mailbox) -> bool {
        let mut running = self.running();
        // A wake that came in before the lock left its permit behind.
        if std::pin::pin!(mailbox.woken.notified()).enable() {
            mailbox.woken.notify_one();
            return false;
        }
        running.remove(map);
        true
    }

    /// Takes a stopping actor off the registry.
    pub(super) fn remove(&self, map: &MapId) {
        self.running().remove(map);
    }

    /// A panic while the lock was held cannot leave the table half changed.
    fn running(&self) -> MutexGuard<'_, HashMap<MapId, Arc<Mailbox>>> {
        self.running.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
