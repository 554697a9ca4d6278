//! Fields in memory, and the making of their tables.
//!
//! A field is made when it is first asked for, by one task however many ask, and answers by search
//! at once; its tables are made in the background, few at a time, and of the published version
//! first. Under new costs they are derived from those before. What was used least lately is thrown
//! out when all take more memory than the setting allows.

use std::collections::HashMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use meetpoint_planning::Plans;
use meetpoint_storage::MapId;
use tokio::sync::{OnceCell, Semaphore, watch};

use super::costs::Costs;
use super::field::Field;
use super::ground::Ground;
use super::profile::Profile;
use super::standing::Standing;
use crate::error::Error;
use crate::service::Service;
use crate::settings::PlanningSettings;

/// Versions whose ground stays in memory besides those of fields.
const N_GROUNDS_KEPT: usize = 2;

/// Names a field.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct Key {
    map: MapId,
    version: u64,
    profile: [u64; 4],
    revision: u64,
}

/// A field that is made, or being made.
#[derive(Clone)]
struct Entry {
    field: Arc<OnceCell<Arc<Field>>>,
    /// When it was last asked for, by a clock that counts questions.
    used: Arc<AtomicU64>,
}

type GroundCell = Arc<OnceCell<Arc<Ground>>>;

/// The fields.
pub(crate) struct Fields {
    entries: Mutex<HashMap<Key, Entry>>,
    grounds: Mutex<Vec<((MapId, u64), GroundCell)>>,
    n_asked: AtomicU64,
    /// One permit for each field whose tables are being made.
    building: Arc<Semaphore>,
    /// Told whenever tables are made.
    made: watch::Sender<u64>,
}

impl Fields {
    /// None yet.
    pub(crate) fn new(settings: &PlanningSettings) -> Self {
        Self {
            entries: Mutex::default(),
            grounds: Mutex::default(),
            n_asked: AtomicU64::new(0),
            building: Arc::new(Semaphore::new(settings.n_builds_at_once)),
            made: watch::Sender::new(0),
        }
    }

    /// Whether there is any of a map.
    pub(crate) fn holds(&self, map: &MapId) -> bool {
        self.entries().keys().any(|key| key.map == *map)
    }

    /// Follows the making of tables.
    pub(crate) fn made(&self) -> watch::Receiver<u64> {
        self.made.subscribe()
    }

    /// A panic while the lock was held cannot leave the table half changed.
    fn entries(&self) -> MutexGuard<'_, HashMap<Key, Entry>> {
        self.entries.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn entry(&self, key: &Key) -> Entry {
        let now = self.n_asked.fetch_add(1, Ordering::Relaxed);
        let mut entries = self.entries();
        if let Some(entry) = entries.get(key) {
            entry.used.store(now, Ordering::Relaxed);
            return entry.clone();
        }
        let entry = Entry { field: Arc::default(), used: Arc::new(AtomicU64::new(now)) };
        entries.insert(key.clone(), entry.clone());
        entry
    }

    /// Tables of the same profile and version under costs before.
    fn tables_before(&self, key: &Key) -> Option<Arc<Plans>> {
        let entries = self.entries();
        let is_alike = |other: &Key| {
            (&other.map, other.version, other.profile) == (&key.map, key.version, key.profile)
        };
        let alike = entries.iter().filter(|(other, _)| is_alike(other));
        let plans = alike.filter_map(|(other, entry)| {
            Some((other.revision, entry.field.get()?.plans()?.clone()))
        });
        plans.max_by_key(|(revision, _)| *revision).map(|(_, plans)| plans)
    }

    /// Forgets what the tables of `key` make needless: fields under costs before, and those of
    /// versions before if this is the published one.
    fn forget_before(&self, key: &Key, is_published: bool) {
        self.entries().retain(|other, _| {
            let is_older = other.version < key.version && is_published
                || other.version == key.version && other.revision < key.revision;
            (&other.map, other.profile) != (&key.map, key.profile) || !is_older
        });
    }

    /// Forgets what was used least lately until the rest takes no more than `bytes_max`, or is one.
    fn forget_least_used(&self, bytes_max: usize) {
        let mut entries = self.entries();
        let mut by_use: Vec<(u64, Key, usize)> = entries
            .iter()
            .filter_map(|(key, entry)| {
                let n_bytes = entry.field.get()?.n_bytes();
                Some((entry.used.load(Ordering::Relaxed), key.clone(), n_bytes))
            })
            .collect();
        by_use.sort_unstable_by_key(|(used, ..)| *used);
        let mut n_bytes: usize = by_use.iter().map(|(.., n_bytes)| n_bytes).sum();
        by_use.pop();
        for (_, key, of_field) in by_use {
            if n_bytes <= bytes_max {
                break;
            }
            entries.remove(&key);
            n_bytes -= of_field;
        }
        metrics::gauge!("meetpoint_plan_bytes").set(n_bytes as f64);
    }

