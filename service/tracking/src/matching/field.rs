//! Likelihood field: how well a hit at a place agrees with the walls of the grid.
//!
//! ```text
//! f(cell) = max over wall cells w near cell of exp(-|centre(cell) - hits(w)|^2 / (2 std^2))
//! ```
//!
//! where `hits(w)` is the mean of the hits in cell `w` ([`HitMean`], in quarters of a cell), and
//! wall cells are those whose log-odds reach a threshold. Zero beyond three standard deviations.
//! S. Thrun, W. Burgard, D. Fox, "Probabilistic Robotics" (2005), section 6.4, with the nearest
//! wall's place known better than to a cell.
//!
//! The field is a function of the grid alone: kept up cell by cell as scans are drawn, it equals
//! the one built anew, bit for bit.

use std::collections::HashMap;

use meetpoint_geometry::{Cell, Point2};
use meetpoint_occupancy::{Grid, HitMean, TILE_CELLS, Tile, TileIndex};

use crate::matching::tile_hashing::TileHashing;
use crate::params::FieldParams;

/// Cells that a tile holds beyond its own on the high sides, copies of its neighbours', so that a
/// block of this many cells from any cell of a tile lies within the tile.
pub(crate) const BLOCK_CELLS: usize = 16;

/// Cells along a side of a stored tile.
pub(crate) const STRIDE: usize = 64 + BLOCK_CELLS;

/// Places in a cell, along each side, that the field tells apart.
const N_PLACES: usize = 4;

/// The field's value where a hit agrees fully.
pub(crate) const FULL: f64 = 255.0;

/// Where the wall runs in a cell: 0 for no wall, else 1 + its place.
type Wall = u8;

#[derive(Clone, Debug)]
pub(crate) struct FieldTile {
    /// [`STRIDE`] cells squared, row-major.
    pub(crate) values: Box<[u8; STRIDE * STRIDE]>,
    walls: Box<[Wall; 64 * 64]>,
}

/// The likelihood field of a grid.
#[derive(Clone, Debug)]
pub struct Field {
    resolution_m: f64,
    occupied_log_odds_min: f32,
    /// A wall reaches this many cells.
    radius: i32,
    /// For each place in a cell, the values around it: a square of `2 radius + 1` cells.
    kernels: Vec<Vec<u8>>,
    places: HashMap<TileIndex, u32, TileHashing>,
    tiles: Vec<FieldTile>,
}

/// A rectangle of cells, both ends included.
#[derive(Clone, Copy)]
struct Rect {
    low: Cell,
    high: Cell,
}

impl Rect {
    fn around(cell: Cell, radius: i32) -> Self {
        Self {
            low: Cell { x: cell.x - radius, y: cell.y - radius },
            high: Cell { x: cell.x + radius, y: cell.y + radius },
        }
    }

    fn meet(self, other: Self) -> Self {
        Self {
            low: Cell { x: self.low.x.max(other.low.x), y: self.low.y.max(other.low.y) },
            high: Cell { x: self.high.x.min(other.high.x), y: self.high.y.min(other.high.y) },
        }
    }
}

impl Field {
    /// The field of a grid.
    pub fn new(grid: &Grid, params: &FieldParams) -> Self {
        let resolution_m = grid.frame().resolution_m();
        let std_cells = (params.hit_std_m / resolution_m).max(STD_CELLS_MIN);
        let radius = reach_cells(std_cells);
        let mut field = Self {
            resolution_m,
            occupied_log_odds_min: params.occupied_log_odds_min,
            radius,
            kernels: (0..N_PLACES * N_PLACES).map(|at| kernel(at, radius, std_cells)).collect(),
            places: HashMap::default(),
            tiles: Vec::new(),
        };
        for (index, tile) in grid.tiles() {
            field.draw_tile(index, tile);
        }
        field
    }

    /// Draws the walls of a tile of which nothing is drawn yet.
    fn draw_tile(&mut self, index: TileIndex, tile: &Tile) {
        let first = Cell { x: index.x * TILE_CELLS, y: index.y * TILE_CELLS };
        let mut place = 0;
        for y in first.y..first.y + TILE_CELLS {
            for x in first.x..first.x + TILE_CELLS {
                let (cell, wall) = (Cell { x, y }, self.wall_in(tile, place));
                if wall != 0 {
                    let stored = self.place_or_new(index);
                    self.tiles[stored].walls[place] = wall;
                    self.stamp(cell, wall, Rect::around(cell, self.radius));
                }
                place += 1;
            }
        }
    }

    /// Brings the field up to date with the grid in some cells.
    pub(crate) fn update(&mut self, grid: &Grid, cells: &[Cell]) {
        for &cell in cells {
            self.update_cell(grid, cell);
        }
    }

