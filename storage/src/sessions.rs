//! Sessions: opening with fencing of older epochs, closing, asking.

use sqlx::SqliteConnection;

use crate::journal::{Kind, NewEvent, record_event};
use crate::maps::require_map;
use crate::number::{COUNT_MAX, to_sql};
use crate::robots::{find_or_register, set_epoch};
use crate::{Error, JournalSeq, MapId, RobotId, SessionId, Store};

/// A session to be opened.
#[derive(Clone, Debug)]
pub struct NewSession {
    /// The id it gets if it is new.
    pub id: SessionId,
    /// A map that exists.
    pub map: MapId,
    /// Registered on the way if it is new.
    pub robot: RobotId,
    /// The client's name for this run, unique for the robot.
    pub client_key: String,
    /// The robot's count of its cold starts; `None` lets the service count.
    pub epoch: Option<u64>,
    /// What the robot declared, opaque; compared when the session is opened again.
    pub declaration: Vec<u8>,
    /// The session's place in the map: x and y in metres, theta in radians; `None` if unknown.
    pub map_from_session: Option<[f64; 3]>,
    /// The service's clock, nanoseconds since 1970.
    pub time_ns: i64,
}

/// What came of opening a session.
#[derive(Clone, Debug, PartialEq)]
pub struct OpenedSession {
    /// The session.
    pub session: SessionRecord,
    /// Whether it was there before.
    pub resumed: bool,
    /// Open sessions of the robot, on any map, that this one ended.
    pub fenced: Vec<SessionId>,
}

/// Whether a session takes batches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, sqlx::Type)]
#[repr(i64)]
pub enum SessionState {
    /// Takes batches.
    Open = 1,
    /// Closed by its robot.
    Closed = 2,
    /// Ended by a newer epoch of the same robot.
    Fenced = 3,
}

/// A session as it is stored.
#[derive(Clone, Debug, PartialEq)]
pub struct SessionRecord {
    /// Its id.
    pub id: SessionId,
    /// The map.
    pub map: MapId,
    /// The robot.
    pub robot: RobotId,
    /// Which of the robot's cold starts.
    pub epoch: u64,
    /// The client's name for this run.
    pub client_key: String,
    /// Whether it takes batches.
    pub state: SessionState,
    /// What the robot declared, opaque.
    pub declaration: Vec<u8>,
    /// The session's place in the map, as it was declared or as a merge in force says: x and y in metres,
    /// theta in radians; `None` if unknown.
    pub map_from_session: Option<[f64; 3]>,
    /// The session in whose frame it is mapped: itself, or one that a merge put it into; `None` for the
    /// map's frame.
    pub frame: Option<SessionId>,
    /// Its own frame seen from the one that it is mapped in.
    pub frame_from_session: [f64; 3],
    /// Batches up to this number are durable, skipped ones included.
    pub acked_through: u64,
    /// Laser scans received, without rejected ones.
    pub n_scans: u64,
    /// Observations rejected.
    pub n_rejected: u64,
    /// Smallest stamp received, the robot's clock in nanoseconds; `None` before the first.
    pub first_time_ns: Option<i64>,
    /// Largest stamp received, the robot's clock in nanoseconds; `None` before the first.
    pub last_time_ns: Option<i64>,
    /// When it was opened, by the service's clock, nanoseconds since 1970.
    pub create_time_ns: i64,
    /// The journal entry that closed or fenced it; `None` while it is open.
    pub end_seq: Option<JournalSeq>,
}

/// Which sessions are meant. Both conditions hold.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SessionFilter {
    /// Only this map's.
    pub map: Option<MapId>,
    /// Only this robot's.
    pub robot: Option<RobotId>,
}

#[derive(sqlx::FromRow)]
struct Row {
    id: SessionId,
    map_id: MapId,
    robot_id: RobotId,
    #[sqlx(try_from = "i64")]
    epoch: u64,
    client_key: String,
    state: SessionState,
    declaration: Vec<u8>,
    map_from_session_x_m: Option<f64>,
    map_from_session_y_m: Option<f64>,
    map_from_session_theta_rad: Option<f64>,
    #[sqlx(try_from = "i64")]
    acked_through: u64,
    #[sqlx(try_from = "i64")]
    n_scans: u64,
    #[sqlx(try_from = "i64")]
    n_rejected: u64,
    first_time_ns: Option<i64>,
    last_time_ns: Option<i64>,
    create_time_ns: i64,
    end_seq: Option<JournalSeq>,
    is_merged: bool,
    frame_id: Option<SessionId>,
    x_m: Option<f64>,
    y_m: Option<f64>,
    theta_rad: Option<f64>,
}

