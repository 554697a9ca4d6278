//! Relaxation by scans as a job: a drive around a block with odometry that drifts is put right by the
//! places that it comes back to; what was taken for the same place can be looked at and switched off.

use std::path::Path;

use meetpoint_client::v1;
use meetpoint_storage::{MapId, PoseRecord};

use crate::door::{Door, finished, job_done, refused};
use crate::drive::{SimulatedDrive, driven, opened, opening, send};
use crate::interrupted_jobs::{copied, seen_busily};
use crate::kept::{kept, store};
use crate::relaxing::{relax, relax_with, trajectory};
use crate::running::{Launch, empty_folder, meetpoint};

/// Mean distance from the truth that a relaxed drive may have, in metres: its odometry is metres off.
const ERROR_MAX_M: f64 = 0.1;
const MAP: &str = "ring";
/// Shares of the work at which the service is killed.
const KILLED_AT: [f64; 5] = [0.0, 0.35, 0.5, 0.7, 0.8];
/// A job that rests twenty times as long as it works, while anybody asks for anything.
const SHARE_OF_A_SLOWED_JOB: f64 = 0.05;

/// Makes the map by the drive. The session is closed, and all of it mapped.
pub(crate) async fn mapped<D: Door>(door: &D, drive: &SimulatedDrive) -> v1::Session {
    let session = driven(door, MAP, drive, &drive.batches(40)).await;
    finished(door, &session).await
}

fn listing(session: &str, verdict: v1::ClosureVerdict) -> v1::ListClosuresRequest {
    let (map, session) = (MAP.to_owned(), session.to_owned());
    v1::ListClosuresRequest { map, session, verdict: verdict.into(), ..Default::default() }
}

async fn relaxed<D: Door>(door: &D) -> v1::Job {
    let job = door.start_job(relax(MAP)).await.expect("a job").id;
    let job = job_done(door, &job).await;
    assert_eq!(job.state, i32::from(v1::JobState::Succeeded), "{job:?}");
    job
}

/// Opens a session of another robot where it starts, sends a drive, and waits until it is mapped.
async fn mapped_too<D: Door>(door: &D, drive: &SimulatedDrive, start: v1::Pose) -> v1::Session {
    let request = opening(MAP, "second", std::slice::from_ref(&drive.sensor));
    let start = Some(v1::Start { kind: Some(v1::start::Kind::Known(start)) });
    let session = opened(door, v1::OpenSessionRequest { start, ..request }).await;
    send(door, &session, &drive.batches(40)).await;
    finished(door, &session).await
}

/// What a job tells of its only session.
fn told(job: &v1::Job) -> v1::RelaxedSession {
    let Some(v1::job::Result::RelaxResult(v1::RelaxResult { sessions })) = &job.result else {
        panic!("no result: {job:?}")
    };
    let [session] = sessions.as_slice() else { panic!("one session: {sessions:?}") };
    session.clone()
}

fn figures_are_told(job: &v1::Job, drive: &SimulatedDrive) -> v1::ScanRelaxation {
    let found = told(job);
    assert_eq!(found.method, i32::from(v1::RelaxMethod::Scans), "{found:?}");
    let scans = found.scans.expect("they are told");
    assert_eq!(scans.scans as usize, drive.n_scans(), "all of them");
    let (before, after) = (scans.before.expect("told"), scans.after.expect("told"));
    let v1::Pose { x_m, y_m, theta_rad } = scans.lasers_moved.expect("there is odometry");
    assert!(x_m.hypot(y_m) < 0.03 && theta_rad.abs() < 0.01, "it sits where declared: {scans:?}");
    assert!(0 < after.cells && after.entropy_bits <= before.entropy_bits * 1.05, "{scans:?}");
    assert!(1 < job.log.iter().filter(|line| line.figures.is_some()).count(), "stages: {job:?}");
    scans
}

/// Moments, verdict and residual of every closure, by id.
async fn ledger<D: Door>(door: &D, session: &str) -> Vec<v1::Closure> {
    let all = listing(session, v1::ClosureVerdict::Unspecified);
    let (mut closures, mut page_token) = (Vec::new(), String::new());
    loop {
        let request = v1::ListClosuresRequest { page_size: 3, page_token, ..all.clone() };
        let (page, next) = door.closures(request).await.expect("a page");
        assert!(page.len() <= 3, "at most so many");
        closures.extend(page);
        if next.is_empty() {
            return closures;
        }
        page_token = next;
    }
}

