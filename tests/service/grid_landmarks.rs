//! Landmarks that the service finds itself: corners of a corridor, in grids of the last metres.

use meetpoint_client::v1;

use crate::door::{Door, FIRST_PAGE, job_done};
use crate::drive::SimulatedDrive;
use crate::laser_relaxing::mapped;
use crate::relaxing::{relax_with, trajectory};
use crate::running::{Launch, empty_folder};

/// The corners of the corridor's middle in the building's frame, in metres.
const CORNERS_M: [[f64; 2]; 4] = [[1.2, 1.0], [14.9, 1.0], [14.9, 8.8], [1.2, 8.8]];
/// A landmark is that near to the corner that it is, in metres: where the middle of a bend lies is told
/// by the clearance about it.
const CORNER_M: f64 = 0.8;

/// The drive's odometry ends metres off; corners that come back put it right.
async fn corners_are_landmarks<D: Door>(door: &D) {
    let drive = SimulatedDrive::around_the_block(3);
    let session = mapped(door, &drive).await;
    let params = v1::RelaxParams { landmarks_from_grid: true, ..v1::RelaxParams::default() };
    let job = door.start_job(relax_with("ring", params)).await.expect("a job").id;
    let job = job_done(door, &job).await;
    assert_eq!(job.state, i32::from(v1::JobState::Succeeded), "{job:?}");
    let Some(v1::job::Result::RelaxResult(v1::RelaxResult { sessions })) = &job.result else {
        panic!("no result: {job:?}")
    };
    let found = &sessions[0];
    assert_eq!(found.method, i32::from(v1::RelaxMethod::Landmarks), "{found:?}");
    assert!(5 <= found.grid_sightings && found.grid_sightings == found.sightings, "{found:?}");
    assert!(job.log.iter().any(|line| line.text.contains("stretches")), "it is told: {job:?}");
    let after = trajectory(door, &session.id, job.result_version).await;
    assert_eq!(after.origin, i32::from(v1::TrajectoryOrigin::Relaxation), "repaired");
    let (error_m, odometry_m) = drive.mean_errors_m(&after);
    assert!(error_m < 0.5 && 1.0 < odometry_m, "{error_m} m, {odometry_m} m by odometry");
    let (landmarks, _) = door.landmarks("ring", 0, FIRST_PAGE).await.expect("a version");
    let is_of_grid = |one: &v1::Landmark| one.source == i32::from(v1::LandmarkSource::Grid);
    assert!(landmarks.iter().all(is_of_grid), "{landmarks:?}");
    for corner in CORNERS_M {
        let off_m = |landmark: &v1::Landmark| {
            let at = landmark.position.expect("a position");
            drive.error_m(corner, [at.x_m, at.y_m])
        };
        let nearest_m = landmarks.iter().map(off_m).fold(f64::INFINITY, f64::min);
        assert!(nearest_m < CORNER_M, "{corner:?}: {nearest_m} m off in {landmarks:?}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn over_grpc() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    corners_are_landmarks(&service.grpc()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn over_rest() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    corners_are_landmarks(&service.rest()).await;
}
