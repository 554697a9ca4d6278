//! Relaxes CARMEN logs offline: `relax LOG RELATIONS [VARIANT...]` maps the FLASER lines of a log live,
//! relaxes them, and prints errors before and after, time and sharpness; a variant is one of those that
//! [`variant`] names, or `cut0.5`: the log as two robots' that are relaxed together,
//! or `grown`: the log relaxed again and again while it grows by tenths, or `tags`: with tags that a camera
//! sees along it. With `IMAGE=PATH` it draws the relaxed map; `THREADS=N` shares the work.

mod log;
mod relations;
mod tags;
mod variant;

use std::collections::BTreeMap;
use std::error::Error;
use std::num::NonZero;
use std::path::Path;
use std::time::Instant;

use meetpoint_geometry::{GridFrame, Pose};
use meetpoint_occupancy::{Grid, ScanMarks, png};
use meetpoint_tracking::{
    DrivenScan, LaserOutcome, LaserRelaxation, LaserRelaxationParams, LaserStage, LaserTravel,
    LiveMap, MappingParams, Observation, ObservationKind, PlacedTravel, Sensor, SensorKind,
    SessionConfig, SessionKey, TravelLaser,
};

use log::LoggedScan;
use relations::Relations;

const KEY: SessionKey = SessionKey(0);

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [path, relations, names @ ..] = arguments.as_slice() else {
        return Err("usage: relax LOG RELATIONS [VARIANT...]".into());
    };
    let log = log::read(Path::new(path))?;
    let relations = Relations::read(relations)?;
    let names = if names.is_empty() { vec!["whole".to_owned()] } else { names.to_vec() };
    for name in names {
        if name == "grown" {
            grow(&log, &relations)?;
            continue;
        }
        let cut = variant::cut(&log, &name);
        let began = Instant::now();
        let mut travels = match cut {
            Some(cut) => tracked_apart(&log, cut)?,
            None => {
                let (scans, start) = variant::of(&log, &name)?;
                vec![PlacedTravel::of_known_start(tracked(&scans, start, variant::mount(&name))?)]
            }
        };
        let mapped_s = began.elapsed().as_secs_f64();
        if name == "tags" {
            let (outcome, _) = relaxed(travels.clone())?;
            travels[0].sightings = tags::sightings(&outcome.travels[0].poses);
            println!("tags: {} sightings", travels[0].sightings.len());
        }
        let began = Instant::now();
        let (outcome, slowest_s) = relaxed(travels.clone())?;
        let relaxed_s = began.elapsed().as_secs_f64();
        let all: Vec<&DrivenScan> =
            travels.iter().flat_map(|placed| &placed.travel.scans).collect();
        println!(
            "{name}: {} scans, mapped in {mapped_s:.2} s, relaxed in {relaxed_s:.2} s (slice {slowest_s:.3} s)",
            all.len()
        );
        let live: BTreeMap<i64, Pose> =
            all.iter().map(|scan| (scan.stamp_ns, scan.map_from_robot)).collect();
        let poses = outcome.travels.iter().flat_map(|travel| &travel.poses).copied();
        let after: BTreeMap<i64, Pose> = all.iter().map(|scan| scan.stamp_ns).zip(poses).collect();
        println!("  live    {}", relations.errors(&live));
        println!("  relaxed {}", relations.errors(&after));
        let mount = variant::mount(&name);
        if mount != Pose::IDENTITY {
            // The logs have the laser at the robot's origin: its poses are judged too.
            let lasers = after.iter().map(|(&stamp_ns, &pose)| (stamp_ns, pose * mount)).collect();
            println!("  the laser {}", relations.errors(&lasers));
        }
        if let Some(cut) = cut {
            let across = relations.across(log[cut].stamp_ns);
            println!("  live, across    {}", across.errors(&live));
            println!("  relaxed, across {}", across.errors(&after));
        }
        print_outcome(&outcome);
        if let Ok(path) = std::env::var("IMAGE") {
            std::fs::write(path, picture(&travels, &outcome)?)?;
        }
    }
    Ok(())
}

