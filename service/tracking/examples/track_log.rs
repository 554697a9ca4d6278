//! Maps a CARMEN log offline: `track_log LOG [TUM]` tracks the FLASER lines of an unpacked log,
//! prints the time a scan took, and writes the trajectory as TUM.

use std::error::Error;
use std::f64::consts::FRAC_PI_2;
use std::fmt::Write as _;
use std::time::{Duration, Instant};

use meetpoint_geometry::Pose;
use meetpoint_occupancy::LaserGeometry;
use meetpoint_tracking::{
    LiveMap, MappingParams, Observation, ObservationKind, Sensor, SensorKind, SessionConfig,
    SessionKey,
};

const KEY: SessionKey = SessionKey(0);

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let log = arguments.next().ok_or("usage: track_log LOG [TUM]")?;
    let text = std::fs::read_to_string(log)?;
    let mut map = LiveMap::new(MappingParams::INDOOR, 0.05).map_err(|_| "no such resolution")?;
    let (mut trajectory, mut took, mut n_scans) = (String::new(), Duration::ZERO, 0_u32);
    for words in text.lines().map(|line| line.split_whitespace().collect::<Vec<_>>()) {
        if words.first() != Some(&"FLASER") {
            continue;
        }
        let (stamp, observations) = read_scan(&words)?;
        if n_scans == 0 {
            map.open_session(KEY, config(words[1].parse()?));
        }
        n_scans += 1;
        let start = Instant::now();
        let estimates: Vec<_> = observations.iter().filter_map(|o| map.apply(KEY, o)).collect();
        took += start.elapsed();
        for pose in estimates.iter().map(|estimate| estimate.map_from_robot) {
            let (sin, cos) = (pose.theta_rad / 2.0).sin_cos();
            writeln!(trajectory, "{stamp} {} {} 0 0 0 {sin} {cos}", pose.x_m, pose.y_m)?;
        }
    }
    let scan_ms = took.as_secs_f64() * 1e3 / f64::from(n_scans.max(1));
    println!("{n_scans} scans, {} drawn, {scan_ms:.3} ms a scan", map.n_drawn());
    if let Some(path) = arguments.next() {
        std::fs::write(path, trajectory)?;
    }
    Ok(())
}

/// CARMEN's rule: a half circle from the right; 180 beams stand 1 degree apart, others half.
fn config(n_beams: u32) -> SessionConfig {
    let angle_increment_rad = if n_beams <= 181 { 1_f64 } else { 0.5 }.to_radians();
    let laser = LaserGeometry {
        angle_min_rad: -FRAC_PI_2,
        angle_increment_rad,
        n_beams,
        range_min_m: 0.0,
        range_max_m: 80.0,
    };
    let sensor = Sensor { robot_from_sensor: Pose::IDENTITY, kind: SensorKind::Laser(laser) };
    SessionConfig { map_from_start: Pose::IDENTITY, sensors: vec![sensor] }
}

/// The stamp as it is written, and what the line observed: odometry, then ranges.
fn read_scan<'a>(words: &[&'a str]) -> Result<(&'a str, [Observation; 2]), Box<dyn Error>> {
    let n_beams: usize = words[1].parse()?;
    let (ranges, rest) = words[2..].split_at_checked(n_beams).ok_or("a short FLASER line")?;
    let [_, _, _, x, y, theta, stamp, ..] = rest else { return Err("a short FLASER line".into()) };
    let (seconds, fraction) = stamp.split_once('.').unwrap_or((stamp, "0"));
    let nanoseconds: String = fraction.chars().chain("000000000".chars()).take(9).collect();
    let stamp_ns = seconds.parse::<i64>()? * 1_000_000_000 + nanoseconds.parse::<i64>()?;
    let pose = Pose::new(x.parse()?, y.parse()?, theta.parse()?);
    let ranges_m = ranges.iter().map(|range| range.parse()).collect::<Result<_, _>>()?;
    let kinds =
        [ObservationKind::OdometryPose(pose), ObservationKind::LaserScan { sensor: 0, ranges_m }];
    Ok((stamp, kinds.map(|kind| Observation { stamp_ns, kind })))
}
