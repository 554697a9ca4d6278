//! The database file: opening, checking, migrating, one writer and several readers.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use sqlx::migrate::{MigrateError, Migrator};
use sqlx::sqlite::{
    SqliteConnectOptions, SqliteJournalMode, SqlitePool, SqlitePoolOptions, SqliteSynchronous,
};
use sqlx::{ConnectOptions, Connection, SqliteConnection};
use tokio::sync::{Mutex, MutexGuard};

use crate::Error;

static MIGRATIONS: Migrator = sqlx::migrate!("../migrations/sqlite");

/// 3.51.3 is the first SQLite whose WAL cannot be damaged by a reset race. `links` lets any other
/// crate pull in a lower one silently.
const SQLITE_VERSION_MIN: [u32; 3] = [3, 51, 3];

/// Above this size a database is not read through at start, which would take seconds.
const QUICK_CHECK_BYTES_MAX: i64 = 1 << 30;

/// The WAL file is cut to this size after a checkpoint, so that one burst does not keep the disk.
const WAL_BYTES_MAX: &str = "67108864";

/// How to open a database.
#[derive(Clone, Debug)]
pub struct StoreSettings {
    /// The database file. Created if it is missing; its folder must exist.
    pub path: PathBuf,
    /// Connections that only read; at least 1.
    pub n_readers: u32,
    /// How long a statement waits for another process's lock, in milliseconds.
    pub busy_timeout_ms: u64,
}

/// The database. Clones share it.
#[derive(Clone, Debug)]
pub struct Store {
    inner: Arc<Inner>,
}

#[derive(Debug)]
struct Inner {
    options: SqliteConnectOptions,
    /// The one connection that writes. `None` after a failure: the next transaction opens another.
    writer: Mutex<Option<SqliteConnection>>,
    readers: SqlitePool,
}

impl Store {
    /// Opens the database, creates it if it is missing, checks it and brings it to the newest
    /// migration.
    ///
    /// # Errors
    /// [`Error::UnknownMigration`] if a newer program wrote it; [`Error::Damaged`] if SQLite finds
    /// it so; [`Error::Internal`] if it cannot be opened at all.
    pub async fn open(settings: &StoreSettings) -> Result<Self, Error> {
        let options = connect_options(settings);
        let mut connection = options.connect().await?;
        check_sqlite_version(&mut connection).await?;
        quick_check(&mut connection).await?;
        migrate(&mut connection).await?;
        let readers = SqlitePoolOptions::new()
            .max_connections(settings.n_readers.max(1))
            .idle_timeout(None)
            .max_lifetime(None)
            .test_before_acquire(false)
            .connect_with(options.clone().pragma("query_only", "ON"))
            .await?;
        let writer = Mutex::new(Some(connection));
        Ok(Self { inner: Arc::new(Inner { options, writer, readers }) })
    }

    /// Waits for the transaction under way and closes all connections. Later calls fail or open
    /// the file again.
    pub async fn close(&self) {
        self.inner.readers.close().await;
        let connection = self.inner.writer.lock().await.take();
        let Some(connection) = connection else { return };
        if let Err(error) = connection.close().await {
            tracing::warn!(%error, "the writing connection did not close cleanly");
        }
    }

    /// The connections that only read.
    pub(crate) fn readers(&self) -> &SqlitePool {
        &self.inner.readers
    }

    /// Begins a transaction that may write. Others wait; what is not committed is rolled back.
    ///
    /// Plain SQL instead of sqlx's transactions: SQLite ends a transaction by itself when the disk
    /// is full, after which sqlx's count of open ones stays wrong for ever.
    pub(crate) async fn write(&self) -> Result<WriteTransaction<'_>, Error> {
        let mut slot = self.inner.writer.lock().await;
        let mut connection = match slot.take() {
            Some(connection) => connection,
            None => self.inner.options.connect().await?,
        };
        sqlx::query("begin immediate").execute(&mut connection).await?;
        Ok(WriteTransaction { slot, connection })
    }
}

/// A transaction that may write. The connection is put back by [`end`](Self::end) only: a failure,
/// or a caller that goes away, closes it, and SQLite forgets what it began.
pub(crate) struct WriteTransaction<'a> {
    slot: MutexGuard<'a, Option<SqliteConnection>>,
    /// Where to send statements.
    pub(crate) connection: SqliteConnection,
}

impl WriteTransaction<'_> {
    /// Makes everything durable if `result` is good, which takes the disk's fsync; otherwise
    /// undoes everything.
    pub(crate) async fn end<T>(mut self, result: Result<T, Error>) -> Result<T, Error> {
        let ending = if result.is_ok() { "commit" } else { "rollback" };
        match (sqlx::query(ending).execute(&mut self.connection).await, result) {
            (Ok(_), result) => {
                *self.slot = Some(self.connection);
                result
            }
            (Err(error), Ok(_)) => Err(error.into()),
            (Err(_), Err(first)) => Err(first),
        }
    }
}

fn connect_options(settings: &StoreSettings) -> SqliteConnectOptions {
    SqliteConnectOptions::new()
        .filename(&settings.path)
        .create_if_missing(true)
        .journal_mode(SqliteJournalMode::Wal)
        .synchronous(SqliteSynchronous::Full)
        .foreign_keys(true)
        .busy_timeout(Duration::from_millis(settings.busy_timeout_ms))
        .pragma("journal_size_limit", WAL_BYTES_MAX)
        .pragma("trusted_schema", "OFF")
        .disable_statement_logging()
}

