//! Merges: where sessions of unknown start lie as jobs found it, and what was decided about it.

use sqlx::{QueryBuilder, Sqlite, SqliteConnection};

use crate::job_runs::hold_checkpoint;
use crate::jobs::insert_job;
use crate::journal::{Kind, record_decision};
use crate::maps::require_map;
use crate::number::to_sql;
use crate::placements::{Placement, replace_placements};
use crate::{Error, JobId, JournalSeq, MapId, MergeId, NewJob, SessionId, Store};

/// What was decided about a merge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, sqlx::Type)]
#[repr(i64)]
pub enum MergeState {
    /// Nothing yet.
    Open = 1,
    /// The session lies where it was found to.
    Accepted = 2,
    /// It stays in its own frame.
    Rejected = 3,
    /// It was accepted, and taken back.
    Undone = 4,
}

/// What a job found of a session's place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NewMerge {
    /// The same whenever the session is looked at.
    pub id: MergeId,
    /// The session.
    pub session: SessionId,
    /// Poses that it had.
    pub n_poses: u64,
    /// Scans that the map had drawn.
    pub n_scans_drawn: u64,
    /// What was found, opaque.
    pub payload: Vec<u8>,
}

/// A merge as it is stored.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MergeRecord {
    /// Its place in the list; never used again.
    pub position: u64,
    /// Its id.
    pub id: MergeId,
    /// The map.
    pub map: MapId,
    /// The session.
    pub session: SessionId,
    /// What was decided.
    pub state: MergeState,
    /// The journal entry that decided it; `None` while it is open.
    pub seq: Option<JournalSeq>,
    /// The job that looked at it last.
    pub job: JobId,
    /// Poses that the session had then.
    pub n_poses: u64,
    /// Scans that the map had drawn then.
    pub n_scans_drawn: u64,
    /// What was found, opaque.
    pub payload: Vec<u8>,
    /// What was decided, opaque; `None` while it is open.
    pub decision: Option<Vec<u8>>,
}

/// Which merges are meant. All conditions hold.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MergeFilter {
    /// Only this map's.
    pub map: Option<MapId>,
    /// Only this session's.
    pub session: Option<SessionId>,
    /// Only those about which this was decided.
    pub state: Option<MergeState>,
}

/// A decision about a merge that is there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MergeDecision {
    /// The merge.
    pub merge: MergeId,
    /// What it is then; not open.
    pub state: MergeState,
    /// For the merge, opaque.
    pub decision: Vec<u8>,
    /// For the journal, opaque.
    pub payload: Vec<u8>,
}

/// Decisions about merges of one map, made together.
#[derive(Clone, Debug)]
pub struct NewMergeDecisions {
    /// The map.
    pub map: MapId,
    /// The newest decision about a merge of the map that whoever decides knew.
    pub known: JournalSeq,
    /// In the order in which they are to stand in the journal.
    pub decisions: Vec<MergeDecision>,
    /// Where all merges of the map that are in force then put sessions.
    pub placements: Vec<Placement>,
    /// Jobs to be queued if and only if this is decided.
    pub jobs: Vec<NewJob>,
    /// The service's clock, nanoseconds since 1970.
    pub time_ns: i64,
}

/// What a job found, and what rules made of it, to be recorded together.
#[derive(Clone, Debug)]
pub struct FoundMerges {
    /// The job.
    pub job: JobId,
    /// The right to write for it.
    pub fence: u64,
    /// What was found.
    pub merges: Vec<NewMerge>,
    /// What rules decided about it.
    pub decided: NewMergeDecisions,
    /// Where the job goes on after a crash, opaque: kept if and only if this is recorded.
    pub checkpoint: Vec<u8>,
}

/// What the journal keeps of a decision about a merge.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MergeDecisionRecord {
    /// Its place in the journal.
    pub seq: JournalSeq,
    /// What was decided, opaque.
    pub payload: Vec<u8>,
}

#[derive(sqlx::FromRow)]
struct Row {
    #[sqlx(try_from = "i64")]
    position: u64,
    id: MergeId,
    map_id: MapId,
    session_id: SessionId,
    state: MergeState,
    seq: Option<JournalSeq>,
    job_id: JobId,
    #[sqlx(try_from = "i64")]
    n_poses: u64,
    #[sqlx(try_from = "i64")]
    n_scans_drawn: u64,
    payload: Vec<u8>,
    decision: Option<Vec<u8>>,
}

impl From<Row> for MergeRecord {
    fn from(row: Row) -> Self {
        Self {
            position: row.position,
            id: row.id,
            map: row.map_id,
            session: row.session_id,
            state: row.state,
            seq: row.seq,
            job: row.job_id,
            n_poses: row.n_poses,
            n_scans_drawn: row.n_scans_drawn,
            payload: row.payload,
            decision: row.decision,
        }
    }
}

