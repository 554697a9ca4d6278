//! Two robots without lasers, driven past the same doors from different corners: where the second lies among
//! the first one's doors.

use std::f64::consts::FRAC_PI_2;

use meetpoint_client::v1;
use meetpoint_geometry::Pose;

use crate::door::{Door, FIRST_PAGE, finished, job_done, refused};
use crate::drive::{opened, opening, send};
use crate::landmark_loop::{LandmarkLoop, N_DOORS};
use crate::merging::{MAP, merge_job, merge_of, merged, off};
use crate::relaxing::{relax, trajectory};
use crate::running::{Launch, empty_folder};

/// How far from the truth the second robot may begin: metres and radians. Who presses the button is up to
/// half a metre off, and so are the doors.
const PLACE_MAX: (f64, f64) = (0.6, 0.1);

/// The second robot's session; the first knows where it began.
async fn two_robots<D: Door>(door: &D, drives: [LandmarkLoop; 2]) -> v1::Session {
    door.create_map(MAP, 0.05).await.expect("a new map");
    let [first, second] = drives;
    let request = opening(MAP, "first", &[LandmarkLoop::sensor()]);
    let known = opened(door, request).await;
    send(door, &known, &first.batches(50)).await;
    finished(door, &known).await;
    let request = opening(MAP, "second", &[LandmarkLoop::sensor()]);
    let start = v1::Start { kind: Some(v1::start::Kind::Unknown(v1::UnknownStart {})) };
    let session = opened(door, v1::OpenSessionRequest { start: Some(start), ..request }).await;
    send(door, &session, &second.batches(50)).await;
    finished(door, &session).await
}

async fn is_placed<D: Door>(door: &D, session: &v1::Session) {
    let placed = door.session(&session.id).await.expect("it was opened");
    let place = placed.map_from_session.expect("it is placed");
    let (off_m, off_rad) = off(place, truth());
    assert!(off_m < PLACE_MAX.0 && off_rad < PLACE_MAX.1, "{off_m} m, {off_rad} rad: {place:?}");
}

/// Where the second robot begins.
fn truth() -> Pose {
    Pose::new(12.0, 0.0, FRAC_PI_2)
}

async fn found_by_names<D: Door>(door: &D) {
    let session = two_robots(door, [0, 1].map(LandmarkLoop::from_corner)).await;
    refused(door.whereabouts(&session.id, None).await, "LANDMARKS_UNKNOWN");
    let job = door.start_job(relax(MAP)).await.expect("a job").id;
    job_done(door, &job).await;
    it_finds_itself(door, &session).await;
    let (_, told) = merged(door, merge_job(MAP)).await;
    let merge = merge_of(door, &session.id).await.expect("it was looked at");
    assert!(told[0].accepted, "{merge:?}");
    assert!(6 <= merge.alignments[0].landmarks_matched, "most doors: {merge:?}");
    is_placed(door, &session).await;
    both_are_fitted_together(door).await;

    let (undone, job) = door.undo(&merge.id).await.expect("it was accepted");
    assert_eq!(undone.state(), v1::MergeState::Undone, "{undone:?}");
    job_done(door, &job).await;
    let poses = trajectory(door, &session.id, 0).await;
    assert_eq!(poses.reference_frame, "session", "in its own frame again");
}

/// By the doors that the first robot saw, after one, two and all of those that the second saw.
async fn it_finds_itself<D: Door>(door: &D, session: &v1::Session) {
    let [first, second, last] =
        [Some(0), Some(1), None].map(async |step| door.whereabouts(&session.id, step).await);
    let first = first.await.expect("it saw a door");
    assert_eq!((first.step, first.sightings), (0, 1), "one door");
    assert_eq!(first.landmarks as usize, N_DOORS, "of the first robot's");
    let second = second.await.expect("it drove on");
    assert!(second.entropy_nats < first.entropy_nats, "it knows more: {first:?} {second:?}");
    let last = last.await.expect("it drove around twice");
    assert_eq!(last.step + 1, last.steps, "the last");
    let place = last.peaks[0].map_from_robot.expect("it lies there");
    // It comes to the corner where it began, along another side.
    let (off_m, off_rad) = off(place, truth() * Pose::new(0.0, 0.0, -FRAC_PI_2));
    assert!(off_m < 1.5 && off_rad < 0.3, "on the paper's grid of a metre: {last:?}");
    assert!(0.5 < last.peaks[0].around, "and surely: {last:?}");
    refused(door.whereabouts(&session.id, Some(last.steps)).await, "INVALID_FIELD");
    let png = door.whereabouts_picture(&session.id, Some(1)).await.expect("a picture");
    assert!(png.starts_with(b"\x89PNG"), "as it is called");
}

