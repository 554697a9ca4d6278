//! The buildings, drawn as text.

use meetpoint_geometry::Point2;
use rand::{Rng, RngExt};

/// Edge of a character, in metres.
pub(crate) const CHARACTER_M: f64 = 0.25;

/// A drawing and a way through it.
pub(crate) type Plan = (String, Vec<Point2<f64>>);

/// Offices on each side.
const N_OFFICES: usize = 20;
/// Columns from one office to the next: 6 m.
const PITCH: usize = 24;
/// Rows of an office (5 m) and of the corridor (2.5 m), without walls.
const DEPTH: usize = 20;
const CORRIDOR: usize = 10;
/// Offices that are visited.
const N_VISITS: usize = 10;

/// Forty offices alike, twenty on each side, each with a door in the middle, a desk and a shelf; ten
/// visits in any order, from the corridor's end and back to it.
pub(crate) fn offices(rng: &mut impl Rng) -> Plan {
    let (width, height) = (N_OFFICES * PITCH + 1, 2 * DEPTH + CORRIDOR + 4);
    let cell = |column: usize, row: usize| {
        let across = column % PITCH;
        let is_end = row == 0 || row + 1 == height || column == 0 || column + 1 == width;
        let from_corridor = if row < DEPTH + 2 {
            DEPTH + 1 - row.min(DEPTH + 1)
        } else {
            row.saturating_sub(DEPTH + CORRIDOR + 2)
        };
        let in_corridor = (DEPTH + 2..DEPTH + 2 + CORRIDOR).contains(&row);
        let is_front = row == DEPTH + 1 || row == DEPTH + 2 + CORRIDOR;
        let is_door = (10..14).contains(&across);
        let is_desk = (4..9).contains(&from_corridor) && (3..6).contains(&across) && !in_corridor;
        let is_shelf =
            (14..18).contains(&from_corridor) && (21..23).contains(&across) && !in_corridor;
        let is_wall = is_end
            || (!in_corridor && across == 0)
            || (is_front && !is_door)
            || is_desk
            || is_shelf;
        if is_wall { '#' } else { '.' }
    };
    let row = |row: usize| (0..width).map(|column| cell(column, row)).collect::<String>();
    let drawing = (0..height).map(row).collect::<Vec<_>>().join("\n");
    let middle_m = height as f64 * CHARACTER_M / 2.0;
    let mut waypoints = vec![Point2::new(1.0, middle_m)];
    for _ in 0..N_VISITS {
        let x_m = (rng.random_range(0..N_OFFICES) * PITCH + 12) as f64 * CHARACTER_M;
        let side = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        waypoints.push(Point2::new(x_m, middle_m));
        waypoints.push(Point2::new(x_m, middle_m + side * 4.0));
        waypoints.push(Point2::new(x_m, middle_m));
    }
    waypoints.push(Point2::new(1.0, middle_m));
    (drawing, waypoints)
}