async fn the_ledger_is_listed<D: Door>(
    door: &D,
    job: &v1::Job,
    scans: &v1::ScanRelaxation,
) -> Vec<v1::Closure> {
    let session = told(job).session;
    let all = ledger(door, &session).await;
    let n_considered = scans.closures_accepted + scans.closures_refused;
    assert_eq!(all.len(), n_considered as usize, "each of them once");
    assert!(
        all.iter().all(|one| one.job == job.id && one.from_time_ns < one.to_time_ns),
        "{all:?}"
    );
    let is_own = |one: &v1::Closure| one.from_session == session && one.to_session == session;
    assert!(all.iter().all(|one| one.map == MAP && is_own(one)), "whose they are");
    let request = listing("", v1::ClosureVerdict::Accepted);
    let (accepted, _) = door.closures(request).await.expect("a page");
    assert_eq!(accepted.len(), scans.closures_accepted as usize, "by verdict");
    let request = listing(&session, v1::ClosureVerdict::Refused);
    let (doubtful, _) = door.closures(request).await.expect("a page");
    assert_eq!(doubtful.len(), scans.closures_refused as usize, "by verdict");
    assert!(doubtful.iter().all(|one| one.refusal != 0), "and why: {doubtful:?}");
    accepted
}

/// Relaxed, looked at, a closure switched off and the map relaxed without it, and with it again.
async fn a_ring_is_closed<D: Door>(door: &D) {
    let drive = SimulatedDrive::around_the_block(3);
    let session = mapped(door, &drive).await;
    refused(door.closures(v1::ListClosuresRequest::default()).await, "MAP_NOT_FOUND");
    assert_eq!(ledger(door, &session.id).await, [], "nobody has looked for any");
    let job = relaxed(door).await;
    let scans = figures_are_told(&job, &drive);
    assert!(0 < scans.closures_accepted, "it comes back to where it was: {scans:?}");
    let after = trajectory(door, &session.id, 0).await;
    assert_eq!(after.origin, i32::from(v1::TrajectoryOrigin::Relaxation), "repaired");
    let (error_m, odometry_m) = drive.mean_errors_m(&after);
    assert!(error_m < ERROR_MAX_M && 1.0 < odometry_m, "{error_m} m, {odometry_m} m by odometry");
    let accepted = the_ledger_is_listed(door, &job, &scans).await;

    let doubted = &accepted[0];
    let off = door.switch_closure(MAP, &doubted.id, true).await.expect("it is there");
    assert!(off.switched_off && off.relax_needed, "the map rests on it: {off:?}");
    let again = door.switch_closure(MAP, &doubted.id, true).await.expect("it is there");
    assert_eq!(again, off, "nothing more");
    let without = relaxed(door).await;
    let now = ledger(door, &session.id).await;
    let found = now.iter().find(|one| one.id == doubted.id).expect("it stays in the ledger");
    assert!(found.switched_off && !found.relax_needed, "the map does without it: {found:?}");
    assert_eq!(found.verdict, i32::from(v1::ClosureVerdict::Refused), "{found:?}");
    assert_eq!(found.refusal, i32::from(v1::ClosureRefusal::SwitchedOff), "{found:?}");
    assert!(
        told(&without).scans.expect("told").closures_refused > scans.closures_refused,
        "one more"
    );

    let on = door.switch_closure(MAP, &doubted.id, false).await.expect("it is there");
    assert!(!on.switched_off && on.relax_needed, "the map was drawn without it: {on:?}");
    let with = relaxed(door).await;
    assert_eq!(told(&with), told(&job), "as the first time");
    assert_eq!(trajectory(door, &session.id, 0).await.poses, after.poses, "bit for bit");
    let nobody = "0199d3a6-6ac5-7c4e-9d51-2d9a3f1f3c11";
    refused(door.switch_closure(MAP, nobody, true).await, "CLOSURE_NOT_FOUND");
    refused(door.switch_closure(MAP, "none", true).await, "INVALID_FIELD");
    refused(door.switch_closure("nowhere", &doubted.id, true).await, "MAP_NOT_FOUND");
}

#[tokio::test(flavor = "multi_thread")]
async fn over_grpc() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    a_ring_is_closed(&service.grpc()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn over_rest() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    a_ring_is_closed(&service.rest()).await;
}