    fn update_cell(&mut self, grid: &Grid, cell: Cell) {
        let wall = self.wall_of(grid, cell);
        let before = self.wall(cell);
        if wall == before {
            return;
        }
        let (tile, index) = tile_place(cell);
        let place = self.place_or_new(tile);
        self.tiles[place].walls[index] = wall;
        let reach = Rect::around(cell, self.radius);
        if before == 0 {
            self.stamp(cell, wall, reach);
        } else {
            self.draw_again(reach);
        }
    }

    /// What the grid says of a cell.
    fn wall_of(&self, grid: &Grid, cell: Cell) -> Wall {
        let (index, place) = tile_place(cell);
        grid.tile(index).map_or(0, |tile| self.wall_in(tile, place))
    }

    /// What a tile says of the cell at one of its places.
    #[inline]
    fn wall_in(&self, tile: &Tile, place: usize) -> Wall {
        // What was never observed is not a number, and no wall.
        if self.occupied_log_odds_min <= tile.log_odds()[place] {
            tile.hit_mean(place).map_or(0, wall_at)
        } else {
            0
        }
    }

    fn wall(&self, cell: Cell) -> Wall {
        let (tile, index) = tile_place(cell);
        self.tile(tile).map_or(0, |tile| tile.walls[index])
    }

    /// The stored tile of that index.
    #[inline]
    pub(crate) fn tile(&self, index: TileIndex) -> Option<&FieldTile> {
        self.places.get(&index).map(|&place| &self.tiles[place as usize])
    }

    /// The stored tiles, in no order that may matter.
    pub(crate) fn tiles(&self) -> impl Iterator<Item = (TileIndex, &FieldTile)> {
        self.places.iter().map(|(&index, &place)| (index, &self.tiles[place as usize]))
    }

    #[expect(clippy::cast_possible_truncation, reason = "memory ends far below 2³² tiles")]
    fn place_or_new(&mut self, index: TileIndex) -> usize {
        let tiles = &mut self.tiles;
        *self.places.entry(index).or_insert_with(|| {
            tiles.push(FieldTile {
                values: Box::new([0; STRIDE * STRIDE]),
                walls: Box::new([0; 64 * 64]),
            });
            tiles.len() as u32 - 1
        }) as usize
    }

    /// Raises the values that a wall reaches within `clip`.
    fn stamp(&mut self, cell: Cell, wall: Wall, clip: Rect) {
        let reach = Rect::around(cell, self.radius).meet(clip);
        let kernel = usize::from(wall) - 1;
        let side = 2 * self.radius + 1;
        for (index, part) in stored_parts(reach) {
            let place = self.place_or_new(index);
            let first = Cell { x: index.x * TILE_CELLS, y: index.y * TILE_CELLS };
            for y in part.low.y..=part.high.y {
                let from = (y - cell.y + self.radius) * side + (part.low.x - cell.x + self.radius);
                let to = stored_index(first, Cell { x: part.low.x, y });
                let n = len(part.high.x - part.low.x + 1);
                let source = &self.kernels[kernel][len(from)..len(from) + n];
                let target = &mut self.tiles[place].values[to..to + n];
                for (value, &by_wall) in target.iter_mut().zip(source) {
                    *value = (*value).max(by_wall);
                }
            }
        }
    }

    /// Computes a rectangle anew from the walls that reach it.
    fn draw_again(&mut self, rect: Rect) {
        for (index, part) in stored_parts(rect) {
            let place = self.place_or_new(index);
            let first = Cell { x: index.x * TILE_CELLS, y: index.y * TILE_CELLS };
            for y in part.low.y..=part.high.y {
                let to = stored_index(first, Cell { x: part.low.x, y });
                let n = len(part.high.x - part.low.x + 1);
                self.tiles[place].values[to..to + n].fill(0);
            }
        }
        for y in rect.low.y - self.radius..=rect.high.y + self.radius {
            for x in rect.low.x - self.radius..=rect.high.x + self.radius {
                let wall = self.wall(Cell { x, y });
                if wall != 0 {
                    self.stamp(Cell { x, y }, wall, rect);
                }
            }
        }
    }

