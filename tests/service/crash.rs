//! Killed at any moment: nothing acknowledged is lost, nothing is applied twice, and the end is the
//! same, bit for bit.

use std::io;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use meetpoint_client::{
    BackoffParams, BatchSource, Client, DeliveryEvent, DeliveryParams, Outgoing, SessionName,
    deliver, v1,
};
use meetpoint_sim::ChaCha8Rng;
use meetpoint_storage::MapId;
use rand::{RngExt, SeedableRng};
use tokio::sync::watch;
use tokio::task::JoinHandle;

use crate::door::{Door, eventually, finished};
use crate::drive::{SimulatedDrive, opened, opening};
use crate::kept::{Kept, kept, kept_of, store};
use crate::running::{Launch, Running, empty_folder};

/// Times that the service, or its client, is killed.
const N_KILLS: u32 = 20;
/// Before every so many kills, the service is stopped in order too.
const ORDERLY_EVERY: u32 = 7;
/// Acknowledged batches between two kills, at most.
const N_ACKS_MAX: u64 = 20;

/// Robots that do not wait long.
const PARAMS: DeliveryParams = DeliveryParams {
    backoff: BackoffParams {
        delay_first: Duration::from_millis(20),
        factor: 1.5,
        delay_max: Duration::from_millis(200),
    },
    give_up_after: Some(Duration::from_mins(2)),
    ..DeliveryParams::ROBOT
};

/// Batches in memory.
#[derive(Clone)]
struct Batches(Arc<[v1::Batch]>);

impl BatchSource for Batches {
    async fn get(&mut self, number: u64) -> io::Result<Outgoing> {
        let index = usize::try_from(number - 1).map_err(io::Error::other)?;
        Ok(self.0.get(index).cloned().map_or(Outgoing::End, Outgoing::Batch))
    }

    async fn forget_through(&mut self, _: u64) -> io::Result<()> {
        Ok(())
    }
}

/// A drive in many small batches: one tick each, every other with a scan.
fn batches() -> (SimulatedDrive, Batches) {
    let drive = SimulatedDrive::through_the_hall(11);
    let batches = Batches(drive.batches(1).into());
    (drive, batches)
}

/// Few batches under way and many versions, so that kills fall between all of them.
fn launch(data: &Path) -> Launch {
    Launch::at(data).setting("limits.n_in_flight_max", 4).setting("mapping.snapshot_scans", 25)
}

async fn session(service: &Running, drive: &SimulatedDrive) -> v1::Session {
    let door = service.grpc();
    door.create_map("hall", 0.05).await.expect("a new map");
    opened(&door, opening("hall", "rover", std::slice::from_ref(&drive.sensor))).await
}

/// Delivers in the background, telling what was acknowledged.
fn delivering(
    client: Client,
    session: &v1::Session,
    batches: &Batches,
    acked: &watch::Sender<u64>,
) -> JoinHandle<u64> {
    let (name, mut batches, acked) = (SessionName::from(session), batches.clone(), acked.clone());
    tokio::spawn(async move {
        let told = |event| {
            if let DeliveryEvent::Acked { through } = event {
                acked.send_replace(through);
            }
        };
        let delivered = deliver(&client, &name, &mut batches, &PARAMS, told).await;
        delivered.expect("the service comes back").acked_through
    })
}

/// Ends the session, waits until all is mapped, stops the service and reads its folder.
async fn at_the_end(service: Running, data: &Path, session: &v1::Session) -> Kept {
    let ended = finished(&service.grpc(), session).await;
    assert_eq!(ended.mapped_through, ended.acked_through, "all is mapped");
    service.stop();
    kept(data, "hall", &session.id).await
}

/// A run that nobody disturbs.
async fn undisturbed(drive: &SimulatedDrive, batches: &Batches) -> Kept {
    let data = empty_folder();
    let service = launch(data.path()).start();
    let session = session(&service, drive).await;
    let (acked, _) = watch::channel(0);
    let through = delivering(service.client(), &session, batches, &acked).await;
    assert_eq!(through.expect("it ended"), batches.0.len() as u64, "all was acknowledged");
    at_the_end(service, data.path(), &session).await
}

fn assert_same(found: &Kept, undisturbed: &Kept) {
    assert_eq!(found.journal, undisturbed.journal, "the same journal");
    assert!(found.poses == undisturbed.poses, "the same trajectory");
    assert!(found.tiles == undisturbed.tiles, "the same grid, all bytes");
    assert!(!found.poses.is_empty() && !found.tiles.is_empty(), "and something is in them");
}

