//! Two robots of which nobody knows where they are, a map without any that does, and a service that is killed
//! at any moment.

use std::path::Path;

use meetpoint_client::v1;
use meetpoint_storage::MapId;

use crate::door::{Door, job_done};
use crate::interrupted_jobs::{copied, seen_busily};
use crate::kept::{Kept, kept, store};
use crate::merge_worlds::{FIRST_WAY, SECOND_WAY, through_the_house, true_place};
use crate::merging::{MAP, is_true_place, merge_job, merge_of, merged, newcomer_mapped};
use crate::running::{Launch, empty_folder};

/// Shares of the work at which the service is killed.
const KILLED_AT: [f64; 4] = [0.0, 0.3, 0.6, 0.8];
/// A job that rests twenty times as long as it works, while anybody asks for anything.
const SHARE_OF_A_SLOWED_JOB: f64 = 0.05;

fn launch(data: &Path) -> Launch {
    let launch = Launch::at(data).setting("merging.looks_again", false);
    launch.setting("merging.relaxes_after", false)
}

fn slowly(data: &Path) -> Launch {
    launch(data).setting("jobs.cpu_share", SHARE_OF_A_SLOWED_JOB)
}

/// What a job leaves in the folder of a service that runs no more.
async fn left(data: &Path, sessions: [&str; 2]) -> [Kept; 2] {
    let [first, second] = sessions;
    let of = |kept: Kept| Kept { journal: meetpoint_storage::ContentHash([0; 32]), ..kept };
    [of(kept(data, MAP, first).await), of(kept(data, MAP, second).await)]
}

async fn n_decisions(data: &Path) -> usize {
    let (store, map) = (store(data).await, MapId(MAP.to_owned()));
    let end = store.journal_end(&map).await.expect("reading works");
    store.merge_decisions(&map, end).await.expect("reading works").len()
}

/// The older one's frame becomes the map's, the younger lies in it: wherever the job is killed, and after a
/// person took it back and said yes again.
#[tokio::test(flavor = "multi_thread")]
async fn two_newcomers_and_a_service_that_is_killed() {
    let (data, other) = (empty_folder(), empty_folder());
    let (first, second) = (through_the_house(FIRST_WAY, 3), through_the_house(SECOND_WAY, 4));
    let service = launch(data.path()).start();
    service.grpc().create_map(MAP, 0.05).await.expect("a new map");
    let older = newcomer_mapped(&service.grpc(), "first", &first).await;
    let younger = newcomer_mapped(&service.grpc(), "second", &second).await;
    service.stop();
    copied(data.path(), other.path());
    let service = launch(other.path()).start();
    let door = service.grpc();
    let (_, told) = merged(&door, merge_job(MAP)).await;
    assert!(told.len() == 2 && told.iter().all(|one| one.accepted), "both: {told:?}");
    let place = async |session: &str| {
        let now = door.session(session).await.expect("it was opened");
        now.map_from_session.expect("it is placed")
    };
    assert_eq!(place(&older.id).await, v1::Pose::default(), "the map's frame is the older one's");
    is_true_place(place(&younger.id).await, true_place(&first, &second));
    let merge = merge_of(&door, &younger.id).await.expect("it was looked at");
    assert_eq!(merge.alignments[0].onto_session, older.id, "in the older one");
    service.stop();
    let expected = left(other.path(), [&older.id, &younger.id]).await;

    let mut service = slowly(data.path()).start();
    let job = service.grpc().start_job(merge_job(MAP)).await.expect("a job").id;
    let mut n_under_way = 0;
    for share in KILLED_AT {
        let now = seen_busily(&service.grpc(), &job, |now| now.done || share <= now.progress).await;
        n_under_way += usize::from(!now.done);
        service.kill();
        service = slowly(data.path()).start();
    }
    let ended = job_done(&service.grpc(), &job).await;
    assert_eq!(ended.state, i32::from(v1::JobState::Succeeded), "{ended:?}");
    assert!(0 < n_under_way, "at least one kill while it ran");
    service.stop();
    assert_eq!(left(data.path(), [&older.id, &younger.id]).await, expected, "the same bits");
    assert_eq!(n_decisions(data.path()).await, 2, "each decided once");

    // Killed between a decision and the version that shows it, twice.
    let service = slowly(data.path()).start();
    let (_, job) = service.grpc().undo(&merge.id).await.expect("it was accepted");
    service.kill();
    let service = slowly(data.path()).start();
    job_done(&service.grpc(), &job).await;
    let alone = service.grpc().session(&younger.id).await.expect("it was opened");
    assert_eq!((alone.map_from_session, &alone.frame_session), (None, &younger.id), "on its own");
    let (_, job) = service.grpc().accept(&merge.id, "").await.expect("it may be");
    service.kill();
    let service = slowly(data.path()).start();
    let drawn = job_done(&service.grpc(), &job).await;
    assert!(0 < drawn.result_version, "{drawn:?}");
    service.stop();
    assert_eq!(left(data.path(), [&older.id, &younger.id]).await, expected, "the same bits");
    assert_eq!(n_decisions(data.path()).await, 4, "each decided once");
}
