//! `RobotSession` over runs that end badly.

use std::path::Path;

use crate::FAST;
use crate::fake::{Fake, Faults};
use meetpoint_client::{
    Client, RobotParams, RobotSession, Run, SpoolParams,
    v1::{Batch, Mark, Observation, SessionState, observation::Kind},
};

const PARAMS: RobotParams = RobotParams { spool: SpoolParams::ROBOT, delivery: FAST };

fn mark(text: &str) -> Vec<Observation> {
    let mark = Kind::Mark(Mark { label: text.to_owned() });
    vec![Observation { kind: Some(mark), ..Observation::default() }]
}

fn run() -> Run {
    Run { map: "office".to_owned(), robot: "rosie".to_owned(), ..Run::default() }
}

async fn start(url: &str, folder: &Path) -> RobotSession {
    let client = Client::connect(url).expect("a good address");
    RobotSession::start(client, folder, run(), PARAMS, |_| {}).await.expect("the folder is ours")
}

fn labels(batches: &[Batch]) -> Vec<&str> {
    let observations = batches.iter().flat_map(|batch| &batch.observations);
    observations
        .filter_map(|observation| match &observation.kind {
            Some(Kind::Mark(mark)) => Some(mark.label.as_str()),
            _ => None,
        })
        .collect()
}

#[tokio::test]
async fn a_run_without_the_service_is_delivered_by_the_next_one() {
    let folder = tempfile::tempdir().expect("a folder");
    // Nobody listens on port 1.
    let offline = start("http://127.0.0.1:1", folder.path()).await;
    for text in ["one", "two", "three"] {
        offline.send(mark(text)).await.expect("a free disk");
    }
    let epoch = offline.epoch();
    offline.stop().await.expect("a free disk");

    let (fake, url) = Fake::start(Faults::ALL, 5).await;
    let online = start(&url, folder.path()).await;
    assert_eq!(online.epoch(), epoch + 1, "a cold start");
    assert_eq!(online.send(mark("four")).await.expect("a free disk"), 1, "numbers begin anew");
    let session = online.finish().await.expect("the service is there");
    assert_eq!(session.state(), SessionState::Closed, "and closed");

    let sessions = fake.sessions();
    let [(first, true), (second, true)] = &sessions[..] else {
        panic!("two, closed: {sessions:?}")
    };
    assert_eq!(labels(&fake.durable(first)), ["one", "two", "three"], "the earlier run, first");
    assert_eq!(labels(&fake.durable(second)), ["four"], "this run");
    let left = std::fs::read_dir(folder.path().join("runs")).expect("a folder").count();
    assert_eq!(left, 0, "nothing is kept that the service has");
}

#[tokio::test]
async fn one_process_at_a_time_uses_a_folder() {
    let folder = tempfile::tempdir().expect("a folder");
    let _first = start("http://127.0.0.1:1", folder.path()).await;
    let client = Client::connect("http://127.0.0.1:1").expect("a good address");
    let second = RobotSession::start(client, folder.path(), run(), PARAMS, |_| {}).await;
    let error = second.expect_err("the folder is in use");
    assert!(error.to_string().contains("another process uses"), "{error}");
}

#[tokio::test]
async fn what_the_service_would_refuse_is_refused_at_once() {
    let folder = tempfile::tempdir().expect("a folder");
    let session = start("http://127.0.0.1:1", folder.path()).await;
    let many = vec![Observation::default(); 4097];
    let error = session.send(many).await.expect_err("one too many");
    assert!(error.to_string().starts_with("4097 observations"), "{error}");
    let long = "x".repeat(1 << 20);
    assert!(session.send(mark(&long)).await.is_err(), "more than a mebibyte");
    assert_eq!(session.send(mark("fits")).await.expect("a free disk"), 1, "no number was used up");
}
