//! The ledger of closures: what relax jobs took, or did not take, for the same place, and what people
//! decided about it.

use sqlx::{QueryBuilder, Sqlite, SqliteConnection};

use crate::journal::{Kind, record_decision};
use crate::maps::require_map;
use crate::number::to_sql;
use crate::{ClosureId, Error, JobId, MapId, SessionId, Store};

/// The two moments that a closure joins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClosureEnds {
    /// Whose the earlier moment is, or that of the session that was relaxed before the other.
    pub from_session: SessionId,
    /// Stamp of its scan, that robot's clock in nanoseconds.
    pub from_ns: i64,
    /// Whose the later moment is.
    pub to_session: SessionId,
    /// Stamp of its scan, that robot's clock in nanoseconds.
    pub to_ns: i64,
}

/// A closure that a job considered.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NewClosure {
    /// The same for the same moments, whichever job considers them.
    pub id: ClosureId,
    /// What it joins.
    pub ends: ClosureEnds,
    /// Whether poses rest on it.
    pub is_accepted: bool,
    /// All else, opaque.
    pub payload: Vec<u8>,
}

/// A closure as it is stored.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ClosureRecord {
    /// Its place in the list; never used again.
    pub position: u64,
    /// Its id.
    pub id: ClosureId,
    /// What it joins.
    pub ends: ClosureEnds,
    /// The job that considered it last.
    pub job: JobId,
    /// Whether poses rest on it.
    pub is_accepted: bool,
    /// Whether a person has switched it off.
    pub is_off: bool,
    /// All else, opaque.
    pub payload: Vec<u8>,
}

/// Which closures of a map are meant. All conditions hold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ClosureFilter {
    /// Only those of which a moment is this session's.
    pub session: Option<SessionId>,
    /// Only those that poses rest on, or only the others.
    pub is_accepted: Option<bool>,
}

/// A closure to be switched off or on.
#[derive(Clone, Debug)]
pub struct ClosureSwitch {
    /// The map.
    pub map: MapId,
    /// The closure.
    pub id: ClosureId,
    /// Off, or on again.
    pub is_off: bool,
    /// The decision as the journal keeps it, opaque.
    pub payload: Vec<u8>,
    /// The service's clock, nanoseconds since 1970.
    pub time_ns: i64,
}

#[derive(sqlx::FromRow)]
struct Row {
    #[sqlx(try_from = "i64")]
    position: u64,
    id: ClosureId,
    #[sqlx(flatten)]
    ends: EndsRow,
    job_id: JobId,
    is_accepted: bool,
    is_off: bool,
    payload: Vec<u8>,
}

#[derive(sqlx::FromRow)]
struct EndsRow {
    from_session_id: SessionId,
    from_ns: i64,
    to_session_id: SessionId,
    to_ns: i64,
}

impl From<EndsRow> for ClosureEnds {
    fn from(row: EndsRow) -> Self {
        let EndsRow { from_session_id, from_ns, to_session_id, to_ns } = row;
        Self { from_session: from_session_id, from_ns, to_session: to_session_id, to_ns }
    }
}

impl From<Row> for ClosureRecord {
    fn from(row: Row) -> Self {
        let Row { position, id, ends, job_id: job, is_accepted, is_off, payload } = row;
        Self { position, id, ends: ends.into(), job, is_accepted, is_off, payload }
    }
}

/// All columns of [`Row`]; conditions follow.
const SELECT: &str = "select closures.*, closures_off.id is not null as is_off
     from closures left join closures_off on closures_off.id = closures.id
     where closures.map_id = ";

impl Store {
    /// At most `limit` closures of a map behind the position `after`, in order.
    ///
    /// # Errors
    /// Those of reading.
    pub async fn closures(
        &self,
        map: &MapId,
        filter: ClosureFilter,
        after: Option<u64>,
        limit: u32,
    ) -> Result<Vec<ClosureRecord>, Error> {
        let mut query = QueryBuilder::<Sqlite>::new(SELECT);
        query.push_bind(map);
        if let Some(session) = filter.session {
            query.push(" and (closures.from_session_id = ").push_bind(session);
            query.push(" or closures.to_session_id = ").push_bind(session).push(")");
        }
        if let Some(is_accepted) = filter.is_accepted {
            query.push(" and closures.is_accepted = ").push_bind(is_accepted);
        }
        query.push(" and closures.position > ").push_bind(to_sql(after.unwrap_or(0)));
        query.push(" order by closures.position limit ").push_bind(limit);
        let rows: Vec<Row> = query.build_query_as().fetch_all(self.readers()).await?;
        Ok(rows.into_iter().map(ClosureRecord::from).collect())
    }

