//! The actor of one map: reads the journal on, maps, and saves versions.
//!
//! The journal is the queue: memory holds a few entries read ahead, however far mapping is behind.
//! What a crash interrupts is mapped again from the last version, with the same bits, because
//! versions are cut at places in the journal and not by the clock. (A version is also made when
//! nothing came for a while; that changes the numbers of versions, never what they hold.)

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

use meetpoint_proto::v1;
use meetpoint_storage::{JournalEntry, JournalSeq, MapId, MapLease, MapRecord, SessionId};

use super::actors::{Awaited, Looker, Mailbox, Replacement, Shared};
use super::checkpoint;
use super::decisions::Decisions;
use super::map_state::{Applied, MapState};
use super::snapshot::{Draft, SavedTiles};
use super::versions::{RETRY_FIRST, RETRY_LONGEST, Versions};
use crate::live::{Event, SessionProgress};
use crate::{clock, convert, error::Error, operations::tiles};

/// Runs a map's actor until it is idle for long or the service stops.
pub(super) async fn run(shared: Arc<Shared>, map: MapId, mailbox: Arc<Mailbox>) {
    let mut wait = RETRY_FIRST;
    loop {
        match Box::pin(live(&shared, &map, &mailbox)).await {
            Ok(()) if shared.stop.is_cancelled() => return shared.remove(&map),
            Ok(()) if shared.retire(&map, &mailbox) => return,
            Ok(()) => wait = RETRY_FIRST,
            Err(error) => {
                error.log();
                tracing::warn!(map = map.as_str(), %error, "mapping halts, the journal goes on");
                metrics::counter!("meetpoint_mapping_failures").increment(1);
                tokio::select! {
                    () = tokio::time::sleep(wait) => {}
                    () = shared.stop.cancelled() => return shared.remove(&map),
                }
                wait = (wait * 2).min(RETRY_LONGEST);
            }
        }
    }
}

/// What versions come from, as they name it.
const TRACKING: &str = "tracking";
const IMPORT: &str = "import";

/// A map's state and the tiles that the store already has.
struct Work {
    state: MapState,
    saved: SavedTiles,
    /// No version is made before this place of the journal: the newest one tells that far already,
    /// and a map never goes back in time.
    quiet_until: JournalSeq,
    /// When it was looked last whether something moved, by the service's clock as the journal has it,
    /// nanoseconds since 1970.
    looked_ns: i64,
}

impl Work {
    fn new(state: MapState, saved: SavedTiles, quiet_until: JournalSeq) -> Self {
        Self { state, saved, quiet_until, looked_ns: 0 }
    }

    /// True if something has moved since the last version: a door was closed, say. Looked at after each
    /// `interval_ns` only.
    fn has_moved(&mut self, receive_time_ns: i64, interval_ns: i64) -> bool {
        let is_time = interval_ns <= receive_time_ns.saturating_sub(self.looked_ns);
        if is_time {
            self.looked_ns = receive_time_ns;
        }
        is_time && self.saved.has_moved(self.state.grid())
    }

    /// Takes a snapshot.
    fn draft(&mut self) -> Draft {
        self.saved.draft(&mut self.state)
    }
}

/// What a stretch of computing left.
struct Advanced {
    work: Work,
    left: VecDeque<JournalEntry>,
    applied: Vec<Applied>,
    /// What is to be saved, and what it comes from.
    draft: Option<(Draft, &'static str)>,
    computing: Duration,
}

struct Actor<'a> {
    shared: &'a Shared,
    record: MapRecord,
    mailbox: &'a Mailbox,
    versions: Versions<'a>,
}

/// One life of the actor: from taking the lease to going idle.
async fn live(shared: &Arc<Shared>, map: &MapId, mailbox: &Mailbox) -> Result<(), Error> {
    let record = shared.store.map(map).await?.ok_or_else(|| Error::NoSuchMap(map.0.clone()))?;
    let Some(lease) = take_lease(shared, map).await? else { return Ok(()) };
    let renewing =
        tokio::spawn(renew(shared.store.clone(), lease.clone(), shared.settings.lease_ttl_s));
    let mut actor = Actor { shared, record, mailbox, versions: Versions::new(shared, &lease) };
    let lived = Box::pin(actor.follow_journal()).await;
    let saved = actor.versions.saved().await.map(|_| ());
    renewing.abort();
    shared.store.release_map_lease(&lease).await?;
    lived.and(saved)
}

