//! What ingest remembers of open sessions: their sensors and the stamps they used.
//!
//! A cache over the journal: what is not here is read again from there.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use meetpoint_proto::v1;
use meetpoint_storage::{MapId, SessionId, SessionRecord, Store};
use prost::Message;

use super::checks::{self, Checked};
use super::stamps::Stamps;
use crate::convert::{sensor, sensor::DeclaredSensor, session};
use crate::{error::Error, settings::Limits};

/// Sessions remembered at once; more are read again when they send.
const N_SESSIONS_MAX: usize = 4096;
/// Batches read back to know a session's newest stamps after a restart.
const N_BATCHES_READ_BACK: u64 = 64;

/// A session that sends.
#[derive(Debug)]
pub(crate) struct KnownSession {
    /// Its id.
    pub(crate) id: SessionId,
    /// Its map.
    pub(crate) map: MapId,
    sensors: Vec<DeclaredSensor>,
    stamps: Mutex<Stamps>,
}

impl KnownSession {
    /// Checks a batch against what the session declared and sent before.
    ///
    /// # Errors
    /// What refuses the batch as a whole.
    pub(crate) fn check(&self, batch: &v1::Batch, limits: &Limits) -> Result<Checked, Error> {
        checks::check(batch, &self.sensors, &mut locked(&self.stamps), limits)
    }
}

/// The sessions that sent lately.
#[derive(Debug, Default)]
pub(crate) struct KnownSessions(Mutex<HashMap<SessionId, Arc<KnownSession>>>);

impl KnownSessions {
    /// The session of that id, from memory or from the store.
    ///
    /// # Errors
    /// [`Error::NoSuchSession`], or the store's.
    pub(crate) async fn get(
        &self,
        store: &Store,
        id: SessionId,
        limits: &Limits,
    ) -> Result<Arc<KnownSession>, Error> {
        if let Some(known) = locked(&self.0).get(&id) {
            return Ok(known.clone());
        }
        let record =
            store.session(id).await?.ok_or_else(|| Error::NoSuchSession(id.0.to_string()))?;
        let known = Arc::new(read_back(store, record, limits).await?);
        let mut sessions = locked(&self.0);
        if sessions.len() >= N_SESSIONS_MAX {
            sessions.retain(|_, session| Arc::strong_count(session) > 1);
        }
        // Whoever was first stays: two views of the used stamps would disagree.
        Ok(sessions.entry(id).or_insert(known).clone())
    }

    /// Forgets a session that ended.
    pub(crate) fn forget(&self, id: SessionId) {
        locked(&self.0).remove(&id);
    }
}

async fn read_back(
    store: &Store,
    record: SessionRecord,
    limits: &Limits,
) -> Result<KnownSession, Error> {
    let declaration = session::declaration(&record.declaration)?;
    let sensors = sensor::sensors(&declaration.sensors)?;
    let mut stamps = Stamps::new(limits.n_stamps_remembered);
    let from = record.acked_through.saturating_sub(N_BATCHES_READ_BACK) + 1;
    let limit = u32::try_from(N_BATCHES_READ_BACK).unwrap_or(u32::MAX);
    for batch in store.session_batches(record.id, from, limit).await? {
        let batch = v1::Batch::decode(batch.payload.as_slice()).map_err(Error::internal)?;
        // Only what it leaves in `stamps` counts: the batch itself was judged when it came.
        checks::check(&batch, &sensors, &mut stamps, limits)?;
    }
    Ok(KnownSession { id: record.id, map: record.map, sensors, stamps: Mutex::new(stamps) })
}

/// A panic while the lock was held cannot leave these maps half changed.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
