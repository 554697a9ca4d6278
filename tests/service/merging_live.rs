//! A robot that nobody knows where it is maps in a frame of its own; while it drives it is found, told so, and
//! tracked in the map from then on.

use meetpoint_client::v1;
use v1::watch_map_response::Kind as Seen;

use crate::door::{Door, eventually, finished, refused};
use crate::drive::send;
use crate::merge_worlds::{FIRST_WAY, SECOND_WAY, through_the_house, true_place};
use crate::merging::{
    MAP, N_TICKS, first_mapped, is_true_place, mean_error_m, merge_of, opened_anywhere,
};
use crate::relaxing::trajectory;
use crate::running::{Launch, Running, empty_folder};

/// Mean distance from the truth of all of the newcomer's scans, in metres, once it is merged.
const ERROR_MAX_M: f64 = 0.15;
/// Batches of the newcomer that are sent after it was found.
const N_BATCHES_AFTER: usize = 4;

fn launch(data: &std::path::Path) -> Launch {
    let launch = Launch::at(data).setting("mapping.snapshot_scans", 50);
    launch.setting("merging.way_again_m", 4.0).setting("merging.relaxes_after", false)
}

/// In a frame of its own it has a map and poses at once.
async fn useful_at_once<D: Door>(door: &D, session: &v1::Session) {
    assert_eq!(session.map_from_session, None, "nobody knows: {session:?}");
    assert_eq!(session.frame_session, session.id, "in a frame of its own");
    let grid =
        eventually("a grid of its own", || async { door.session_grid(&session.id, 0).await.ok() })
            .await;
    assert_eq!((grid.map.as_str(), &grid.frame_session), (MAP, &session.id), "whose it is");
    assert!(grid.cells.iter().any(|&cell| 70 < cell && cell <= 100), "it has walls");
    let poses = trajectory(door, &session.id, 0).await;
    assert_eq!(poses.reference_frame, "session", "its frame is named");
}

async fn found_while_it_drives<D: Door>(door: &D, service: &Running) {
    let first = through_the_house(FIRST_WAY, 3);
    let second = through_the_house(SECOND_WAY, 4);
    first_mapped(door, &first).await;
    let watch = v1::WatchMapRequest { map: MAP.to_owned() };
    let watched = service.grpc().maps.watch_map(watch).await;
    let mut watched = watched.expect("a stream").into_inner();

    let session = opened_anywhere(door, "second", &second).await;
    let batches = second.batches(N_TICKS);
    let (before, after) = batches.split_at(batches.len() - N_BATCHES_AFTER);
    send(door, &session, &before[..3]).await;
    useful_at_once(door, &session).await;
    send(door, &session, &before[3..]).await;
    let placed = eventually("a place in the map", || async {
        let now = door.session(&session.id).await.expect("it was opened");
        now.map_from_session.is_some().then_some(now)
    })
    .await;
    let place = placed.map_from_session.expect("it has a place");
    is_true_place(place, true_place(&first, &second));
    assert_eq!(placed.frame_session, "", "in the map");
    let merge = merge_of(door, &session.id).await.expect("it was looked at");
    assert_eq!(merge.verdict(), v1::MergeVerdict::Merged, "{merge:?}");
    assert_eq!(merge.state(), v1::MergeState::Accepted, "{merge:?}");
    let decision = merge.decision.expect("somebody decided");
    assert!(decision.by_rule && !decision.reason.is_empty(), "a rule did: {decision:?}");

    // Its robot is told where it is in the map.
    let mut frames = Vec::new();
    while frames.last() != Some(&String::new()) {
        let seen = watched.message().await.expect("the stream goes on").expect("it goes on");
        let Some(Seen::Correction(correction)) = seen.kind else { continue };
        if correction.session == session.id {
            frames.push(correction.correction.expect("it says where").frame_session);
        }
    }
    assert!(1 < frames.len() && frames[0] == session.id, "first in its own frame: {frames:?}");
    eventually("the map with both", || async {
        let refusal = door.session_grid(&session.id, 0).await.err();
        let version = door.version(MAP, 0).await.expect("a version");
        (version.origin == "merge" && refusal.is_some()).then_some(())
    })
    .await;
    refused(door.session_grid(&session.id, 0).await, "SESSION_PLACED");

    send(door, &session, after).await;
    finished(door, &session).await;
    let poses = trajectory(door, &session.id, 0).await;
    assert_eq!(poses.reference_frame, "map", "its frame is named");
    let error_m = mean_error_m(&first, &second, &poses);
    assert!(error_m < ERROR_MAX_M, "{error_m} m");
}

#[tokio::test(flavor = "multi_thread")]
async fn over_grpc() {
    let data = empty_folder();
    let service = launch(data.path()).start();
    found_while_it_drives(&service.grpc(), &service).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn over_rest() {
    let data = empty_folder();
    let service = launch(data.path()).start();
    found_while_it_drives(&service.rest(), &service).await;
}