/// What a job leaves: poses, number of tiles, and the ledger without the job's id.
async fn left(data: &Path, session: &str) -> (Vec<PoseRecord>, usize, Vec<v1::Closure>) {
    let kept = kept(data, MAP, session).await;
    let service = Launch::at(data).start();
    let mut closures = ledger(&service.grpc(), session).await;
    for closure in &mut closures {
        closure.job = String::new();
    }
    service.stop();
    (kept.poses, kept.tiles.len(), closures)
}

/// Wherever a job is killed, it ends the same, bit for bit; and it decides once.
#[tokio::test(flavor = "multi_thread")]
async fn killed_at_any_moment() {
    let (data, other) = (empty_folder(), empty_folder());
    let service = Launch::at(data.path()).start();
    let session = mapped(&service.grpc(), &SimulatedDrive::around_the_block(3)).await;
    service.stop();
    copied(data.path(), other.path());
    let service = Launch::at(other.path()).start();
    relaxed(&service.grpc()).await;
    service.stop();
    let expected = left(other.path(), &session.id).await;

    let slowly = || Launch::at(data.path()).setting("jobs.cpu_share", SHARE_OF_A_SLOWED_JOB);
    let mut service = slowly().start();
    let job = service.grpc().start_job(relax(MAP)).await.expect("a job").id;
    let mut n_under_way = 0;
    for share in KILLED_AT {
        let now = seen_busily(&service.grpc(), &job, |now| now.done || share <= now.progress).await;
        n_under_way += usize::from(!now.done);
        service.kill();
        service = slowly().start();
    }
    let ended = job_done(&service.grpc(), &job).await;
    assert_eq!(ended.state, i32::from(v1::JobState::Succeeded), "{ended:?}");
    assert!(0 < n_under_way, "at least one kill while it ran");
    service.stop();
    let found = left(data.path(), &session.id).await;
    assert!(found.0 == expected.0 && found.1 == expected.1, "the same bits");
    assert_eq!(found.2, expected.2, "the same closures");
    let store = store(data.path()).await;
    let map = MapId(MAP.to_owned());
    let end = store.journal_end(&map).await.expect("reading works");
    let decisions = store.relaxations(&map, end).await.expect("reading works");
    assert_eq!(decisions.len(), 1, "decided once");
}

/// Two robots on one map, the second not quite where it says: both are put right together, by what both
/// saw; and what was seen by one and the other is in the ledger of each.
async fn two_robots_make_one_map<D: Door>(door: &D) {
    let drives = [SimulatedDrive::around_the_block(3), SimulatedDrive::around_the_block(8)];
    let first = mapped(door, &drives[0]).await;
    let start = v1::Pose { x_m: 0.3, y_m: -0.2, theta_rad: 0.05 };
    let second = mapped_too(door, &drives[1], start).await;
    let mut live_m = [0.0; 2];
    for (live_m, (session, drive)) in live_m.iter_mut().zip([&first, &second].iter().zip(&drives)) {
        *live_m = drive.mean_errors_m(&trajectory(door, &session.id, 0).await).0;
    }
    let job = relaxed(door).await;
    let Some(v1::job::Result::RelaxResult(v1::RelaxResult { sessions })) = &job.result else {
        panic!("no result: {job:?}")
    };
    let [of_first, of_second] = sessions.as_slice() else { panic!("two sessions: {sessions:?}") };
    assert_eq!(of_first.together_with, [second.id.as_str()], "with one another");
    assert_eq!(of_second.together_with, [first.id.as_str()], "with one another");
    for (found, (drive, live_m)) in sessions.iter().zip(drives.iter().zip(live_m)) {
        let after = trajectory(door, &found.session, 0).await;
        assert_eq!(after.origin, i32::from(v1::TrajectoryOrigin::Relaxation), "repaired");
        let (error_m, _) = drive.mean_errors_m(&after);
        assert!(error_m < ERROR_MAX_M && error_m < live_m, "{error_m} m, live {live_m} m");
    }
    let between = |one: &&v1::Closure| one.from_session == first.id && one.to_session == second.id;
    let of_first = ledger(door, &first.id).await;
    let of_second = ledger(door, &second.id).await;
    let n_between = of_first.iter().filter(between).count();
    assert!(0 < n_between, "what both saw: {of_first:?}");
    assert_eq!(of_second.iter().filter(between).count(), n_between, "in the ledger of each");
    assert!(job.log.iter().any(|line| line.text.contains("relaxed together")), "told: {job:?}");

    // Named, a session is relaxed without the others, which stay where they are.
    let before = trajectory(door, &first.id, 0).await;
    let named = v1::RelaxParams { sessions: vec![second.id.clone()], ..Default::default() };
    let job = door.start_job(relax_with(MAP, named)).await.expect("a job").id;
    let job = job_done(door, &job).await;
    assert_eq!(told(&job).session, second.id, "by itself: {job:?}");
    assert_eq!(trajectory(door, &first.id, 0).await.poses, before.poses, "the other one stayed");
}

