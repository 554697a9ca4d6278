//! Observations that cannot be used are kept, listed with their codes, and harm nothing else.

use std::f64::consts::PI;

use meetpoint_client::v1;
use meetpoint_geometry::Pose;
use v1::ingest_batch_request::Kind as Upload;
use v1::observation::Kind;

use crate::door::{Door, finished};
use crate::drive::{
    SECOND_NS, START_NS, laser_scan, observation, odometry_pose, opened, opening, pose,
};
use crate::running::{Launch, empty_folder};

/// Beams of the laser that the sessions declare.
const N_BEAMS: usize = 5;

fn sensors() -> Vec<v1::Sensor> {
    let laser = v1::LaserGeometry {
        angle_min_rad: -1.0,
        angle_increment_rad: 0.5,
        n_beams: 5,
        range_min_m: 0.1,
        range_max_m: 10.0,
    };
    let ring = v1::SonarRing {
        sensor_from_transducer: vec![pose(Pose::IDENTITY); 3],
        cone_angle_rad: 0.26,
        range_min_m: 0.1,
        range_max_m: 5.0,
    };
    let eye = v1::LandmarkDetector { range_max_m: 4.0, half_field_of_view_rad: 0.5 * PI };
    let sensor = |id: &str, kind| v1::Sensor {
        id: id.to_owned(),
        robot_from_sensor: None,
        kind: Some(kind),
    };
    vec![
        sensor("laser", v1::sensor::Kind::Laser(laser)),
        sensor("ring", v1::sensor::Kind::SonarRing(ring)),
        sensor("eye", v1::sensor::Kind::LandmarkDetector(eye)),
    ]
}

/// So many seconds after the start.
fn at(seconds: i64, sensor_id: &str, kind: Kind) -> v1::Observation {
    observation(START_NS + seconds * SECOND_NS, sensor_id, kind)
}

fn scan(range_m: f32, n_beams: usize) -> Kind {
    laser_scan(vec![range_m; n_beams])
}

fn sonar(range_m: f32, n: usize) -> Kind {
    Kind::SonarScan(v1::SonarScan { ranges_m: vec![range_m; n] })
}

fn mark(label: &str) -> Kind {
    Kind::Mark(v1::Mark { label: label.to_owned() })
}

fn sighting(range_m: f64, landmark_type: &str) -> Kind {
    Kind::LandmarkSighting(v1::LandmarkSighting {
        identity: Some("tag 7".into()),
        landmark_type: landmark_type.to_owned(),
        bearing_rad: Some(0.1),
        range_m: Some(range_m),
    })
}

fn velocity(forward_m_per_s: f64) -> Kind {
    Kind::OdometryVelocity(v1::OdometryVelocity { forward_m_per_s, ..Default::default() })
}

/// Observations that both protocols can tell, and what is said of each; empty for nothing.
fn judged() -> Vec<(v1::Observation, &'static str)> {
    let empty = v1::Observation { stamp_ns: START_NS, ..Default::default() };
    let far = Pose::new(1e9, 0.0, 0.0);
    let with_intensities =
        Kind::LaserScan(v1::LaserScan { ranges_m: vec![1.0; N_BEAMS], intensities: vec![1.0; 3] });
    let negative = observation(-1, "", mark("before 1970"));
    let mixed = [f32::NAN, f32::INFINITY, -3.0, 0.0, 2.0];
    vec![
        (at(1, "", odometry_pose(Pose::IDENTITY)), ""),
        (empty, "EMPTY_OBSERVATION"),
        (at(1, "nose", scan(1.0, N_BEAMS)), "UNKNOWN_SENSOR"),
        (at(1, "", scan(1.0, N_BEAMS)), "UNKNOWN_SENSOR"),
        (at(1, "ring", scan(1.0, 3)), "WRONG_SENSOR_KIND"),
        (at(1, "laser", sighting(1.0, "door")), "WRONG_SENSOR_KIND"),
        (at(1, "laser", scan(1.0, 4)), "WRONG_BEAM_COUNT"),
        (at(1, "laser", scan(1.0, 0)), "WRONG_BEAM_COUNT"),
        (at(1, "laser", with_intensities), "WRONG_BEAM_COUNT"),
        (at(1, "ring", sonar(1.0, 4)), "WRONG_BEAM_COUNT"),
        (at(1, "", odometry_pose(far)), "OUT_OF_RANGE"),
        (at(1, "", velocity(51.0)), "OUT_OF_RANGE"),
        (at(1, "eye", sighting(-1.0, "door")), "OUT_OF_RANGE"),
        (at(1, "eye", sighting(4.1, "door")), "OUT_OF_RANGE"),
        (at(1, "laser", scan(f32::NAN, N_BEAMS)), "NO_USABLE_READING"),
        (at(1, "laser", scan(-1.0, N_BEAMS)), "NO_USABLE_READING"),
        (at(1, "laser", scan(0.0, N_BEAMS)), "NO_USABLE_READING"),
        (at(1, "laser", scan(f32::NEG_INFINITY, N_BEAMS)), "NO_USABLE_READING"),
        (at(1, "ring", sonar(0.01, 3)), "NO_USABLE_READING"),
        (at(1, "laser", laser_scan(mixed.to_vec())), ""),
        (at(1, "laser", scan(2.0, N_BEAMS)), "DUPLICATE_STAMP"),
        (at(1, "ring", sonar(1.0, 3)), ""),
        (at(1, "eye", sighting(3.0, "door")), ""),
        (at(1, "eye", sighting(3.0, &"x".repeat(201))), "TOO_LONG"),
        (at(1, "", mark(&"x".repeat(201))), "TOO_LONG"),
        (at(1, "", mark("lift door")), ""),
        (negative, "STAMP_OUT_OF_RANGE"),
        (at(2, "laser", scan(f32::INFINITY, N_BEAMS)), ""),
    ]
}

