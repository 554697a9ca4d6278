//! Several robots, robots that do not know where they are, and restarts in between.

use meetpoint_client::v1;

use crate::door::{Door, complete, finished, refused};
use crate::drive::{SimulatedDrive, driven, opened, opening, send};
use crate::running::{Launch, empty_folder};

async fn whole_trajectory<D: Door>(door: &D, session: &str) -> v1::Trajectory {
    let request = v1::GetTrajectoryRequest { session: session.to_owned(), ..Default::default() };
    door.trajectory(request).await.expect("it is mapped").0
}

async fn two_robots<D: Door + Clone + Send + Sync + 'static>(grpc: &D) {
    grpc.create_map("hall", 0.05).await.expect("a new map");
    let drives = [1, 2].map(SimulatedDrive::through_the_hall);
    let [a, b] =
        ["a", "b"].map(|robot| opening("hall", robot, std::slice::from_ref(&drives[0].sensor)));
    let (a, b) = (opened(grpc, a).await, opened(grpc, b).await);
    let [first, second] = [0, 1].map(|index| drives[index].batches(20));
    tokio::join!(send(grpc, &a, &first), send(grpc, &b, &second));
    for (session, drive) in [(a, &drives[0]), (b, &drives[1])] {
        let session = finished(grpc, &session).await;
        assert!(!session.lost, "{session:?}");
        let trajectory = whole_trajectory(grpc, &session.id).await;
        assert_eq!(trajectory.reference_frame, "map", "both began at its origin");
        let (error_m, _) = drive.mean_errors_m(&trajectory);
        assert!(error_m < 0.06, "{}: {error_m} m", session.robot);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn two_robots_at_once() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    two_robots(&service.grpc()).await;
}

async fn nobody_knows_where<D: Door>(door: &D) {
    door.create_map("hall", 0.05).await.expect("a new map");
    let drive = SimulatedDrive::through_the_hall(3);
    let unknown = v1::start::Kind::Unknown(v1::UnknownStart {});
    let request = v1::OpenSessionRequest {
        start: Some(v1::Start { kind: Some(unknown) }),
        ..opening("hall", "rover", std::slice::from_ref(&drive.sensor))
    };
    let session = opened(door, request).await;
    assert_eq!(session.map_from_session, None, "it is not placed");
    assert!(!session.warnings.is_empty(), "people are told");
    send(door, &session, &drive.batches(20)).await;
    let session = finished(door, &session).await;
    let trajectory = whole_trajectory(door, &session.id).await;
    assert_eq!(trajectory.reference_frame, "session", "in a frame of its own");
    let (error_m, _) = drive.mean_errors_m(&trajectory);
    assert!(error_m < 0.05, "mapped as well as any: {error_m} m");
    refused(door.grid("hall", 0, None).await, "NOTHING_OBSERVED");
}

#[tokio::test(flavor = "multi_thread")]
async fn an_unknown_start_over_grpc() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    nobody_knows_where(&service.grpc()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn an_unknown_start_over_rest() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    nobody_knows_where(&service.rest()).await;
}

/// An orderly stop in the middle: the session goes on as if nothing had been.
#[tokio::test(flavor = "multi_thread")]
async fn a_restart_in_the_middle() {
    let data = empty_folder();
    let drive = SimulatedDrive::through_the_hall(3);
    let batches = drive.batches(20);
    let (before, after) = batches.split_at(batches.len() / 2);
    let service = Launch::at(data.path()).start();
    let session = driven(&service.grpc(), "hall", &drive, before).await;
    service.stop();
    let service = Launch::at(data.path()).start();
    let door = service.rest();
    let again = door.open(opening("hall", "rover", std::slice::from_ref(&drive.sensor))).await;
    let again = again.expect("the same again");
    assert!(again.resumed, "it was there before");
    let found = again.session.expect("a session");
    assert_eq!((&found.id, found.acked_through), (&session.id, before.len() as u64), "it goes on");
    send(&door, &session, after).await;
    finished(&door, &session).await;
    let (error_m, _) = drive.mean_errors_m(&whole_trajectory(&door, &session.id).await);
    assert!(error_m < 0.05, "{error_m} m");
}

/// A session that a newer epoch fences is mapped to its end and published all the same.
#[tokio::test(flavor = "multi_thread")]
async fn a_fenced_session_is_completed() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    let door = service.grpc();
    let drive = SimulatedDrive::through_the_hall(3);
    let batches = &drive.batches(20)[..10];
    let session = driven(&door, "hall", &drive, batches).await;
    let newer = v1::OpenSessionRequest {
        client_key: "after a cold start".into(),
        epoch: 2,
        ..opening("hall", "rover", std::slice::from_ref(&drive.sensor))
    };
    opened(&door, newer).await;
    let fenced = complete(&door, &session.id).await;
    assert_eq!(fenced.state, i32::from(v1::SessionState::Fenced), "{fenced:?}");
    assert_eq!(fenced.mapped_through, batches.len() as u64, "all of it");
}

/// A robot that lets live mapping lag still has everything kept.
#[tokio::test(flavor = "multi_thread")]
async fn bounded_lag_keeps_everything() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    let door = service.rest();
    door.create_map("hall", 0.05).await.expect("a new map");
    let drive = SimulatedDrive::through_the_hall(3);
    let request = v1::OpenSessionRequest {
        delivery: v1::Delivery::BoundedLag.into(),
        ..opening("hall", "rover", std::slice::from_ref(&drive.sensor))
    };
    let session = opened(&door, request).await;
    assert_eq!(session.delivery, i32::from(v1::Delivery::BoundedLag), "as asked for");
    let batches = &drive.batches(20)[..10];
    send(&door, &session, batches).await;
    let session = finished(&door, &session).await;
    let sent = batches.iter().flat_map(|batch| &batch.observations);
    let n_scans = sent.filter(|observation| !observation.sensor_id.is_empty()).count();
    assert_eq!(session.scans, n_scans as u64, "every scan is kept");
}
