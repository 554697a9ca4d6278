//! What people decide about robots that explore as they are told, step by step.

use sqlx::SqliteConnection;

use crate::journal::{Kind, record_decision};
use crate::maps::require_map;
use crate::{Error, JournalSeq, MapId, Store};

/// A decision to be recorded.
#[derive(Clone, Debug)]
pub struct NewExplorationDecision {
    /// The map.
    pub map: MapId,
    /// What was decided, opaque.
    pub payload: Vec<u8>,
    /// The service's clock, nanoseconds since 1970.
    pub time_ns: i64,
}

impl Store {
    /// Records a decision about an exploration: its place in the journal.
    ///
    /// # Errors
    /// [`Error::NoSuchMap`].
    pub async fn decide_exploration(
        &self,
        new: &NewExplorationDecision,
    ) -> Result<JournalSeq, Error> {
        let mut write = self.write().await?;
        let result = decide(&mut write.connection, new).await;
        write.end(result).await
    }

    /// The decisions about the explorations of a map, in order.
    ///
    /// # Errors
    /// [`Error::Damaged`] if one does not have its hash any more.
    pub async fn exploration_decisions(&self, map: &MapId) -> Result<Vec<Vec<u8>>, Error> {
        let through = self.journal_end(map).await?;
        let decisions = self.decisions(map, Kind::ExplorationDecided, through).await?;
        Ok(decisions.into_iter().map(|(_, payload)| payload).collect())
    }
}

async fn decide(
    connection: &mut SqliteConnection,
    new: &NewExplorationDecision,
) -> Result<JournalSeq, Error> {
    let NewExplorationDecision { map, payload, time_ns } = new;
    require_map(&mut *connection, map).await?;
    record_decision(connection, map, Kind::ExplorationDecided, *time_ns, payload).await
}