impl Actor<'_> {
    async fn follow_journal(&mut self) -> Result<(), Error> {
        let settings = &self.shared.settings;
        let mut work = self.restore().await?;
        for (session, mapped_through) in work.state.progress() {
            self.shared
                .live
                .progress(session, SessionProgress { mapped_through, correction: None });
        }
        let mut entries = self.read(work.state.position()).await?;
        let mut idle_since = Instant::now();
        loop {
            if self.shared.stop.is_cancelled() {
                return self.save_rest(work).await;
            }
            if let Some(awaited) = self.mailbox.replacement() {
                work = Box::pin(self.replace(work, awaited)).await?;
                entries = self.read(work.state.position()).await?;
            }
            self.show(&work);
            if let Some(last) = entries.back().map(|entry| entry.seq) {
                let ahead = tokio::spawn(read(
                    self.shared.store.clone(),
                    self.record.id.clone(),
                    last,
                    settings.read_ahead_n_max,
                    settings.read_ahead_bytes_max,
                ));
                work = self.map(work, entries).await?;
                entries = ahead.await.map_err(Error::internal)??;
                idle_since = Instant::now();
                continue;
            }
            self.tell_age_s(0.0);
            let idle = if work.state.is_saved() {
                Duration::from_secs(settings.idle_stop_s)
            } else {
                Duration::from_millis(settings.idle_snapshot_ms)
            };
            tokio::select! {
                () = self.mailbox.woken.notified() => {}
                () = self.shared.stop.cancelled() => {}
                () = tokio::time::sleep(idle.saturating_sub(idle_since.elapsed())) => {
                    if work.state.is_saved() {
                        return Ok(());
                    }
                    work = self.snapshot(work, TRACKING).await?;
                    idle_since = Instant::now();
                }
            }
            entries = self.read(work.state.position()).await?;
        }
    }

    /// Maps all of `entries`, saving versions where they are due.
    async fn map(
        &mut self,
        mut work: Work,
        mut entries: VecDeque<JournalEntry>,
    ) -> Result<Work, Error> {
        let settings = &self.shared.settings;
        let due = Due {
            n_scans: settings.snapshot_scans,
            moved_ns: nanoseconds(Duration::from_millis(settings.moved_snapshot_ms)),
        };
        while !entries.is_empty() {
            let thread = self.shared.threads.acquire().await.map_err(|_| Error::Stopping)?;
            let advanced = tokio::task::spawn_blocking(move || advance(work, entries, due))
                .await
                .map_err(Error::internal)??;
            // Saving needs one of its own.
            drop(thread);
            let Advanced { work: advanced_work, left, applied, draft, computing } = advanced;
            (work, entries) = (advanced_work, left);
            self.tell(&applied, computing, entries.len());
            self.show(&work);
            if let Some((draft, origin)) = draft {
                self.versions.save(draft, origin).await?;
            }
        }
        Ok(work)
    }

    /// Takes a state that was computed apart, brings it to where the own one was, and saves it.
    async fn replace(&mut self, work: Work, awaited: Awaited) -> Result<Work, Error> {
        let Awaited { replacement: Replacement { state, origin, corrections }, done } = awaited;
        let reached = work.state.position();
        let saved = SavedTiles::default();
        for (session, correction) in corrections {
            self.tell_correction(session, correction);
        }
        let mut work = Work::new(state, saved, reached);
        while work.state.position() < reached {
            let entries = self.read(work.state.position()).await?;
            work = self.map(work, entries).await?;
        }
        let work = self.snapshot(work, origin).await?;
        if let Some(version) = self.versions.saved().await? {
            // A job that was given up meanwhile does not need to know.
            let _ = done.send(version.number);
        }
        Ok(work)
    }

    /// Shows the map to those who wait for it: a pointer a tile.
    fn show(&self, work: &Work) {
        for Looker { frame, show } in self.mailbox.lookers() {
            if let Some(grid) = work.state.grid_in(frame) {
                // Who has gone away does not need to see it.
                let _ = show.send(grid.clone());
            }
        }
    }

    /// Tells streams and watchers how far their sessions are.
    fn tell(&self, applied: &[Applied], computing: Duration, n_left: usize) {
        let live = &self.shared.live;
        let n_scans: u64 = applied.iter().map(|entry| entry.n_scans).sum();
        let advanced_ns: i64 = applied.iter().map(|entry| entry.advanced_ns).sum();
        metrics::counter!("meetpoint_scans_mapped").increment(n_scans);
        if n_scans > 0 && !computing.is_zero() {
            let ratio = advanced_ns as f64 * 1e-9 / computing.as_secs_f64();
            metrics::gauge!("meetpoint_real_time_ratio", "map" => self.record.id.0.clone())
                .set(ratio);
        }
        let map = self.record.id.0.clone();
        metrics::gauge!("meetpoint_mapping_queue_depth", "map" => map).set(n_left as f64);
        if let Some(last) = applied.last() {
            self.tell_age_s((clock::now_ns() - last.receive_time_ns) as f64 * 1e-9);
        }
        for entry in applied {
            let Some(session) = entry.session else { continue };
            let correction = entry.correction.clone();
            let mapped_through = entry.mapped_through;
            let before = live.session(session).and_then(|progress| progress.correction);
            live.progress(
                session,
                SessionProgress { mapped_through, correction: correction.clone().or(before) },
            );
            if let Some(correction) = correction {
                self.announce_correction(session, correction);
            }
            if entry.ended {
                live.forget(session);
            }
        }
    }

    /// Tells a robot that is online, and watchers, that it is elsewhere than it was told before.
    fn tell_correction(&self, session: SessionId, correction: v1::PoseCorrection) {
        let Some(progress) = self.shared.live.session(session) else { return };
        let told = SessionProgress { correction: Some(correction.clone()), ..progress };
        self.shared.live.progress(session, told);
        self.announce_correction(session, correction);
    }

    fn announce_correction(&self, session: SessionId, correction: v1::PoseCorrection) {
        let event = convert::session::correction_event(session, correction);
        self.shared.live.announce(self.record.id.clone(), Event::Correction(event));
    }

    /// How long ago the entry came in that was mapped last; 0 when none waits.
    fn tell_age_s(&self, age_s: f64) {
        let map = self.record.id.0.clone();
        metrics::gauge!("meetpoint_mapping_queue_age_seconds", "map" => map).set(age_s);
    }

    /// The map as its last version left it, or empty if there is none that can be read: then it is
    /// made anew from the journal, which writes again whatever was damaged.
    async fn restore(&self) -> Result<Work, Error> {
        match self.last_saved().await {
            Ok(Some(work)) => return Ok(work),
            Ok(None) => {}
            Err(error @ (Error::StorageDamaged | Error::Internal(_))) => {
                error.log();
                let map = self.record.id.as_str();
                tracing::warn!(map, "the last version cannot be read: made anew from the journal");
            }
            Err(error) => return Err(error),
        }
        let (store, map) = (&self.shared.store, &self.record.id);
        let decisions = Decisions::load(store, map, store.journal_end(map).await?).await?;
        let state = MapState::new(&self.shared.sensing, self.record.resolution_m, decisions)?;
        let newest = self.shared.store.versions(&self.record.id, None, 1).await?;
        let quiet_until = newest.first().map_or(JournalSeq::START, |version| version.journal_seq);
        Ok(Work::new(state, SavedTiles::default(), quiet_until))
    }

    async fn last_saved(&self) -> Result<Option<Work>, Error> {
        let store = &self.shared.store;
        let Some(saved) = store.checkpoint(&self.record.id).await? else { return Ok(None) };
        let hashes: Vec<_> = saved.tiles.iter().map(|(_, hash)| *hash).collect();
        let tiles = tiles::load(store, &saved.tiles, &tiles::Known::default()).await?;
        let known = SavedTiles::restored(&tiles, &hashes);
        let (sensing, resolution_m) = (&self.shared.sensing, self.record.resolution_m);
        let position = saved.journal_seq;
        let decided_through = checkpoint::decided_through(&saved.state)?;
        let decisions = Decisions::load(store, &self.record.id, decided_through).await?;
        let bytes = &saved.state;
        let state = checkpoint::restore(sensing, resolution_m, position, bytes, tiles, decisions)?;
        Ok(Some(Work::new(state, known, position)))
    }

    async fn read(&self, after: JournalSeq) -> Result<VecDeque<JournalEntry>, Error> {
        let settings = &self.shared.settings;
        let (n_max, bytes_max) = (settings.read_ahead_n_max, settings.read_ahead_bytes_max);
        read(self.shared.store.clone(), self.record.id.clone(), after, n_max, bytes_max).await
    }

    /// Saves what is not saved yet, at the end.
    async fn save_rest(&mut self, work: Work) -> Result<(), Error> {
        if !work.state.is_saved() && work.quiet_until <= work.state.position() {
            self.snapshot(work, TRACKING).await?;
        }
        self.versions.saved().await.map(|_| ())
    }

    async fn snapshot(&mut self, mut work: Work, origin: &'static str) -> Result<Work, Error> {
        let drafted = tokio::task::spawn_blocking(move || {
            let draft = work.draft();
            (work, draft)
        });
        let (work, draft) = drafted.await.map_err(Error::internal)?;
        self.versions.save(draft, origin).await?;
        Ok(work)
    }
}

