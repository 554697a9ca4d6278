//! Relaxation as a job: a drive with odometry that drifts is straightened by the doors that it
//! passes, whatever happens meanwhile.

use meetpoint_client::v1;
use meetpoint_geometry::{Point2, Pose};
use v1::create_job_request::Params;
use v1::job_log_line::Figures;
use v1::watch_map_response::Kind as Seen;

use crate::door::{Door, FIRST_PAGE, Page, eventually, finished, job_done, refused};
use crate::drive::{SimulatedDrive, opened, opening, send};
use crate::landmark_loop::{BUTTON, LandmarkLoop};
use crate::running::{Launch, empty_folder, meetpoint};

/// Mean distance from the truth that a relaxed drive may have, in metres; its odometry ends several
/// metres off.
const ERROR_MAX_M: f64 = 0.5;
pub(crate) fn relax(map: &str) -> v1::CreateJobRequest {
    let (map, kind) = (map.to_owned(), v1::JobKind::Relax.into());
    v1::CreateJobRequest { map, kind, ..Default::default() }
}

pub(crate) fn relax_with(map: &str, params: v1::RelaxParams) -> v1::CreateJobRequest {
    v1::CreateJobRequest { params: Some(Params::Relax(params)), ..relax(map) }
}

/// Makes a map and drives around the block on it. The session stays open.
pub(crate) async fn driven_around<D: Door>(
    door: &D,
    map: &str,
    drive: &LandmarkLoop,
) -> v1::Session {
    door.create_map(map, 0.05).await.expect("a new map");
    let session =
        opened(door, opening(map, &format!("rover-{map}"), &[LandmarkLoop::sensor()])).await;
    send(door, &session, &drive.batches(50)).await;
    session
}

pub(crate) async fn trajectory<D: Door>(door: &D, session: &str, version: u64) -> v1::Trajectory {
    let session = session.to_owned();
    let request = v1::GetTrajectoryRequest { session, version, ..Default::default() };
    door.trajectory(request).await.expect("it is mapped").0
}

fn poses(trajectory: &v1::Trajectory) -> impl Iterator<Item = Pose> + '_ {
    trajectory.poses.iter().map(|pose| {
        let v1::Pose { x_m, y_m, theta_rad } = pose.pose.expect("every pose is there");
        Pose::new(x_m, y_m, theta_rad)
    })
}

/// Before: the poses are those of the odometry, and nobody knows of landmarks.
async fn the_odometry_drifts<D: Door>(door: &D, drive: &LandmarkLoop, session: &v1::Session) {
    let before = trajectory(door, &session.id, 0).await;
    assert_eq!(before.origin, i32::from(v1::TrajectoryOrigin::Odometry), "dead reckoning");
    let off_m = drive.mean_error_m(poses(&before));
    let reckoned_m = drive.mean_error_m(drive.odometry.iter().copied());
    assert!((off_m - reckoned_m).abs() < 1e-6, "{off_m} m, {reckoned_m} m by odometry");
    assert!(1.0 < off_m, "it drifts: {off_m} m");
    let (landmarks, _) = door.landmarks("block", 0, FIRST_PAGE).await.expect("a version");
    assert_eq!(landmarks, [], "nobody has looked for any");
}

fn figures_are_told(job: &v1::Job, session: &v1::Session) {
    let told: Vec<&v1::RelaxFigures> = job
        .log
        .iter()
        .filter_map(|line| line.figures.as_ref())
        .map(|Figures::Relax(figures)| figures)
        .collect();
    assert!(1 < told.len(), "more than one iteration: {told:?}");
    assert!(told.iter().all(|figures| figures.session == session.id), "of that session");
    let iterations = told.iter().map(|figures| figures.iteration);
    assert!(iterations.eq(1..=u32::try_from(told.len()).expect("few")), "counted: {told:?}");
    assert!(told.iter().any(|figures| figures.log_likelihood.is_some()), "a curve: {told:?}");
}

