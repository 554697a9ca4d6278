//! What can happen to a database from outside: locks and damage.

use std::fs;

use meetpoint_storage::{ContentHash, Error, JournalSeq, Store};
use sqlx::sqlite::SqliteConnectOptions;
use sqlx::{ConnectOptions, Connection, SqliteConnection};

use crate::fixture::{Fixture, batch, hall, settings};
use crate::versions::{lease, snapshot, tile};

async fn other_process(fixture: &Fixture) -> SqliteConnection {
    let options = SqliteConnectOptions::new().filename(&fixture.settings.path);
    options.connect().await.expect("a second connection opens")
}

#[tokio::test]
async fn a_locked_database_is_busy_and_works_again_afterwards() {
    let fixture = Fixture::new().await;
    let session = fixture.open("ann", "monday").await;
    let mut other = other_process(&fixture).await;
    sqlx::query("begin immediate").execute(&mut other).await.expect("nobody writes");
    for _ in 0..2 {
        let answer = fixture.store.append(&[batch(&session, 1, "a")]).await;
        assert!(matches!(answer, Err(Error::Busy)), "somebody else writes");
    }
    let read = fixture.store.session(session.id).await.expect("reading works meanwhile");
    assert_eq!(read, Some(session.clone()), "nothing was appended");
    sqlx::query("rollback").execute(&mut other).await.expect("the lock is given back");
    fixture.append_one(batch(&session, 1, "a")).await.expect("1 is still expected");
    other.close().await.expect("it closes");
}

#[tokio::test]
async fn a_caller_that_goes_away_leaves_the_store_usable() {
    let fixture = Fixture::new().await;
    let session = fixture.open("ann", "monday").await;
    for _ in 0..20 {
        let store = fixture.store.clone();
        let group = [batch(&session, 1, "a")];
        let append = tokio::spawn(async move { store.append(&group).await });
        tokio::task::yield_now().await;
        append.abort();
    }
    let answer = fixture.append_one(batch(&session, 1, "a")).await;
    assert!(answer.is_ok_and(|appended| appended.acked_through == 1), "once, by whomever");
}

#[tokio::test]
async fn a_flipped_byte_in_a_payload_is_noticed() {
    let fixture = Fixture::new().await;
    let session = fixture.open("ann", "monday").await;
    let content = "0123456789abcdef".repeat(2000);
    fixture.append_one(batch(&session, 1, &content)).await.expect("1 is expected");
    fixture.store.close().await;
    let mut file = fs::read(&fixture.settings.path).expect("the file is there");
    let place = file.windows(16).rposition(|bytes| bytes == b"0123456789abcdef");
    file[place.expect("the payload is in the file")] ^= 1;
    fs::write(&fixture.settings.path, file).expect("the file can be written");

    let store = Store::open(&fixture.settings).await.expect("the pages are sound");
    let journal = store.journal(&hall(), JournalSeq::START, 10, 1 << 20).await;
    let Err(Error::Damaged(place)) = journal else { panic!("damage not noticed: {journal:?}") };
    let names_the_batch = place.contains("batch 1") && place.contains(&session.id.to_string());
    assert!(names_the_batch, "the message says where: {place}");
    let batches = store.session_batches(session.id, 1, 10).await;
    assert!(matches!(batches, Err(Error::Damaged(_))), "on every way of reading");
}

#[tokio::test]
async fn a_damaged_tile_is_mended_by_saving_it_again() {
    let fixture = Fixture::new().await;
    let Fixture { store, .. } = &fixture;
    let lease = lease(store).await;
    let mut new = snapshot(&lease);
    new.tiles = vec![tile(None, 0, b"walls")];
    store.save_snapshot(&new).await.expect("the lease is in force");
    let mut other = other_process(&fixture).await;
    let damage = "update tiles set bytes = x'00'";
    sqlx::query(damage).execute(&mut other).await.expect("nobody writes");
    other.close().await.expect("it closes");
    let hash = ContentHash::of(b"walls");
    let read = store.tiles(&[hash]).await;
    assert!(matches!(read, Err(Error::Damaged(_))), "it is noticed");
    store.save_snapshot(&new).await.expect("the lease is in force");
    let read = store.tiles(&[hash]).await.expect("it is whole again");
    assert_eq!(read, [(hash, b"walls".to_vec())], "as it was");
}

#[tokio::test]
async fn a_damaged_file_does_not_open() {
    let fixture = Fixture::new().await;
    let session = fixture.open("ann", "monday").await;
    let group: Vec<_> = (1..=50).map(|number| batch(&session, number, "content")).collect();
    fixture.store.append(&group).await.expect("the group commits");
    fixture.store.close().await;
    let sound = fs::read(&fixture.settings.path).expect("the file is there");
    let page_bytes = usize::from(u16::from_be_bytes([sound[16], sound[17]]));
    for page in [1, sound.len() / page_bytes / 2] {
        let mut damaged = sound.clone();
        damaged[page * page_bytes..][..page_bytes].fill(0x5a);
        fs::write(&fixture.settings.path, damaged).expect("the file can be written");
        let opened = Store::open(&fixture.settings).await;
        assert!(matches!(opened, Err(Error::Damaged(_))), "page {page} is garbage: {opened:?}");
    }
}

#[tokio::test]
async fn a_file_that_is_no_database_does_not_open() {
    let folder = tempfile::TempDir::new().expect("a temporary folder can be made");
    let settings = settings(folder.path().join("meetpoint.db"));
    fs::write(&settings.path, "a shopping list, and much more than a header of it".repeat(99))
        .expect("the file can be written");
    let opened = Store::open(&settings).await;
    assert!(matches!(opened, Err(Error::Damaged(_))), "not a database: {opened:?}");
}

#[tokio::test]
async fn a_folder_that_is_not_there_is_an_error() {
    let folder = tempfile::TempDir::new().expect("a temporary folder can be made");
    let opened = Store::open(&settings(folder.path().join("missing/meetpoint.db"))).await;
    assert!(matches!(opened, Err(Error::Internal(_))), "nowhere to put it: {opened:?}");
}
