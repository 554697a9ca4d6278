//! Floors of many rooms, made by cutting a rectangle in two again and again.
//!
//! Each cut is a wall with a door of a metre; no cut ends in a door, so that every room can be reached.
//! Some rooms have furniture: blocks that stand apart from walls and from one another.

use rand::seq::IndexedRandom;
use rand::{Rng, RngExt};

use crate::building::{Building, InvalidBuilding};

/// How rooms are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoomParams {
    /// Edge of the floor's cells, and thickness of a wall, in metres.
    pub cell_m: f64,
    /// No room is cut to less than this, in metres.
    pub room_min_m: f64,
    /// Rooms larger than this are cut if they can be, in metres along the longer side.
    pub room_max_m: f64,
    /// Width of a door, in metres.
    pub door_m: f64,
    /// Blocks of furniture tried for every 10 square metres.
    pub furniture_per_10_m2: f64,
}

impl RoomParams {
    /// Offices and halls, a table or a shelf in every other.
    pub const OFFICES: Self = Self {
        cell_m: 0.1,
        room_min_m: 2.5,
        room_max_m: 7.0,
        door_m: 1.0,
        furniture_per_10_m2: 0.6,
    };
}

/// A room: its first column and row and the ones beyond, walls not included.
#[derive(Clone, Copy, Debug)]
struct Room {
    x: (usize, usize),
    y: (usize, usize),
}

/// A floor under work.
struct Floor<'a, R> {
    params: &'a RoomParams,
    walls: Vec<bool>,
    width: usize,
    rng: &'a mut R,
}

/// Sizes of furniture, in metres.
const FURNITURE_M: std::ops::Range<f64> = 0.4..1.6;
/// Furniture stands off walls and other furniture by so much, in metres: a robot passes.
const PASSAGE_M: f64 = 0.8;

/// A floor of that size, in metres, surrounded by a wall.
///
/// # Errors
/// [`InvalidBuilding`] if there is no floor of that size, or no such cells.
pub fn random_rooms(
    (width_m, height_m): (f64, f64),
    params: &RoomParams,
    rng: &mut impl Rng,
) -> Result<Building, InvalidBuilding> {
    let cells = |metres: f64| cells(metres, params.cell_m);
    let (width, height) = (cells(width_m), cells(height_m));
    if width < 3 || height < 3 {
        return Err(InvalidBuilding::Empty);
    }
    let is_rim = |at: usize| {
        let (x, y) = (at % width, at / width);
        x == 0 || y == 0 || x + 1 == width || y + 1 == height
    };
    let walls = (0..width * height).map(is_rim).collect();
    let mut floor = Floor { params, walls, width, rng };
    let mut rooms = vec![Room { x: (1, width - 1), y: (1, height - 1) }];
    while let Some(room) = rooms.pop() {
        match floor.cut(room) {
            Some(halves) => rooms.extend(halves),
            None => floor.furnish(room),
        }
    }
    let columns = u32::try_from(width).map_err(|_| InvalidBuilding::Empty)?;
    Building::from_cells(floor.walls, columns, params.cell_m)
}

/// The nearest whole number of cells.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "saturating; absurd sizes are refused where cells are counted"
)]
fn cells(metres: f64, cell_m: f64) -> usize {
    (metres / cell_m).round().clamp(0.0, 1e5) as usize
}

