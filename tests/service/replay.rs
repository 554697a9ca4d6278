//! The commands: logs replayed, interrupted and resumed; maps and trajectories saved.

use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::{Output, Stdio};

use meetpoint_client::v1;
use meetpoint_geometry::Pose;
use meetpoint_sim::Tick;
use serde_json::Value;

use crate::door::{Door, FIRST_PAGE, eventually};
use crate::drive::{SECOND_NS, START_NS, SimulatedDrive};
use crate::running::{Launch, Running, empty_folder, meetpoint, signal};

/// CARMEN's ways to log a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Dialect {
    /// `FLASER`, with the odometry in the line.
    Old,
    /// `RAWLASER1`, with the odometry in `ODOM` lines.
    Raw,
    /// `ROBOTLASER1`, with the poses of laser and robot.
    Robot,
}

/// A log of a drive.
fn log(drive: &SimulatedDrive, dialect: Dialect) -> String {
    let mut text =
        String::from("# CARMEN Logfile, simulated\nPARAM laser_front_laser_resolution 1\n");
    for tick in &drive.ticks {
        // Writing to a string cannot fail.
        let _ = match dialect {
            Dialect::Old => old_line(&mut text, tick),
            Dialect::Raw => raw_lines(&mut text, tick),
            Dialect::Robot => robot_line(&mut text, tick),
        };
    }
    text
}

/// The logger's clock, seconds from its start with microseconds.
fn trailer(tick: &Tick) -> String {
    let since_ns = tick.stamp_ns - START_NS;
    let stamp = format!("{}.{:06}", since_ns / SECOND_NS + 1, since_ns % SECOND_NS / 1000);
    format!("{stamp} robot {stamp}")
}

fn ranges(scan: &[f32]) -> String {
    let words: Vec<String> = scan.iter().map(|range_m| format!("{range_m:.3}")).collect();
    format!("{} {}", scan.len(), words.join(" "))
}

fn words(Pose { x_m, y_m, theta_rad }: Pose) -> String {
    format!("{x_m:.6} {y_m:.6} {theta_rad:.6}")
}

fn old_line(text: &mut String, tick: &Tick) -> std::fmt::Result {
    let Some(scan) = &tick.scan else { return Ok(()) };
    let odometry = words(tick.odometry);
    writeln!(text, "FLASER {} {odometry} {odometry} {}", ranges(scan), trailer(tick))
}

fn raw_lines(text: &mut String, tick: &Tick) -> std::fmt::Result {
    writeln!(text, "ODOM {} 0.5 0.0 0.0 {}", words(tick.odometry), trailer(tick))?;
    let Some(scan) = &tick.scan else { return Ok(()) };
    let geometry = "0 -1.570796 3.141593 0.017453 20.0 0.01 0";
    writeln!(text, "RAWLASER1 {geometry} {} 0 {}", ranges(scan), trailer(tick))
}

fn robot_line(text: &mut String, tick: &Tick) -> std::fmt::Result {
    let Some(scan) = &tick.scan else { return Ok(()) };
    let geometry = "0 -1.570796 3.141593 0.017453 20.0 0.01 0";
    let laser = words(tick.odometry * Pose::new(0.1, 0.0, 0.0));
    let robot = words(tick.odometry);
    let settings = "0.5 0.0 0.3 0.3 1000000.0";
    writeln!(
        text,
        "ROBOTLASER1 {geometry} {} 0 {laser} {robot} {settings} {}",
        ranges(scan),
        trailer(tick)
    )
}

/// A command against a service.
pub(crate) fn run(service: &Running, arguments: &[&str]) -> Output {
    let url = service.url();
    let arguments = [arguments, &["--server", &url]].concat();
    meetpoint(&arguments).output().expect("the binary under test starts")
}

/// What a command printed, and how it ended.
pub(crate) fn told(output: &Output) -> String {
    format!(
        "{}: {}{}",
        output.status,
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    )
}

/// Replays a file, which has to succeed: what it reported.
fn replayed(service: &Running, file: &Path, map: &str) -> Value {
    let file = file.to_string_lossy();
    let output = run(service, &["replay", &file, "--map", map, "--json"]);
    assert!(output.status.success(), "{}", told(&output));
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {output:?}"))
}

async fn only_session(service: &Running, map: &str) -> v1::Session {
    let (mut sessions, _) = service.grpc().sessions(map, FIRST_PAGE).await.expect("a page");
    assert_eq!(sessions.len(), 1, "one run, one session");
    sessions.remove(0)
}

