//! Variants of a log, by name.

use std::error::Error;

use meetpoint_geometry::Pose;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::log::LoggedScan;

/// The scans of a variant, and where it starts: `whole`, `thin` (every second scan), `first` and
/// `second` (half), `long` and `short` (odometry's lengths off by 3 %), `turns` (its turns off by 3 %),
/// `wrong` (5 % of the beams anywhere), `blind` (no odometry), `startN` (a start of that seed), `from0.1`
/// (without the first tenth of the time), `mountN` (the laser declared N degrees to the left and 0.2 m
/// ahead of where it sits).
pub(crate) fn of(
    log: &[LoggedScan],
    name: &str,
) -> Result<(Vec<LoggedScan>, Pose), Box<dyn Error>> {
    let half = log.len() / 2;
    let scans = match name {
        "thin" => log.iter().step_by(2).cloned().collect(),
        "first" => log[..half].to_vec(),
        "second" => log[half..].to_vec(),
        "long" => scaled(log, 1.03, 1.0),
        "short" => scaled(log, 0.97, 1.0),
        "turns" => scaled(log, 1.0, 1.03),
        "wrong" => with_wrong_beams(log),
        "blind" => log.iter().map(|scan| LoggedScan { odometry: None, ..scan.clone() }).collect(),
        _ => match name.strip_prefix("from") {
            Some(share) => since(log, share.parse()?),
            None => log.to_vec(),
        },
    };
    let start = match name.strip_prefix("start") {
        Some(seed) => {
            let mut rng = ChaCha8Rng::seed_from_u64(seed.parse()?);
            let mut within = |most: f64| rng.random_range(-most..most);
            Pose::new(within(10.0), within(10.0), within(3.1))
        }
        None => Pose::IDENTITY,
    };
    Ok((scans, start))
}

/// Where a variant declares that the laser sits: at the robot's origin, as logs have it, or elsewhere.
pub(crate) fn mount(name: &str) -> Pose {
    let degrees = name.strip_prefix("mount").and_then(|degrees| degrees.parse::<f64>().ok());
    degrees.map_or(Pose::IDENTITY, |degrees| Pose::new(0.2, 0.0, degrees.to_radians()))
}

/// Two robots in place of one: a log cut at the share of its scans that `cut0.5` names, the second part
/// placed where `map_from_robot` has the robot there, 0.3 m and 3 degrees off, in a direction of its own.
pub(crate) fn cut(log: &[LoggedScan], name: &str) -> Option<usize> {
    Some(share_of(log, name.strip_prefix("cut")?.parse().ok()?))
}

/// So many scans as are a share of a log.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share")]
fn share_of(log: &[LoggedScan], share: f64) -> usize {
    (share.clamp(0.0, 1.0) * log.len() as f64) as usize
}

/// How far off the second part is placed, and the deviations that it is told to be placed with, in metres
/// and radians.
pub(crate) const CUT_OFF: (f64, f64) = (0.3, 3.0 * std::f64::consts::PI / 180.0);

/// The error of a place, different for each cut.
pub(crate) fn cut_error(cut: usize) -> Pose {
    let (sin, cos) = (cut as f64).sin_cos();
    Pose::new(
        CUT_OFF.0 * cos,
        CUT_OFF.0 * sin,
        if cut.is_multiple_of(2) { CUT_OFF.1 } else { -CUT_OFF.1 },
    )
}

/// What comes after a share of the time.
fn since(log: &[LoggedScan], share: f64) -> Vec<LoggedScan> {
    let stamp_ns = |scan: Option<&LoggedScan>| scan.map_or(0, |scan| scan.stamp_ns);
    let (first_ns, last_ns) = (stamp_ns(log.first()), stamp_ns(log.last()));
    let passed = |scan: &&LoggedScan| (scan.stamp_ns - first_ns) as f64;
    let from_ns = share * (last_ns - first_ns) as f64;
    log.iter().filter(|scan| from_ns <= passed(scan)).cloned().collect()
}

/// With odometry that errs in scale.
fn scaled(log: &[LoggedScan], length: f64, turn: f64) -> Vec<LoggedScan> {
    let mut pose = Pose::IDENTITY;
    let mut before: Option<Pose> = None;
    let next = |scan: &LoggedScan| {
        let step = before.zip(scan.odometry).map_or(Pose::IDENTITY, |(a, b)| a.step_to(b));
        before = scan.odometry;
        pose = pose * Pose::new(length * step.x_m, length * step.y_m, turn * step.theta_rad);
        LoggedScan { odometry: Some(pose), ..scan.clone() }
    };
    log.iter().map(next).collect()
}

/// With beams that end anywhere up to 10 m, one in twenty.
fn with_wrong_beams(log: &[LoggedScan]) -> Vec<LoggedScan> {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut beam = |&range_m: &f32| {
        if rng.random_bool(0.05) { rng.random_range(0.1_f32..10.0) } else { range_m }
    };
    let next = |scan: &LoggedScan| LoggedScan {
        ranges_m: scan.ranges_m.iter().map(&mut beam).collect(),
        ..scan.clone()
    };
    log.iter().map(next).collect()
}
