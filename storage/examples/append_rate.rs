//! How fast the journal takes batches, with the disk's fsync in it.
//!
//! ```text
//! cargo run --release -p meetpoint-storage --example append_rate [FOLDER]
//! ```
//!
//! Sessions of 32 robots send batches of 20 kB in turn, in groups of 1, 8 and 64 a transaction, to
//! a new database in FOLDER (the system's folder for temporary files if none is given).

use std::time::{Duration, Instant};

use meetpoint_storage::{
    AppendRequest, ContentHash, MapId, NewEntry, NewMap, NewSession, RobotId, SessionId, Store,
    StoreSettings,
};
use uuid::Uuid;

/// A few scans of 360 beams with odometry.
const PAYLOAD_BYTES: usize = 20_000;
const N_ROBOTS: u64 = 32;
/// Long enough for several checkpoints of the WAL.
const RUN_TIME: Duration = Duration::from_secs(5);

/// Why the program stopped early.
type Failure = Box<dyn std::error::Error>;

#[tokio::main]
async fn main() -> Result<(), Failure> {
    let parent = std::env::args_os().nth(1).map_or_else(std::env::temp_dir, Into::into);
    println!(
        "{:>6} {:>12} {:>8} {:>12} {:>12}",
        "group", "batches/s", "MB/s", "median ms", "p99 ms"
    );
    for group_size in [1, 8, 64] {
        let folder = tempfile::tempdir_in(&parent)?;
        let path = folder.path().join("meetpoint.db");
        let settings = StoreSettings { path, n_readers: 1, busy_timeout_ms: 5_000 };
        let store = Store::open(&settings).await?;
        let sessions = open_sessions(&store).await?;
        let latencies_ms = run(&store, &sessions, group_size).await?;
        store.close().await;
        report(group_size, latencies_ms);
    }
    Ok(())
}

async fn open_sessions(store: &Store) -> Result<Vec<SessionId>, Failure> {
    let map = MapId("hall".to_owned());
    let new_map =
        NewMap { id: map.clone(), display_name: "Hall".to_owned(), resolution_m: 0.05, time_ns: 0 };
    store.create_map(&new_map).await?;
    let mut sessions = Vec::new();
    for robot in 0..N_ROBOTS {
        let new = NewSession {
            id: SessionId(Uuid::from_u64_pair(7, robot)),
            map: map.clone(),
            robot: RobotId(format!("robot-{robot}")),
            client_key: "run".to_owned(),
            epoch: None,
            declaration: Vec::new(),
            map_from_session: Some([0.0; 3]),
            time_ns: 0,
        };
        sessions.push(store.open_session(&new).await?.session.id);
    }
    Ok(sessions)
}

/// Appends groups until the time is over; the time each took, in milliseconds.
async fn run(
    store: &Store,
    sessions: &[SessionId],
    group_size: usize,
) -> Result<Vec<f64>, Failure> {
    let mut turns = (1..).flat_map(|number| sessions.iter().map(move |session| (*session, number)));
    let mut latencies_ms = Vec::new();
    let start = Instant::now();
    while start.elapsed() < RUN_TIME {
        let group: Vec<AppendRequest> = turns
            .by_ref()
            .take(group_size)
            .map(|(session, number)| request(session, number))
            .collect();
        let begin = Instant::now();
        for answer in store.append(&group).await? {
            answer?;
        }
        latencies_ms.push(begin.elapsed().as_secs_f64() * 1e3);
    }
    Ok(latencies_ms)
}

fn request(session: SessionId, number: u64) -> AppendRequest {
    let payload: Vec<u8> = number.to_le_bytes().repeat(PAYLOAD_BYTES / 8);
    AppendRequest {
        session,
        epoch: 1,
        receive_time_ns: 0,
        entry: NewEntry::Batch {
            number,
            content_hash: ContentHash::of(&payload),
            payload,
            rejections: Vec::new(),
            n_scans: 10,
            n_visits: 0,
            stamps_ns: Some((0, 1)),
        },
    }
}

fn report(group_size: usize, mut latencies_ms: Vec<f64>) {
    latencies_ms.sort_by(f64::total_cmp);
    let at = |share: usize| latencies_ms[(latencies_ms.len() - 1) * share / 100];
    let seconds: f64 = latencies_ms.iter().sum::<f64>() / 1e3;
    let rate = (latencies_ms.len() * group_size) as f64 / seconds;
    let mb_per_s = rate * PAYLOAD_BYTES as f64 / 1e6;
    println!("{group_size:>6} {rate:>12.0} {mb_per_s:>8.1} {:>12.2} {:>12.2}", at(50), at(99));
}