fn result_is_told(job: &v1::Job, drive: &LandmarkLoop, session: &v1::Session) {
    let Some(v1::job::Result::RelaxResult(v1::RelaxResult { sessions })) = &job.result else {
        panic!("no result: {job:?}")
    };
    let [found] = sessions.as_slice() else { panic!("one session: {sessions:?}") };
    assert_eq!(found.session, session.id, "that one");
    let counts = (found.sightings as usize, found.landmarks as usize, found.sightings_left_out);
    assert_eq!(counts, (drive.truth.len(), drive.doors.len(), 0), "{found:?}");
    assert!(found.spread_after_m < 0.3 && 1.0 < found.spread_before_m, "{found:?}");
    assert!(1.0 < found.correction_max_m, "{found:?}");
    assert!((0.0..=1.0).contains(&found.confidence), "{found:?}");
    let odometry = found.calibration.expect("it is told");
    assert!(odometry.turn_per_m < 0.0, "it is undone: {odometry:?}");
}

async fn landmarks_are_right<D: Door>(door: &D, drive: &LandmarkLoop, session: &v1::Session) {
    let (landmarks, _) = door.landmarks("block", 0, FIRST_PAGE).await.expect("a version");
    assert_eq!(landmarks.len(), drive.doors.len(), "{landmarks:?}");
    for landmark in &landmarks {
        let name = landmark.identity.as_deref().expect("each has a name");
        let door = drive.doors.iter().find(|(known, _)| known == name).expect("a door");
        let at = landmark.position.expect("a position");
        let off_m = (at.x_m - door.1.x).hypot(at.y_m - door.1.y);
        assert!(off_m < ERROR_MAX_M, "{name}: {off_m} m off");
        let facts = (landmark.landmark_type.as_str(), landmark.session.as_str());
        assert_eq!(facts, ("door", session.id.as_str()), "{landmark:?}");
        let spread = landmark.covariance.expect("a covariance");
        assert!(0.0 < spread.xx_m2 && 0.0 < spread.yy_m2, "{spread:?}");
        assert!(2 <= landmark.sightings && landmark.confidence <= 1.0, "{landmark:?}");
    }
    let (first, token) = door.landmarks("block", 0, Page(3, "")).await.expect("a page");
    assert_eq!(first, landmarks[..3], "the first page");
    let (second, _) = door.landmarks("block", 0, Page(100, &token)).await.expect("a page");
    assert_eq!(second, landmarks[3..], "and the rest");
    refused(door.landmarks("block", 99, FIRST_PAGE).await, "VERSION_NOT_FOUND");
}

