//! Two robots without lasers, driven past the same doors from different corners: where the second lies among
//! the first one's doors.

use std::f64::consts::FRAC_PI_2;

use meetpoint_client::v1;
use meetpoint_geometry::Pose;

use crate::door::{Door, finished, job_done};
use crate::drive::{opened, opening, send};
use crate::landmark_loop::LandmarkLoop;
use crate::merging::{MAP, merge_job, merge_of, merged, off};
use crate::relaxing::trajectory;
use crate::running::{Launch, empty_folder};

/// How far from the truth the second robot may begin: metres and radians. Who presses the button is up to
/// half a metre off, and so are the doors.
const PLACE_MAX: (f64, f64) = (0.6, 0.1);

async fn found_by_doors<D: Door>(door: &D) {
    door.create_map(MAP, 0.05).await.expect("a new map");
    let [first, second] = [0, 1].map(LandmarkLoop::from_corner);
    let request = opening(MAP, "first", &[LandmarkLoop::sensor()]);
    let known = opened(door, request).await;
    send(door, &known, &first.batches(50)).await;
    finished(door, &known).await;
    let request = opening(MAP, "second", &[LandmarkLoop::sensor()]);
    let start = v1::Start { kind: Some(v1::start::Kind::Unknown(v1::UnknownStart {})) };
    let session = opened(door, v1::OpenSessionRequest { start: Some(start), ..request }).await;
    send(door, &session, &second.batches(50)).await;
    finished(door, &session).await;

    let (_, told) = merged(door, merge_job(MAP)).await;
    let merge = merge_of(door, &session.id).await.expect("it was looked at");
    assert!(told[0].accepted, "{merge:?}");
    assert!(6 <= merge.alignments[0].landmarks_matched, "most doors: {merge:?}");
    let placed = door.session(&session.id).await.expect("it was opened");
    let place = placed.map_from_session.expect("it is placed");
    let (off_m, off_rad) = off(place, Pose::new(12.0, 0.0, FRAC_PI_2));
    assert!(off_m < PLACE_MAX.0 && off_rad < PLACE_MAX.1, "{off_m} m, {off_rad} rad: {place:?}");

    let (undone, job) = door.undo(&merge.id).await.expect("it was accepted");
    assert_eq!(undone.state(), v1::MergeState::Undone, "{undone:?}");
    job_done(door, &job).await;
    let poses = trajectory(door, &session.id, 0).await;
    assert_eq!(poses.reference_frame, "session", "in its own frame again");
}

#[tokio::test(flavor = "multi_thread")]
async fn over_grpc() {
    let data = empty_folder();
    let launch = Launch::at(data.path()).setting("merging.looks_again", false);
    let service = launch.setting("merging.relaxes_after", false).start();
    found_by_doors(&service.grpc()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn over_rest() {
    let data = empty_folder();
    let launch = Launch::at(data.path()).setting("merging.looks_again", false);
    let service = launch.setting("merging.relaxes_after", false).start();
    found_by_doors(&service.rest()).await;
}