#[tokio::test(flavor = "multi_thread")]
async fn every_dialect_twice() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    let drive = SimulatedDrive::through_the_hall(12);
    let n_scans = drive.n_scans() as u64;
    for (dialect, map) in [(Dialect::Old, "old"), (Dialect::Raw, "raw"), (Dialect::Robot, "robot")]
    {
        let file = data.path().join(format!("{map}.log"));
        fs::write(&file, log(&drive, dialect)).expect("there is room");
        let report = replayed(&service, &file, map);
        let session = only_session(&service, map).await;
        assert_eq!(session.scans, n_scans, "{dialect:?}: every scan, {report}");
        assert_eq!(session.rejected, 0, "{dialect:?}: {report}");
        assert!(0 < session.complete_in_version, "{dialect:?}: in a version, {report}");
        assert!(!session.lost, "{dialect:?}: {report}");
        let versions = service.grpc().map(map).await.expect("it was made").latest_version;

        let again = replayed(&service, &file, map);
        assert_eq!(only_session(&service, map).await.id, session.id, "the same session: {again}");
        let now = service.grpc().map(map).await.expect("it is there").latest_version;
        assert_eq!(versions, now, "{dialect:?}: nothing was left to do, {again}");
    }
    gzipped(&service, &data.path().join("old.log"));
}

/// The same log, gzipped, is the same recording.
fn gzipped(service: &Running, file: &Path) {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    std::io::Write::write_all(&mut encoder, &fs::read(file).expect("it was written"))
        .expect("it grows");
    let zipped = file.with_extension("log.gz");
    fs::write(&zipped, encoder.finish().expect("it grows")).expect("there is room");
    let report = replayed(service, &zipped, "old");
    assert_eq!(report["session"].as_str().map(str::len), Some(36), "{report}");
}

/// Stopped in the middle, by Ctrl-C and by SIGKILL: the same command goes on from there, and ends
/// with the same map.
#[tokio::test(flavor = "multi_thread")]
async fn interrupted_and_resumed() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    let drive = SimulatedDrive::through_the_hall(13);
    let file = data.path().join("hall.log");
    fs::write(&file, log(&drive, Dialect::Old)).expect("there is room");
    let expected = replayed(&service, &file, "undisturbed");
    let n_scans = drive.n_scans() as u64;
    let mut acked = 0;
    for stop in ["INT", "KILL"] {
        let (url, path) = (service.url(), file.to_string_lossy());
        // Real time: it cannot be over before it is stopped.
        let arguments = ["replay", &path, "--map", "disturbed", "--rate", "2x", "--server", &url];
        // The same robot may not be on two maps at once.
        let arguments = [&arguments[..], &["--robot", "other"]].concat();
        let mut child = meetpoint(&arguments)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("the binary under test starts");
        let door = service.grpc();
        acked = eventually("more acknowledged batches", || async {
            let (sessions, _) = door.sessions("disturbed", FIRST_PAGE).await.ok()?;
            let now = sessions.first()?.acked_through;
            (acked < now).then_some(now)
        })
        .await;
        signal(&child, stop);
        let status = child.wait().expect("it was started");
        assert!(!status.success(), "it is not done: {status}");
    }
    let before = only_session(&service, "disturbed").await;
    assert!(before.scans < n_scans, "it was stopped in the middle: {before:?}");
    let path = file.to_string_lossy();
    let output = run(&service, &["replay", &path, "--map", "disturbed", "--robot", "other"]);
    assert!(output.status.success(), "{}", told(&output));
    let after = only_session(&service, "disturbed").await;
    assert_eq!((&after.id, after.scans), (&before.id, n_scans), "it went on: {expected}");
    let door = service.grpc();
    let grids = [
        door.grid("undisturbed", 0, None).await.expect("a grid"),
        door.grid("disturbed", 0, None).await.expect("a grid"),
    ];
    assert!(grids[0].cells == grids[1].cells, "the same map, bit for bit");
}