/// A whole drive, relaxed; the version before it stays what it was, and a rebuild is drawn by what was
/// found.
async fn a_loop_is_straightened<D: Door>(door: &D) {
    let drive = LandmarkLoop::around_the_block();
    let session = driven_around(door, "block", &drive).await;
    let session = finished(door, &session).await;
    the_odometry_drifts(door, &drive, &session).await;
    let before = session.complete_in_version;
    let job = door.start_job(relax("block")).await.expect("a job");
    let job = job_done(door, &job.id).await;
    assert_eq!(job.state, i32::from(v1::JobState::Succeeded), "{job:?}");
    figures_are_told(&job, &session);
    result_is_told(&job, &drive, &session);
    let version = door.version("block", 0).await.expect("published");
    assert_eq!((version.number, version.origin.as_str()), (job.result_version, "relax"), "new");
    let after = trajectory(door, &session.id, 0).await;
    assert_eq!(after.origin, i32::from(v1::TrajectoryOrigin::Relaxation), "repaired");
    let off_m = drive.mean_error_m(poses(&after));
    assert!(off_m < ERROR_MAX_M, "{off_m} m");
    landmarks_are_right(door, &drive, &session).await;
    let [drawn_before, drawn_after] = [v1::JobPicture::Before, v1::JobPicture::After];
    let drawn_before = door.picture(&job.id, drawn_before).await.expect("a picture");
    let drawn_after = door.picture(&job.id, drawn_after).await.expect("a picture");
    assert!(drawn_before.starts_with(b"\x89PNG") && drawn_after.starts_with(b"\x89PNG"), "PNGs");
    assert!(drawn_before != drawn_after, "it is another way");
    for table in [v1::JobPicture::Alpha, v1::JobPicture::Beta, v1::JobPicture::Posterior] {
        let table = door.picture(&job.id, table).await.expect("a table");
        assert!(table.starts_with(b"\x89PNG"), "a PNG");
    }
    let old = trajectory(door, &session.id, before).await;
    assert_eq!(old.origin, i32::from(v1::TrajectoryOrigin::Odometry), "it stays what it was");

    let rebuilt = door.create_job("block").await.expect("a job");
    let rebuilt = job_done(door, &rebuilt.id).await;
    refused(door.picture(&rebuilt.id, v1::JobPicture::After).await, "PICTURE_NOT_MADE");
    let again = trajectory(door, &session.id, rebuilt.result_version).await;
    assert!(again.poses == after.poses, "drawn by what was found");
    let of = async |version| door.landmarks("block", version, FIRST_PAGE).await.expect("a version");
    assert_eq!(
        of(rebuilt.result_version).await,
        of(job.result_version).await,
        "the same landmarks"
    );
    assert_eq!(of(before).await.0, [], "not in versions before");
}

#[tokio::test(flavor = "multi_thread")]
async fn over_grpc() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    a_loop_is_straightened(&service.grpc()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn over_rest() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    a_loop_is_straightened(&service.rest()).await;
    let map = "block";
    let reply = service.http().get(&format!("/v1/maps/{map}/landmarks?format=geojson"));
    let collection = reply.json();
    assert_eq!((reply.status, &collection["frame"]), (200, &"map".into()), "{collection}");
    let features = collection["features"].as_array().expect("features");
    assert_eq!(features.len(), LandmarkLoop::around_the_block().doors.len(), "a door each");
    assert!(features.iter().all(|one| one["geometry"]["type"] == "Point"), "{collection}");
    let version = service.rest().version(map, 0).await.expect("published").number;
    assert_eq!(reply.header("meetpoint-map-version"), version.to_string(), "its version");
}

