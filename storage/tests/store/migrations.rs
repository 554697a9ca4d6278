//! Databases of other programs: older ones open, newer ones are refused.

use meetpoint_storage::{ContentHash, Error, JournalEvent, JournalSeq, NewImport, NextIds, Store};
use sqlx::migrate::Migrator;
use sqlx::sqlite::SqliteConnectOptions;
use sqlx::{ConnectOptions, Connection};
use tempfile::TempDir;

use crate::fixture::{Fixture, batch, hall, new_map, new_session, settings};

static MIGRATIONS: Migrator = sqlx::migrate!("../migrations/sqlite");

/// Rows as a program wrote them that knew the first migration only.
const ROWS_OF_MIGRATION_1: &str = "
    insert into maps (id, display_name, resolution_m, create_time_ns)
        values ('hall', 'The hall', 0.05, 100);
    insert into robots (id, display_name, epoch, create_time_ns) values ('ann', 'ann', 3, 150);
    insert into sessions (id, map_id, robot_id, epoch, client_key, state, declaration,
            map_from_session_x_m, map_from_session_y_m, map_from_session_theta_rad,
            acked_through, n_scans, n_rejected, first_time_ns, last_time_ns, create_time_ns)
        values (x'99999999999999999999999999999999', 'hall', 'ann', 3, 'monday', 1,
            cast('one laser' as blob), null, null, null, 1, 7, 1, 5, 6, 200);
    insert into journal (map_id, kind, session_id, number, through, receive_time_ns, content_hash,
            rejections, payload)
        values
            ('hall', 1, null, null, null, 100, null, null, null),
            ('hall', 2, x'99999999999999999999999999999999', null, null, 200, null, null, null),
            ('hall', 3, x'99999999999999999999999999999999', 1, 1, 300,
             -- BLAKE3 of nothing, from its specification.
             x'af1349b9f5f9a1a6a0404dea36dcc9499bcb25c9adc112b7cc9a93cae41f3262',
             '[{\"index\":2,\"code\":\"NOT_FINITE\",\"detail\":\"nan\"}]', x'');
";

#[tokio::test]
async fn a_database_of_the_first_migration_opens() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let settings = settings(folder.path().join("old.db"));
    let options = SqliteConnectOptions::new().filename(&settings.path).create_if_missing(true);
    let mut old = options.connect().await.expect("an empty database can be made");
    MIGRATIONS.run_to(1, &mut old).await.expect("the first migration runs");
    sqlx::raw_sql(ROWS_OF_MIGRATION_1).execute(&mut old).await.expect("its rows fit");
    old.close().await.expect("it closes");

    let store = Store::open(&settings).await.expect("an older database opens");
    let map = store.map(&hall()).await.expect("reading works").expect("the map is there");
    assert_eq!((map.published_version, map.latest_version), (0, 0), "no version yet");
    assert!(map.publishes_automatically, "an old map publishes as a new one does");
    let reopened = store.open_session(&new_session("ann", "monday")).await;
    let session = reopened.expect("the session is found by its key").session;
    assert_eq!((session.epoch, session.map_from_session), (3, None), "as it was written");
    let journal = store.journal(&hall(), JournalSeq::START, 9, 9).await.expect("reading works");
    let last = journal.last().map(|entry| &entry.event);
    let is_batch =
        matches!(last, Some(JournalEvent::Batch { number: 1, rejected, .. }) if *rejected == [2]);
    assert!(is_batch, "the journal is read: {last:?}");
    let next = store.append(&[batch(&session, 2, "b")]).await.expect("the group commits");
    assert!(next[0].is_ok(), "and goes on");
}

/// What a program added that knew the third migration: everything before there were decisions with
/// content and topologies.
const ROWS_OF_MIGRATION_3: &str = "
    insert into tiles (hash, bytes) values
        (x'af1349b9f5f9a1a6a0404dea36dcc9499bcb25c9adc112b7cc9a93cae41f3262', x'00');
    insert into map_versions (map_id, number, journal_seq, n_scans, origin, create_time_ns, manifest)
        values ('hall', 1, 3, 7, 'tracking', 400, x'010000000000000000');
    insert into checkpoints (map_id, version, journal_seq, state) values ('hall', 1, 3, x'aa');
    update maps set published_version = 1, latest_version = 1;
    insert into journal (map_id, kind, session_id, number, through, receive_time_ns, reason) values
        ('hall', 4, x'99999999999999999999999999999999', 2, 4, 500, 'spool full'),
        ('hall', 7, null, 1, null, 600, null);
";

#[tokio::test]
async fn a_database_of_the_third_migration_keeps_its_journal_and_versions() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let settings = settings(folder.path().join("old.db"));
    let options = SqliteConnectOptions::new().filename(&settings.path).create_if_missing(true);
    let mut old = options.connect().await.expect("an empty database can be made");
    MIGRATIONS.run_to(3, &mut old).await.expect("three migrations run");
    let rows = [ROWS_OF_MIGRATION_1, ROWS_OF_MIGRATION_3].concat();
    sqlx::raw_sql(sqlx::AssertSqlSafe(rows)).execute(&mut old).await.expect("their rows fit");
    old.close().await.expect("it closes");

    let store = Store::open(&settings).await.expect("an older database opens");
    let journal = store.journal(&hall(), JournalSeq::START, 9, 9).await.expect("reading works");
    let seqs: Vec<i64> = journal.iter().map(|entry| entry.seq.0).collect();
    assert_eq!(seqs, [1, 2, 3, 4, 5], "every entry in its place");
    assert!(matches!(journal[3].event, JournalEvent::Skipped { from: 2, through: 4, .. }), "skip");
    assert_eq!(journal[4].event, JournalEvent::VersionPublished { number: 1 }, "decision");
    assert_eq!(store.topology(&hall(), 1).await.expect("1 exists"), None, "none was made then");
    assert_eq!(
        store.next_ids(&hall()).await.expect("the map exists"),
        NextIds::default(),
        "from 0"
    );
    let refused = store.import_map(&import("hall")).await;
    assert!(matches!(refused, Err(Error::MapNotEmpty(_))), "it has a batch");
    let attic = store.import_map(&import("attic")).await.expect("a new map");
    assert_eq!(attic.seq, JournalSeq(7), "places are not used again");
}

fn import(map: &str) -> NewImport {
    NewImport { map: new_map(map), payload: vec![1], content_hash: ContentHash::of(&[1]) }
}

#[tokio::test]
async fn a_database_of_a_newer_program_is_refused() {
    let fixture = Fixture::new().await;
    fixture.store.close().await;
    let options = SqliteConnectOptions::new().filename(&fixture.settings.path);
    let mut newer = options.connect().await.expect("the database opens");
    let migrate = "insert into _sqlx_migrations
        (version, description, success, checksum, execution_time) values (9999, 'x', 1, x'00', 0)";
    sqlx::query(migrate).execute(&mut newer).await.expect("the row fits");
    newer.close().await.expect("it closes");
    let opened = Store::open(&fixture.settings).await;
    assert!(matches!(opened, Err(Error::UnknownMigration(9999))), "it may mean anything");
}
