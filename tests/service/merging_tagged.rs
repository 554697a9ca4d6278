//! Two wings that are alike, which walls do not tell apart, and tags that do.

use std::path::Path;

use meetpoint_client::v1;

use crate::door::{Door, finished};
use crate::drive::{SimulatedDrive, opened, opening, send};
use crate::merge_worlds::{
    BOTH_WINGS, ONE_WING, places_of_the_twins, through_the_twins, true_place,
};
use crate::merging::{MAP, is_true_place, merge_job, merge_of, merged};
use crate::running::{Launch, empty_folder};
use crate::tag_camera::{batches_with_tags, camera};

/// By these places hangs a tag each, so far beside them in metres: in the wing on the left and that on the
/// right.
const TAGGED: &str = "ABEF";
const BESIDE_M: [f64; 2] = [0.4, 0.8];

fn tags_m() -> Vec<[f64; 2]> {
    let places = places_of_the_twins(TAGGED);
    places.iter().map(|[x_m, y_m]| [x_m + BESIDE_M[0], y_m + BESIDE_M[1]]).collect()
}

/// Has a robot drive that sees some tags, to the end.
async fn tagged<D: Door>(
    door: &D,
    robot: &str,
    drive: &SimulatedDrive,
    (start, tags_m): (Option<v1::Start>, &[[f64; 2]]),
) -> v1::Session {
    let request = opening(MAP, robot, &[drive.sensor.clone(), camera()]);
    let start = start.or(request.start);
    let session = opened(door, v1::OpenSessionRequest { start, ..request }).await;
    let (batches, n_sightings) = batches_with_tags(drive, tags_m, None);
    assert!(0 < n_sightings || tags_m.is_empty(), "tags are seen");
    send(door, &session, &batches).await;
    finished(door, &session).await
}

fn anywhere() -> v1::Start {
    v1::Start { kind: Some(v1::start::Kind::Unknown(v1::UnknownStart {})) }
}

async fn tags_tell_which_wing<D: Door>(door: &D) {
    door.create_map(MAP, 0.05).await.expect("a new map");
    let (first, second) = (through_the_twins(BOTH_WINGS, 1), through_the_twins(ONE_WING, 2));
    tagged(door, "first", &first, (None, &tags_m())).await;

    let blind = tagged(door, "blind", &second, (Some(anywhere()), &[])).await;
    let (_, sessions) = merged(door, merge_job(MAP)).await;
    assert_eq!(sessions[0].verdict, i32::from(v1::MergeVerdict::Ambiguous), "{sessions:?}");
    let merge = merge_of(door, &blind.id).await.expect("a merge");
    assert!(merge.alignments.iter().all(|it| it.landmarks_matched == 0), "{merge:?}");

    let seeing = tagged(door, "seeing", &second, (Some(anywhere()), &tags_m())).await;
    let (_, sessions) = merged(door, merge_job(MAP)).await;
    let found = sessions.iter().find(|found| found.session == seeing.id).expect("its merge");
    let merge = merge_of(door, &seeing.id).await.expect("a merge");
    assert_eq!(found.verdict, i32::from(v1::MergeVerdict::Merged), "{merge:?}");
    assert!(found.accepted, "nobody is needed: {merge:?}");
    let first_place = &merge.alignments[0];
    assert_eq!(first_place.landmarks_matched, 2, "those of the wing: {merge:?}");
    assert_eq!(first_place.landmarks_contradicted, 0, "{merge:?}");
    is_true_place(first_place.onto_from_session.expect("a pose"), true_place(&first, &second));
}

/// Nothing is looked at unless somebody asks.
fn launch(data: &Path) -> Launch {
    Launch::at(data).setting("merging.looks_again", false)
}

#[tokio::test(flavor = "multi_thread")]
async fn over_grpc() {
    let data = empty_folder();
    let service = launch(data.path()).start();
    tags_tell_which_wing(&service.grpc()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn over_rest() {
    let data = empty_folder();
    let service = launch(data.path()).start();
    tags_tell_which_wing(&service.rest()).await;
}
