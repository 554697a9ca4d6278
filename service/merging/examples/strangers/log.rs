//! The FLASER lines of a CARMEN log.

use std::error::Error;
use std::f64::consts::FRAC_PI_2;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::sync::Arc;

use flate2::read::GzDecoder;
use meetpoint_geometry::Pose;
use meetpoint_occupancy::LaserGeometry;
use meetpoint_tracking::TravelLaser;

/// One line.
#[derive(Clone, Debug)]
pub(crate) struct LoggedScan {
    pub(crate) stamp_ns: i64,
    pub(crate) ranges_m: Arc<[f32]>,
    pub(crate) odometry: Option<Pose>,
}

/// The scans of a log, packed or not.
pub(crate) fn read(path: &Path) -> Result<Vec<LoggedScan>, Box<dyn Error>> {
    let mut text = String::new();
    if path.extension().is_some_and(|extension| extension == "gz") {
        GzDecoder::new(File::open(path)?).read_to_string(&mut text)?;
    } else {
        File::open(path)?.read_to_string(&mut text)?;
    }
    let lines = text.lines().map(|line| line.split_whitespace().collect::<Vec<_>>());
    lines.filter(|words| words.first() == Some(&"FLASER")).map(|words| scan(&words)).collect()
}

/// CARMEN's rule: a half circle from the right; up to 181 beams stand 1 degree apart, others half.
pub(crate) fn laser(scans: &[LoggedScan]) -> TravelLaser {
    let n_beams = scans.first().map_or(0, |scan| u32::try_from(scan.ranges_m.len()).unwrap_or(0));
    let geometry = LaserGeometry {
        angle_min_rad: -FRAC_PI_2,
        angle_increment_rad: if n_beams <= 181 { 1_f64 } else { 0.5 }.to_radians(),
        n_beams,
        range_min_m: 0.0,
        range_max_m: 80.0,
    };
    TravelLaser { robot_from_sensor: Pose::IDENTITY, geometry }
}

/// Seconds as written, in nanoseconds.
pub(crate) fn stamp_ns(seconds: &str) -> Result<i64, Box<dyn Error>> {
    let (seconds, fraction) = seconds.split_once('.').unwrap_or((seconds, "0"));
    let nanoseconds: String = fraction.chars().chain("000000000".chars()).take(9).collect();
    Ok(seconds.parse::<i64>()? * 1_000_000_000 + nanoseconds.parse::<i64>()?)
}

fn scan(words: &[&str]) -> Result<LoggedScan, Box<dyn Error>> {
    let n_beams: usize = words[1].parse()?;
    let (ranges, rest) = words[2..].split_at_checked(n_beams).ok_or("a short FLASER line")?;
    let [_, _, _, x, y, theta, stamp, ..] = rest else { return Err("a short FLASER line".into()) };
    Ok(LoggedScan {
        stamp_ns: stamp_ns(stamp)?,
        ranges_m: ranges.iter().map(|range| range.parse()).collect::<Result<_, _>>()?,
        odometry: Some(Pose::new(x.parse()?, y.parse()?, theta.parse()?)),
    })
}