/// What JSON has no word for: numbers that are none.
fn judged_without_words() -> Vec<(v1::Observation, &'static str)> {
    let nowhere = Pose { x_m: f64::NAN, y_m: 0.0, theta_rad: 0.0 };
    let turned = Pose { x_m: 0.0, y_m: 0.0, theta_rad: f64::INFINITY };
    let poseless = Kind::OdometryPose(v1::OdometryPose { odometry_from_robot: None });
    vec![
        (at(3, "", odometry_pose(nowhere)), "NOT_FINITE"),
        (at(3, "", odometry_pose(turned)), "NOT_FINITE"),
        (at(3, "", velocity(f64::NEG_INFINITY)), "NOT_FINITE"),
        (at(3, "eye", sighting(f64::NAN, "door")), "NOT_FINITE"),
        (at(3, "", poseless), "EMPTY_OBSERVATION"),
        (at(3, "laser", scan(3.0, N_BEAMS)), ""),
    ]
}

/// Far from what came in earlier batches.
fn judged_after(week_and_more: i64) -> Vec<(v1::Observation, &'static str)> {
    vec![
        (at(-61, "", mark("long ago")), "STAMP_OUT_OF_RANGE"),
        (at(week_and_more, "", mark("long after")), "STAMP_OUT_OF_RANGE"),
        (observation(i64::MAX, "", mark("the end of time")), "STAMP_OUT_OF_RANGE"),
        (observation(i64::MIN, "", mark("its beginning")), "STAMP_OUT_OF_RANGE"),
        (at(0, "", mark("a little back")), ""),
        (at(1, "laser", scan(2.0, N_BEAMS)), "DUPLICATE_STAMP"),
    ]
}

async fn each_is_judged<D: Door>(
    door: &D,
    session: &v1::Session,
    number: u64,
    judged: Vec<(v1::Observation, &'static str)>,
) {
    let expected: Vec<(u32, &str)> = (0..)
        .zip(&judged)
        .filter(|(_, (_, code))| !code.is_empty())
        .map(|(index, (_, code))| (index, *code))
        .collect();
    let observations = judged.iter().map(|(observation, _)| observation.clone()).collect();
    let batch = v1::Batch { number, observations };
    for _ in 0..2 {
        // Sent again, it is judged as before.
        let upload = Upload::Batch(batch.clone());
        let ack = door.upload(&session.id, session.epoch, upload).await.expect("it is taken");
        assert_eq!(ack.acked_through, number, "kept");
        let found: Vec<(u32, &str)> =
            ack.rejected.iter().map(|found| (found.index, found.code.as_str())).collect();
        assert_eq!(found, expected, "{:#?}", ack.rejected);
        for rejection in &ack.rejected {
            assert_eq!(rejection.batch_number, number, "{rejection:?}");
            assert!(!rejection.detail.is_empty(), "people are told why: {rejection:?}");
        }
    }
}

/// What was rejected stays so after a restart, and the rest is mapped.
async fn the_rest_is_mapped<D: Door>(door: &D, session: &v1::Session, rejected: u64, scans: u64) {
    let session = finished(door, session).await;
    assert_eq!((session.rejected, session.scans), (rejected, scans), "counted once: {session:?}");
    let request = v1::GetTrajectoryRequest { session: session.id.clone(), ..Default::default() };
    let (trajectory, _) = door.trajectory(request).await.expect("it is mapped");
    let scans_posed = trajectory.poses.iter().filter(|pose| pose.sensor_id == "laser").count();
    assert_eq!(scans_posed as u64, scans, "a pose for every scan that is usable");
}

fn count(judged: &[(v1::Observation, &str)]) -> u64 {
    judged.iter().filter(|(_, code)| !code.is_empty()).count() as u64
}

/// Over a restart in between: what stamps were used is known from the journal.
macro_rules! over_a_restart {
    ($door:ident, $wordless:expr, $scans:expr) => {{
        let data = empty_folder();
        let service = Launch::at(data.path()).start();
        let door = service.$door();
        door.create_map("lab", 0.05).await.expect("a new map");
        let session = opened(&door, opening("lab", "rover", &sensors())).await;
        each_is_judged(&door, &session, 1, judged()).await;
        each_is_judged(&door, &session, 2, $wordless).await;
        service.kill();
        let service = Launch::at(data.path()).start();
        let door = service.$door();
        let week_and_more = 7 * 24 * 3600 + 60;
        each_is_judged(&door, &session, 3, judged_after(week_and_more)).await;
        let all = [judged(), $wordless, judged_after(0)].concat();
        the_rest_is_mapped(&door, &session, count(&all), $scans).await;
    }};
}

#[tokio::test(flavor = "multi_thread")]
async fn over_grpc() {
    over_a_restart!(grpc, judged_without_words(), 3);
}

#[tokio::test(flavor = "multi_thread")]
async fn over_rest() {
    over_a_restart!(rest, Vec::new(), 2);
}