/// When a version is due.
#[derive(Clone, Copy, Debug)]
struct Due {
    /// After so many scans.
    n_scans: u64,
    /// When something has moved, which is looked at so often, nanoseconds.
    moved_ns: i64,
}

/// Computes until a version is due or the entries are done.
fn advance(mut work: Work, mut left: VecDeque<JournalEntry>, due: Due) -> Result<Advanced, Error> {
    let begun = Instant::now();
    let mut applied = Vec::with_capacity(left.len());
    let mut due_from = None;
    while due_from.is_none()
        && let Some(entry) = left.pop_front()
    {
        let done = work.state.apply(entry)?;
        let origin = if done.imported { IMPORT } else { TRACKING };
        let is_due = done.ended
            || done.imported
            || work.state.n_scans_since_snapshot() >= due.n_scans
            || work.has_moved(done.receive_time_ns, due.moved_ns);
        due_from = (is_due && work.quiet_until <= work.state.position()).then_some(origin);
        applied.push(done);
    }
    let computing = begun.elapsed();
    let draft = due_from.map(|origin| (work.draft(), origin));
    Ok(Advanced { work, left, applied, draft, computing })
}

async fn read(
    store: meetpoint_storage::Store,
    map: MapId,
    after: JournalSeq,
    n_entries_max: u32,
    n_bytes_max: usize,
) -> Result<VecDeque<JournalEntry>, Error> {
    Ok(store.journal(&map, after, n_entries_max, n_bytes_max).await?.into())
}

