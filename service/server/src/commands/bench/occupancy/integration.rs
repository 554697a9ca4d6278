//! Scans integrated per second on one core: a laser and a ring of sonars, each against a plain integration
//! written from its definition. What both draw is compared before anything is timed.
//!
//! 360 beams all around, and rings of 24 sonars, from poses along a walk through a floor of rooms, cells of
//! 5 cm.

use std::time::Instant;

use meetpoint_geometry::{Cell, GridFrame, Point2, Pose};
use meetpoint_occupancy::{
    BeamModel, Grid, Interpretation, LaserGeometry, Network, ScanMarks, SonarModel, SonarRing,
};
use meetpoint_sim::{Building, ChaCha8Rng, Laser, RoomParams, random_rooms};
use rand::{RngExt, SeedableRng};

use super::plain_grid::PlainGrid;
use crate::training::declared;

/// Edge of a cell, in metres.
const RESOLUTION_M: f64 = 0.05;
/// Scans of the comparison, and of a timed round.
const N_SCANS: usize = 200;
/// Rounds; the fastest counts, since other work on the machine only ever slows one down.
const N_ROUNDS: usize = 9;
/// Log-odds of the paper's 0.7: what is beyond, or below their negative, is decided.
const DECIDED: f32 = 0.847;

/// What robots saw and heard from their poses.
struct Scans {
    lasers: Vec<(Pose, Vec<f32>)>,
    sonars: Vec<(Pose, Vec<f32>)>,
    geometry: LaserGeometry,
    ring: SonarRing,
}

/// Prints a table.
pub(super) fn print() -> anyhow::Result<()> {
    let scans = scans()?;
    println!("| sensor | integration | agrees with plain | scans a second | of plain |");
    println!("|---|---|---|---|---|");
    laser(&scans)?;
    sonar(&scans)
}

fn laser(scans: &Scans) -> anyhow::Result<()> {
    let fast = || {
        let (mut grid, mut marks) = (empty(), ScanMarks::new());
        for (map_from_sensor, ranges_m) in &scans.lasers {
            let model = &BeamModel::INDOOR;
            grid.insert_scan(*map_from_sensor, &scans.geometry, ranges_m, model, &mut marks);
        }
        grid
    };
    let plain = || {
        let mut grid = PlainGrid::new(RESOLUTION_M);
        for (map_from_sensor, ranges_m) in &scans.lasers {
            grid.insert_scan(*map_from_sensor, &scans.geometry, ranges_m, &BeamModel::INDOOR);
        }
        grid
    };
    let agreement = agreement(&fast(), &plain(), |fast, plain| (fast - plain).abs() < 1e-5);
    anyhow::ensure!(0.9999 < agreement, "{agreement} of the cells agree");
    report("laser of 360 beams", agreement, scans_per_s(fast), scans_per_s(plain));
    Ok(())
}

fn sonar(scans: &Scans) -> anyhow::Result<()> {
    let network = Network::shipped();
    let model = SonarModel::INDOOR;
    let fast = || {
        let mut grid = empty();
        for (robot, ranges_m) in &scans.sonars {
            let heard = Interpretation::new(&scans.ring.scan(ranges_m), &network, &model);
            grid.insert_sonar(*robot, &heard, &BeamModel::INDOOR);
        }
        grid
    };
    let plain = || {
        let mut grid = PlainGrid::new(RESOLUTION_M);
        for (robot, ranges_m) in &scans.sonars {
            let scan = scans.ring.scan(ranges_m);
            grid.insert_sonar(*robot, &scan, (&network, &model), &BeamModel::INDOOR);
        }
        grid
    };
    let decided = |log_odds: f32| (DECIDED < log_odds.abs()).then_some(log_odds.is_sign_positive());
    let agreement = agreement(&fast(), &plain(), |fast, plain| {
        decided(fast).zip(decided(plain)).is_none_or(|(fast, plain)| fast == plain)
    });
    anyhow::ensure!(0.98 < agreement, "{agreement} of the cells are decided alike");
    report("ring of 24 sonars", agreement, scans_per_s(fast), scans_per_s(plain));
    Ok(())
}

fn report(sensor: &str, agreement: f64, fast_per_s: f64, plain_per_s: f64) {
    let agrees = 100.0 * agreement;
    println!("| {sensor} | grid | {agrees:.2} % | {fast_per_s:.0} | {:.1} |", {
        fast_per_s / plain_per_s
    });
    println!("| | plain | | {plain_per_s:.0} | 1 |");
}

fn empty() -> Grid {
    Grid::new(GridFrame::new(RESOLUTION_M).expect("a length"))
}

/// Share of the cells observed by either that are alike.
fn agreement(grid: &Grid, plain: &PlainGrid, is_alike: impl Fn(f32, f32) -> bool) -> f64 {
    let raster = grid.raster(None);
    let width = raster.info.width as usize;
    let offset = |n: usize| i32::try_from(n).expect("a small map");
    let (mut n_cells, mut n_alike) = (0_usize, 0_usize);
    for (index, &log_odds) in raster.log_odds.iter().enumerate() {
        let first = raster.info.first;
        let cell = Cell { x: first.x + offset(index % width), y: first.y + offset(index / width) };
        let drawn = (!log_odds.is_nan()).then_some(log_odds);
        match (drawn, plain.log_odds(cell)) {
            (None, None) => {}
            (Some(fast), Some(plain)) => {
                n_cells += 1;
                n_alike += usize::from(is_alike(fast, plain));
            }
            (fast, plain) => {
                n_cells += 1;
                let said = fast.or(plain).unwrap_or(0.0);
                n_alike += usize::from(is_alike(said, 0.0));
            }
        }
    }
    n_alike as f64 / n_cells as f64
}

fn scans_per_s<T>(round: impl Fn() -> T) -> f64 {
    let seconds = (0..N_ROUNDS).map(|_| {
        let began = Instant::now();
        std::hint::black_box(round());
        began.elapsed().as_secs_f64()
    });
    N_SCANS as f64 / seconds.fold(f64::INFINITY, f64::min)
}

fn scans() -> anyhow::Result<Scans> {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let floor = random_rooms((24.0, 16.0), &RoomParams::OFFICES, &mut rng)?;
    let laser = Laser {
        angle_min_rad: -std::f64::consts::PI,
        angle_increment_rad: std::f64::consts::TAU / 360.0,
        n_beams: 360,
        ..Laser::INDOOR
    };
    let sonars = meetpoint_sim::SonarRing::RING_24;
    let poses: Vec<Pose> = (0..N_SCANS).map(|_| free_pose(&floor, &mut rng)).collect();
    let seen = |&robot: &Pose| {
        (
            robot * laser.robot_from_laser,
            laser.scan(&floor, robot, &mut ChaCha8Rng::seed_from_u64(1)),
        )
    };
    let lasers = poses.iter().map(seen).collect();
    let heard = |&robot: &Pose| (robot, sonars.scan(&floor, robot, &mut rng));
    Ok(Scans {
        lasers,
        sonars: poses.iter().map(heard).collect(),
        geometry: laser.geometry(),
        ring: declared(&sonars),
    })
}

fn free_pose(floor: &Building, rng: &mut ChaCha8Rng) -> Pose {
    loop {
        let at = Point2::new(rng.random_range(0.0..24.0), rng.random_range(0.0..16.0));
        if floor.is_free(at, 0.3) {
            return Pose::new(at.x, at.y, rng.random_range(0.0..std::f64::consts::TAU));
        }
    }
}