    /// One closure of a map, or `None`.
    ///
    /// # Errors
    /// Those of reading.
    pub async fn closure(
        &self,
        map: &MapId,
        id: ClosureId,
    ) -> Result<Option<ClosureRecord>, Error> {
        let mut query = QueryBuilder::<Sqlite>::new(SELECT);
        query.push_bind(map).push(" and closures.id = ").push_bind(id);
        let row: Option<Row> = query.build_query_as().fetch_optional(self.readers()).await?;
        Ok(row.map(ClosureRecord::from))
    }

    /// What the closures of a map join that are switched off, in the order of writing.
    ///
    /// # Errors
    /// Those of reading.
    pub async fn closures_off(&self, map: &MapId) -> Result<Vec<ClosureEnds>, Error> {
        let rows: Vec<EndsRow> = sqlx::query_as(
            "select from_session_id, from_ns, to_session_id, to_ns
             from closures join closures_off using (id) where map_id = $1 order by position",
        )
        .bind(map)
        .fetch_all(self.readers())
        .await?;
        Ok(rows.into_iter().map(ClosureEnds::from).collect())
    }

    /// Switches a closure off or on, as a decision in the journal: what it is then, or `None` if the map
    /// has no such closure. Switching to what it is already records nothing.
    ///
    /// # Errors
    /// [`Error::NoSuchMap`].
    pub async fn switch_closure(
        &self,
        switch: &ClosureSwitch,
    ) -> Result<Option<ClosureRecord>, Error> {
        let mut write = self.write().await?;
        let result = record_switch(&mut write.connection, switch).await;
        write.end(result).await
    }
}

async fn record_switch(
    connection: &mut SqliteConnection,
    switch: &ClosureSwitch,
) -> Result<Option<ClosureRecord>, Error> {
    let ClosureSwitch { map, id, is_off, payload, time_ns } = switch;
    require_map(&mut *connection, map).await?;
    let mut query = QueryBuilder::<Sqlite>::new(SELECT);
    query.push_bind(map).push(" and closures.id = ").push_bind(id);
    let row: Option<Row> = query.build_query_as().fetch_optional(&mut *connection).await?;
    let Some(record) = row.map(ClosureRecord::from) else { return Ok(None) };
    if record.is_off == *is_off {
        return Ok(Some(record));
    }
    let kind = Kind::ClosureSwitched;
    let seq = record_decision(&mut *connection, map, kind, *time_ns, payload).await?;
    let change = if *is_off {
        sqlx::query("insert into closures_off (id, seq) values ($1, $2)").bind(id).bind(seq)
    } else {
        sqlx::query("delete from closures_off where id = $1").bind(id)
    };
    change.execute(connection).await?;
    Ok(Some(ClosureRecord { is_off: *is_off, ..record }))
}

/// Puts what a job considered of some sessions in place of what was considered of them before, inside a
/// transaction. What is switched off stays in the list even if it was not considered again.
pub(crate) async fn replace_closures(
    connection: &mut SqliteConnection,
    map: &MapId,
    job: JobId,
    (sessions, closures): (&[SessionId], &[NewClosure]),
) -> Result<(), Error> {
    for session in sessions {
        sqlx::query(
            "delete from closures where (from_session_id = $1 or to_session_id = $1)
                 and id not in (select id from closures_off)",
        )
        .bind(session)
        .execute(&mut *connection)
        .await?;
    }
    for closure in closures {
        let NewClosure { id, ends, is_accepted, payload } = closure;
        let ClosureEnds { from_session, from_ns, to_session, to_ns } = ends;
        sqlx::query(
            "insert into closures (id, map_id, from_session_id, from_ns, to_session_id, to_ns,
                 job_id, is_accepted, payload)
             values ($1, $2, $3, $4, $5, $6, $7, $8, $9)
             on conflict (id) do update set job_id = excluded.job_id,
                 is_accepted = excluded.is_accepted, payload = excluded.payload",
        )
        .bind(id)
        .bind(map)
        .bind(from_session)
        .bind(from_ns)
        .bind(to_session)
        .bind(to_ns)
        .bind(job)
        .bind(is_accepted)
        .bind(payload.as_slice())
        .execute(&mut *connection)
        .await?;
    }
    Ok(())
}
