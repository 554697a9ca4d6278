//! What the scenarios of merging share: a robot of known start, and one that nobody knows where it is.

use meetpoint_client::v1;
use meetpoint_geometry::Pose;
use v1::create_job_request::Params;

use crate::door::{Door, finished, job_done};
use crate::drive::{SimulatedDrive, driven, opened, opening, send};

/// How far from the truth a merged session may begin, before it is relaxed: metres and radians. Of its start,
/// which may be far from what both saw.
const PLACE_MAX: (f64, f64) = (0.25, 0.02);
pub(crate) const MAP: &str = "site";
/// Ticks of a batch: two seconds.
pub(crate) const N_TICKS: usize = 40;

pub(crate) fn merge_job(map: &str) -> v1::CreateJobRequest {
    let (map, kind) = (map.to_owned(), v1::JobKind::Merge.into());
    v1::CreateJobRequest { map, kind, ..Default::default() }
}

pub(crate) fn merge_job_with(map: &str, params: v1::MergeParams) -> v1::CreateJobRequest {
    v1::CreateJobRequest { params: Some(Params::Merge(params)), ..merge_job(map) }
}

/// Opens a session of which nobody knows where it begins.
pub(crate) async fn opened_anywhere<D: Door>(
    door: &D,
    robot: &str,
    drive: &SimulatedDrive,
) -> v1::Session {
    let request = opening(MAP, robot, std::slice::from_ref(&drive.sensor));
    let start = v1::Start { kind: Some(v1::start::Kind::Unknown(v1::UnknownStart {})) };
    opened(door, v1::OpenSessionRequest { start: Some(start), ..request }).await
}

/// Makes the map by a robot that knows where it begins, to the end.
pub(crate) async fn first_mapped<D: Door>(door: &D, drive: &SimulatedDrive) -> v1::Session {
    let session = driven(door, MAP, drive, &drive.batches(N_TICKS)).await;
    finished(door, &session).await
}

/// Has one more robot drive whose start nobody knows, to the end.
pub(crate) async fn newcomer_mapped<D: Door>(
    door: &D,
    robot: &str,
    drive: &SimulatedDrive,
) -> v1::Session {
    let session = opened_anywhere(door, robot, drive).await;
    send(door, &session, &drive.batches(N_TICKS)).await;
    finished(door, &session).await
}

/// Runs a merge job to its end, which has to be a good one: what came of each session.
pub(crate) async fn merged<D: Door>(
    door: &D,
    request: v1::CreateJobRequest,
) -> (v1::Job, Vec<v1::MergedSession>) {
    let job = door.start_job(request).await.expect("a job").id;
    let job = job_done(door, &job).await;
    assert_eq!(job.state, i32::from(v1::JobState::Succeeded), "{job:?}");
    let Some(v1::job::Result::MergeResult(v1::MergeResult { sessions })) = job.result.clone()
    else {
        panic!("no result: {job:?}")
    };
    (job, sessions)
}

/// The only merge of a session.
pub(crate) async fn merge_of<D: Door>(door: &D, session: &str) -> Option<v1::Merge> {
    let request = v1::ListMergesRequest {
        map: MAP.to_owned(),
        session: session.to_owned(),
        ..Default::default()
    };
    let (mut merges, _) = door.merges(request).await.expect("a page");
    assert!(merges.len() <= 1, "one a session: {merges:?}");
    merges.pop()
}

pub(crate) fn pose(wire: v1::Pose) -> Pose {
    Pose { x_m: wire.x_m, y_m: wire.y_m, theta_rad: wire.theta_rad }
}

/// How far a place is from the truth, in metres and radians.
pub(crate) fn off(found: v1::Pose, truth: Pose) -> (f64, f64) {
    let step = truth.step_to(pose(found));
    (step.distance_m(), step.theta_rad.abs())
}

#[track_caller]
pub(crate) fn is_true_place(found: v1::Pose, truth: Pose) {
    let (off_m, off_rad) = off(found, truth);
    let (max_m, max_rad) = PLACE_MAX;
    assert!(off_m < max_m && off_rad < max_rad, "{off_m} m, {off_rad} rad: {found:?}");
}

/// Mean distance of a session's scans from the truth, in metres, in the frame of the first robot's start.
pub(crate) fn mean_error_m(
    first: &SimulatedDrive,
    drive: &SimulatedDrive,
    trajectory: &v1::Trajectory,
) -> f64 {
    let scans = drive.ticks.iter().filter(|tick| tick.scan.is_some());
    let map_from_building = first.building_from_start.inverse();
    let offs = scans.zip(&trajectory.poses).map(|(tick, found)| {
        assert_eq!(tick.stamp_ns, found.stamp_ns, "in the order of the scans");
        off(found.pose.expect("every pose is there"), map_from_building * tick.truth).0
    });
    offs.sum::<f64>() / trajectory.poses.len() as f64
}
