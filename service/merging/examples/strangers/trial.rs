//! One newcomer and one site, simulated or logged.

use std::error::Error;
use std::sync::Arc;

use meetpoint_geometry::{Point2, Pose};
use meetpoint_merging::{AlignmentParams, AlignmentSearch, Alignments, MergeRules, Part, Verdict};
use meetpoint_occupancy::Grid;
use meetpoint_sim::{Building, Drive, OdometryError, Robot, Tick};
use meetpoint_tracking::{
    LiveMap, MappingParams, Observation, ObservationKind, Sensor, SensorKind, SessionConfig,
    SessionKey,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::cpu::cpu_s;
use crate::plan::{Plan, SQUARE_M};

const KEY: SessionKey = SessionKey(0);
/// A scan each 0.3 s is enough for a map.
const N_TICKS_PER_SCAN: u32 = 6;

/// A drive as live mapping has it.
pub(crate) struct Driven {
    pub(crate) grid: Grid,
    /// Poses in the own frame and in truth.
    pub(crate) poses: Vec<(Pose, Pose)>,
    pub(crate) way_m: f64,
}

/// A robot driven through a plan; `start` is its first pose in its own frame, that of the building if
/// none is given.
pub(crate) fn driven(
    plan: &Plan,
    waypoints: &[Point2<f64>],
    start: Option<Pose>,
    seed: u64,
) -> Result<Driven, Box<dyn Error>> {
    let building = Building::from_drawing(&plan.drawing(), SQUARE_M)?;
    let mut error = OdometryError::UNCALIBRATED;
    if seed.is_multiple_of(2) {
        (error.scale, error.drift_rad_per_m) = (0.98, -error.drift_rad_per_m);
    }
    let robot =
        Robot { odometry_error: error, n_ticks_per_scan: N_TICKS_PER_SCAN, ..Robot::INDOOR };
    let rng = ChaCha8Rng::seed_from_u64(seed);
    let drive = Drive::new(&building, robot, waypoints, 0, rng).ok_or("no such way")?;
    let way_m = drive.length_m();
    let laser = &robot.laser;
    let geometry = laser.geometry();
    let kind = SensorKind::Laser(geometry);
    let sensor = Sensor { robot_from_sensor: laser.robot_from_laser, kind };
    let map_from_start = start.unwrap_or(drive.truth());
    let mut map = LiveMap::new(MappingParams::INDOOR, 0.05).map_err(|_| "no such resolution")?;
    map.open_session(KEY, SessionConfig { map_from_start, sensors: vec![sensor] });
    let mut poses = Vec::new();
    for Tick { stamp_ns, truth, odometry, scan } in drive {
        map.apply(KEY, &Observation { stamp_ns, kind: ObservationKind::OdometryPose(odometry) });
        let Some(ranges_m) = scan else { continue };
        let kind = ObservationKind::LaserScan { sensor: 0, ranges_m };
        let estimate = map.apply(KEY, &Observation { stamp_ns, kind }).ok_or("no estimate")?;
        poses.push((estimate.map_from_robot, truth));
    }
    Ok(Driven { grid: map.grid().clone(), poses, way_m })
}

/// The newcomer's alignments to the site, and how long they took on a processor, in seconds.
pub(crate) fn aligned(site: &Grid, newcomer: &Grid) -> (Alignments, f64) {
    let params = AlignmentParams::INDOOR;
    let [site, newcomer] = [site, newcomer].map(|grid| Arc::new(Part::of_grid(grid, &params)));
    let began = cpu_s();
    let search = AlignmentSearch::new(site, newcomer, params, MergeRules::INDOOR);
    (search.into_alignments(), cpu_s() - began)
}

/// How far the first alignment is from the truth: the median over the newcomer's poses, in metres, and
/// degrees; `None` without an alignment.
pub(crate) fn error(alignments: &Alignments, newcomer: &Driven) -> Option<(f64, f64)> {
    let best = alignments.ranked.first()?;
    let error = |&(own, truth): &(Pose, Pose)| {
        let error = truth.step_to(best.site_from_newcomer * own);
        (error.distance_m(), error.theta_rad.abs().to_degrees())
    };
    let mut errors: Vec<(f64, f64)> = newcomer.poses.iter().map(error).collect();
    errors.sort_by(|a, b| a.0.total_cmp(&b.0));
    errors.get(errors.len() / 2).copied()
}

/// A line about a trial.
pub(crate) fn told(alignments: &Alignments) -> String {
    let best = alignments.ranked.first().map(|best| {
        format!(
            "odds {:.1} margin {:.1} overlap {:.0} m2 {:.2} agreement {:.2} contradiction {:.3}",
            best.log_odds,
            best.margin.unwrap_or(f64::INFINITY),
            best.overlap_m2,
            best.overlap_share,
            best.agreement,
            best.contradiction,
        )
    });
    let reasons: Vec<String> = alignments.reasons.iter().map(ToString::to_string).collect();
    let verdict: Verdict = alignments.verdict;
    format!("{verdict:?}; {}; {}", best.unwrap_or_default(), reasons.join("; "))
}
