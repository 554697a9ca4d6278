//! Jobs: order, claiming, takeover, cancelling, ending.

use meetpoint_storage::{
    ClaimedJob, Error, JobId, JobOutcome, JobReport, JobState, LOG_LINES_MAX, LogLine, MapId,
    NewJob, NewLogLine, Store,
};
use uuid::Uuid;

use crate::fixture::{Fixture, hall, new_map};

const ANN: Uuid = Uuid::from_u128(1);
const BOB: Uuid = Uuid::from_u128(2);

fn new_job(map: &str, id: u128) -> NewJob {
    NewJob {
        id: JobId(Uuid::from_u128(id)),
        map: MapId(map.to_owned()),
        kind: "rebuild".to_owned(),
        params: b"all".to_vec(),
        priority: 0,
        time_ns: 1,
    }
}

async fn queue(store: &Store, map: &str, id: u128) -> JobId {
    store.create_job(&new_job(map, id)).await.expect("the map exists").id
}

fn line(text: &str) -> NewLogLine<'_> {
    NewLogLine { text, figures: None }
}

async fn claim(store: &Store, owner: Uuid, now_ns: i64) -> Option<ClaimedJob> {
    store.claim_job(owner, now_ns, 10).await.expect("writing works")
}

fn report(progress: f64) -> JobReport<'static> {
    JobReport { progress, checkpoint: None, log_line: None }
}

#[tokio::test]
async fn jobs_of_a_map_are_done_one_after_the_other() {
    let Fixture { store, .. } = &Fixture::new().await;
    store.create_map(&new_map("lab")).await.expect("the id is free");
    let first = queue(store, "hall", 30).await;
    let second = queue(store, "hall", 20).await;
    let other = queue(store, "lab", 10).await;
    let claimed = claim(store, ANN, 5).await.expect("there is work");
    assert_eq!(claimed.job.id, first, "by creation, not by id");
    let running = (claimed.job.state, claimed.job.start_time_ns, claimed.job.params.as_slice());
    assert_eq!(running, (JobState::Running, Some(5), &b"all"[..]), "begun, with its parameters");
    let claimed_other = claim(store, BOB, 5).await.expect("the other map is free");
    assert_eq!(claimed_other.job.id, other, "another map's");
    assert_eq!(claim(store, BOB, 5).await, None, "the hall is busy");
    let done = JobOutcome::Succeeded { version: 4, result: Some(b"two rooms".to_vec()) };
    let done = store.finish_job(first, claimed.fence, 6, &done).await.expect("it is ours");
    assert_eq!((done.state, done.result_version), (JobState::Succeeded, 4), "it made version 4");
    assert_eq!(done.progress, 1.0, "done is all done");
    assert_eq!(done.result.as_deref(), Some(&b"two rooms"[..]), "and more");
    let next = claim(store, BOB, 7).await.expect("the hall is free");
    assert_eq!(next.job.id, second, "now the second");
}

#[tokio::test]
async fn a_job_whose_holder_died_goes_on_from_its_checkpoint() {
    let Fixture { store, .. } = &Fixture::new().await;
    let id = queue(store, "hall", 1).await;
    let dead = claim(store, ANN, 0).await.expect("there is work");
    let figures = Some(&b"7"[..]);
    let log_line = Some(NewLogLine { text: "half way", figures });
    let half = JobReport { progress: 0.5, checkpoint: Some(b"half"), log_line };
    store.heartbeat_job(id, dead.fence, 5, 10, half).await.expect("it is ours");
    store.heartbeat_job(id, dead.fence, 6, 10, report(0.6)).await.expect("it is ours");
    assert_eq!(claim(store, BOB, 15).await, None, "held until 16");
    let taken = claim(store, BOB, 16).await.expect("its lease ran out");
    assert_eq!(taken.job.checkpoint.as_deref(), Some(&b"half"[..]), "the last one given");
    let written = LogLine { time_ns: 5, text: "half way".into(), figures: Some(b"7".to_vec()) };
    assert_eq!(taken.job.log, [written], "and the log");
    assert_eq!(taken.job.start_time_ns, Some(0), "begun once");
    let late = store.heartbeat_job(id, dead.fence, 17, 10, report(0.7)).await;
    assert!(matches!(late, Err(Error::LeaseLost)), "the dead one's fence is passed");
    let late = store.finish_job(id, dead.fence, 17, &JobOutcome::Cancelled).await;
    assert!(matches!(late, Err(Error::LeaseLost)), "nor can it end the job");
    store.release_all_leases().await.expect("writing works");
    assert!(claim(store, ANN, 17).await.is_some(), "after a start nobody holds it");
}

#[tokio::test]
async fn cancelling_stops_what_is_queued_and_asks_what_runs() {
    let Fixture { store, .. } = &Fixture::new().await;
    let running = queue(store, "hall", 1).await;
    let queued = queue(store, "hall", 2).await;
    let claimed = claim(store, ANN, 0).await.expect("there is work");
    let cancelled = store.cancel_job(queued, 3).await.expect("it exists");
    assert_eq!(cancelled.state, JobState::Cancelled, "nobody had begun");
    let asked = store.cancel_job(running, 3).await.expect("it exists");
    assert_eq!((asked.state, asked.cancel_requested), (JobState::Running, true), "asked");
    let told = store.heartbeat_job(running, claimed.fence, 4, 10, report(0.1)).await;
    assert!(told.expect("it is ours").cancel_requested, "its runner is told");
    store.finish_job(running, claimed.fence, 5, &JobOutcome::Cancelled).await.expect("ours");
    assert_eq!(claim(store, ANN, 6).await, None, "nothing is left");
    let ended = store.cancel_job(running, 9).await.expect("it exists");
    assert_eq!((ended.state, ended.update_time_ns), (JobState::Cancelled, 5), "as it was");
    let unknown = store.cancel_job(JobId(Uuid::nil()), 9).await;
    assert!(matches!(unknown, Err(Error::NoSuchJob(_))), "no such job");
}

