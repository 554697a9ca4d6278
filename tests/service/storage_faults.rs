//! The disk full, the database locked or damaged, the folder or port taken: what robots and
//! operators are told, and that nothing acknowledged is lost.

use std::fs::{self, File, OpenOptions};
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use meetpoint_client::v1;
use tempfile::TempDir;
use v1::ingest_batch_request::Kind as Upload;

use crate::door::{Answer, Door, Refused, eventually, finished, refused};
use crate::drive::{SimulatedDrive, driven, mark, opened, opening, send};
use crate::http::Http;
use crate::running::{Launch, empty_folder};

/// Tells whoever runs the tests that something was not tested, past the capture of test output.
fn skipped(what: &str, why: &str) {
    // Without standard error there is nobody to tell.
    let _ = writeln!(std::io::stderr(), "SKIPPED: {what}: {why}");
}

/// A small disk of its own. Unmounted when dropped.
struct SmallDisk(TempDir);

impl SmallDisk {
    /// `None` where mounting is not permitted.
    fn mounted() -> Option<Self> {
        let folder = empty_folder();
        let mount = Command::new("mount")
            .args(["-t", "tmpfs", "-o", "size=12m", "tmpfs"])
            .arg(folder.path())
            .output();
        match mount {
            Ok(output) if output.status.success() => Some(Self(folder)),
            Ok(output) => {
                skipped("a full disk", String::from_utf8_lossy(&output.stderr).trim());
                None
            }
            Err(error) => {
                skipped("a full disk", &error.to_string());
                None
            }
        }
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    fn ballast(&self) -> PathBuf {
        self.path().join("ballast")
    }

    /// Takes all room that is left.
    fn fill(&self) {
        let mut file = File::create(self.ballast()).expect("there is room for a name");
        while file.write_all(&[7; 4096]).is_ok() {}
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        // Lazily: whoever has a file open keeps it until the end.
        let _ = Command::new("umount").arg("-l").arg(self.path()).status();
    }
}

async fn sent<D: Door>(door: &D, session: &v1::Session, number: u64) -> Answer<v1::Ack> {
    // Large enough that a full disk is felt at once.
    let batch = mark(number, &"x".repeat(100_000));
    door.upload(&session.id, session.epoch, Upload::Batch(batch)).await
}

/// Sends until it is refused: the last acknowledged number, and the refusal.
async fn until_refused<D: Door>(door: &D, session: &v1::Session, from: u64) -> (u64, Refused) {
    for number in from..from + 1000 {
        if let Err(refused) = sent(door, session, number).await {
            return (number - 1, refused);
        }
    }
    panic!("a disk of 12 MB took 100 MB")
}

/// Batches cannot be kept, and whoever asks for readiness is told.
fn assert_not_ready(http: &Http) {
    let reply = http.get("/readyz");
    let problem = reply.problem();
    assert_eq!((reply.status, &problem["code"]), (503, &"NOT_READY".into()), "{problem}");
    assert_eq!(problem["check"], "journal", "what failed is named: {problem}");
}

#[tokio::test(flavor = "multi_thread")]
async fn disk_full() {
    let Some(disk) = SmallDisk::mounted() else { return };
    let launch = Launch::at(&disk.path().join("data"));
    let service = launch.start();
    let (grpc, rest) = (service.grpc(), service.rest());
    grpc.create_map("site", 0.05).await.expect("a new map");
    let session = opened(&grpc, opening("site", "rover", &[])).await;
    for number in 1..=3 {
        sent(&grpc, &session, number).await.expect("there is room");
    }
    disk.fill();
    let (acked, full) = until_refused(&grpc, &session, 4).await;
    assert_eq!(full.code, "STORAGE_FULL", "{full:?}");
    assert!(full.retry_after.is_some(), "when to try again is told: {full:?}");
    let over_rest = refused(sent(&rest, &session, acked + 1).await, "STORAGE_FULL");
    assert!(over_rest.retry_after.is_some(), "when to try again is told: {over_rest:?}");
    assert_eq!(service.http().get("/healthz").status, 200, "the process is up");
    assert_not_ready(&service.http());
    assert!(service.log().contains("disk is full"), "the operator is told: {}", service.log());
    let now = grpc.session(&session.id).await.expect("it still reads");
    assert_eq!(now.acked_through, acked, "nothing half applied");

    fs::remove_file(disk.ballast()).expect("it was made");
    eventually("an ack when there is room again", || async {
        sent(&grpc, &session, acked + 1).await.ok()
    })
    .await;
    assert_eq!(service.http().get("/readyz").status, 200, "all is well again");
    service.kill();
    let service = launch.start();
    let found = service.grpc().session(&session.id).await.expect("it was opened");
    assert_eq!(found.acked_through, acked + 1, "nothing acknowledged is lost");
    finished(&service.grpc(), &session).await;
}

/// Another program's write transaction on the database, held until dropped.
struct WriteLock(Child);

impl WriteLock {
    /// `None` where there is no Python with SQLite: this workspace leaves SQL to the storage crate.
    fn held(data: &Path) -> Option<Self> {
        const HOLD: &str = "import sqlite3, sys
connection = sqlite3.connect(sys.argv[1], isolation_level=None)
connection.execute('begin immediate')
print('held', flush=True)
sys.stdin.read()";
        let child = Command::new("python3")
            .args(["-c", HOLD])
            .arg(data.join("meetpoint.db"))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn();
        let Ok(mut child) = child else {
            skipped("a locked database", "no python3");
            return None;
        };
        let mut line = String::new();
        let stdout = child.stdout.take().expect("it was piped");
        BufReader::new(stdout).read_line(&mut line).expect("text");
        if line.trim() == "held" {
            return Some(Self(child));
        }
        skipped("a locked database", "python3 cannot lock it");
        let _ = child.wait();
        None
    }
}

impl Drop for WriteLock {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn database_locked() {
    let data = empty_folder();
    let service = Launch::at(data.path()).setting("journal.busy_timeout_ms", 100).start();
    let (grpc, rest) = (service.grpc(), service.rest());
    grpc.create_map("site", 0.05).await.expect("a new map");
    let session = opened(&grpc, opening("site", "rover", &[])).await;
    send(&grpc, &session, &[mark(1, "a")]).await;
    let Some(lock) = WriteLock::held(data.path()) else { return };
    let upload = || Upload::Batch(mark(2, "a"));
    let busy = grpc.upload(&session.id, session.epoch, upload()).await;
    let busy = refused(busy, "STORAGE_BUSY");
    assert!(busy.retry_after.is_some(), "when to try again is told: {busy:?}");
    let busy = refused(rest.upload(&session.id, session.epoch, upload()).await, "STORAGE_BUSY");
    assert!(busy.retry_after.is_some(), "when to try again is told: {busy:?}");
    refused(grpc.create_map("other", 0.05).await, "STORAGE_BUSY");
    assert_not_ready(&service.http());
    let found = grpc.session(&session.id).await.expect("reading goes on");
    assert_eq!(found.acked_through, 1, "nothing half applied");
    drop(lock);
    send(&grpc, &session, &[mark(2, "a"), mark(3, "a")]).await;
    finished(&rest, &session).await;
}

/// Overwrites a page of the database: its number is counted from 0.
fn damage(database: &Path, page: u64) {
    const PAGE: [u8; 4096] = [0xa5; 4096];
    let mut file = OpenOptions::new().write(true).open(database).expect("the database");
    file.seek(SeekFrom::Start(page * PAGE.len() as u64)).expect("within the file");
    file.write_all(&PAGE).expect("it can be written");
}

#[tokio::test(flavor = "multi_thread")]
async fn database_damaged() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    let drive = SimulatedDrive::through_the_hall(3);
    let session = driven(&service.grpc(), "hall", &drive, &drive.batches(20)[..10]).await;
    finished(&service.grpc(), &session).await;
    let grid = service.grpc().grid("hall", 0, None).await.expect("a grid");
    service.stop();
    let whole = fs::read(data.path().join("meetpoint.db")).expect("the database");
    let n_pages = whole.len() as u64 / 4096;
    let mut n_refused = 0;
    // The first page, and a dozen through the whole file.
    for page in (0..n_pages).step_by(usize::try_from(n_pages / 12).expect("a small file").max(1)) {
        let copy = empty_folder();
        let database = copy.path().join("meetpoint.db");
        fs::write(&database, &whole).expect("a copy");
        damage(&database, page);
        let Some(service) = Launch::at(copy.path()).started_or_refused(|status, told| {
            assert_eq!(status.code(), Some(1), "page {page}: {told}");
            assert!(told.contains("meetpoint.db"), "page {page}: the file is named: {told}");
            assert!(told.contains("damaged"), "page {page}: what is wrong is told: {told}");
            assert!(!told.contains("panicked"), "page {page}: {told}");
            n_refused += 1;
        }) else {
            continue;
        };
        // What starts all the same answers the truth, or that it cannot.
        match service.grpc().grid("hall", 0, None).await {
            Ok(found) => assert!(found.cells == grid.cells, "page {page}: a wrong grid"),
            Err(refused) => assert_eq!(refused.code, "STORAGE_DAMAGED", "page {page}: {refused:?}"),
        }
        assert!(!service.log().contains("panicked"), "page {page}: {}", service.log());
    }
    assert!(2 < n_refused, "{n_refused} of the damaged copies were noticed at the start");
}

#[test]
fn not_a_database() {
    let data = empty_folder();
    fs::write(data.path().join("meetpoint.db"), "a shopping list\n".repeat(1000)).expect("a file");
    let (status, told) = Launch::at(data.path()).refused();
    assert_eq!(status.code(), Some(1), "{told}");
    assert!(told.contains("meetpoint.db"), "the file is named: {told}");
    let kept = fs::read_to_string(data.path().join("meetpoint.db")).expect("it is there");
    assert!(kept.starts_with("a shopping list"), "what it was is left alone");
}

#[test]
fn folder_taken() {
    let data = empty_folder();
    let first = Launch::at(data.path()).start();
    let (status, told) = Launch::at(data.path()).refused();
    assert_eq!(status.code(), Some(1), "{told}");
    assert!(told.contains("another meetpoint uses"), "{told}");
    assert_eq!(first.http().get("/readyz").status, 200, "the first goes on");
}

#[test]
fn folder_that_cannot_be() {
    let folder = empty_folder();
    let file = folder.path().join("file");
    fs::write(&file, "in the way").expect("a file");
    let (status, told) = Launch::at(&file.join("data")).refused();
    assert_eq!(status.code(), Some(1), "{told}");
    assert!(told.contains(&*file.to_string_lossy()), "the path is named: {told}");
}

#[test]
fn port_taken() {
    let data = empty_folder();
    let other = std::net::TcpListener::bind("127.0.0.1:0").expect("a free port");
    let port = other.local_addr().expect("it is bound").port();
    let (status, told) = Launch::at(data.path()).port(port).refused();
    assert_eq!(status.code(), Some(1), "{told}");
    assert!(told.contains(&format!("127.0.0.1:{port}")), "the address is named: {told}");
}

#[test]
fn settings_that_make_no_sense() {
    let data = empty_folder();
    let launch = Launch::at(data.path());
    let (status, told) = launch.clone().setting("journal.queue_n_max", 0).refused();
    assert_eq!(status.code(), Some(1), "{told}");
    assert!(told.contains("journal.queue_n_max = 0: must be at least 1"), "{told}");
    let (_, told) = launch.setting("journal.speed", 11).refused();
    assert!(told.contains("MEETPOINT_JOURNAL__SPEED: no such setting"), "{told}");
    let mut found = Vec::new();
    let folder = fs::read_dir(data.path()).expect("the folder");
    found.extend(folder.map(|entry| entry.expect("an entry").file_name()));
    assert!(found.is_empty(), "nothing was made before the settings were checked: {found:?}");
}

/// What was acknowledged is on the disk: a copy of the folder made after a kill has it.
#[tokio::test(flavor = "multi_thread")]
async fn a_copy_of_a_killed_service() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    let door = service.rest();
    door.create_map("site", 0.05).await.expect("a new map");
    let session = opened(&door, opening("site", "rover", &[])).await;
    let batches: Vec<v1::Batch> = (1..=20).map(|number| mark(number, "a")).collect();
    send(&door, &session, &batches).await;
    service.kill();
    let copy = empty_folder();
    for entry in fs::read_dir(data.path()).expect("the folder") {
        let path = entry.expect("an entry").path();
        let mut bytes = Vec::new();
        File::open(&path).and_then(|mut file| file.read_to_end(&mut bytes)).expect("a file");
        fs::write(copy.path().join(path.file_name().expect("a file's name")), bytes)
            .expect("a copy");
    }
    let service = Launch::at(copy.path()).start();
    let found = service.rest().session(&session.id).await.expect("it was opened");
    assert_eq!(found.acked_through, 20, "all of it");
}