async fn what_is_wrong_is_refused<D: Door>(door: &D) {
    door.create_map("lab", 0.05).await.expect("a new map");
    door.create_map("attic", 0.05).await.expect("a new map");
    let elsewhere = opened(door, opening("attic", "hermit", &[])).await;
    let start = Some(v1::Start { kind: Some(v1::start::Kind::Unknown(v1::UnknownStart {})) });
    let lost = v1::OpenSessionRequest { start, ..opening("lab", "lost", &[]) };
    let lost = opened(door, lost).await;
    let of = |session: &str| v1::RelaxParams {
        sessions: vec![session.to_owned()],
        ..v1::RelaxParams::default()
    };
    let nobody = "0199d3a6-6ac5-7c4e-9d51-2d9a3f1f3c11";
    refused(door.start_job(relax("nowhere")).await, "MAP_NOT_FOUND");
    refused(door.start_job(relax_with("lab", of(nobody))).await, "SESSION_NOT_FOUND");
    refused(door.start_job(relax_with("lab", of(&lost.id))).await, "SESSION_NOT_PLACED");
    let other =
        refused(door.start_job(relax_with("lab", of(&elsewhere.id))).await, "INVALID_FIELD");
    assert_eq!(other.fact("field"), "relax.sessions[0]", "{other:?}");
    let rebuild = v1::CreateJobRequest {
        kind: v1::JobKind::Rebuild.into(),
        ..relax_with("lab", v1::RelaxParams::default())
    };
    let rebuild = refused(door.start_job(rebuild).await, "INVALID_FIELD");
    assert_eq!(rebuild.fact("field"), "relax", "{rebuild:?}");
    let urgent = v1::CreateJobRequest { priority: 101, ..relax("lab") };
    let urgent = refused(door.start_job(urgent).await, "INVALID_FIELD");
    assert_eq!(urgent.fact("field"), "priority", "{urgent:?}");

    let idle = door.start_job(relax("lab")).await.expect("it finds out by itself");
    let idle = job_done(door, &idle.id).await;
    let code = idle.error.as_ref().map(|error| error.code.as_str());
    assert_eq!((idle.state(), code), (v1::JobState::Failed, Some("NOTHING_TO_RELAX")), "{idle:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn refusals() {
    for over_rest in [false, true] {
        let data = empty_folder();
        let service = Launch::at(data.path()).start();
        if over_rest {
            what_is_wrong_is_refused(&service.rest()).await;
        } else {
            what_is_wrong_is_refused(&service.grpc()).await;
        }
    }
}

/// A robot that is online is told where it really is.
#[tokio::test(flavor = "multi_thread")]
async fn online_robots_are_corrected_and_go_on() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    let door = service.grpc();
    let drive = LandmarkLoop::around_the_block();
    let session = driven_around(&door, "block", &drive).await;
    let n_batches = drive.batches(50).len() as u64;
    eventually("all is mapped", || async {
        let now = door.session(&session.id).await.expect("it was opened");
        (now.mapped_through == n_batches).then_some(())
    })
    .await;
    let watch = v1::WatchMapRequest { map: "block".into() };
    let mut watched = door.maps.clone().watch_map(watch).await.expect("a stream").into_inner();
    let job = door.start_job(relax("block")).await.expect("a job").id;
    let last = drive.truth[drive.truth.len() - 1];
    let corrected = loop {
        let seen = watched.message().await.expect("it stands").expect("it stands");
        if let Some(Seen::Correction(told)) = seen.kind {
            break told.correction.and_then(|told| told.map_from_robot).expect("a pose");
        }
    };
    let at = Pose::new(corrected.x_m, corrected.y_m, corrected.theta_rad);
    let off_m = last.step_to(at).distance_m();
    assert!(off_m < ERROR_MAX_M, "{off_m} m from where it is: {at:?}");
    assert!(job_done(&door, &job).await.error.is_none(), "it ends well");

    // It drives on by a metre: odometry is chained to where it was found to be.
    let odometry = drive.odometry[drive.odometry.len() - 1];
    let stamp_ns = crate::drive::START_NS + 3600 * crate::drive::SECOND_NS;
    let turned = Pose::new(0.0, 0.0, std::f64::consts::FRAC_PI_2);
    let onwards = odometry * turned * Pose::new(1.0, 0.0, 0.0);
    let sighting = v1::LandmarkSighting { landmark_type: "door".into(), ..Default::default() };
    let observations = vec![
        crate::drive::observation(stamp_ns, "", crate::drive::odometry_pose(onwards)),
        crate::drive::observation(
            stamp_ns,
            BUTTON,
            v1::observation::Kind::LandmarkSighting(sighting),
        ),
    ];
    send(&door, &session, &[v1::Batch { number: n_batches + 1, observations }]).await;
    finished(&door, &session).await;
    let after = trajectory(&door, &session.id, 0).await;
    let end = poses(&after).last().expect("poses");
    let expected = last * turned * Pose::new(1.0, 0.0, 0.0);
    let off_m = expected.step_to(end).distance_m();
    assert!(off_m < 2.0 * ERROR_MAX_M, "{off_m} m from where it drove: {end:?}");
}

