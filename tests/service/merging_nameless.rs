//! Two wings that are alike, which walls do not tell apart, and poles that do, though none has a name.

use std::path::Path;

use meetpoint_client::v1;

use crate::door::{Door, finished, job_done};
use crate::drive::{SimulatedDrive, opened, opening, send};
use crate::merge_worlds::{
    BOTH_WINGS, ONE_WING, places_of_the_twins, through_the_twins, true_place,
};
use crate::merging::{MAP, is_true_place, merge_job, merge_of, merged};
use crate::running::{Launch, empty_folder};
use crate::tag_camera::{batches_with_tags, camera};

/// Beside the places of the wing on the left stand these poles, in metres...
const ON_THE_LEFT: [(&str, [f64; 2]); 4] =
    [("A", [1.2, 2.0]), ("A", [1.6, -0.4]), ("B", [-0.8, 0.8]), ("B", [1.6, 1.2])];
/// ...and beside those on the right these.
const ON_THE_RIGHT: [(&str, [f64; 2]); 4] =
    [("E", [-1.2, -0.4]), ("E", [0.4, 0.8]), ("F", [0.4, -0.8]), ("F", [-2.0, 2.0])];

fn poles_m() -> Vec<[f64; 2]> {
    let all = ON_THE_LEFT.iter().chain(&ON_THE_RIGHT);
    all.flat_map(|(place, [x_m, y_m])| {
        places_of_the_twins(place).into_iter().map(move |at| [at[0] + x_m, at[1] + y_m])
    })
    .collect()
}

/// Has a robot drive that sees poles, none of which it can tell from another, to the end.
async fn past_poles<D: Door>(
    door: &D,
    robot: &str,
    drive: &SimulatedDrive,
    start: Option<v1::Start>,
) -> v1::Session {
    let request = opening(MAP, robot, &[drive.sensor.clone(), camera()]);
    let start = start.or(request.start);
    let session = opened(door, v1::OpenSessionRequest { start, ..request }).await;
    let (mut batches, n_sightings) = batches_with_tags(drive, &poles_m(), Some(1));
    for batch in &mut batches {
        batch.observations.sort_by_key(|it| it.stamp_ns);
    }
    assert!(10 < n_sightings, "poles are seen: {n_sightings}");
    send(door, &session, &batches).await;
    finished(door, &session).await
}

async fn poles_tell_which_wing<D: Door>(door: &D, is_accepted: bool) {
    door.create_map(MAP, 0.05).await.expect("a new map");
    let (first, second) = (through_the_twins(BOTH_WINGS, 1), through_the_twins(ONE_WING, 2));
    past_poles(door, "first", &first, None).await;
    let anywhere = v1::Start { kind: Some(v1::start::Kind::Unknown(v1::UnknownStart {})) };
    let session = past_poles(door, "second", &second, Some(anywhere)).await;
    let (_, sessions) = merged(door, merge_job(MAP)).await;
    let merge = merge_of(door, &session.id).await.expect("a merge");
    let best = &merge.alignments[0];
    is_true_place(best.onto_from_session.expect("a pose"), true_place(&first, &second));
    assert!(3 <= best.landmarks_matched, "poles of the wing: {merge:?}");
    let other = &merge.alignments[1];
    assert!(other.landmarks_matched < best.landmarks_matched, "of the other wing: {merge:?}");
    assert!(best.landmarks_contradicted < other.landmarks_contradicted, "missing there: {merge:?}");
    assert_eq!(sessions[0].accepted, is_accepted, "{merge:?}");
    let is_told = merge.reasons.iter().any(|why| why.contains("without names"));
    assert_eq!(is_told, !is_accepted, "why a person is asked: {merge:?}");
    if !is_accepted {
        assert_eq!(merge.verdict(), v1::MergeVerdict::Proposed, "never without one: {merge:?}");
        let (_, job) = door.accept(&merge.id, &best.id).await.expect("a person knows");
        job_done(door, &job).await;
    }
    let placed = door.session(&session.id).await.expect("it was opened");
    is_true_place(placed.map_from_session.expect("it lies there"), true_place(&first, &second));
}

/// Nothing is looked at unless somebody asks.
fn launch(data: &Path) -> Launch {
    Launch::at(data).setting("merging.looks_again", false)
}

#[tokio::test(flavor = "multi_thread")]
async fn over_grpc() {
    let data = empty_folder();
    let service = launch(data.path()).start();
    poles_tell_which_wing(&service.grpc(), false).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn over_rest() {
    let data = empty_folder();
    let service = launch(data.path()).start();
    poles_tell_which_wing(&service.rest(), false).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn where_nothing_looks_alike_nobody_is_asked() {
    let data = empty_folder();
    let launch = launch(data.path()).setting("merging.landmarks_accepts_nameless", true);
    // A wing has fewer walls than a rule asks for without a person.
    let service = launch.setting("merging.log_odds_min", 40.0).start();
    poles_tell_which_wing(&service.grpc(), true).await;
}