    /// The field at a point of the map, bilinear between the four nearest cell centres (Thrun
    /// 1998, eq. (3), with the nearest corner weighing most), in 0..=1, and its gradient along x
    /// and y per metre.
    #[inline]
    pub(crate) fn interpolate(&self, point: Point2<f64>) -> (f64, f64, f64) {
        let u = point.x / self.resolution_m - 0.5;
        let v = point.y / self.resolution_m - 0.5;
        let (cell, (s, t)) = (floor_cell(u, v), (u - u.floor(), v - v.floor()));
        let (index, _) = tile_place(cell);
        let Some(tile) = self.tile(index) else { return (0.0, 0.0, 0.0) };
        let at = stored_place(cell);
        let value = |offset: usize| f64::from(tile.values[at + offset]);
        let (a, b, c, d) = (value(0), value(1), value(STRIDE), value(STRIDE + 1));
        let low = a + s * (b - a);
        let high = c + s * (d - c);
        let scale = 1.0 / (FULL * self.resolution_m);
        let along_x = (1.0 - t) * (b - a) + t * (d - c);
        ((low + t * (high - low)) / FULL, along_x * scale, (high - low) * scale)
    }

    pub(crate) fn resolution_m(&self) -> f64 {
        self.resolution_m
    }
}

/// A wall narrower than this many cells' standard deviation would fall between cell centres.
const STD_CELLS_MIN: f64 = 0.75;

/// A wall's reach in standard deviations: beyond it the value is below 1.2 %.
const REACH_STDS: f64 = 3.0;

/// No reach is longer, whatever the parameters say: cost grows with its square.
const REACH_CELLS_MAX: f64 = 24.0;

#[expect(clippy::cast_possible_truncation, reason = "clamped")]
fn reach_cells(std_cells: f64) -> i32 {
    (REACH_STDS * std_cells).ceil().clamp(1.0, REACH_CELLS_MAX) as i32
}

/// Values around a cell whose wall runs through the given place.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "rounded from 0..=255")]
fn kernel(place: usize, radius: i32, std_cells: f64) -> Vec<u8> {
    let share = |at: usize| (at as f64 + 0.5) / N_PLACES as f64 - 0.5;
    let (x, y) = (share(place % N_PLACES), share(place / N_PLACES));
    let mut values = Vec::new();
    for row in -radius..=radius {
        for column in -radius..=radius {
            let (dx, dy) = (f64::from(column) - x, f64::from(row) - y);
            let squares = (dx * dx + dy * dy) / (std_cells * std_cells);
            values.push((FULL * (-0.5 * squares).exp()).round() as u8);
        }
    }
    values
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "shares are in (0, 1)")]
fn wall_at(mean: HitMean) -> Wall {
    let (x, y) = mean.offset();
    let place = |share: f32| ((share * N_PLACES as f32) as usize).min(N_PLACES - 1);
    1 + (place(y) * N_PLACES + place(x)) as u8
}

/// The stored tiles that a rectangle touches, with their parts of it; a cell on an apron belongs
/// to several.
fn stored_parts(rect: Rect) -> impl Iterator<Item = (TileIndex, Rect)> {
    let block = i32::try_from(BLOCK_CELLS).unwrap_or(0);
    let range = move |low: i32, high: i32| {
        (low - block).div_euclid(TILE_CELLS)..=high.div_euclid(TILE_CELLS)
    };
    let rows = range(rect.low.y, rect.high.y);
    rows.flat_map(move |y| range(rect.low.x, rect.high.x).map(move |x| TileIndex { x, y }))
        .filter_map(move |index| {
            let low = Cell { x: index.x * TILE_CELLS, y: index.y * TILE_CELLS };
            let side = TILE_CELLS + block - 1;
            let part = rect.meet(Rect { low, high: Cell { x: low.x + side, y: low.y + side } });
            let touches = part.low.x <= part.high.x && part.low.y <= part.high.y;
            touches.then_some((index, part))
        })
}

fn len(n: i32) -> usize {
    usize::try_from(n).unwrap_or(0)
}

/// Place of a cell in the stored tile whose first cell is given.
fn stored_index(first: Cell, cell: Cell) -> usize {
    len(cell.y - first.y) * STRIDE + len(cell.x - first.x)
}

/// Place of a cell in the stored tile whose own it is.
#[inline]
#[expect(clippy::cast_sign_loss, reason = "remainders are not negative")]
pub(crate) fn stored_place(cell: Cell) -> usize {
    (cell.y & (TILE_CELLS - 1)) as usize * STRIDE + (cell.x & (TILE_CELLS - 1)) as usize
}

/// The tile of a cell, and the cell's place among the tile's own.
#[inline]
#[expect(clippy::cast_sign_loss, reason = "remainders are not negative")]
pub(crate) fn tile_place(cell: Cell) -> (TileIndex, usize) {
    let tile = TileIndex { x: cell.x.div_euclid(TILE_CELLS), y: cell.y.div_euclid(TILE_CELLS) };
    let (x, y) = (cell.x & (TILE_CELLS - 1), cell.y & (TILE_CELLS - 1));
    (tile, (y * TILE_CELLS + x) as usize)
}