    fn ground(&self, map: &MapId, version: u64) -> GroundCell {
        let mut grounds = self.grounds.lock().unwrap_or_else(PoisonError::into_inner);
        let name = (map.clone(), version);
        let place = grounds.iter().position(|(other, _)| *other == name);
        let found = place.map(|place| grounds.remove(place));
        let found = found.unwrap_or_else(|| (name, GroundCell::default()));
        let cell = found.1.clone();
        grounds.push(found);
        if N_GROUNDS_KEPT < grounds.len() {
            grounds.remove(0);
        }
        cell
    }
}

impl Service {
    /// The field for a profile on a version (0 for the published one) under the costs of `standing`.
    pub(crate) async fn field(
        &self,
        standing: &Standing,
        version: u64,
        profile: &Profile,
    ) -> Result<Arc<Field>, Error> {
        let map = &standing.map;
        let is_published = version == 0 || version == standing.published_version;
        let version = if version == 0 { standing.published_version } else { version };
        if version == 0 {
            return Err(Error::NothingPublished(map.0.clone()));
        }
        let (revision, bits) = (standing.costs.revision(), profile.bits());
        let key = Key { map: map.clone(), version, profile: bits, revision };
        let entry = self.planner.fields.entry(&key);
        if let Some(field) = entry.field.get() {
            return Ok(field.clone());
        }
        let making = self.new_field(&key, &standing.costs, profile, is_published);
        match entry.field.get_or_try_init(|| making).await {
            Ok(field) => Ok(field.clone()),
            Err(error) => {
                // Nothing is kept of what is not there.
                self.planner.fields.entries().remove(&key);
                Err(error)
            }
        }
    }

    async fn new_field(
        &self,
        key: &Key,
        costs: &Arc<Costs>,
        profile: &Profile,
        is_published: bool,
    ) -> Result<Arc<Field>, Error> {
        let ground = self.ground(&key.map, key.version).await?;
        let (costs, profile) = (costs.clone(), profile.clone());
        let has_tables = !profile.name.is_empty();
        let _permit = self.planner.searching.acquire().await.map_err(|_| Error::Stopping)?;
        let making = tokio::task::spawn_blocking(move || Field::new(ground, costs, profile));
        let field = Arc::new(making.await.map_err(Error::internal)??);
        if has_tables {
            tokio::spawn(make_tables(self.clone(), key.clone(), field.clone(), is_published));
        }
        self.planner.fields.forget_least_used(self.settings.planning.memory_bytes_max);
        Ok(field)
    }

    /// What a version offers for planning.
    async fn ground(&self, map: &MapId, version: u64) -> Result<Arc<Ground>, Error> {
        let cell = self.planner.fields.ground(map, version);
        let made = cell.get_or_try_init(|| async {
            let found = self.version_topology(&map.0, version).await?;
            let grid = self.version_grid(&map.0, version).await?;
            let making = tokio::task::spawn_blocking(move || {
                let raster = grid.grid.raster(None);
                Arc::new(Ground::new(
                    found.map,
                    found.version,
                    found.space,
                    found.topology,
                    &raster,
                ))
            });
            making.await.map_err(Error::internal)
        });
        made.await.cloned()
    }
}

/// Makes the tables of a field when it is its turn, unless nobody will ask for it any more.
async fn make_tables(service: Service, key: Key, field: Arc<Field>, is_published: bool) {
    let fields = &service.planner.fields;
    let Ok(_permit) = fields.building.clone().acquire_owned().await else { return };
    let is_wanted = match service.standing(&key.map.0).await {
        Ok(now) => {
            let is_newest = now.costs.revision() == key.revision;
            is_newest && (!is_published || now.published_version == key.version)
        }
        Err(_) => false,
    };
    if service.stop.is_cancelled() || !is_wanted {
        // Whoever asks for it again, after rolling back, gets another with its tables.
        fields.entries().remove(&key);
        return;
    }
    let before = fields.tables_before(&key);
    let pair_bytes_max = service.settings.planning.pair_bytes_max;
    let begun = std::time::Instant::now();
    let making =
        tokio::task::spawn_blocking(move || field.make_plans(before.as_deref(), pair_bytes_max));
    match making.await {
        Ok(Ok(())) => {
            metrics::histogram!("meetpoint_plan_tables_seconds")
                .record(begun.elapsed().as_secs_f64());
            fields.forget_before(&key, is_published);
            fields.forget_least_used(service.settings.planning.memory_bytes_max);
            fields.made.send_modify(|n_made| *n_made += 1);
        }
        Ok(Err(error)) => error.log(),
        Err(error) => Error::internal(error).log(),
    }
}
