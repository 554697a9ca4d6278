//! MRCLAM folders: replayed through the real binary, robot by robot.

use std::fmt::Write as _;
use std::fs;
use std::io::Write as _;
use std::path::Path;

use flate2::{Compression, write::GzEncoder};
use meetpoint_client::v1;
use serde_json::Value;

use crate::door::{Door, FIRST_PAGE};
use crate::replay::{run, told};
use crate::running::{Launch, Running, empty_folder};

/// When both robots begin, by their clocks, in milliseconds.
const START_MS: i64 = 1_248_000_000_000;
/// Whose the barcodes are: two robots, three landmarks.
const BARCODES: &str = "# Subject #    Barcode #\n 1 \t 5\n 2 \t 14\n 6 \t 63\n 7 \t 81\n 8 \t 7\n";
/// Robot 1 sees: a landmark; two in one picture; the other robot; a barcode that nothing bears; a
/// landmark, after a line that is none.
const MEASURED: &str = "# Time [s]    Subject #    range [m]    bearing [rad]\n\
    1248000001.050 \t 63 \t 3.787 \t -0.257\n\
    1248000003.500 \t 63 \t 2.500 \t -0.300\n\
    1248000003.500 \t 81 \t 4.100 \t 0.310\n\
    1248000004.000 \t 14 \t 1.000 \t 0.000\n\
    1248000004.500 \t 43 \t 1.000 \t 0.000\n\
    1248000005.000 \t 7 \t near \t 0.000\n\
    1248000007.050 \t 7 \t 5.000 \t 0.100\n";

/// Four seconds straight on at half a metre a second, then four of turning by a quarter radian each.
fn odometry() -> String {
    let mut text =
        String::from("# Time [s]    forward velocity [m/s]    angular velocity[rad/s]\n");
    for index in 0..=80 {
        let time_ms = START_MS + index * 100;
        let velocities = if index < 40 { "0.5 \t 0.0" } else { "0.0 \t 0.25" };
        let (seconds, thousandths) = (time_ms / 1000, time_ms % 1000);
        writeln!(text, "{seconds}.{thousandths:03} \t {velocities}").expect("text grows");
    }
    text
}

/// A folder of two robots; the second is gzipped and sees one landmark.
fn made_up(folder: &Path) {
    for (name, text) in [
        ("Barcodes.dat", BARCODES),
        ("Robot1_Odometry.dat", &odometry()),
        ("Robot1_Measurement.dat", MEASURED),
        ("Robot1_Groundtruth.dat", "nobody reads this"),
    ] {
        fs::write(folder.join(name), text).expect("there is room");
    }
    for (name, text) in [
        ("Robot2_Odometry.dat.gz", odometry()),
        ("Robot2_Measurement.dat.gz", "1248000002.000 81 2.000 0.100\n".to_owned()),
    ] {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(text.as_bytes()).expect("it grows");
        fs::write(folder.join(name), encoder.finish().expect("it grows")).expect("there is room");
    }
}

/// Replays a folder, which has to succeed: what was reported of each robot.
fn replayed(service: &Running, folder: &Path, map: &str, options: &[&str]) -> Vec<Value> {
    let folder = folder.to_string_lossy();
    let words = [&["replay", &folder, "--map", map, "--json"], options].concat();
    let output = run(service, &words);
    assert!(output.status.success(), "{}", told(&output));
    let lines = String::from_utf8_lossy(&output.stdout).into_owned();
    lines.lines().map(|line| serde_json::from_str(line).expect("a report a line")).collect()
}

