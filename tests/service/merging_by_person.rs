//! Where it cannot be told where a robot is, a person says so; and takes it back.

use std::path::Path;

use meetpoint_client::v1;

use crate::door::{Door, FIRST_PAGE, job_done, refused};
use crate::drive::SimulatedDrive;
use crate::kept::kept;
use crate::merge_worlds::{
    BOTH_WINGS, FIRST_WAY, ONE_WING, SECOND_WAY, through_the_house, through_the_twins, true_place,
};
use crate::merging::{
    MAP, first_mapped, is_true_place, merge_job, merge_job_with, merge_of, merged, newcomer_mapped,
    off,
};
use crate::relaxing::trajectory;
use crate::running::{Launch, Running, empty_folder, meetpoint};

const NOBODY: &str = "0199d3a6-6ac5-7c4e-9d51-2d9a3f1f3c11";

/// Nothing is looked at unless somebody asks.
fn launch(data: &Path) -> Launch {
    Launch::at(data).setting("merging.looks_again", false)
}

async fn drawn<D: Door>(door: &D, job: &str) -> v1::Job {
    let job = job_done(door, job).await;
    assert_eq!(job.state, i32::from(v1::JobState::Succeeded), "{job:?}");
    assert!(0 < job.result_version, "a version was made: {job:?}");
    job
}

/// Two wings that look the same: the newcomer is in one of them, and only a person can tell in which.
async fn one_of_two_wings<D: Door>(door: &D) {
    let first = through_the_twins(BOTH_WINGS, 3);
    let second = through_the_twins(ONE_WING, 4);
    first_mapped(door, &first).await;
    refused(door.start_job(merge_job("nowhere")).await, "MAP_NOT_FOUND");
    let session = newcomer_mapped(door, "second", &second).await;
    assert_eq!(merge_of(door, &session.id).await, None, "nobody has looked");
    let (job, told) = merged(door, merge_job(MAP)).await;
    assert_eq!(job.result_version, 0, "nothing is drawn: {job:?}");
    let [told] = told.as_slice() else { panic!("one session: {told:?}") };
    assert_eq!((&told.session, told.accepted), (&session.id, false), "it is left alone");
    let merge = merge_of(door, &session.id).await.expect("it was looked at");
    assert_eq!(
        (&merge.id, merge.verdict()),
        (&told.merge, v1::MergeVerdict::Ambiguous),
        "{merge:?}"
    );
    assert_eq!((merge.state(), &merge.decision), (v1::MergeState::Open, &None), "{merge:?}");
    assert!(2 <= merge.alignments.len() && !merge.reasons.is_empty(), "rivals: {merge:?}");
    assert_eq!(door.merge(&merge.id).await, Ok(merge.clone()), "by itself too");
    refused(door.merge(NOBODY).await, "MERGE_NOT_FOUND");
    refused(door.merge("none").await, "INVALID_FIELD");

    let truth = true_place(&first, &second);
    let place = |one: &v1::MergeAlignment| one.onto_from_session.expect("it says where");
    let far_m = |one: &&v1::MergeAlignment| off(place(one), truth).0;
    let right = merge.alignments.iter().min_by(|a, b| far_m(a).total_cmp(&far_m(b)));
    let right = right.expect("there are several").clone();
    is_true_place(place(&right), truth);
    let wrong = merge.alignments.iter().find(|one| one.id != right.id).expect("a rival");
    for alignment in ["", wrong.id.as_str(), right.id.as_str()] {
        let png = door.preview(&merge.id, alignment).await.expect("a picture");
        assert_eq!(&png[..8], b"\x89PNG\r\n\x1a\n", "by its signature");
    }
    refused(door.preview(&merge.id, NOBODY).await, "ALIGNMENT_NOT_FOUND");
    decided_by_a_person(door, &merge, &right, &wrong.id).await;
}

async fn decided_by_a_person<D: Door>(
    door: &D,
    merge: &v1::Merge,
    right: &v1::MergeAlignment,
    wrong: &str,
) {
    let session = &merge.session;
    refused(door.undo(&merge.id).await, "MERGE_NOT_ACCEPTED");
    refused(door.accept(&merge.id, NOBODY).await, "ALIGNMENT_NOT_FOUND");
    let (accepted, job) = door.accept(&merge.id, &right.id).await.expect("it is there");
    assert_eq!(accepted.state(), v1::MergeState::Accepted, "{accepted:?}");
    let decision = accepted.decision.expect("somebody decided");
    assert_eq!((&decision.alignment, decision.by_rule), (&right.id, false), "a person did");
    let placed = door.session(session).await.expect("it was opened");
    assert_eq!(placed.map_from_session, right.onto_from_session, "where the alignment says");
    drawn(door, &job).await;
    let (_, again) = door.accept(&merge.id, &right.id).await.expect("it is in force");
    assert_eq!(again, "", "nothing more");
    refused(door.accept(&merge.id, wrong).await, "MERGE_ACCEPTED");
    refused(door.reject(&merge.id).await, "MERGE_ACCEPTED");
    refused(door.session_grid(session, 0).await, "SESSION_PLACED");
    let params = v1::MergeParams { sessions: vec![session.clone()], ..Default::default() };
    refused(door.start_job(merge_job_with(MAP, params)).await, "SESSION_PLACED");

    let (undone, job) = door.undo(&merge.id).await.expect("it was accepted");
    assert_eq!(undone.state(), v1::MergeState::Undone, "{undone:?}");
    drawn(door, &job).await;
    let free = door.session(session).await.expect("it was opened");
    assert_eq!((free.map_from_session, &free.frame_session), (None, session), "as before");
    door.session_grid(session, 0).await.expect("in its own frame again");
    assert_eq!(door.undo(&merge.id).await.expect("it is undone").1, "", "nothing more");
    let rejected = door.reject(&merge.id).await.expect("it may be");
    assert_eq!(rejected.state(), v1::MergeState::Rejected, "{rejected:?}");
    let request = v1::ListMergesRequest {
        state: v1::MergeState::Rejected.into(),
        page_size: 1,
        ..Default::default()
    };
    assert_eq!(door.merges(request).await.expect("a page").0, [rejected], "by its state");
}

