//! Relax jobs side by side, cancelled, and killed at any moment.

use std::path::Path;

use meetpoint_client::v1;
use meetpoint_sim::ChaCha8Rng;
use meetpoint_storage::{MapId, PoseRecord};
use rand::{RngExt, SeedableRng};

use crate::door::{Door, FIRST_PAGE, eventually, finished, job_done};
use crate::kept::{kept, store};
use crate::landmark_loop::LandmarkLoop;
use crate::relaxing::{driven_around, relax};
use crate::running::{Launch, Running, empty_folder};

/// Times that the service is killed while a job runs.
const N_KILLS: usize = 10;
/// A job that rests a hundred times as long as it works, while anybody asks for anything...
const SHARE_OF_A_SLOW_JOB: f64 = 0.01;
/// ...or twenty times as long.
const SHARE_OF_A_SLOWED_JOB: f64 = 0.05;

/// Asks for the map, which a slow job makes room for, until the job says so.
pub(crate) async fn seen_busily<D: Door>(
    door: &D,
    job: &str,
    is_seen: impl Fn(&v1::Job) -> bool,
) -> v1::Job {
    eventually("what the job is to come to", || async {
        let now = door.job(job).await.expect("it was made");
        door.map(&now.map).await.expect("it was made");
        is_seen(&now).then_some(now)
    })
    .await
}

fn n_iterations(job: &v1::Job) -> usize {
    job.log.iter().filter(|line| line.figures.is_some()).count()
}

fn is_running(job: &v1::Job) -> bool {
    job.state == i32::from(v1::JobState::Running)
}

/// Two maps' jobs run side by side, a third one waits; one that is cancelled makes no version.
#[tokio::test(flavor = "multi_thread")]
async fn two_maps_side_by_side_and_cancelled() {
    let data = empty_folder();
    let launch = Launch::at(data.path()).setting("jobs.n_at_once", 2);
    let service = launch.setting("jobs.cpu_share", SHARE_OF_A_SLOW_JOB).start();
    let door = service.grpc();
    let drive = LandmarkLoop::around_the_block();
    let maps = ["north", "south", "west"];
    for map in maps {
        let session = driven_around(&door, map, &drive).await;
        finished(&door, &session).await;
    }
    let mut jobs = Vec::new();
    for map in maps {
        jobs.push(door.start_job(relax(map)).await.expect("a job").id);
    }
    let [north, south, west] = jobs.as_slice() else { panic!("three jobs") };
    for job in [north, south] {
        seen_busily(&door, job, is_running).await;
    }
    let waiting = door.job(west).await.expect("it was made");
    assert_eq!(waiting.state, i32::from(v1::JobState::Queued), "two at a time: {waiting:?}");
    let before = door.map("north").await.expect("it was made").latest_version;
    door.cancel_job(north).await.expect("it is there");
    let ended = seen_busily(&door, north, |job| job.done).await;
    assert_eq!(ended.state, i32::from(v1::JobState::Cancelled), "{ended:?}");
    assert_eq!(door.map("north").await.expect("it was made").latest_version, before, "no version");
    seen_busily(&door, west, is_running).await;
    // Nobody asks for maps any more: they work on without rest.
    for job in [south, west] {
        let ended = job_done(&door, job).await;
        assert_eq!(ended.state, i32::from(v1::JobState::Succeeded), "{ended:?}");
    }
}

/// What a job leaves: poses, tiles, and landmarks without their ids.
async fn left(data: &Path, session: &str) -> (Vec<PoseRecord>, usize, Vec<v1::Landmark>) {
    let kept = kept(data, "block", session).await;
    let service = Launch::at(data).start();
    let (mut landmarks, _) =
        service.grpc().landmarks("block", 0, FIRST_PAGE).await.expect("a version");
    for landmark in &mut landmarks {
        landmark.id = String::new();
    }
    service.stop();
    (kept.poses, kept.tiles.len(), landmarks)
}

pub(crate) fn copied(from: &Path, to: &Path) {
    for entry in std::fs::read_dir(from).expect("a folder") {
        let entry = entry.expect("an entry");
        std::fs::copy(entry.path(), to.join(entry.file_name())).expect("a file");
    }
}

/// Wherever a job is killed, it goes on from its last iteration and ends the same, bit for bit.
#[tokio::test(flavor = "multi_thread")]
async fn killed_at_any_moment() {
    let (data, other) = (empty_folder(), empty_folder());
    let service = Launch::at(data.path()).start();
    let drive = LandmarkLoop::around_the_block();
    let session = driven_around(&service.grpc(), "block", &drive).await;
    finished(&service.grpc(), &session).await;
    service.stop();
    copied(data.path(), other.path());

    let service = Launch::at(other.path()).start();
    let job = service.grpc().start_job(relax("block")).await.expect("a job").id;
    let undisturbed = job_done(&service.grpc(), &job).await;
    let n_total = n_iterations(&undisturbed);
    service.stop();
    let expected = left(other.path(), &session.id).await;

    let slowly = || Launch::at(data.path()).setting("jobs.cpu_share", SHARE_OF_A_SLOWED_JOB);
    let mut service: Running = slowly().start();
    let job = service.grpc().start_job(relax("block")).await.expect("a job").id;
    let mut rng = ChaCha8Rng::seed_from_u64(41);
    let (mut n_under_way, mut least) = (0, 0);
    for _ in 0..N_KILLS {
        let target = least + rng.random_range(0..=n_total.div_ceil(N_KILLS));
        let is_far = |now: &v1::Job| now.done || target <= n_iterations(now);
        let now = seen_busily(&service.grpc(), &job, is_far).await;
        assert!(least <= n_iterations(&now), "nothing is done twice, or forgotten: {now:?}");
        least = n_iterations(&now);
        n_under_way += usize::from(!now.done);
        service.kill();
        service = slowly().start();
    }
    let ended = job_done(&service.grpc(), &job).await;
    assert_eq!(ended.state, i32::from(v1::JobState::Succeeded), "{ended:?}");
    assert!(0 < n_under_way, "at least one kill while it ran");
    assert_eq!(n_iterations(&ended), n_total, "each iteration once: {ended:?}");
    service.stop();
    let found = left(data.path(), &session.id).await;
    assert!(found.0 == expected.0 && found.1 == expected.1, "the same bits");
    assert_eq!(found.2, expected.2, "the same landmarks");
    let store = store(data.path()).await;
    let map = MapId("block".to_owned());
    let end = store.journal_end(&map).await.expect("reading works");
    let decisions = store.relaxations(&map, end).await.expect("reading works");
    assert_eq!(decisions.len(), 1, "decided once");
}