impl From<Row> for SessionRecord {
    fn from(row: Row) -> Self {
        let declared = place([
            row.map_from_session_x_m,
            row.map_from_session_y_m,
            row.map_from_session_theta_rad,
        ]);
        let merged = place([row.x_m, row.y_m, row.theta_rad]).filter(|_| row.is_merged);
        let (frame, frame_from_session) = match (declared, merged) {
            (Some(map_from_session), _) => (None, map_from_session),
            (None, Some(frame_from_session)) => (row.frame_id, frame_from_session),
            (None, None) => (Some(row.id), [0.0; 3]),
        };
        Self {
            id: row.id,
            map: row.map_id,
            robot: row.robot_id,
            epoch: row.epoch,
            client_key: row.client_key,
            state: row.state,
            declaration: row.declaration,
            map_from_session: frame.is_none().then_some(frame_from_session),
            frame,
            frame_from_session,
            acked_through: row.acked_through,
            n_scans: row.n_scans,
            n_rejected: row.n_rejected,
            first_time_ns: row.first_time_ns,
            last_time_ns: row.last_time_ns,
            create_time_ns: row.create_time_ns,
            end_seq: row.end_seq,
        }
    }
}

/// A place from its three columns, which are all there or all null.
pub(crate) fn place(columns: [Option<f64>; 3]) -> Option<[f64; 3]> {
    let [x_m, y_m, theta_rad] = columns;
    Some([x_m?, y_m?, theta_rad?])
}

impl Store {
    /// Opens a session and ends the robot's older ones, or finds the one that was opened with the
    /// same robot and key, whatever its state.
    ///
    /// # Errors
    /// [`Error::NoSuchMap`]; [`Error::SessionKeyTaken`] if the key names a session with another map
    /// or declaration; [`Error::SessionFenced`] if the epoch is not above the robot's newest;
    /// [`Error::EpochTooLarge`].
    pub async fn open_session(&self, new: &NewSession) -> Result<OpenedSession, Error> {
        let mut write = self.write().await?;
        let result = open(&mut write.connection, new).await;
        write.end(result).await
    }

    /// Closes a session: nothing more will come. Closing a closed one changes nothing.
    ///
    /// # Errors
    /// [`Error::NoSuchSession`]; [`Error::SessionFenced`] if `epoch` is not the session's own or a
    /// newer one ended it.
    pub async fn close_session(
        &self,
        id: SessionId,
        epoch: u64,
        time_ns: i64,
    ) -> Result<SessionRecord, Error> {
        let mut write = self.write().await?;
        let result = close(&mut write.connection, id, epoch, time_ns).await;
        write.end(result).await
    }

    /// One session, or `None`.
    ///
    /// # Errors
    /// Those of reading.
    pub async fn session(&self, id: SessionId) -> Result<Option<SessionRecord>, Error> {
        let row: Option<Row> = sqlx::query_as("select * from placed_sessions where id = $1")
            .bind(id)
            .fetch_optional(self.readers())
            .await?;
        Ok(row.map(SessionRecord::from))
    }

    /// At most `limit` sessions in the order of their opening, those behind `after`. None if there
    /// is no session `after`.
    ///
    /// # Errors
    /// Those of reading.
    pub async fn sessions(
        &self,
        filter: &SessionFilter,
        after: Option<SessionId>,
        limit: u32,
    ) -> Result<Vec<SessionRecord>, Error> {
        let rows: Vec<Row> = sqlx::query_as(
            "select * from placed_sessions
             where ($1 is null or map_id = $1) and ($2 is null or robot_id = $2)
                 and ($3 is null or (select position from sessions where id = $3) < position)
             order by position limit $4",
        )
        .bind(&filter.map)
        .bind(&filter.robot)
        .bind(after)
        .bind(limit)
        .fetch_all(self.readers())
        .await?;
        Ok(rows.into_iter().map(SessionRecord::from).collect())
    }

    /// The sessions of a map that take batches, in the order of their opening, at most `limit`; those of
    /// one robot if one is given.
    ///
    /// # Errors
    /// Those of reading.
    pub async fn open_sessions(
        &self,
        map: &MapId,
        robot: Option<&RobotId>,
        limit: u32,
    ) -> Result<Vec<SessionRecord>, Error> {
        let rows: Vec<Row> = sqlx::query_as(
            "select * from placed_sessions
             where map_id = $1 and state = $2 and ($3 is null or robot_id = $3)
             order by position limit $4",
        )
        .bind(map)
        .bind(SessionState::Open)
        .bind(robot)
        .bind(limit)
        .fetch_all(self.readers())
        .await?;
        Ok(rows.into_iter().map(SessionRecord::from).collect())
    }
}