/// Where scans say to centimetres where the robot was, sightings leave it so; landmarks lie where it saw
/// them from there.
#[tokio::test(flavor = "multi_thread")]
async fn scans_and_sightings_together() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    let door = service.grpc();
    let drive = SimulatedDrive::through_the_hall(5);
    door.create_map("hall", 0.05).await.expect("a new map");
    let sensors = [drive.sensor.clone(), SimulatedDrive::beacon_detector()];
    let session = opened(&door, opening("hall", "rover", &sensors)).await;
    send(&door, &session, &drive.batches_with_beacons(20)).await;
    let session = finished(&door, &session).await;
    let before = door.version("hall", session.complete_in_version).await.expect("it is there");
    let job = door.start_job(relax("hall")).await.expect("a job").id;
    let job = job_done(&door, &job).await;
    assert_eq!(job.state, i32::from(v1::JobState::Succeeded), "{job:?}");
    let after = door.version("hall", job.result_version).await.expect("it is there");
    assert_eq!(before.scans, after.scans, "every scan again: {before:?} {after:?}");
    let n_free = async |version| {
        let cells = door.grid("hall", version, None).await.expect("a grid").cells;
        cells.into_iter().filter(|cell| *cell <= 30).count()
    };
    let (old, new) = (n_free(before.number).await, n_free(after.number).await);
    assert!(old.abs_diff(new) < old / 10, "the same hall: {old} and {new} free cells");
    let relaxed = trajectory(&door, &session.id, after.number).await;
    assert_eq!(relaxed.origin, i32::from(v1::TrajectoryOrigin::Relaxation), "by known poses");
    let (error_m, odometry_m) = drive.mean_errors_m_of_scans(&relaxed);
    assert!(error_m < 0.05, "{error_m} m, {odometry_m} m by odometry");
    let (landmarks, _) = door.landmarks("hall", 0, FIRST_PAGE).await.expect("a version");
    assert_eq!(landmarks.len(), 3, "a beacon each: {landmarks:?}");
    for landmark in &landmarks {
        let at = landmark.position.expect("a position");
        let off_m = drive.beacon_error_m(landmark.identity.as_deref(), Point2::new(at.x_m, at.y_m));
        assert!(off_m < 0.1, "{off_m} m off: {landmark:?}");
        assert_eq!(landmark.source, i32::from(v1::LandmarkSource::Detector), "{landmark:?}");
    }
    let graph = door.graph("hall", 0, v1::GraphPruning::Unspecified, false).await;
    assert!(!graph.expect("a graph").regions.is_empty(), "and its regions");
}

/// The command shows how it went.
#[tokio::test(flavor = "multi_thread")]
async fn by_command() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    let door = service.grpc();
    let session = driven_around(&door, "block", &LandmarkLoop::around_the_block()).await;
    finished(&door, &session).await;
    let url = format!("http://127.0.0.1:{}", service.port());
    let arguments = ["relax", "--map", "block", "--server", &url];
    let ran = async |more: &'static [&str]| {
        let mut command = meetpoint(&arguments);
        command.args(more);
        let output = tokio::task::spawn_blocking(move || command.output()).await;
        output.expect("it runs").expect("it ends")
    };
    let told = ran(&[]).await;
    let text = String::from_utf8_lossy(&told.stdout).into_owned();
    assert!(told.status.success(), "{text} {}", String::from_utf8_lossy(&told.stderr));
    assert!(text.contains("8 landmarks") && text.contains('█'), "figures and a curve: {text}");
    let told = ran(&["--json", "--forget-identities", "--priority", "-3"]).await;
    let json: serde_json::Value = serde_json::from_slice(&told.stdout).expect("JSON");
    assert_eq!(json["map"], "block", "{json}");
    assert!(json["sessions"][0]["log_likelihoods"][0]["values"].is_array(), "{json}");
    let detached = ran(&["--detach"]).await;
    let text = String::from_utf8_lossy(&detached.stdout).into_owned();
    let id = text.trim().strip_prefix("job ").expect("its id").to_owned();
    assert!(job_done(&door, &id).await.done, "it ends by itself");
    let wrong = meetpoint(&["relax", "--map", "nowhere", "--server", &url]).output();
    assert!(!wrong.expect("it ends").status.success(), "no such map");
}
