//! A fresh database, and short ways to fill it.

use std::path::PathBuf;

use meetpoint_storage::{
    AppendRequest, Appended, ContentHash, MapId, NewEntry, NewMap, NewSession, Refusal,
    RejectionRecord, RobotId, SessionId, SessionRecord, Store, StoreSettings,
};
use tempfile::TempDir;
use uuid::Uuid;

/// A database in a folder that goes away with it, holding the map `hall`.
pub(crate) struct Fixture {
    pub(crate) store: Store,
    pub(crate) settings: StoreSettings,
    _folder: TempDir,
}

impl Fixture {
    pub(crate) async fn new() -> Self {
        let folder = TempDir::new().expect("a temporary folder can be made");
        let settings = settings(folder.path().join("meetpoint.db"));
        let store = Store::open(&settings).await.expect("a new database opens");
        store.create_map(&new_map("hall")).await.expect("a new database has no map `hall`");
        Self { store, settings, _folder: folder }
    }

    /// The same database, closed and opened again.
    pub(crate) async fn reopened(self) -> Self {
        self.store.close().await;
        let store = Store::open(&self.settings).await.expect("the database opens again");
        Self { store, ..self }
    }

    /// A new session of `robot` on `hall`.
    pub(crate) async fn open(&self, robot: &str, client_key: &str) -> SessionRecord {
        let new = new_session(robot, client_key);
        self.store.open_session(&new).await.expect("the session opens").session
    }

    /// One request appended alone.
    pub(crate) async fn append_one(&self, request: AppendRequest) -> Result<Appended, Refusal> {
        let answers = self.store.append(&[request]).await.expect("the group commits");
        answers.into_iter().next().expect("every request gets an answer")
    }
}

pub(crate) fn settings(path: PathBuf) -> StoreSettings {
    StoreSettings { path, n_readers: 2, busy_timeout_ms: 50 }
}

pub(crate) fn hall() -> MapId {
    MapId("hall".to_owned())
}

pub(crate) fn new_map(id: &str) -> NewMap {
    NewMap {
        id: MapId(id.to_owned()),
        display_name: format!("The {id}"),
        resolution_m: 0.05,
        time_ns: 100,
    }
}

/// A session whose id follows from robot and key.
pub(crate) fn new_session(robot: &str, client_key: &str) -> NewSession {
    let name = ContentHash::of(format!("{robot}/{client_key}").as_bytes());
    let (id, _) = name.0.split_first_chunk().expect("a hash is longer than an id");
    NewSession {
        id: SessionId(Uuid::from_bytes(*id)),
        map: hall(),
        robot: RobotId(robot.to_owned()),
        client_key: client_key.to_owned(),
        epoch: None,
        declaration: b"one laser".to_vec(),
        map_from_session: Some([1.0, -2.0, 0.5]),
        time_ns: 200,
    }
}

/// A batch with nothing rejected, one scan, and its number as stamp.
pub(crate) fn batch(session: &SessionRecord, number: u64, content: &str) -> AppendRequest {
    batch_rejecting(session, number, content, Vec::new())
}

pub(crate) fn batch_rejecting(
    session: &SessionRecord,
    number: u64,
    content: &str,
    rejections: Vec<RejectionRecord>,
) -> AppendRequest {
    let stamp_ns = i64::try_from(number).unwrap_or(i64::MAX);
    let entry = NewEntry::Batch {
        number,
        payload: content.as_bytes().to_vec(),
        content_hash: ContentHash::of(content.as_bytes()),
        rejections,
        n_scans: 1,
        n_visits: 0,
        stamps_ns: Some((stamp_ns, stamp_ns)),
    };
    AppendRequest { session: session.id, epoch: session.epoch, receive_time_ns: 300, entry }
}

pub(crate) fn skip(session: &SessionRecord, from: u64, through: u64) -> AppendRequest {
    let entry = NewEntry::Skip { from, through, reason: "spool full".to_owned() };
    AppendRequest { session: session.id, epoch: session.epoch, receive_time_ns: 300, entry }
}

pub(crate) fn rejection(index: u32) -> RejectionRecord {
    RejectionRecord { index, code: "NOT_FINITE".to_owned(), detail: "theta_rad is NaN".to_owned() }
}
