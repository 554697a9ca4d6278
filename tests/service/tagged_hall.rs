//! A robot with a laser and a camera in a hall whose walls the laser does not see from where it drives: tags
//! that it passes again put right what odometry got wrong, in the same graph as the scans.

use meetpoint_client::v1;
use meetpoint_geometry::Point2;
use meetpoint_sim::{Building, Laser, OdometryError, Robot};

use crate::door::{Door, FIRST_PAGE, finished, job_done};
use crate::drive::{SimulatedDrive, opened, opening, send};
use crate::relaxing::{relax_with, trajectory};
use crate::running::{Launch, empty_folder};
use crate::tag_camera::{batches_with_tags, camera};

const MAP: &str = "tagged";
/// Tags in the hall, in the building's frame, in metres.
const TAGS_M: [[f64; 2]; 5] = [[10.0, 7.0], [20.0, 9.0], [33.0, 15.0], [20.0, 22.5], [7.0, 15.0]];
/// What the robot drives past, half around twice.
const WAY_M: [[f64; 2]; 7] =
    [[8.0, 8.0], [32.0, 8.0], [32.0, 22.0], [8.0, 22.0], [8.0, 8.0], [32.0, 8.0], [32.0, 22.0]];
/// Of the sightings one in so many does not tell which tag it is.
const ANONYMOUS_EACH: usize = 10;

/// A hall of 40 m by 30 m, and odometry that ends some 13 m off.
fn drive() -> SimulatedDrive {
    let row = |y: usize| if y == 0 || y == 59 { "#".repeat(80) } else { format!("#{:78}#", "") };
    let rows: Vec<String> = (0..60).map(|y| row(y).replace(' ', ".")).collect();
    let hall = Building::from_drawing(&rows.join("\n"), 0.5).expect("a drawing");
    let laser = Laser { range_max_m: 4.0, ..Laser::INDOOR };
    let odometry_error = OdometryError { drift_rad_per_m: 0.009, ..OdometryError::UNCALIBRATED };
    let robot = Robot { laser, odometry_error, n_ticks_per_scan: 4, ..Robot::INDOOR };
    let way = WAY_M.map(|[x_m, y_m]| Point2::new(x_m, y_m));
    SimulatedDrive::by_way_of(&hall, robot, &way, 3)
}

/// The drive's batches with what the camera sees, and how many sightings that is.
fn batches(drive: &SimulatedDrive) -> (Vec<v1::Batch>, usize) {
    batches_with_tags(drive, &TAGS_M, Some(ANONYMOUS_EACH))
}

/// What a relax job tells of the only session, and the job.
async fn relaxed<D: Door>(door: &D, params: v1::RelaxParams) -> (v1::RelaxedSession, v1::Job) {
    let job = door.start_job(relax_with(MAP, params)).await.expect("a job").id;
    let job = job_done(door, &job).await;
    assert_eq!(job.state, i32::from(v1::JobState::Succeeded), "{job:?}");
    let Some(v1::job::Result::RelaxResult(result)) = &job.result else {
        panic!("no result: {job:?}")
    };
    assert_eq!(result.sessions.len(), 1, "{result:?}");
    (result.sessions[0].clone(), job)
}

async fn tags_and_scans_work_together<D: Door>(door: &D) {
    let drive = drive();
    door.create_map(MAP, 0.05).await.expect("a new map");
    let request = opening(MAP, "rover", &[drive.sensor.clone(), camera()]);
    let session = opened(door, request).await;
    let (batches, n_sightings) = batches(&drive);
    send(door, &session, &batches).await;
    finished(door, &session).await;
    let live = trajectory(door, &session.id, 0).await;
    let (live_m, _) = drive.mean_errors_m_of_scans(&live);
    assert!(3.0 < live_m, "nothing that the laser saw helps: {live_m} m");

    // As if the camera could not tell them apart: they are where they were seen from those poses.
    let forgetting = v1::RelaxParams { forget_identities: true, ..v1::RelaxParams::default() };
    let (told, _) = relaxed(door, forgetting).await;
    let scans = told.scans.expect("by scans");
    assert_eq!(scans.sightings_in_graph, 0, "{scans:?}");
    assert_eq!(scans.sightings_fitted_only as usize, n_sightings, "{scans:?}");
    let (without_m, _) = drive.mean_errors_m_of_scans(&trajectory(door, &session.id, 0).await);
    assert!(0.5 * live_m < without_m, "{without_m} m, live {live_m} m");

    let (told, job) = relaxed(door, v1::RelaxParams::default()).await;
    let scans = told.scans.expect("by scans");
    let (in_graph, fitted_only) = (scans.sightings_in_graph, scans.sightings_fitted_only);
    assert_eq!((in_graph + fitted_only) as usize, n_sightings, "each of them: {scans:?}");
    assert!(n_sightings * 2 / 3 < in_graph as usize, "those that tell which: {scans:?}");
    assert!(n_sightings / ANONYMOUS_EACH <= fitted_only as usize, "not the others: {scans:?}");
    assert_eq!(scans.sightings_doubted, 0, "all are right: {scans:?}");
    let is_told = |line: &v1::JobLogLine| line.text.contains("sightings of landmarks in the graph");
    assert!(job.log.iter().any(is_told), "for people: {job:?}");
    let after = trajectory(door, &session.id, 0).await;
    assert_eq!(after.origin, i32::from(v1::TrajectoryOrigin::Relaxation), "repaired");
    let (error_m, _) = drive.mean_errors_m_of_scans(&after);
    assert!(error_m < 0.25 * live_m, "{error_m} m, live {live_m} m");
    let (landmarks, _) = door.landmarks(MAP, 0, FIRST_PAGE).await.expect("a version");
    for (tag, at) in TAGS_M.into_iter().enumerate() {
        let name = format!("tag {tag}");
        let named = landmarks.iter().find(|one| one.identity.as_ref() == Some(&name));
        let position = named.and_then(|one| one.position).expect("where it is");
        let off_m = drive.error_m(at, [position.x_m, position.y_m]);
        assert!(off_m < 2.0, "{name} is {off_m} m off");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn over_grpc() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    tags_and_scans_work_together(&service.grpc()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn over_rest() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    tags_and_scans_work_together(&service.rest()).await;
}