#[tokio::test(flavor = "multi_thread")]
async fn two_robots_over_grpc() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    two_robots_make_one_map(&service.grpc()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn two_robots_over_rest() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    two_robots_make_one_map(&service.rest()).await;
}

/// Of sessions whose scans do not fit into memory together the later ones are left out, by name.
#[tokio::test(flavor = "multi_thread")]
async fn what_does_not_fit_is_left_out() {
    let drive = SimulatedDrive::through_the_hall(4);
    let n_bytes = drive.ticks.iter().filter_map(|tick| tick.scan.as_ref());
    let n_bytes: usize = n_bytes.map(|ranges_m| size_of_val(ranges_m.as_slice())).sum();
    let data = empty_folder();
    let service = Launch::at(data.path()).setting("jobs.scans_bytes_max", n_bytes * 3 / 2).start();
    let door = service.grpc();
    let first = mapped(&door, &drive).await;
    let second = mapped_too(&door, &drive, v1::Pose::default()).await;
    let job = relaxed(&door).await;
    assert_eq!(told(&job).session, first.id, "the first alone");
    let is_told =
        |line: &v1::JobLogLine| line.text.contains(&second.id) && line.text.contains("left out");
    assert!(job.log.iter().any(is_told), "which is told: {job:?}");
}

/// More scans than a job may keep in memory are refused by name.
#[tokio::test(flavor = "multi_thread")]
async fn too_many_scans_are_refused() {
    let data = empty_folder();
    let service = Launch::at(data.path()).setting("jobs.scans_bytes_max", 50_000).start();
    let door = service.grpc();
    let session = mapped(&door, &SimulatedDrive::through_the_hall(4)).await;
    let job = door.start_job(relax(MAP)).await.expect("a job").id;
    let job = job_done(&door, &job).await;
    let error = job.error.expect("it cannot be done");
    assert_eq!(error.code, "CANNOT_RELAX", "{error:?}");
    assert!(error.message.contains(&session.id), "which session: {error:?}");
}

/// The commands show what was taken for the same place, and switch it.
#[tokio::test(flavor = "multi_thread")]
async fn by_command() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    let door = service.grpc();
    mapped(&door, &SimulatedDrive::around_the_block(3)).await;
    let url = format!("http://127.0.0.1:{}", service.port());
    let ran = async |arguments: Vec<String>| {
        let mut command = meetpoint(&[]);
        command.args(arguments).args(["--server", &url]);
        let output = tokio::task::spawn_blocking(move || command.output()).await;
        let output = output.expect("it runs").expect("it ends");
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{text} {error}");
        text
    };
    let words = |line: &str| line.split_whitespace().map(str::to_owned).collect::<Vec<String>>();
    let text = ran(words("relax --map ring")).await;
    assert!(text.contains("closures accepted and") && text.contains("bits"), "{text}");
    let (closures, _) = door.closures(listing("", v1::ClosureVerdict::Accepted)).await.expect("ok");
    let id = &closures[0].id;
    let text = ran(words("closures --map ring")).await;
    assert!(text.contains(id) && text.contains("accepted"), "{text}");
    let text = ran(words(&format!("closures --map ring --off {id}"))).await;
    assert!(text.contains("meetpoint relax --map ring"), "what is to be done: {text}");
    let text = ran(words("closures --map ring --json")).await;
    let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let is_off = |one: &serde_json::Value| one["switched_off"] == true && one["id"] == **id;
    assert!(json["closures"].as_array().expect("a list").iter().any(is_off), "{json}");
    let text = ran(words(&format!("closures --map ring --on {id}"))).await;
    assert!(text.contains(id), "{text}");
}