async fn check_sqlite_version(connection: &mut SqliteConnection) -> Result<(), Error> {
    let text: String = sqlx::query_scalar("select sqlite_version()").fetch_one(connection).await?;
    let version: Vec<u32> = text.split('.').filter_map(|part| part.parse().ok()).collect();
    if version.as_slice() < SQLITE_VERSION_MIN.as_slice() {
        return Err(Error::Internal(format!("sqlite {text} is older than 3.51.3").into()));
    }
    Ok(())
}

async fn quick_check(connection: &mut SqliteConnection) -> Result<(), Error> {
    let n_pages: i64 = sqlx::query_scalar("pragma page_count").fetch_one(&mut *connection).await?;
    let page_bytes: i64 =
        sqlx::query_scalar("pragma page_size").fetch_one(&mut *connection).await?;
    if QUICK_CHECK_BYTES_MAX < n_pages.saturating_mul(page_bytes) {
        return Ok(());
    }
    let found: String = sqlx::query_scalar("pragma quick_check(1)").fetch_one(connection).await?;
    if found == "ok" { Ok(()) } else { Err(Error::Damaged(found)) }
}

async fn migrate(connection: &mut SqliteConnection) -> Result<(), Error> {
    MIGRATIONS.run(connection).await.map_err(|error| match error {
        MigrateError::Execute(error) | MigrateError::ExecuteMigration(error, _) => error.into(),
        MigrateError::VersionMissing(version) | MigrateError::VersionMismatch(version) => {
            Error::UnknownMigration(version)
        }
        other => Error::Internal(other.into()),
    })
}

#[cfg(test)]
mod tests {
    use sqlx::query;
    use tempfile::TempDir;

    use super::*;
    use crate::{MapId, NewMap};

    async fn new_store(folder: &TempDir) -> Store {
        let path = folder.path().join("meetpoint.db");
        let settings = StoreSettings { path, n_readers: 1, busy_timeout_ms: 50 };
        Store::open(&settings).await.expect("a new database opens")
    }

    fn map(id: &str, display_name: String) -> NewMap {
        NewMap { id: MapId(id.to_owned()), display_name, resolution_m: 0.05, time_ns: 0 }
    }

    /// Lets the database grow by no page beyond what it has.
    async fn fill(store: &Store) {
        let mut write = store.write().await.expect("nobody writes");
        query("pragma max_page_count = 1")
            .execute(&mut write.connection)
            .await
            .expect("the limit can be set");
        write.end(Ok(())).await.expect("nothing was written");
    }

    #[tokio::test]
    async fn a_full_disk_passes() {
        let folder = TempDir::new().expect("a temporary folder can be made");
        let store = new_store(&folder).await;
        store.create_map(&map("hall", "Hall".to_owned())).await.expect("there is room");
        let long = "x".repeat(1 << 20);
        for _ in 0..3 {
            fill(&store).await;
            let refused = store.create_map(&map("lab", long.clone())).await;
            assert!(matches!(refused, Err(Error::Full)), "no room: {refused:?}");
            let hall = store.map(&MapId("hall".to_owned())).await.expect("reading works");
            assert!(hall.is_some(), "what was there is there");
            // More room: the limit belongs to the connection.
            store.inner.writer.lock().await.take();
        }
        store.create_map(&map("lab", long)).await.expect("there is room again");
    }

    #[tokio::test]
    async fn a_transaction_that_sqlite_ended_itself_does_no_harm() {
        let folder = TempDir::new().expect("a temporary folder can be made");
        let store = new_store(&folder).await;
        let mut write = store.write().await.expect("nobody writes");
        query("rollback").execute(&mut write.connection).await.expect("it was begun");
        let failed: Result<(), Error> = write.end(Err(Error::Full)).await;
        assert!(matches!(failed, Err(Error::Full)), "the first error is told");
        store.create_map(&map("hall", "Hall".to_owned())).await.expect("the next one works");
    }

    #[tokio::test]
    async fn the_settings_are_in_force() {
        let folder = TempDir::new().expect("a temporary folder can be made");
        let store = new_store(&folder).await;
        let mut write = store.write().await.expect("nobody writes");
        let expected = [("journal_mode", "wal"), ("synchronous", "2"), ("foreign_keys", "1")];
        for (name, value) in expected {
            let sql =
                sqlx::AssertSqlSafe(format!("select cast({name} as text) from pragma_{name}"));
            let found: String = sqlx::query_scalar(sql)
                .fetch_one(&mut write.connection)
                .await
                .expect("the setting can be read");
            assert_eq!(found, value, "{name}");
        }
        write.end(Ok(())).await.expect("nothing was written");
        let refused = query("delete from maps").execute(store.readers()).await;
        assert!(refused.is_err(), "readers do not write");
    }

    #[tokio::test]
    async fn what_is_begun_is_seen_by_nobody_until_its_end() {
        let folder = TempDir::new().expect("a temporary folder can be made");
        let store = new_store(&folder).await;
        let mut write = store.write().await.expect("nobody writes");
        query("insert into robots values ('ann', 'Ann', 0, 0)")
            .execute(&mut write.connection)
            .await
            .expect("the row fits");
        assert_eq!(store.robots(None, 9).await.expect("reading works"), [], "not yet");
        write.end(Ok(())).await.expect("it commits");
        assert_eq!(store.robots(None, 9).await.expect("reading works").len(), 1, "now");
        drop(store.write().await.expect("nobody writes"));
        store.write().await.expect("a dropped one is gone").end(Ok(())).await.expect("it commits");
    }
}