async fn poses(service: &Running, report: &Value) -> Vec<(i64, v1::Pose)> {
    let session = report["session"].as_str().expect("a report names its session").to_owned();
    let request = v1::GetTrajectoryRequest { session, ..Default::default() };
    let (trajectory, _) = service.grpc().trajectory(request).await.expect("a trajectory");
    let pose = |pose: v1::TrajectoryPose| (pose.stamp_ns, pose.pose.expect("every one has a pose"));
    trajectory.poses.into_iter().map(pose).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn every_robot_becomes_a_session() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    let folder = data.path().join("Lab 6");
    fs::create_dir(&folder).expect("there is room");
    made_up(&folder);
    let reports = replayed(&service, &folder, "lab", &[]);
    let robots: Vec<_> = reports.iter().map(|report| report["robot"].as_str()).collect();
    assert_eq!(robots, [Some("lab-6-1"), Some("lab-6-2")], "{reports:?}");
    let first = &reports[0];
    assert_eq!(first["sightings"], 4, "of landmarks: {first}");
    assert_eq!(first["rejected"], 0, "two in one picture are no duplicates: {first}");
    assert_eq!(first["lines_skipped"]["sightings of other robots"], 1, "{first}");
    assert_eq!(first["lines_skipped"]["sightings of unknown barcodes"], 1, "{first}");
    assert_eq!(first["bad"][0]["file"], "Robot1_Measurement.dat", "{first}");
    assert_eq!(first["bad"][0]["line"], 7, "{first}");
    assert!(0 < first["map_version"].as_u64().unwrap_or(0), "all is in a version: {first}");

    let found = poses(&service, first).await;
    let since_start_ns = [1_050_000_000, 3_500_000_000, 3_500_000_001, 7_050_000_000];
    let stamps_ns: Vec<i64> = found.iter().map(|(stamp_ns, _)| *stamp_ns).collect();
    let expected = since_start_ns.map(|ns| START_MS * 1_000_000 + ns);
    assert_eq!(
        stamps_ns, expected,
        "as in the files, a nanosecond later for one more in a picture"
    );
    for ((_, pose), [x_m, theta_rad]) in
        found.iter().zip([[0.525, 0.0], [1.75, 0.0], [1.75, 0.0], [2.0, 0.7625]])
    {
        let off = [pose.x_m - x_m, pose.y_m, pose.theta_rad - theta_rad];
        assert!(off.iter().all(|off| off.abs() < 1e-6), "{pose:?}, not {x_m} m, {theta_rad} rad");
    }

    let (sessions, _) = service.grpc().sessions("lab", FIRST_PAGE).await.expect("a page");
    let placed: Vec<_> =
        sessions.iter().map(|session| session.map_from_session.is_some()).collect();
    assert_eq!(placed, [true, false], "nobody knows where the second begins: {sessions:?}");
    let again = replayed(&service, &folder, "lab", &[]);
    for (report, before) in again.iter().zip(&reports) {
        assert_eq!(report["session"], before["session"], "the same session");
        assert_eq!(report["was_done"], true, "nothing was left to do: {report}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn one_robot_a_part_and_nobody_known() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    made_up(data.path());
    let alone = ["--source-robot", "1", "--robot", "rover"];
    let whole = replayed(&service, data.path(), "lab", &alone);
    assert_eq!(whole.len(), 1, "one robot: {whole:?}");
    assert_eq!(whole[0]["robot"], "rover", "{whole:?}");
    let part = [&alone[..], &["--from", "2s", "--to", "4s"]].concat();
    let part = replayed(&service, data.path(), "part", &part);
    assert_eq!(part[0]["sightings"], 2, "one picture: {part:?}");
    assert_eq!(poses(&service, &part[0]).await.len(), 2, "only these are sent: {part:?}");
    let forgotten = [&alone[..], &["--anonymous-landmarks"]].concat();
    let forgotten = replayed(&service, data.path(), "lab", &forgotten);
    assert_ne!(forgotten[0]["session"], whole[0]["session"], "another recording: {forgotten:?}");
    assert_eq!(forgotten[0]["sightings"], 4, "as many: {forgotten:?}");
}

/// What cannot be done ends with 1, and says in which file, in which line, and what to do.
#[test]
fn folders_that_cannot_be_replayed() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    let folder = data.path().join("lab");
    fs::create_dir(&folder).expect("there is room");
    let replay = |options: &[&str]| {
        let folder = folder.to_string_lossy();
        let output = run(&service, &[&["replay", &folder, "--map", "lab"], options].concat());
        assert_eq!(output.status.code(), Some(1), "{options:?}: {}", told(&output));
        told(&output)
    };
    let words = replay(&[]);
    assert!(words.contains("is no MRCLAM folder: no Robot1_Odometry.dat"), "{words}");
    made_up(&folder);
    let words = replay(&["--source-robot", "3"]);
    assert!(words.contains("no robot 3 in it; there are 1, 2"), "{words}");
    let words = replay(&["--start", "0,0,0"]);
    assert!(words.contains("2 robots cannot begin at one pose"), "{words}");
    let nothing = "1248000001.050 14 3.0 0.1\n1248000001.150 63 3.0\n";
    fs::write(folder.join("Robot1_Measurement.dat"), nothing).expect("there is room");
    let words = replay(&[]);
    for part in [
        "no sighting of a landmark in",
        "sightings of other robots 1",
        "Robot1_Measurement.dat, line 2: 3 columns, must be 4",
    ] {
        assert!(words.contains(part), "no `{part}` in {words}");
    }
    fs::write(folder.join("Barcodes.dat"), "6 63\n7 63\n").expect("there is room");
    let words = replay(&[]);
    assert!(words.contains("Barcodes.dat: the barcode 63 stands in a line before"), "{words}");
}
