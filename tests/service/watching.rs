//! Jobs, and what happens as it happens: server-sent events, `WatchMap`, `WatchJob`.

use meetpoint_client::v1;
use serde_json::Value;
use v1::watch_map_response::Kind as Seen;

use crate::door::{Answer, Door, FIRST_PAGE, Page, complete, job_done, refused};
use crate::drive::{SimulatedDrive, driven};
use crate::http::Events;
use crate::running::{Launch, empty_folder};

/// Needs the map `hall` with a version.
async fn jobs_are_made_followed_and_listed<D: Door>(door: &D) {
    let before = door.map("hall").await.expect("it was made").latest_version;
    let job = door.create_job("hall").await.expect("a new job");
    assert_eq!((job.map.as_str(), job.done), ("hall", false), "it is queued: {job:?}");
    let done = job_done(door, &job.id).await;
    assert_eq!(done.state, i32::from(v1::JobState::Succeeded), "{done:?}");
    assert!(before < done.result_version, "a new version: {done:?}");
    let version = door.version("hall", done.result_version).await.expect("it is there");
    assert_eq!(version.origin, "rebuild", "what made it: {version:?}");
    let [old, new] = [before, done.result_version];
    let (old, new) = (door.grid("hall", old, None).await, door.grid("hall", new, None).await);
    assert!(old.map(|grid| grid.cells) == new.map(|grid| grid.cells), "the same map again");

    let cancelled = door.cancel_job(&job.id).await.expect("it is there");
    assert_eq!(cancelled.state, done.state, "a job that has ended stays as it is");
    let second = door.create_job("hall").await.expect("a new job");
    let asked: Answer<v1::Job> = door.cancel_job(&second.id).await;
    let asked = asked.expect("it is there");
    assert!(asked.cancel_requested || asked.done, "{asked:?}");
    let ended = job_done(door, &second.id).await;
    assert!(ended.done && ended.error.is_none(), "cancelled, or done just before: {ended:?}");
    let (newest, token) = door.jobs("hall", Page(1, "")).await.expect("a page");
    assert_eq!(newest[0].id, second.id, "newest first");
    let (older, _) = door.jobs("hall", Page(1, &token)).await.expect("a page");
    assert_eq!(older[0].id, job.id, "the next page");
    assert_eq!(door.jobs("", FIRST_PAGE).await.expect("a page").0.len(), 2, "of all maps");

    refused(door.create_job("nowhere").await, "MAP_NOT_FOUND");
    refused(door.job("0199d3a6-6ac5-7c4e-9d51-2d9a3f1f3c11").await, "JOB_NOT_FOUND");
    refused(door.cancel_job("0199d3a6-6ac5-7c4e-9d51-2d9a3f1f3c11").await, "JOB_NOT_FOUND");
    refused(door.job("7").await, "INVALID_FIELD");
}

#[tokio::test(flavor = "multi_thread")]
async fn jobs_over_both_doors() {
    let drive = SimulatedDrive::through_the_hall(8);
    let batches = &drive.batches(20)[..8];
    for over_rest in [false, true] {
        let data = empty_folder();
        let service = Launch::at(data.path()).start();
        let (grpc, rest) = (service.grpc(), service.rest());
        let session = driven(&grpc, "hall", &drive, batches).await;
        crate::door::finished(&grpc, &session).await;
        if over_rest {
            jobs_are_made_followed_and_listed(&rest).await;
        } else {
            jobs_are_made_followed_and_listed(&grpc).await;
        }
    }
}

/// An event's name, and what its data must say.
type Wanted<'a> = (&'a str, &'a dyn Fn(&Value) -> bool);

/// Reads events until all that is wanted has come, in whatever order.
fn read_until(events: &mut Events, wanted: &[Wanted<'_>]) {
    let mut missing: Vec<_> = wanted.iter().collect();
    while !missing.is_empty() {
        let Some((found, data)) = events.next() else {
            let names: Vec<_> = missing.iter().map(|(name, _)| name).collect();
            panic!("the stream ended before {names:?} came")
        };
        missing.retain(|(name, is_wanted)| *name != found || !is_wanted(&data));
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_drive_is_seen() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    let door = service.grpc();
    // The map has to be there to be watched.
    let drive = SimulatedDrive::through_the_hall(9);
    let session = driven(&door, "hall", &drive, &[]).await;
    let mut everything = service.http().events("/v1/events");
    let map = "hall";
    let mut of_the_map = service.http().events(&format!("/v1/events?map={map}"));
    let watch = v1::WatchMapRequest { map: map.to_owned() };
    let mut watched = door.maps.clone().watch_map(watch).await.expect("a stream").into_inner();
    assert_eq!(service.http().get("/v1/events?map=nowhere").status, 404, "no such map");

    crate::drive::send(&door, &session, &drive.batches(20)[..8]).await;
    door.close(&session.id, session.epoch).await.expect("it can be closed");
    let whole = complete(&door, &session.id).await.complete_in_version;
    let is_whole = |version: &Value| whole <= crate::from_json::unsigned(&version["number"]);
    for events in [&mut everything, &mut of_the_map] {
        read_until(
            events,
            &[
                ("correction", &|correction| correction["session"] == session.id),
                ("session", &|session| session["state"] == "CLOSED"),
                ("version", &is_whole),
            ],
        );
    }
    let (mut is_corrected, mut is_closed, mut is_published) = (false, false, false);
    while !(is_corrected && is_closed && is_published) {
        let seen = watched.message().await.expect("it stands").expect("it stands");
        match seen.kind.expect("something happened") {
            Seen::Correction(correction) => is_corrected |= correction.session == session.id,
            Seen::Session(now) => is_closed |= now.state == i32::from(v1::SessionState::Closed),
            Seen::Version(version) => is_published |= whole <= version.number,
            Seen::Costs(costs) => panic!("nobody changed costs: {costs:?}"),
        }
    }

    let job = door.create_job(map).await.expect("a new job").id;
    let watch = v1::WatchJobRequest { job: job.clone() };
    let mut jobs = door.jobs.clone().watch_job(watch).await.expect("a stream").into_inner();
    let mut of_the_job = service.http().events(&format!("/v1/jobs/{job}/events"));
    let mut last = None;
    while let Some(reply) = jobs.message().await.expect("it stands to the job's end") {
        last = reply.job;
    }
    assert!(last.is_some_and(|job| job.done), "the stream ends with the job");
    let is_done = |job: &Value| job["done"] == true;
    read_until(&mut of_the_job, &[("job", &is_done)]);
    assert_eq!(of_the_job.next().map(|(name, _)| name), None, "the stream ends with the job");
    read_until(&mut everything, &[("job", &is_done)]);
}