/// Relaxes a log while it grows, each time going on from what was found before.
fn grow(log: &[LoggedScan], relations: &Relations) -> Result<(), Box<dyn Error>> {
    let whole = tracked(log, Pose::IDENTITY, Pose::IDENTITY)?;
    let (mut known, mut poses) = (Vec::new(), Vec::<Pose>::new());
    for tenth in 1..=N_GROWN {
        let mut travel = whole.clone();
        travel.scans.truncate(log.len() * tenth / N_GROWN);
        let n_relaxed = poses.len();
        // Live mapping goes on from where the last relaxation left the robot.
        let moved = poses.last().map_or(Pose::IDENTITY, |last| {
            *last * travel.scans[n_relaxed - 1].map_from_robot.inverse()
        });
        for (index, scan) in travel.scans.iter_mut().enumerate() {
            let carried = moved * scan.map_from_robot;
            scan.map_from_robot = poses.get(index).copied().unwrap_or(carried);
        }
        let stamps: Vec<i64> = travel.scans.iter().map(|scan| scan.stamp_ns).collect();
        let placed = PlacedTravel { n_relaxed, ..PlacedTravel::of_known_start(travel) };
        let began = Instant::now();
        let goes_on = LaserRelaxation::going_on(vec![placed], params(), &[], known);
        let (outcome, slowest_s) = finished(goes_on.map_err(|_| "no such resolution")?);
        let took_s = began.elapsed().as_secs_f64();
        (known, poses) = (outcome.closures, outcome.travels[0].poses.clone());
        let after: BTreeMap<i64, Pose> = stamps.into_iter().zip(poses.iter().copied()).collect();
        println!("{tenth}: relaxed in {took_s:.2} s (slice {slowest_s:.3} s)");
        println!("  {}", relations.errors(&after));
    }
    Ok(())
}

/// Times that a growing log is relaxed.
const N_GROWN: usize = 10;

/// The parts of a log before and after a scan, each mapped by itself, the second not quite where it was.
fn tracked_apart(log: &[LoggedScan], cut: usize) -> Result<Vec<PlacedTravel>, Box<dyn Error>> {
    let whole = tracked(log, Pose::IDENTITY, Pose::IDENTITY)?;
    let there = whole.scans.get(cut).ok_or("nothing behind the cut")?.map_from_robot;
    let first = tracked(&log[..cut], Pose::IDENTITY, Pose::IDENTITY)?;
    let second = tracked(&log[cut..], there * variant::cut_error(cut), Pose::IDENTITY)?;
    let (std_m, std_rad) = variant::CUT_OFF;
    let mut start_covariance = [[0.0; 3]; 3];
    for (axis, std) in [std_m, std_m, std_rad].into_iter().enumerate() {
        start_covariance[axis][axis] = std * std;
    }
    let second = PlacedTravel { start_covariance, ..PlacedTravel::of_known_start(second) };
    Ok(vec![PlacedTravel::of_known_start(first), second])
}

fn print_outcome(outcome: &LaserOutcome) {
    let [before, after] =
        [outcome.before, outcome.after].map(|figures| figures.sharpness.unwrap_or_default());
    println!(
        "  entropy {:.4} bits a cell of {} -> {:.4} of {}; total {:.0} -> {:.0}; moved up to {:.3} m; {} closures, chi2 {:.0} -> {:.0}",
        before.mean_bits(),
        before.n_cells,
        after.mean_bits(),
        after.n_cells,
        before.entropy_bits,
        after.entropy_bits,
        outcome.travels.iter().map(|travel| travel.move_max_m).fold(0.0, f64::max),
        outcome.closures.len(),
        outcome.before.chi2,
        outcome.after.chi2,
    );
    let mut verdicts = BTreeMap::<String, usize>::new();
    for closure in &outcome.closures {
        let between = if closure.key.from.travel == closure.key.to.travel { "" } else { " across" };
        *verdicts.entry(format!("{:?}{between}", closure.verdict)).or_default() += 1;
    }
    for travel in &outcome.travels {
        let (n_in_graph, n_doubted) = (travel.n_sightings_in_graph, travel.n_sightings_doubted);
        if 0 < n_in_graph + n_doubted {
            println!("  {n_in_graph} sightings in the graph, {n_doubted} doubted");
        }
    }
    let calibrations: Vec<_> = outcome.travels.iter().map(|travel| travel.calibration).collect();
    println!("  {verdicts:?} {calibrations:?}");
    if std::env::var("LEDGER").is_ok() {
        for closure in &outcome.closures {
            println!("  {closure:?}");
        }
    }
}