/// Relaxed once they lie in one map, each door is one landmark.
async fn both_are_fitted_together<D: Door>(door: &D) {
    let job = door.start_job(relax(MAP)).await.expect("a job").id;
    let job = job_done(door, &job).await;
    let Some(v1::job::Result::RelaxResult(v1::RelaxResult { sessions })) = &job.result else {
        panic!("no result: {job:?}")
    };
    let [first, second] = sessions.as_slice() else { panic!("two sessions: {sessions:?}") };
    assert_eq!(first.together_with, std::slice::from_ref(&second.session), "with one another");
    assert_eq!(second.together_with, std::slice::from_ref(&first.session), "with one another");
    let (landmarks, _) = door.landmarks(MAP, 0, FIRST_PAGE).await.expect("a page");
    assert_eq!(landmarks.len(), N_DOORS, "one a door: {landmarks:?}");
    let mut names: Vec<_> = landmarks.iter().filter_map(|it| it.identity.clone()).collect();
    names.sort();
    names.dedup();
    assert_eq!(names.len(), N_DOORS, "each by its name: {names:?}");
    assert!(landmarks.iter().all(|it| 4 <= it.sightings), "by both, twice: {landmarks:?}");
}

/// Doors that look alike are no proof, however many there are: a person has to know.
async fn nameless_doors_are_left_to_a_person<D: Door>(door: &D) {
    let drives = [0, 1].map(|corner| LandmarkLoop::from_corner(corner).past_nameless_doors());
    let session = two_robots(door, drives).await;
    let (_, told) = merged(door, merge_job(MAP)).await;
    let merge = merge_of(door, &session.id).await.expect("it was looked at");
    assert!(!told[0].accepted, "{merge:?}");
    let is_open = [v1::MergeVerdict::Proposed, v1::MergeVerdict::Ambiguous];
    assert!(is_open.contains(&merge.verdict()), "{merge:?}");
    assert!(merge.reasons.iter().any(|why| why.contains("have names")), "and why: {merge:?}");
    let is_right = |it: &&v1::MergeAlignment| {
        let (off_m, off_rad) = off(it.onto_from_session.expect("it lies there"), truth());
        off_m < PLACE_MAX.0 && off_rad < PLACE_MAX.1
    };
    let right = merge.alignments.iter().find(is_right);
    let right = right.unwrap_or_else(|| panic!("the truth is among them: {merge:?}"));
    let png = door.preview(&merge.id, &right.id).await.expect("a picture");
    assert!(png.starts_with(b"\x89PNG"), "of its way over the doors");
    let (_, job) = door.accept(&merge.id, &right.id).await.expect("a person knows");
    job_done(door, &job).await;
    is_placed(door, &session).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn over_grpc() {
    let data = empty_folder();
    let launch = Launch::at(data.path()).setting("merging.looks_again", false);
    let service = launch.setting("merging.relaxes_after", false).start();
    found_by_names(&service.grpc()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn over_rest() {
    let data = empty_folder();
    let launch = Launch::at(data.path()).setting("merging.looks_again", false);
    let service = launch.setting("merging.relaxes_after", false).start();
    found_by_names(&service.rest()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn nameless_over_grpc() {
    let data = empty_folder();
    let launch = Launch::at(data.path()).setting("merging.looks_again", false);
    let service = launch.setting("merging.relaxes_after", false).start();
    nameless_doors_are_left_to_a_person(&service.grpc()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn nameless_over_rest() {
    let data = empty_folder();
    let launch = Launch::at(data.path()).setting("merging.looks_again", false);
    let service = launch.setting("merging.relaxes_after", false).start();
    nameless_doors_are_left_to_a_person(&service.rest()).await;
}