#[tokio::test(flavor = "multi_thread")]
async fn over_grpc() {
    let data = empty_folder();
    let service = launch(data.path()).setting("merging.relaxes_after", false).start();
    one_of_two_wings(&service.grpc()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn over_rest() {
    let data = empty_folder();
    let service = launch(data.path()).setting("merging.relaxes_after", false).start();
    one_of_two_wings(&service.rest()).await;
}

/// A robot in another building is not found here.
#[tokio::test(flavor = "multi_thread")]
async fn elsewhere() {
    let data = empty_folder();
    let service = launch(data.path()).start();
    let door = service.grpc();
    first_mapped(&door, &through_the_house(FIRST_WAY, 3)).await;
    let stranger = SimulatedDrive::around_the_block(4);
    let session = newcomer_mapped(&door, "stranger", &stranger).await;
    let (_, told) = merged(&door, merge_job(MAP)).await;
    assert_eq!(told[0].verdict(), v1::MergeVerdict::NoOverlap, "{told:?}");
    let now = door.session(&session.id).await.expect("it was opened");
    assert_eq!(now.map_from_session, None, "it is left alone");
}

fn asked_by_command(service: &Running, arguments: &[&str]) -> serde_json::Value {
    let url = service.url();
    let output = meetpoint(arguments).args(["--server", &url, "--json"]).output();
    let output = output.expect("the binary under test starts");
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{arguments:?}: {told}");
    serde_json::from_slice(&output.stdout).unwrap_or(serde_json::Value::Null)
}

/// What a merge left, and the relaxation of both that followed, is taken back by undoing it: every tile and
/// every pose is what it was, bit for bit.
#[tokio::test(flavor = "multi_thread")]
async fn undone_without_a_trace() {
    let data = empty_folder();
    let service = launch(data.path()).start();
    let known = first_mapped(&service.grpc(), &through_the_house(FIRST_WAY, 3)).await;
    let second = through_the_house(SECOND_WAY, 4);
    let session = newcomer_mapped(&service.grpc(), "second", &second).await;
    service.stop();
    let before = kept(data.path(), MAP, &session.id).await;
    let known_before = kept(data.path(), MAP, &known.id).await;

    let service = launch(data.path()).start();
    let told = asked_by_command(&service, &["merge", "--map", MAP]);
    assert_eq!(told["sessions"][0]["accepted"], true, "{told}");
    let door = service.grpc();
    let (jobs, _) = door.jobs(MAP, FIRST_PAGE).await.expect("a page");
    let relax = jobs.iter().find(|job| job.kind() == v1::JobKind::Relax).expect("it follows");
    drawn(&door, &relax.id).await;
    let relaxed = trajectory(&door, &session.id, 0).await;
    assert_eq!(relaxed.origin, i32::from(v1::TrajectoryOrigin::Relaxation), "with the first");
    let listed = asked_by_command(&service, &["merges", "list", "--map", MAP]);
    let merge = listed["merges"][0]["id"].as_str().expect("an id").to_owned();
    assert_eq!(listed["merges"][0]["state"], "ACCEPTED", "{listed}");
    let shown = asked_by_command(&service, &["merges", "show", &merge]);
    assert_eq!(shown["decision"]["by_rule"], true, "{shown}");
    let picture = data.path().join("preview.png");
    let path = picture.to_string_lossy().into_owned();
    asked_by_command(&service, &["merges", "preview", &merge, "--output", &path]);
    assert!(picture.exists(), "it is written");
    let undone = asked_by_command(&service, &["merges", "undo", &merge, "--reason", "try"]);
    assert_eq!(undone["state"], "UNDONE", "{undone}");
    let output = data.path().join("own.png").to_string_lossy().into_owned();
    let own = ["map", "--session", &session.id, "--format", "png", "--output", &output];
    assert_eq!(asked_by_command(&service, &own)["map"], session.id, "its own map");
    service.stop();
    let after = kept(data.path(), MAP, &session.id).await;
    assert!(after.tiles == before.tiles, "every tile");
    assert!(after.poses == before.poses, "every pose of the newcomer");
    let known_after = kept(data.path(), MAP, &known.id).await;
    assert!(known_after.poses == known_before.poses, "and of the first");
}
