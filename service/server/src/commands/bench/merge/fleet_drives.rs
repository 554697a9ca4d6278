//! A building of many rooms, and robots that drive through a part of it each.

use anyhow::Context;
use meetpoint_geometry::{Point2, Pose};
use meetpoint_sim::{Building, ChaCha8Rng, Drive, Robot, RoomParams, random_rooms};
use rand::{RngExt, SeedableRng};

use crate::demo::{SimulatedDrive, simulated};

/// The building, in metres.
const SIZE_M: (f64, f64) = (100.0, 60.0);
/// Robots begin about the middles of so many columns and rows of parts...
const N_PARTS: (u32, u32) = (4, 2);
/// ...and drive to places no farther from there, in metres along either axis: well into the parts beside.
const REACH_M: f64 = 18.0;
/// Places that each drives to: some fifty metres from one to the next, through many doors.
const N_PLACES: usize = 6;
/// What a place keeps off walls, in metres: a robot stands there.
const CLEARANCE_M: f64 = 0.5;
/// Places tried before a robot is said to have none.
const N_TRIES: usize = 100_000;
/// The clock of the robots when they start: 2026-01-01 00:00 UTC, in nanoseconds.
const START_NS: i64 = 1_767_225_600_000_000_000;

/// Drives of so many robots, none of which knows where it starts. Truth is in the building's frame.
pub(super) fn fleet_drives(n_robots: u32, seed: u64) -> anyhow::Result<Vec<SimulatedDrive>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let building = random_rooms(SIZE_M, &RoomParams::OFFICES, &mut rng)?;
    let drive = |number: u32| {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(u64::from(number) + 1);
        let places = places(&building, middle(number), &mut rng).context("no free place")?;
        let robot = Robot::INDOOR;
        let drive = Drive::new(&building, robot, &places, START_NS, rng).context("no such way")?;
        let drive = simulated(number + 1, &robot, drive, Pose::IDENTITY);
        anyhow::Ok(drive.of_unknown_start())
    };
    (0..n_robots).map(drive).collect()
}

/// The middle of a robot's part of the building.
fn middle(number: u32) -> Point2<f64> {
    let (columns, rows) = N_PARTS;
    let (column, row) = (number % columns, (number / columns) % rows);
    let at = |index: u32, n: u32, size_m: f64| size_m * (f64::from(index) + 0.5) / f64::from(n);
    Point2::new(at(column, columns, SIZE_M.0), at(row, rows, SIZE_M.1))
}

/// Free places near one, in the order in which they are driven to.
fn places(
    building: &Building,
    near: Point2<f64>,
    rng: &mut ChaCha8Rng,
) -> Option<Vec<Point2<f64>>> {
    let mut places = Vec::new();
    for _ in 0..N_TRIES {
        let mut off_m = || rng.random_range(-REACH_M..REACH_M);
        let place = Point2::new(near.x + off_m(), near.y + off_m());
        if building.is_free(place, CLEARANCE_M) {
            places.push(place);
            if places.len() == N_PLACES {
                return Some(places);
            }
        }
    }
    None
}
