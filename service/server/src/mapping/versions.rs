//! Versions of one map on their way into the store, one after another, while mapping goes on.
//!
//! Regions and graph of a version are made here, beside the mapping of what follows it: they take
//! about as long as the mapping of the scans between two versions.

use std::sync::Arc;
use std::time::{Duration, Instant};

use meetpoint_storage::{MapLease, NewSnapshot, Store, VersionRecord};
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;

use super::actors::Shared;
use super::snapshot::Draft;
use super::topology::Topologies;
use crate::live::Event;
use crate::{clock, convert, error::Error};

/// Waits between attempts after the store failed: short enough that a robot notices nothing.
pub(super) const RETRY_FIRST: Duration = Duration::from_millis(500);
/// The longest wait between attempts.
pub(super) const RETRY_LONGEST: Duration = Duration::from_secs(30);

/// What has been saved of a map, and what is being saved.
pub(super) struct Versions<'a> {
    shared: &'a Arc<Shared>,
    lease: &'a MapLease,
    /// Read when it is first needed; away while a version is being saved.
    topologies: Option<Topologies>,
    saving: Option<JoinHandle<Result<(VersionRecord, Topologies), Error>>>,
}

impl<'a> Versions<'a> {
    /// Goes on from the newest version that the store has.
    pub(super) fn new(shared: &'a Arc<Shared>, lease: &'a MapLease) -> Self {
        Self { shared, lease, topologies: None, saving: None }
    }

    /// Begins to save a version, once the one before it is saved.
    ///
    /// # Errors
    /// Those of saving the one before; the store's.
    pub(super) async fn save(&mut self, draft: Draft, origin: &'static str) -> Result<(), Error> {
        self.saved().await?;
        let topologies = match self.topologies.take() {
            Some(topologies) => topologies,
            None => {
                let n_cells_max = self.shared.settings.topology_cells_max;
                Topologies::restored(&self.shared.store, &self.lease.map, n_cells_max).await?
            }
        };
        let (shared, lease) = (self.shared.clone(), self.lease.clone());
        self.saving = Some(tokio::spawn(save(shared, lease, draft, origin, topologies)));
        Ok(())
    }

    /// Waits until the version that is being saved is saved; `None` if there is none.
    ///
    /// # Errors
    /// Those of saving it.
    pub(super) async fn saved(&mut self) -> Result<Option<VersionRecord>, Error> {
        let Some(saving) = self.saving.take() else { return Ok(None) };
        let (version, topologies) = saving.await.map_err(Error::internal)??;
        self.topologies = Some(topologies);
        Ok(Some(version))
    }
}

/// Makes the topology of a version, saves it and announces it.
async fn save(
    shared: Arc<Shared>,
    lease: MapLease,
    draft: Draft,
    origin: &'static str,
    mut topologies: Topologies,
) -> Result<(VersionRecord, Topologies), Error> {
    let thread = shared.threads.acquire().await.map_err(|_| Error::Stopping)?;
    let made = tokio::task::spawn_blocking(move || {
        let topology = topologies.next(draft.grid());
        (draft, topology, topologies)
    });
    let (draft, topology, topologies) = made.await.map_err(Error::internal)?;
    drop(thread);
    let snapshot = draft.into_snapshot(topology, lease, origin, clock::now_ns());
    let version = save_stubbornly(&shared.store, &snapshot, &shared.stop).await?;
    let event = Event::Version(convert::map::version_to_wire(&version));
    shared.live.announce(version.map.clone(), event);
    Ok((version, topologies))
}

/// A full disk or a locked database is waited for: the map stays in memory meanwhile.
async fn save_stubbornly(
    store: &Store,
    snapshot: &NewSnapshot,
    stop: &CancellationToken,
) -> Result<VersionRecord, Error> {
    let mut wait = RETRY_FIRST;
    loop {
        let begun = Instant::now();
        let saved = store.save_snapshot(snapshot).await.map_err(Error::from);
        metrics::histogram!("meetpoint_database_seconds", "what" => "save_snapshot")
            .record(begun.elapsed().as_secs_f64());
        match saved {
            Err(error @ (Error::StorageFull | Error::StorageBusy)) if !stop.is_cancelled() => {
                error.log();
                metrics::counter!("meetpoint_snapshot_failures").increment(1);
            }
            settled => return settled,
        }
        tokio::time::sleep(wait).await;
        wait = (wait * 2).min(RETRY_LONGEST);
    }
}