#[tokio::test(flavor = "multi_thread")]
async fn maps_and_trajectories_are_saved() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    let drive = SimulatedDrive::through_the_hall(14);
    let log_file = data.path().join("hall.log");
    fs::write(&log_file, log(&drive, Dialect::Old)).expect("there is room");
    replayed(&service, &log_file, "hall");
    let out = empty_folder();
    let at = |name: &str| out.path().join(name).to_string_lossy().into_owned();

    let saved = run(&service, &["map", "hall", "--format", "pgm", "-o", &at("hall.pgm")]);
    assert!(saved.status.success(), "{}", told(&saved));
    let http = service.http();
    let pgm = fs::read(at("hall.pgm")).expect("it was written");
    assert!(pgm == http.get("/v1/maps/hall/grid?format=pgm").body, "the image that REST gives");
    let yaml = fs::read(at("hall.yaml")).expect("it was written beside");
    assert_eq!(
        String::from_utf8_lossy(&yaml),
        http.get("/v1/maps/hall/grid?format=yaml").text(),
        "the description that REST gives"
    );
    for format in ["png", "npy"] {
        let name = at(&format!("hall.{format}"));
        let saved = run(&service, &["map", "hall", "--format", format, "-o", &name]);
        assert!(saved.status.success(), "{}", told(&saved));
        assert!(fs::metadata(&name).is_ok_and(|file| 100 < file.len()), "{name} is there");
    }
    let drawn = run(&service, &["map", "hall"]);
    assert!(drawn.status.success() && 20 < told(&drawn).lines().count(), "{}", told(&drawn));

    let tum = at("hall.tum");
    let saved = run(&service, &["trajectory", "latest", "--map", "hall", "-o", &tum]);
    assert!(saved.status.success(), "{}", told(&saved));
    let text = fs::read_to_string(&tum).expect("it was written");
    assert_eq!(text.lines().count(), drive.n_scans(), "a line a scan");
    assert!(text.lines().all(|line| line.split(' ').count() == 8), "t x y z qx qy qz qw");

    let rebuilt = run(&service, &["rebuild", "hall", "--json"]);
    assert!(rebuilt.status.success(), "{}", told(&rebuilt));
    let again = run(&service, &["map", "hall", "--format", "pgm", "-o", &at("again.pgm")]);
    assert!(again.status.success(), "{}", told(&again));
    assert!(pgm == fs::read(at("again.pgm")).expect("it was written"), "rebuilt to the same bits");
}

/// What cannot be done ends with 1 and says why; wrong usage with 2.
#[test]
fn refusals_of_commands() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    let missing = data.path().join("none.log");
    let empty = data.path().join("empty.log");
    fs::write(&empty, "# nothing\nODOM 0 0 0 0 0 0 1.0 h 1.0\n").expect("there is room");
    for (arguments, word) in [
        (vec!["map", "nowhere"], "no map `nowhere`"),
        (vec!["trajectory", "latest", "--map", "nowhere"], "nowhere"),
        (vec!["rebuild", "nowhere"], "no map `nowhere`"),
        (vec!["replay", &missing.to_string_lossy(), "--map", "m"], "none.log"),
        (vec!["replay", &empty.to_string_lossy(), "--map", "m"], "no laser scan"),
    ] {
        let output = run(&service, &arguments);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {}", told(&output));
        assert!(told(&output).contains(word), "{arguments:?}: {}", told(&output));
    }
    let usage = run(&service, &["replay"]);
    assert_eq!(usage.status.code(), Some(2), "{}", told(&usage));
    let url = service.url();
    service.stop();
    let away = meetpoint(&["map", "hall", "--server", &url]).output().expect("it starts");
    assert_eq!(away.status.code(), Some(1), "{}", told(&away));
}

/// The demo: from nothing to a map, nearer to the truth than the wheels alone, a robot that has to be
/// found, and a site that is kept.
#[tokio::test(flavor = "multi_thread")]
async fn the_demo() {
    let folder = empty_folder();
    let site = folder.path().join("site");
    let shown = site.to_string_lossy();
    let demo = ["demo", "--exit", "--port", "0", "--data", &shown];
    let output = meetpoint(&demo).output().expect("the binary under test starts");
    assert!(output.status.success(), "{}", told(&output));
    let text = told(&output);
    for words in ["wheels alone", "on the map", "robot-2", "robot-3", "office.png", "/docs"] {
        assert!(text.contains(words), "no `{words}` in {text}");
    }
    assert!(
        fs::read(site.join("office.png")).is_ok_and(|png| png.starts_with(b"\x89PNG")),
        "drawn"
    );
    let service = Launch::at(&site).start();
    let (sessions, _) = service.grpc().sessions("office", FIRST_PAGE).await.expect("a page");
    assert_eq!(sessions.len(), 3, "two robots, and one that was found");
    assert!(sessions.iter().all(|session| session.map_from_session.is_some()), "{sessions:?}");
    assert!(sessions.iter().all(|session| 0 < session.complete_in_version), "{sessions:?}");
}