#[tokio::test(flavor = "multi_thread")]
async fn of_the_service() {
    let (drive, batches) = batches();
    let expected = undisturbed(&drive, &batches).await;
    let data = empty_folder();
    let mut service = launch(data.path()).start();
    let (port, session) = (service.port(), session(&service, &drive).await);
    let (acked, mut watched) = watch::channel(0);
    let delivery = delivering(service.client(), &session, &batches, &acked);
    let mut rng = ChaCha8Rng::seed_from_u64(20);
    let mut n_under_way = 0;
    for kill in 1..=N_KILLS {
        let target = *watched.borrow() + rng.random_range(1..=N_ACKS_MAX);
        let target = target.min(batches.0.len() as u64);
        watched.wait_for(|&through| target <= through).await.expect("it delivers");
        n_under_way += u32::from(!delivery.is_finished());
        if kill % ORDERLY_EVERY == 0 {
            service.stop();
            service = launch(data.path()).port(port).start();
        }
        service.kill();
        let told = *watched.borrow();
        service = launch(data.path()).port(port).start();
        let now = service.grpc().session(&session.id).await.expect("it was opened");
        assert!(told <= now.acked_through, "{told} was acknowledged, {now:?}");
    }
    assert!(N_KILLS / 2 < n_under_way, "{n_under_way} of {N_KILLS} kills while it delivered");
    let through = delivery.await.expect("it ended");
    assert_eq!(through, batches.0.len() as u64, "all was acknowledged");
    assert_same(&at_the_end(service, data.path(), &session).await, &expected);
}

#[tokio::test(flavor = "multi_thread")]
async fn of_the_client_and_a_rebuild_after_it() {
    let (drive, batches) = batches();
    let expected = undisturbed(&drive, &batches).await;
    let data = empty_folder();
    let service = launch(data.path()).start();
    let session = session(&service, &drive).await;
    let mut rng = ChaCha8Rng::seed_from_u64(21);
    let (acked, mut watched) = watch::channel(0);
    for _ in 0..N_KILLS {
        // A client that starts anew knows only what the service tells it.
        let name = service.grpc().session(&session.id).await.expect("it was opened");
        let delivery = delivering(service.client(), &name, &batches, &acked);
        let target = name.acked_through + rng.random_range(1..=N_ACKS_MAX);
        let target = target.min(batches.0.len() as u64);
        watched.wait_for(|&through| target <= through).await.expect("it delivers");
        delivery.abort();
        // Cancelled is what it is meant to be; it may have ended just before.
        let _ = delivery.await;
    }
    let name = service.grpc().session(&session.id).await.expect("it was opened");
    let through = delivering(service.client(), &name, &batches, &acked).await.expect("it ended");
    assert_eq!(through, batches.0.len() as u64, "all was acknowledged");
    finished(&service.grpc(), &session).await;
    let rebuilt = rebuilt(&service.grpc()).await;
    service.stop();
    let store = store(data.path()).await;
    let map = MapId("hall".to_owned());
    assert_same(&kept_of(&store, &map, rebuilt - 1, &session.id).await, &expected);
    assert_same(&kept_of(&store, &map, rebuilt, &session.id).await, &expected);
}

/// Runs a rebuild to its end: the version that it made.
async fn rebuilt<D: Door>(door: &D) -> u64 {
    let job = door.create_job("hall").await.expect("a new job");
    let job = eventually("the job's end", || async {
        let now = door.job(&job.id).await.expect("it was made");
        now.done.then_some(now)
    })
    .await;
    assert_eq!(job.state, i32::from(v1::JobState::Succeeded), "{job:?}");
    assert_eq!(job.progress, 1.0, "all of it");
    job.result_version
}

/// A job that a crash interrupts is continued or done again at the next start, without anyone's
/// help.
#[tokio::test(flavor = "multi_thread")]
async fn of_a_job() {
    let (drive, batches) = batches();
    let data = empty_folder();
    let service = launch(data.path()).start();
    let session = session(&service, &drive).await;
    let (acked, _) = watch::channel(0);
    delivering(service.client(), &session, &batches, &acked).await.expect("it ended");
    finished(&service.grpc(), &session).await;
    let before = service.grpc().grid("hall", 0, None).await.expect("a grid");
    let job = service.grpc().create_job("hall").await.expect("a new job").id;
    service.kill();
    let service = launch(data.path()).start();
    let door = service.rest();
    let job = eventually("the job's end", || async {
        let now = door.job(&job).await.expect("it was made");
        now.done.then_some(now)
    })
    .await;
    assert_eq!(job.state, i32::from(v1::JobState::Succeeded), "{job:?}");
    let after = door.grid("hall", job.result_version, None).await.expect("a grid");
    assert!(before.cells == after.cells, "the same bits");
}