impl Store {
    /// At most `limit` merges behind the position `after`, in the order of being looked at first.
    ///
    /// # Errors
    /// Those of reading.
    pub async fn merges(
        &self,
        filter: &MergeFilter,
        after: Option<u64>,
        limit: u32,
    ) -> Result<Vec<MergeRecord>, Error> {
        let mut query = QueryBuilder::<Sqlite>::new("select * from merges where position > ");
        query.push_bind(to_sql(after.unwrap_or(0)));
        if let Some(map) = &filter.map {
            query.push(" and map_id = ").push_bind(map);
        }
        if let Some(session) = filter.session {
            query.push(" and session_id = ").push_bind(session);
        }
        if let Some(state) = filter.state {
            query.push(" and state = ").push_bind(state);
        }
        query.push(" order by position limit ").push_bind(limit);
        let rows: Vec<Row> = query.build_query_as().fetch_all(self.readers()).await?;
        Ok(rows.into_iter().map(MergeRecord::from).collect())
    }

    /// One merge, or `None`.
    ///
    /// # Errors
    /// Those of reading.
    pub async fn merge(&self, id: MergeId) -> Result<Option<MergeRecord>, Error> {
        let row: Option<Row> = sqlx::query_as("select * from merges where id = $1")
            .bind(id)
            .fetch_optional(self.readers())
            .await?;
        Ok(row.map(MergeRecord::from))
    }

    /// The decisions about merges of a map up to `through`, in order.
    ///
    /// # Errors
    /// [`Error::Damaged`] if one does not have its hash any more.
    pub async fn merge_decisions(
        &self,
        map: &MapId,
        through: JournalSeq,
    ) -> Result<Vec<MergeDecisionRecord>, Error> {
        let decisions = self.decisions(map, Kind::MergeDecided, through).await?;
        let record = |(seq, payload)| MergeDecisionRecord { seq, payload };
        Ok(decisions.into_iter().map(record).collect())
    }

    /// Records decisions about merges: all of them, or none.
    ///
    /// # Errors
    /// [`Error::NoSuchMap`]; [`Error::MergesChanged`] if somebody decided otherwise meanwhile.
    pub async fn decide_merges(&self, new: &NewMergeDecisions) -> Result<(), Error> {
        let mut write = self.write().await?;
        let result = decide(&mut write.connection, new).await;
        write.end(result).await
    }

    /// Records what a job found and what rules made of it, together with the job's checkpoint.
    ///
    /// # Errors
    /// [`Error::NoSuchMap`]; [`Error::MergesChanged`] if somebody decided meanwhile;
    /// [`Error::LeaseLost`] if the fence is not the one in force or the job has ended.
    pub async fn record_found_merges(&self, found: &FoundMerges) -> Result<(), Error> {
        let mut write = self.write().await?;
        let result = record_found(&mut write.connection, found).await;
        write.end(result).await
    }
}

async fn record_found(connection: &mut SqliteConnection, found: &FoundMerges) -> Result<(), Error> {
    let FoundMerges { job, fence, merges, decided, checkpoint } = found;
    hold_checkpoint(&mut *connection, *job, *fence, checkpoint).await?;
    for new in merges {
        insert_or_update(&mut *connection, &decided.map, *job, new).await?;
    }
    decide(connection, decided).await
}

async fn insert_or_update(
    connection: &mut SqliteConnection,
    map: &MapId,
    job: JobId,
    new: &NewMerge,
) -> Result<(), Error> {
    let NewMerge { id, session, n_poses, n_scans_drawn, payload } = new;
    sqlx::query(
        "insert into merges
             (id, map_id, session_id, state, job_id, n_poses, n_scans_drawn, payload)
         values ($1, $2, $3, 1, $4, $5, $6, $7)
         on conflict (session_id) do update set job_id = excluded.job_id,
             n_poses = excluded.n_poses, n_scans_drawn = excluded.n_scans_drawn,
             payload = excluded.payload",
    )
    .bind(id)
    .bind(map)
    .bind(session)
    .bind(job)
    .bind(to_sql(*n_poses))
    .bind(to_sql(*n_scans_drawn))
    .bind(payload.as_slice())
    .execute(connection)
    .await?;
    Ok(())
}

async fn decide(connection: &mut SqliteConnection, new: &NewMergeDecisions) -> Result<(), Error> {
    let NewMergeDecisions { map, known, decisions, placements, jobs, time_ns } = new;
    require_map(&mut *connection, map).await?;
    let newest: JournalSeq = sqlx::query_scalar(
        "select coalesce(max(seq), 0) from journal where map_id = $1 and 8 <= kind and kind = $2",
    )
    .bind(map)
    .bind(Kind::MergeDecided)
    .fetch_one(&mut *connection)
    .await?;
    if newest != *known {
        return Err(Error::MergesChanged(map.clone()));
    }
    for MergeDecision { merge, state, decision, payload } in decisions {
        let kind = Kind::MergeDecided;
        let seq = record_decision(&mut *connection, map, kind, *time_ns, payload).await?;
        sqlx::query("update merges set state = $1, seq = $2, decision = $3 where id = $4")
            .bind(state)
            .bind(seq)
            .bind(decision.as_slice())
            .bind(merge)
            .execute(&mut *connection)
            .await?;
    }
    if !decisions.is_empty() {
        replace_placements(&mut *connection, map, placements).await?;
    }
    for job in jobs {
        insert_job(&mut *connection, job).await?;
    }
    Ok(())
}
