//! What holds on maps now: the published version, and the costs in force.
//!
//! Kept in memory, so that a query asks no database. An entry is good for as long as nothing was
//! announced since it was read: whoever changes a version or a cost announces it after the commit
//! and before answering, so that a query that begins after the answer sees the change.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use meetpoint_storage::MapId;

use super::costs::Costs;
use crate::convert::cost;
use crate::error::Error;
use crate::service::Service;

/// What holds on a map.
#[derive(Clone)]
pub(crate) struct Standing {
    /// Changes announced before it was read.
    n_changes: u64,
    pub(crate) map: MapId,
    /// 0 before the first.
    pub(crate) published_version: u64,
    pub(crate) costs: Arc<Costs>,
}

/// What holds on maps that were asked for.
#[derive(Default)]
pub(crate) struct Standings(Mutex<HashMap<String, Standing>>);

impl Standings {
    fn get(&self, map: &str) -> Option<Standing> {
        self.entries().get(map).cloned()
    }

    fn put(&self, standing: Standing) {
        self.entries().insert(standing.map.0.clone(), standing);
    }

    /// Has a map be read again.
    pub(crate) fn forget(&self, map: &str) {
        self.entries().remove(map);
    }

    /// A panic while the lock was held cannot leave the table half changed.
    fn entries(&self) -> MutexGuard<'_, HashMap<String, Standing>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Service {
    /// What holds on a map that has to exist.
    pub(crate) async fn standing(&self, map: &str) -> Result<Standing, Error> {
        // Before reading: what is announced meanwhile makes the entry old.
        let n_changes = self.live.n_changes();
        let before = self.planner.standings.get(map);
        if let Some(standing) = &before
            && standing.n_changes == n_changes
        {
            return Ok(standing.clone());
        }
        let record = self.map_record(map).await?;
        let known = before.map(|standing| standing.costs).unwrap_or_default();
        let costs = self.costs_in_force(&record.id, known, record.cost_revision).await?;
        let published_version = record.published_version;
        let standing = Standing { n_changes, map: record.id, published_version, costs };
        self.planner.standings.put(standing.clone());
        Ok(standing)
    }

    /// The costs of a map, those `known` brought to a revision or beyond.
    async fn costs_in_force(
        &self,
        map: &MapId,
        known: Arc<Costs>,
        revision: u64,
    ) -> Result<Arc<Costs>, Error> {
        if revision <= known.revision() {
            return Ok(known);
        }
        let mut costs = Costs::clone(&known);
        for record in self.store.cost_decisions(map, known.last()).await? {
            costs.apply(record.seq, record.time_ns, cost::recorded(&record.payload)?);
        }
        Ok(Arc::new(costs))
    }
}
