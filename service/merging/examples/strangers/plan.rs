//! Buildings by one architect: corridors with rooms on both sides, drawn into squares of 0.25 m.

use meetpoint_geometry::Point2;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Edge of a square, in metres.
pub(crate) const SQUARE_M: f64 = 0.25;
/// Squares across a corridor: 2 m.
const CORRIDOR: usize = 8;
/// Squares into a room: 5 m.
const DEPTH: usize = 20;
/// Squares about a door and the place behind it that stay free.
const FREE: f64 = 4.0;
/// Squares of a door: 1 m.
const DOOR: usize = 4;
/// Widths of rooms: 3.5, 4.5 and 6 m.
const WIDTHS: [usize; 3] = [14, 18, 24];

/// What stands and moves in a building.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    width: usize,
    height: usize,
    walls: Vec<bool>,
    pub(crate) rooms: Vec<Room>,
}

/// A room, and how one comes in.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Room {
    /// Squares: left, low, right, high; right and high are outside.
    inside: [usize; 4],
    /// Its door.
    door: [usize; 4],
    /// In the corridor before the door, in metres.
    pub(crate) before: Point2<f64>,
    /// Inside, behind the door, in metres.
    pub(crate) within: Point2<f64>,
}

impl Plan {
    /// All wall.
    pub(crate) fn solid(width: usize, height: usize) -> Self {
        Self { width, height, walls: vec![true; width * height], rooms: Vec::new() }
    }

    fn fill(&mut self, [left, low, right, high]: [usize; 4], is_wall: bool) {
        for y in low..high.min(self.height) {
            for x in left..right.min(self.width) {
                self.walls[y * self.width + x] = is_wall;
            }
        }
    }

    /// Carves a corridor of `length` squares and its rooms on both sides: along x, or along y. `corner`
    /// is its lower left; rooms are as wide as lots say, or all as wide as given.
    pub(crate) fn wing(
        &mut self,
        corner: (usize, usize),
        (length, along_y): (usize, bool),
        width: Option<usize>,
        rng: &mut impl Rng,
    ) {
        let placed = |[a, b, c, d]: [usize; 4]| {
            if along_y {
                [corner.0 + b, corner.1 + a, corner.0 + d, corner.1 + c]
            } else {
                [corner.0 + a, corner.1 + b, corner.0 + c, corner.1 + d]
            }
        };
        let low = DEPTH + 1;
        let alike = ChaCha8Rng::seed_from_u64(3);
        self.fill(placed([0, low, length, low + CORRIDOR]), false);
        for is_high in [false, true] {
            let mut at = 0;
            loop {
                let room = width.unwrap_or_else(|| WIDTHS[rng.random_range(0..WIDTHS.len())]);
                if length < at + room {
                    break;
                }
                let from = if is_high { low + CORRIDOR + 1 } else { 0 };
                let inside = placed([at, from, at + room - 1, from + DEPTH]);
                let slot = if width.is_some() { 5 } else { rng.random_range(1..room - DOOR - 2) };
                let wall = if is_high { low + CORRIDOR } else { DEPTH };
                let door = placed([at + slot, wall, at + slot + DOOR, wall + 1]);
                self.fill(inside, false);
                self.fill(door, false);
                let spot = |across: usize| {
                    let [left, low, right, high] =
                        placed([at + slot, across, at + slot + DOOR, across + 1]);
                    let middle = |a: usize, b: usize| 0.5 * (a + b) as f64 * SQUARE_M;
                    Point2::new(middle(left, right), middle(low, high))
                };
                let before = spot(low + CORRIDOR / 2);
                let within = spot(if is_high { low + CORRIDOR + 4 } else { DEPTH - 4 });
                let room_there = Room { inside, door, before, within };
                self.rooms.push(room_there);
                if width.is_some() {
                    self.furnish(&room_there, 2, &mut alike.clone());
                } else {
                    self.furnish(&room_there, 2, rng);
                }
                at += room;
            }
        }
    }

    /// Puts some things into a room, off its door.
    fn furnish(&mut self, room: &Room, n: usize, rng: &mut impl Rng) {
        let [left, low, right, high] = room.inside;
        for _ in 0..n {
            let (width, depth) = (rng.random_range(2..7), rng.random_range(2..4));
            let x = rng.random_range(left..right.saturating_sub(width).max(left + 1));
            let y = rng.random_range(low..high.saturating_sub(depth).max(low + 1));
            let thing = [x, y, x + width, y + depth];
            if is_off(thing, room) {
                self.fill(thing, true);
            }
        }
    }

    /// Carves a free rectangle.
    pub(crate) fn carve(&mut self, rectangle: [usize; 4]) {
        self.fill(rectangle, false);
    }

    /// Another day: of the rooms that nobody enters some doors are closed, and chairs stand about.
    pub(crate) fn another_day(&mut self, visited: &[usize], rng: &mut impl Rng) {
        for index in 0..self.rooms.len() {
            let room = self.rooms[index];
            if !visited.contains(&index) && rng.random_bool(0.4) {
                self.fill(room.door, true);
            }
            let [left, low, right, high] = room.inside;
            let (x, y) = (rng.random_range(left..right - 2), rng.random_range(low..high - 2));
            let chair = [x, y, x + 2, y + 2];
            if is_off(chair, &room) {
                self.fill(chair, true);
            }
        }
    }

    /// As text, the top line first.
    pub(crate) fn drawing(&self) -> String {
        let row = |row: &[bool]| row.iter().map(|&wall| if wall { '#' } else { '.' }).collect();
        let rows: Vec<String> = self.walls.chunks_exact(self.width).rev().map(row).collect();
        rows.join("\n")
    }
}

/// True if a thing leaves a way into a room.
fn is_off([left, low, right, high]: [usize; 4], room: &Room) -> bool {
    let (x, y) = (room.within.x / SQUARE_M, room.within.y / SQUARE_M);
    let door =
        (0.5 * (room.door[0] + room.door[2]) as f64, 0.5 * (room.door[1] + room.door[3]) as f64);
    let is_far = |(x, y): (f64, f64)| {
        x + FREE < left as f64
            || right as f64 + FREE < x
            || y + FREE < low as f64
            || high as f64 + FREE < y
    };
    is_far((x, y)) && is_far(door)
}

/// A way along a wing's corridor into some rooms.
pub(crate) fn way(plan: &Plan, rooms: &[usize]) -> Vec<Point2<f64>> {
    let stops = rooms.iter().map(|&room| plan.rooms[room]);
    stops.flat_map(|room| [room.before, room.within, room.before]).collect()
}