#[tokio::test]
async fn a_failed_job_says_why() {
    let Fixture { store, .. } = &Fixture::new().await;
    let id = queue(store, "hall", 1).await;
    let claimed = claim(store, ANN, 0).await.expect("there is work");
    store.heartbeat_job(id, claimed.fence, 1, 10, report(f64::NAN)).await.expect("it is ours");
    let (code, message) = ("INTERNAL".to_owned(), "no room".to_owned());
    let outcome = JobOutcome::Failed { code: code.clone(), message: message.clone() };
    store.finish_job(id, claimed.fence, 2, &outcome).await.expect("it is ours");
    let job = store.job(id).await.expect("reading works").expect("it exists");
    assert_eq!(job.error, Some((code, message)), "code and message");
    assert_eq!(job.progress, 0.0, "a progress that is no number counts as none");
    let again = store.finish_job(id, claimed.fence, 3, &outcome).await;
    assert!(matches!(again, Err(Error::LeaseLost)), "it has ended");
}

#[tokio::test]
async fn the_log_keeps_its_last_lines() {
    let Fixture { store, .. } = &Fixture::new().await;
    let id = queue(store, "hall", 1).await;
    let claimed = claim(store, ANN, 0).await.expect("there is work");
    let n_lines = i64::from(LOG_LINES_MAX) + 2;
    for time_ns in 0..n_lines {
        let report = JobReport { progress: 0.0, checkpoint: None, log_line: Some(line("line")) };
        store.heartbeat_job(id, claimed.fence, time_ns, 10, report).await.expect("it is ours");
    }
    let job = store.job(id).await.expect("reading works").expect("it exists");
    let times_ns: Vec<i64> = job.log.iter().map(|line| line.time_ns).collect();
    assert!(times_ns.into_iter().eq(2..n_lines), "the first two are gone");
}

#[tokio::test]
async fn jobs_are_listed_newest_first() {
    let Fixture { store, .. } = &Fixture::new().await;
    store.create_map(&new_map("lab")).await.expect("the id is free");
    let ids = [queue(store, "hall", 3).await, queue(store, "lab", 2).await];
    let last = queue(store, "hall", 1).await;
    let listed = async |map: Option<&MapId>, before, limit| {
        let page = store.jobs(map, before, limit).await.expect("reading works");
        page.into_iter().map(|job| job.id).collect::<Vec<_>>()
    };
    assert_eq!(listed(None, None, 2).await, [last, ids[1]], "the first page");
    assert_eq!(listed(None, Some(ids[1]), 2).await, [ids[0]], "the page behind it");
    assert_eq!(listed(Some(&hall()), None, 9).await, [last, ids[0]], "one map's");
    let nobody = Some(JobId(Uuid::nil()));
    assert_eq!(listed(None, nobody, 9).await, [], "nothing is behind what is not there");
    let refused = store.create_job(&new_job("attic", 9)).await;
    assert!(matches!(refused, Err(Error::NoSuchMap(_))), "there is no attic");
}

#[tokio::test]
async fn what_is_waited_for_goes_first_but_what_was_begun_is_ended() {
    let Fixture { store, .. } = &Fixture::new().await;
    store.create_map(&new_map("lab")).await.expect("the id is free");
    let of_priority = async |map, id, priority| {
        let new = NewJob { priority, ..new_job(map, id) };
        store.create_job(&new).await.expect("the map exists").id
    };
    let begun = of_priority("hall", 1, 0).await;
    let claimed = claim(store, ANN, 0).await.expect("there is work");
    let nightly = of_priority("hall", 2, -1).await;
    let awaited = of_priority("hall", 3, 5).await;
    let elsewhere = of_priority("lab", 4, 3).await;
    let next = async |now_ns| claim(store, BOB, now_ns).await.map(|claimed| claimed.job.id);
    assert_eq!(next(1).await, Some(elsewhere), "the hall is busy");
    assert_eq!(next(10).await, Some(begun), "its holder died: it goes on before all others");
    let refused = store.finish_job(begun, claimed.fence, 11, &JobOutcome::Cancelled).await;
    assert!(matches!(refused, Err(Error::LeaseLost)), "it has another holder");
    let done = JobOutcome::Succeeded { version: 0, result: None };
    store.finish_job(begun, claimed.fence + 1, 11, &done).await.expect("it is his");
    let taken = store.claim_job(BOB, 11, 10).await.expect("writing works").expect("there is work");
    assert_eq!((taken.job.id, taken.job.priority), (awaited, 5), "the highest priority");
    store.finish_job(awaited, taken.fence, 12, &done).await.expect("it is his");
    assert_eq!(next(12).await, Some(elsewhere), "its lease ran out too");
    assert_eq!(next(13).await, Some(nightly), "the lowest last");
}