/// What live mapping says of the scans, with the laser declared to sit at `mount`.
fn tracked(scans: &[LoggedScan], start: Pose, mount: Pose) -> Result<LaserTravel, Box<dyn Error>> {
    let mut map = LiveMap::new(MappingParams::INDOOR, 0.05).map_err(|_| "no such resolution")?;
    let laser = TravelLaser { robot_from_sensor: mount, ..log::laser(scans) };
    let kind = SensorKind::Laser(laser.geometry);
    let sensor = Sensor { robot_from_sensor: laser.robot_from_sensor, kind };
    map.open_session(KEY, SessionConfig { map_from_start: start, sensors: vec![sensor] });
    let mut travel = LaserTravel { lasers: vec![laser], scans: Vec::new() };
    for scan in scans {
        let stamp_ns = scan.stamp_ns;
        if let Some(odometry) = scan.odometry {
            let kind = ObservationKind::OdometryPose(odometry);
            map.apply(KEY, &Observation { stamp_ns, kind });
        }
        let kind = ObservationKind::LaserScan { sensor: 0, ranges_m: scan.ranges_m.to_vec() };
        let estimate = map.apply(KEY, &Observation { stamp_ns, kind }).ok_or("no estimate")?;
        travel.scans.push(DrivenScan {
            stamp_ns,
            laser: 0,
            ranges_m: scan.ranges_m.clone(),
            odometry_from_robot: scan.odometry,
            map_from_robot: estimate.map_from_robot,
            is_lost: estimate.lost,
        });
    }
    Ok(travel)
}

fn params() -> LaserRelaxationParams {
    let n_threads = std::env::var("THREADS").ok().and_then(|n| n.parse().ok());
    LaserRelaxationParams {
        n_threads: n_threads.unwrap_or(NonZero::<usize>::MIN),
        ..LaserRelaxationParams::INDOOR
    }
}

fn relaxed(travels: Vec<PlacedTravel>) -> Result<(LaserOutcome, f64), Box<dyn Error>> {
    let relaxation = LaserRelaxation::new(travels, params(), &[]);
    Ok(finished(relaxation.map_err(|_| "no such resolution")?))
}

/// What a relaxation finds, and the time of its longest slice, in seconds.
fn finished(mut relaxation: LaserRelaxation) -> (LaserOutcome, f64) {
    let mut slowest_s = 0.0_f64;
    let (mut stage, mut stages) = (LaserStage::Before, Vec::<(LaserStage, f64)>::new());
    loop {
        let began = Instant::now();
        let progress = relaxation.advance();
        let took_s = began.elapsed().as_secs_f64();
        slowest_s = slowest_s.max(took_s);
        match stages.last_mut() {
            Some((last, sum_s)) if *last == stage => *sum_s += took_s,
            _ => stages.push((stage, took_s)),
        }
        let Some(progress) = progress else {
            println!("  {}", told(&stages));
            return (relaxation.into_outcome(), slowest_s);
        };
        stage = progress.stage;
    }
}

fn told(stages: &[(LaserStage, f64)]) -> String {
    let told = stages.iter().map(|(stage, took_s)| format!("{stage:?} {took_s:.2} s"));
    told.collect::<Vec<_>>().join(", ")
}

fn picture(travels: &[PlacedTravel], outcome: &LaserOutcome) -> Result<Vec<u8>, Box<dyn Error>> {
    let mut grid = Grid::new(GridFrame::new(0.05).map_err(|_| "no such resolution")?);
    let mut marks = ScanMarks::new();
    for (PlacedTravel { travel, .. }, found) in travels.iter().zip(&outcome.travels) {
        for (scan, &pose) in travel.scans.iter().zip(&found.poses) {
            let laser = travel.lasers[scan.laser];
            let model = &MappingParams::INDOOR.beam_model;
            let pose = pose * laser.robot_from_sensor;
            grid.insert_scan(pose, &laser.geometry, &scan.ranges_m, model, &mut marks);
        }
    }
    Ok(png(&grid.raster(None)))
}