/// Waits until the map is ours; `None` if the service stops first.
async fn take_lease(shared: &Shared, map: &MapId) -> Result<Option<MapLease>, Error> {
    let ttl = Duration::from_secs(u64::from(shared.settings.lease_ttl_s));
    loop {
        let taken = shared
            .store
            .acquire_map_lease(map, shared.owner, clock::now_ns(), nanoseconds(ttl))
            .await?;
        if taken.is_some() {
            return Ok(taken);
        }
        tokio::select! {
            () = tokio::time::sleep(ttl / 3) => {}
            () = shared.stop.cancelled() => return Ok(None),
        }
    }
}

/// Renews a lease until it is lost. Whoever lost it notices when saving, by the fence.
async fn renew(store: meetpoint_storage::Store, lease: MapLease, ttl_s: u32) {
    let ttl = Duration::from_secs(u64::from(ttl_s));
    loop {
        tokio::time::sleep(ttl / 3).await;
        match store.renew_map_lease(&lease, clock::now_ns(), nanoseconds(ttl)).await {
            Ok(true) => {}
            Ok(false) => return tracing::warn!(map = lease.map.as_str(), "the lease is lost"),
            Err(error) => Error::from(error).log(),
        }
    }
}

fn nanoseconds(duration: Duration) -> i64 {
    i64::try_from(duration.as_nanos()).unwrap_or(i64::MAX)
}