/// The cell of a point given in cells; far beyond the grid's reach it stays where sums of indices
/// do not overflow.
#[inline]
#[expect(clippy::cast_possible_truncation, reason = "clamped; NaN becomes 0")]
pub(crate) fn floor_cell(u: f64, v: f64) -> Cell {
    const FAR: f64 = (1 << 28) as f64;
    Cell { x: u.floor().clamp(-FAR, FAR) as i32, y: v.floor().clamp(-FAR, FAR) as i32 }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use meetpoint_geometry::{GridFrame, Pose};
    use meetpoint_occupancy::{BeamModel, LaserGeometry, ScanMarks};
    use proptest::prelude::*;

    use super::*;

    const PARAMS: FieldParams = FieldParams { hit_std_m: 0.05, occupied_log_odds_min: 0.0 };
    const LASER: LaserGeometry = LaserGeometry {
        angle_min_rad: -PI,
        angle_increment_rad: PI / 20.0,
        n_beams: 40,
        range_min_m: 0.0,
        range_max_m: 9.0,
    };

    /// A grid of some scans, and the field kept up with it.
    fn drawn(scans: &[(f64, f64, Vec<f32>)]) -> (Grid, Field) {
        let mut grid = Grid::new(GridFrame::new(0.05).expect("a length"));
        let mut field = Field::new(&grid, &PARAMS);
        let mut marks = ScanMarks::new();
        for (x, y, ranges_m) in scans {
            let pose = Pose::new(*x, *y, x + y);
            grid.insert_scan(pose, &LASER, ranges_m, &BeamModel::INDOOR, &mut marks);
            field.update(&grid, marks.changed());
        }
        (grid, field)
    }

    fn scans() -> impl Strategy<Value = Vec<(f64, f64, Vec<f32>)>> {
        let ranges_m = prop::collection::vec(0.2_f32..4.0, 40);
        prop::collection::vec((-2.0_f64..2.0, -2.0_f64..2.0, ranges_m), 1..6)
    }

    /// The definition, word for word.
    fn reference(grid: &Grid, field: &Field, cell: Cell) -> u8 {
        let near = |offset: i32| offset - field.radius..=offset + field.radius;
        let walls = near(cell.y).flat_map(|y| near(cell.x).map(move |x| Cell { x, y }));
        let value = |wall: Cell| {
            let place = field.wall_of(grid, wall);
            if place == 0 {
                return 0;
            }
            let kernel = kernel(usize::from(place) - 1, field.radius, 1.0);
            let side = 2 * field.radius + 1;
            let (dx, dy) = (cell.x - wall.x + field.radius, cell.y - wall.y + field.radius);
            kernel[len(dy * side + dx)]
        };
        walls.map(value).max().unwrap_or(0)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn kept_up_equals_the_definition(scans in scans(), x in -90..90, y in -90..90) {
            let (grid, field) = drawn(&scans);
            for offset in 0..40 {
                let cell = Cell { x: x + offset, y: y - offset };
                let (tile, _) = tile_place(cell);
                let kept = field.tile(tile).map_or(0, |tile| tile.values[stored_place(cell)]);
                prop_assert_eq!(kept, reference(&grid, &field, cell), "{:?}", cell);
            }
        }

        #[test]
        fn kept_up_equals_built_anew(scans in scans()) {
            let (grid, field) = drawn(&scans);
            let anew = Field::new(&grid, &PARAMS);
            for (index, tile) in field.tiles() {
                let empty = [0; STRIDE * STRIDE];
                let values = anew.tile(index).map_or(&empty, |tile| &*tile.values);
                prop_assert!(&*tile.values == values, "tile {index:?} differs");
            }
        }

        /// Eq. (3) of Thrun 1998 with each corner weighing by the area opposite.
        #[test]
        fn interpolates_between_four_centres(
            scans in scans(),
            x in -3.0_f64..3.0,
            y in -3.0_f64..3.0,
        ) {
            let (_, field) = drawn(&scans);
            let (u, v) = (x / 0.05 - 0.5, y / 0.05 - 0.5);
            let low = floor_cell(u, v);
            let mut expected = 0.0;
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let cell = Cell { x: low.x + dx, y: low.y + dy };
                let value = field.tile(tile_place(cell).0).map_or(0, |t| t.values[stored_place(cell)]);
                let weight = (1.0 - (u - f64::from(cell.x)).abs()) * (1.0 - (v - f64::from(cell.y)).abs());
                expected += weight * f64::from(value) / FULL;
            }
            let (value, _, _) = field.interpolate(Point2::new(x, y));
            prop_assert!((value - expected).abs() < 1e-9, "{value} is not {expected}");
        }
    }
}