async fn open(connection: &mut SqliteConnection, new: &NewSession) -> Result<OpenedSession, Error> {
    require_map(&mut *connection, &new.map).await?;
    if let Some(session) = find_by_key(&mut *connection, new).await? {
        return Ok(OpenedSession { session, resumed: true, fenced: Vec::new() });
    }
    let robot = find_or_register(&mut *connection, &new.robot, new.time_ns).await?;
    let epoch = new.epoch.unwrap_or(robot.epoch + 1);
    if epoch <= robot.epoch {
        return Err(Error::SessionFenced { newest: robot.epoch });
    }
    if COUNT_MAX < epoch {
        return Err(Error::EpochTooLarge { epoch, epoch_max: COUNT_MAX });
    }
    set_epoch(&mut *connection, &new.robot, to_sql(epoch)).await?;
    let fenced = fence_open_sessions(&mut *connection, &new.robot, new.time_ns).await?;
    insert(&mut *connection, new, epoch).await?;
    let opened = event(&new.map, Kind::SessionOpened, new.id, new.time_ns);
    record_event(&mut *connection, &opened).await?;
    let session = require_session(connection, new.id).await?;
    Ok(OpenedSession { session, resumed: false, fenced })
}

/// The session that the robot opened with the same key.
async fn find_by_key(
    connection: &mut SqliteConnection,
    new: &NewSession,
) -> Result<Option<SessionRecord>, Error> {
    let row: Option<Row> =
        sqlx::query_as("select * from placed_sessions where robot_id = $1 and client_key = $2")
            .bind(&new.robot)
            .bind(&new.client_key)
            .fetch_optional(connection)
            .await?;
    let Some(session) = row.map(SessionRecord::from) else { return Ok(None) };
    if session.map == new.map && session.declaration == new.declaration {
        return Ok(Some(session));
    }
    let (robot, client_key) = (new.robot.clone(), new.client_key.clone());
    Err(Error::SessionKeyTaken { robot, client_key })
}

async fn fence_open_sessions(
    connection: &mut SqliteConnection,
    robot: &RobotId,
    time_ns: i64,
) -> Result<Vec<SessionId>, Error> {
    let open: Vec<(SessionId, MapId)> = sqlx::query_as(
        "select id, map_id from sessions where robot_id = $1 and state = $2 order by position",
    )
    .bind(robot)
    .bind(SessionState::Open)
    .fetch_all(&mut *connection)
    .await?;
    for (id, map) in &open {
        let fenced = event(map, Kind::SessionFenced, *id, time_ns);
        let seq = record_event(&mut *connection, &fenced).await?;
        set_ended(&mut *connection, *id, SessionState::Fenced, seq).await?;
    }
    Ok(open.into_iter().map(|(id, _)| id).collect())
}

async fn insert(
    connection: &mut SqliteConnection,
    new: &NewSession,
    epoch: u64,
) -> Result<(), Error> {
    sqlx::query(
        "insert into sessions (id, map_id, robot_id, epoch, client_key, state, declaration,
             map_from_session_x_m, map_from_session_y_m, map_from_session_theta_rad,
             acked_through, n_scans, n_rejected, create_time_ns)
         values ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, 0, 0, 0, $11)",
    )
    .bind(new.id)
    .bind(&new.map)
    .bind(&new.robot)
    .bind(to_sql(epoch))
    .bind(&new.client_key)
    .bind(SessionState::Open)
    .bind(new.declaration.as_slice())
    .bind(new.map_from_session.map(|[x_m, _, _]| x_m))
    .bind(new.map_from_session.map(|[_, y_m, _]| y_m))
    .bind(new.map_from_session.map(|[_, _, theta_rad]| theta_rad))
    .bind(new.time_ns)
    .execute(connection)
    .await?;
    Ok(())
}

async fn close(
    connection: &mut SqliteConnection,
    id: SessionId,
    epoch: u64,
    time_ns: i64,
) -> Result<SessionRecord, Error> {
    let session = require_session(&mut *connection, id).await?;
    if session.epoch != epoch || session.state == SessionState::Fenced {
        let robot = find_or_register(connection, &session.robot, time_ns).await?;
        return Err(Error::SessionFenced { newest: robot.epoch });
    }
    if session.state == SessionState::Closed {
        return Ok(session);
    }
    let closed = event(&session.map, Kind::SessionClosed, id, time_ns);
    let seq = record_event(&mut *connection, &closed).await?;
    set_ended(&mut *connection, id, SessionState::Closed, seq).await?;
    require_session(connection, id).await
}

fn event(map: &MapId, kind: Kind, session: SessionId, time_ns: i64) -> NewEvent<'_> {
    NewEvent { map, kind, session: Some(session), number: None, time_ns }
}

async fn set_ended(
    connection: &mut SqliteConnection,
    id: SessionId,
    state: SessionState,
    seq: JournalSeq,
) -> Result<(), Error> {
    sqlx::query("update sessions set state = $1, end_seq = $2 where id = $3")
        .bind(state)
        .bind(seq)
        .bind(id)
        .execute(connection)
        .await?;
    Ok(())
}

async fn require_session(
    connection: &mut SqliteConnection,
    id: SessionId,
) -> Result<SessionRecord, Error> {
    let row: Option<Row> = sqlx::query_as("select * from placed_sessions where id = $1")
        .bind(id)
        .fetch_optional(connection)
        .await?;
    row.map(SessionRecord::from).ok_or(Error::NoSuchSession(id))
}
