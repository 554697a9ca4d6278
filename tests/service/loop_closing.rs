//! A loop closes while the robot drives: the service relaxes what it drew by itself, the robot is told where
//! it is, and goes on from there.

use meetpoint_client::v1;
use meetpoint_geometry::Pose;
use v1::watch_map_response::Kind as Seen;

use crate::door::{Door, FIRST_PAGE, eventually, finished};
use crate::drive::{SimulatedDrive, opened, opening, send};
use crate::relaxing::trajectory;
use crate::running::{Launch, empty_folder};

const MAP: &str = "large";
/// Distance from the truth of a loop of 60 m by 20 m that is closed, in the mean and of the robot at the
/// end, in metres; by odometry it is 20.
const ERROR_MAX_M: f64 = 0.3;
/// Share of the drive after which the robot has come back and driven on around a corner.
const SHARE_BACK: f64 = 0.95;
/// Batches that are sent before it is waited for what they set going: 20 m of the way.
const N_BATCHES_AT_ONCE: usize = 10;

#[tokio::test(flavor = "multi_thread")]
async fn a_loop_is_closed_while_the_robot_drives() {
    let data = empty_folder();
    // Batches come as fast as they can, which else nothing is started for.
    let service = Launch::at(data.path())
        .setting("jobs.closing_pace_max", f64::INFINITY)
        .setting("mapping.snapshot_scans", 100)
        .start();
    let door = service.grpc();
    let drive = SimulatedDrive::around_a_large_block(3);
    door.create_map(MAP, 0.05).await.expect("a new map");
    let sensors = std::slice::from_ref(&drive.sensor);
    let session = opened(&door, opening(MAP, "rover", sensors)).await;
    let batches = drive.batches(40);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share")]
    let (before, after) = batches.split_at((batches.len() as f64 * SHARE_BACK) as usize);
    for some in before.chunks(N_BATCHES_AT_ONCE) {
        send(&door, &session, some).await;
        eventually("all is mapped, and no job at work", || async {
            let now = door.session(&session.id).await.expect("it is there");
            let (jobs, _) = door.jobs(MAP, FIRST_PAGE).await.expect("a page");
            let is_mapped = now.mapped_through == some[some.len() - 1].number;
            (is_mapped && jobs.iter().all(|job| job.done)).then_some(())
        })
        .await;
    }
    let (jobs, _) = door.jobs(MAP, FIRST_PAGE).await.expect("a page");
    let job = jobs.first().expect("a job that nobody asked for");
    assert_eq!(job.state, i32::from(v1::JobState::Succeeded), "{job:?}");
    let Some(v1::job::Params::Relax(params)) = &job.params else { panic!("{job:?}") };
    assert!(params.going_on && job.priority < 0, "cheap, and behind all others: {job:?}");
    let all = v1::ListClosuresRequest { map: MAP.to_owned(), ..Default::default() };
    let (closures, _) = door.closures(all).await.expect("a page");
    let accepted = i32::from(v1::ClosureVerdict::Accepted);
    assert!(closures.iter().any(|one| one.verdict == accepted), "{job:?} {closures:?}");
    let open = door.session(&session.id).await.expect("it is there");
    assert_eq!(open.state, i32::from(v1::SessionState::Open), "it is still driving");

    let watch = v1::WatchMapRequest { map: MAP.to_owned() };
    let mut watched = door.maps.clone().watch_map(watch).await.expect("a stream").into_inner();
    send(&door, &session, after).await;
    finished(&door, &session).await;
    let mut last_m = None;
    while let Some(seen) = watched.message().await.expect("it stands") {
        match seen.kind {
            Some(Seen::Correction(told)) => {
                let told = told.correction.expect("a correction");
                let v1::Pose { x_m, y_m, theta_rad } = told.map_from_robot.expect("a pose");
                let pose = Pose::new(x_m, y_m, theta_rad);
                last_m = Some(drive.error_at_m(told.stamp_ns, pose));
            }
            Some(Seen::Session(ended)) if ended.state != i32::from(v1::SessionState::Open) => break,
            _ => {}
        }
    }
    let last_m = last_m.expect("the robot is told where it is");
    let found = trajectory(&door, &session.id, 0).await;
    assert_eq!(found.origin, i32::from(v1::TrajectoryOrigin::Relaxation), "repaired");
    let (error_m, odometry_m) = drive.mean_errors_m(&found);
    assert!(error_m < ERROR_MAX_M && 1.0 < odometry_m, "{error_m} m, {odometry_m} m by odometry");
    assert!(last_m < ERROR_MAX_M, "{last_m} m off at the end");
}