impl<R: Rng> Floor<'_, R> {
    fn cells(&self, metres: f64) -> usize {
        cells(metres, self.params.cell_m)
    }

    /// Cuts a room across its longer side, if it is long enough and a place is found.
    fn cut(&mut self, room: Room) -> Option<[Room; 2]> {
        let lengths = [room.x.1 - room.x.0, room.y.1 - room.y.0];
        let is_across_x = lengths[1] <= lengths[0];
        let (along, beside) = if is_across_x { (room.x, room.y) } else { (room.y, room.x) };
        let least = self.cells(self.params.room_min_m);
        if along.1 - along.0 <= self.cells(self.params.room_max_m) || least == 0 {
            return None;
        }
        let at = |along: usize, beside: usize| {
            if is_across_x { [along, beside] } else { [beside, along] }
        };
        // A cut may not end in a door.
        let ends_in_walls = |&place: &usize| {
            let is_wall = |[x, y]: [usize; 2]| self.walls[y * self.width + x];
            is_wall(at(place, beside.0 - 1)) && is_wall(at(place, beside.1))
        };
        let places: Vec<usize> =
            (along.0 + least..along.1.saturating_sub(least)).filter(ends_in_walls).collect();
        let &place = places.choose(self.rng)?;
        let n_door = self.cells(self.params.door_m).clamp(1, beside.1 - beside.0);
        let first = self.rng.random_range(beside.0..=beside.1 - n_door);
        let door = first..first + n_door;
        for beside in (beside.0..beside.1).filter(|beside| !door.contains(beside)) {
            let [x, y] = at(place, beside);
            self.walls[y * self.width + x] = true;
        }
        let parts = [(along.0, place), (place + 1, along.1)];
        Some(parts.map(|part| {
            if is_across_x { Room { x: part, ..room } } else { Room { y: part, ..room } }
        }))
    }

    /// Puts some blocks into a room where they block nothing.
    fn furnish(&mut self, room: Room) {
        let lengths = [room.x.1 - room.x.0, room.y.1 - room.y.0];
        let area_m2 = (lengths[0] * lengths[1]) as f64 * self.params.cell_m.powi(2);
        let expected = self.params.furniture_per_10_m2 * area_m2 / 10.0;
        let n_tries = cells(expected + self.rng.random_range(-0.5..0.5), 1.0);
        let passage = self.cells(PASSAGE_M);
        for _ in 0..n_tries {
            let sides_m: [f64; 2] = std::array::from_fn(|_| self.rng.random_range(FURNITURE_M));
            let sides = sides_m.map(|side_m| self.cells(side_m).max(1));
            let fits = |axis: usize| sides[axis] + 2 * passage < lengths[axis];
            if !(fits(0) && fits(1)) {
                continue;
            }
            let first = [room.x.0, room.y.0];
            let [x, y] = std::array::from_fn(|axis| {
                let last = first[axis] + lengths[axis] - passage - sides[axis];
                self.rng.random_range(first[axis] + passage..=last)
            });
            self.put([x, y], sides, passage);
        }
    }

    /// Puts a block where nothing stands within `passage` cells.
    fn put(&mut self, [x, y]: [usize; 2], sides: [usize; 2], passage: usize) {
        let mut near = (y - passage..y + sides[1] + passage)
            .flat_map(|y| (x - passage..x + sides[0] + passage).map(move |x| (x, y)));
        if near.any(|(x, y)| self.walls[y * self.width + x]) {
            return;
        }
        for (x, y) in (y..y + sides[1]).flat_map(|y| (x..x + sides[0]).map(move |x| (x, y))) {
            self.walls[y * self.width + x] = true;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use meetpoint_geometry::Cell;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    /// Cells that can be reached from the first free one, and all free ones.
    fn reached(building: &Building) -> (usize, usize) {
        let info = building.info();
        let is_free = |cell: Cell| info.index_of(cell).is_some() && !building.is_wall(cell);
        let all = (0..info.height.cast_signed())
            .flat_map(|y| (0..info.width.cast_signed()).map(move |x| Cell { x, y }));
        let free: Vec<Cell> = all.filter(|&cell| is_free(cell)).collect();
        let mut seen = std::collections::BTreeSet::new();
        let mut ahead = vec![free[0]];
        while let Some(cell) = ahead.pop() {
            if is_free(cell) && seen.insert((cell.x, cell.y)) {
                let steps = [(1, 0), (-1, 0), (0, 1), (0, -1)];
                ahead.extend(steps.map(|(dx, dy)| Cell { x: cell.x + dx, y: cell.y + dy }));
            }
        }
        (seen.len(), free.len())
    }

    #[test]
    fn every_room_can_be_reached() {
        for seed in 0..8 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let floor =
                random_rooms((30.0, 18.0), &RoomParams::OFFICES, &mut rng).expect("a floor");
            assert_eq!((floor.info().width, floor.info().height), (300, 180), "as large as asked");
            let (n_reached, n_free) = reached(&floor);
            assert_eq!(n_reached, n_free, "seed {seed}: a room without a door");
            assert!(n_free < 300 * 180 * 97 / 100, "seed {seed}: hardly any walls");
        }
    }

    #[test]
    fn no_floor_no_rooms() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let floor = random_rooms((0.1, 5.0), &RoomParams::OFFICES, &mut rng);
        assert_eq!(floor.err(), Some(InvalidBuilding::Empty), "too narrow for walls");
    }
}
