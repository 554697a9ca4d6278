//! Occupancy of space, in log-odds, as a map of tiles that grows where it is observed.
//!
//! Each reading adds its evidence to the log-odds of the cells that it observes (Thrun 1998,
//! eq. (1)), which first decay towards the prior (section 2.4). What a laser looks at is the laser's:
//! sonar says nothing of it any more (`sonar/drawing.rs`). Tiles are shared until written to,
//! so that a snapshot of the whole grid costs one pointer a tile.

use std::collections::BTreeMap;
use std::sync::Arc;

use meetpoint_geometry::{Cell, GridFrame, GridInfo, Pose};

use crate::beam::{BeamModel, LaserGeometry, Reading};
use crate::history::History;
use crate::raster::Raster;
use crate::ray::Ray;
use crate::scan_marks::{Mark, ScanMarks, tile_place};
use crate::tile::{HitMean, TILE_CELLS, Tile, TileIndex};

/// No cell beyond ±this along either axis is ever drawn: 52 km at 0.05 m, so that absurd poses
/// neither overflow nor fill the memory with nothing.
pub const GRID_REACH_CELLS: i32 = 1 << 20;

/// A map of occupancy: square cells of which each has log-odds or was never observed.
#[derive(Clone, Debug)]
pub struct Grid {
    frame: GridFrame,
    pub(crate) tiles: BTreeMap<TileIndex, Arc<Tile>>,
}

impl Grid {
    /// A grid of which nothing is observed.
    pub fn new(frame: GridFrame) -> Self {
        Self { frame, tiles: BTreeMap::new() }
    }

    /// The grid that has these tiles. Of two with one index the later counts; tiles beyond
    /// [`GRID_REACH_CELLS`] are left out.
    pub fn from_tiles(
        frame: GridFrame,
        tiles: impl IntoIterator<Item = (TileIndex, Arc<Tile>)>,
    ) -> Self {
        let reach = GRID_REACH_CELLS / TILE_CELLS;
        let near = |index: i32| (-reach..reach).contains(&index);
        let tiles = tiles.into_iter().filter(|(index, _)| near(index.x) && near(index.y));
        Self { frame, tiles: tiles.collect() }
    }

    /// How metres and cells relate.
    pub fn frame(&self) -> GridFrame {
        self.frame
    }

    /// The tiles, by index along x, then y.
    pub fn tiles(&self) -> impl Iterator<Item = (TileIndex, &Arc<Tile>)> {
        self.tiles.iter().map(|(&index, tile)| (index, tile))
    }

    /// The tile of that index, or `None` where nothing was ever observed.
    pub fn tile(&self, index: TileIndex) -> Option<&Arc<Tile>> {
        self.tiles.get(&index)
    }

    /// Log-odds of "occupied", or `None` if no reading ever observed the cell.
    pub fn log_odds(&self, cell: Cell) -> Option<f32> {
        let (tile, index) = tile_place(cell);
        let log_odds = self.tiles.get(&tile)?.log_odds()[index];
        (!log_odds.is_nan()).then_some(log_odds)
    }

    /// Log-odds of "occupied" as robots without a laser are followed by them ([`Grid::insert_followed`]), or `None`
    /// where nothing is known.
    pub fn followed_log_odds(&self, cell: Cell) -> Option<f32> {
        let (tile, index) = tile_place(cell);
        let log_odds = self.tiles.get(&tile)?.followed_log_odds(index);
        (!log_odds.is_nan()).then_some(log_odds)
    }

    /// Where in a cell its recent hits lie, or `None` if nothing was ever hit there.
    pub fn hit_mean(&self, cell: Cell) -> Option<HitMean> {
        let (tile, index) = tile_place(cell);
        self.tiles.get(&tile)?.hit_mean(index)
    }

    /// What became of a cell, or `None` if it was never both hit and clearly free.
    pub fn history(&self, cell: Cell) -> Option<&History> {
        let (tile, index) = tile_place(cell);
        self.tiles.get(&tile)?.history(index)
    }

    /// The smallest rectangle that holds all observed cells, or `None` if there are none.
    pub fn bounds(&self) -> Option<GridInfo> {
        let mut bounds: Option<(Cell, Cell)> = None;
        for (index, tile) in self.tiles() {
            let Some((low, high)) = observed_box(index, tile) else { continue };
            let (first, last) = bounds.get_or_insert((low, high));
            *first = Cell { x: first.x.min(low.x), y: first.y.min(low.y) };
            *last = Cell { x: last.x.max(high.x), y: last.y.max(high.y) };
        }
        let (first, last) = bounds?;
        Some(GridInfo {
            frame: self.frame,
            first,
            width: last.x.abs_diff(first.x) + 1,
            height: last.y.abs_diff(first.y) + 1,
        })
    }

    /// The cells of a rectangle, or of [`Grid::bounds`] if none is given; a rectangle of no cells
    /// if nothing was observed. The frame of `info` is not looked at: its cells are this grid's.
    pub fn raster(&self, info: Option<GridInfo>) -> Raster {
        let empty = GridInfo { frame: self.frame, first: Cell { x: 0, y: 0 }, width: 0, height: 0 };
        let mut info = info.or_else(|| self.bounds()).unwrap_or(empty);
        info.frame = self.frame;
        let mut raster = Raster { info, log_odds: vec![f32::NAN; info.n_cells()] };
        for (index, tile) in self.tiles() {
            copy_tile(index, tile, &mut raster);
        }
        raster
    }

    /// Draws a scan taken from `map_from_sensor`, and leaves in `marks` which of the cells ever hit
    /// it met ([`ScanMarks::changed`]). A pose that is not finite or beyond the grid's reach draws
    /// nothing.
    pub fn insert_scan(
        &mut self,
        map_from_sensor: Pose,
        geometry: &LaserGeometry,
        ranges_m: &[f32],
        model: &BeamModel,
        marks: &mut ScanMarks,
    ) {
        marks.clear();
        let resolution_m = self.frame.resolution_m();
        let from = (map_from_sensor.x_m / resolution_m, map_from_sensor.y_m / resolution_m);
        if !within_reach(from) {
            return;
        }
        for (bearing_rad, reading) in geometry.readings(ranges_m) {
            let Some((range_m, hits)) = drawn_range(reading, geometry, model) else { continue };
            let (sin, cos) = (map_from_sensor.theta_rad + bearing_rad).sin_cos();
            let range = range_m / resolution_m;
            let to = (from.0 + range * cos, from.1 + range * sin);
            if within_reach(to) {
                mark_beam(from, to, hits, marks);
            }
        }
        self.integrate(model, marks);
    }

    /// Brings the marks of a scan into the cells.
    fn integrate(&mut self, model: &BeamModel, marks: &mut ScanMarks) {
        let ScanMarks { tiles, hits, changed, .. } = marks;
        for hit in hits {
            let index = tiles[hit.tile as usize].0;
            let tile =
                Arc::make_mut(self.tiles.entry(index).or_insert_with(|| Arc::new(Tile::unknown())));
            tile.add_hit(hit.index, hit.share, model.hit_weight);
        }
        for (index, marks) in tiles.iter() {
            let tile = Arc::make_mut(
                self.tiles.entry(*index).or_insert_with(|| Arc::new(Tile::unknown())),
            );
            integrate_tile(*index, tile, marks, model, changed);
        }
    }
}

fn integrate_tile(
    tile_index: TileIndex,
    tile: &mut Tile,
    marks: &[Mark; 4096],
    model: &BeamModel,
    changed: &mut Vec<Cell>,
) {
    for (row, marks) in marks.chunks_exact(64).enumerate() {
        if marks.iter().all(|&mark| mark == Mark::Unseen) {
            continue;
        }
        for (column, &mark) in marks.iter().enumerate() {
            let evidence = match mark {
                Mark::Unseen => continue,
                Mark::Missed => model.log_odds_miss,
                Mark::Hit => model.log_odds_hit,
            };
            let index = row * 64 + column;
            tile.forget_heard(index);
            tile.set_log_odds(index, model.updated(tile.log_odds()[index], evidence));
            if tile.hit_mean(index).is_some() {
                changed.push(cell_of(tile_index, index));
            }
        }
    }
}

/// How far a reading is drawn, in metres, and whether it ends in a hit; `None` for nothing.
fn drawn_range(
    reading: Reading,
    geometry: &LaserGeometry,
    model: &BeamModel,
) -> Option<(f64, bool)> {
    match reading {
        Reading::Invalid => None,
        Reading::Nothing => Some((geometry.range_max_m.min(model.clear_range_max_m), false)),
        Reading::Hit(range_m) if model.hit_range_max_m < range_m => {
            Some((model.clear_range_max_m.min(range_m), false))
        }
        Reading::Hit(range_m) => Some((range_m, true)),
    }
}

/// Marks a beam between two points given in cells.
fn mark_beam(from: (f64, f64), to: (f64, f64), hits: bool, marks: &mut ScanMarks) {
    let last = Cell { x: floor(to.0), y: floor(to.1) };
    for cell in Ray::new(from, to) {
        if cell != last || !hits {
            marks.miss(cell);
        }
    }
    if hits {
        marks.hit(last, (share(to.0), share(to.1)));
    }
}

#[expect(clippy::cast_possible_truncation, reason = "within the grid's reach")]
fn floor(coordinate: f64) -> i32 {
    coordinate.floor() as i32
}

#[expect(clippy::cast_possible_truncation, reason = "a share of a cell needs no more digits")]
fn share(coordinate: f64) -> f32 {
    (coordinate - coordinate.floor()) as f32
}

/// False also for NaN.
fn within_reach(point: (f64, f64)) -> bool {
    let reach = f64::from(GRID_REACH_CELLS);
    point.0.abs() < reach && point.1.abs() < reach
}

/// The cell at a place of a tile.
#[expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "below 4,096")]
pub(crate) fn cell_of(tile: TileIndex, index: usize) -> Cell {
    let index = index as i32;
    Cell {
        x: tile.x * TILE_CELLS + index % TILE_CELLS,
        y: tile.y * TILE_CELLS + index / TILE_CELLS,
    }
}

/// The cells of a square about one, which is among them.
pub(crate) fn around(cell: Cell, distance: i32) -> impl Iterator<Item = Cell> {
    let side = -distance..=distance;
    side.clone().flat_map(move |dy| {
        side.clone()
            .map(move |dx| Cell { x: cell.x.saturating_add(dx), y: cell.y.saturating_add(dy) })
    })
}

/// The lower-left and upper-right of a tile's observed cells.
fn observed_box(tile_index: TileIndex, tile: &Tile) -> Option<(Cell, Cell)> {
    let observed = tile.log_odds().iter().enumerate().filter(|(_, log_odds)| !log_odds.is_nan());
    observed.map(|(index, _)| cell_of(tile_index, index)).fold(None, |bounds, cell| {
        let (low, high) = bounds.unwrap_or((cell, cell));
        Some((
            Cell { x: low.x.min(cell.x), y: low.y.min(cell.y) },
            Cell { x: high.x.max(cell.x), y: high.y.max(cell.y) },
        ))
    })
}

/// Copies what of a tile lies in the raster.
fn copy_tile(tile_index: TileIndex, tile: &Tile, raster: &mut Raster) {
    for (row, cells) in tile.log_odds().chunks_exact(64).enumerate() {
        for (column, &log_odds) in cells.iter().enumerate() {
            if let Some(index) = raster.info.index_of(cell_of(tile_index, row * 64 + column)) {
                raster.log_odds[index] = log_odds;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use meetpoint_geometry::Point2;
    use proptest::prelude::*;

    use super::*;

    const LASER: LaserGeometry = LaserGeometry {
        angle_min_rad: -PI,
        angle_increment_rad: PI / 12.0,
        n_beams: 24,
        range_min_m: 0.0,
        range_max_m: 9.0,
    };

    fn drawn(pose: Pose, ranges_m: &[f32]) -> Grid {
        let mut grid = Grid::new(GridFrame::new(0.1).expect("a length"));
        grid.insert_scan(pose, &LASER, ranges_m, &BeamModel::INDOOR, &mut ScanMarks::new());
        grid
    }

    #[test]
    fn free_up_to_the_hit_and_nothing_behind() {
        let grid = drawn(Pose::new(0.05, 0.05, PI), &[1.0]);
        let model = BeamModel::INDOOR;
        let at = |x| grid.log_odds(Cell { x, y: 0 });
        assert_eq!(at(-1), None, "behind the sensor");
        assert_eq!(at(0), Some(model.log_odds_miss), "at the sensor");
        assert_eq!(at(9), Some(model.log_odds_miss), "before the hit");
        assert_eq!(at(10), Some(model.log_odds_hit), "the hit");
        assert_eq!(at(11), None, "behind the hit");
        let bounds = grid.bounds().expect("observed");
        assert_eq!((bounds.first, bounds.width), (Cell { x: 0, y: 0 }, 11), "as far as observed");
        assert_eq!(grid.raster(None).log_odds[10], model.log_odds_hit, "lowest row first");
    }

    #[test]
    fn nothing_hit_clears_as_far_as_the_model_believes() {
        let grid = drawn(Pose::new(0.05, 0.05, PI), &[f32::INFINITY]);
        let bounds = grid.bounds().expect("observed");
        assert_eq!(bounds.width, 51, "5 m of the laser's 9 m");
        assert_eq!(drawn(Pose::IDENTITY, &[f32::NAN; 24]).bounds(), None, "invalid says nothing");
    }

    #[test]
    fn absurd_poses_draw_nothing() {
        for x_m in [f64::NAN, f64::INFINITY, 1e300, 1e7] {
            assert_eq!(drawn(Pose { x_m, ..Pose::IDENTITY }, &[1.0; 24]).bounds(), None, "{x_m} m");
        }
    }

    #[test]
    fn snapshots_stay_as_they_were() {
        let mut grid = drawn(Pose::IDENTITY, &[1.0; 24]);
        let snapshot = grid.clone();
        let before: Vec<_> = snapshot.tiles().map(|(_, tile)| tile.to_bytes()).collect();
        let model = BeamModel::INDOOR;
        grid.insert_scan(Pose::IDENTITY, &LASER, &[2.0; 24], &model, &mut ScanMarks::new());
        let after: Vec<_> = snapshot.tiles().map(|(_, tile)| tile.to_bytes()).collect();
        assert!(before == after, "written to a copy");
    }

    proptest! {
        /// The definition by dense sampling: hit cells are occupied, cells that a beam's samples
        /// meet before are free, and no others are observed.
        #[test]
        fn agrees_with_dense_sampling(
            (x, y, theta) in (-3.0_f64..3.0, -3.0_f64..3.0, -3.0_f64..3.0),
            ranges_m in prop::collection::vec(0.3_f32..4.0, 24),
        ) {
            let pose = Pose::new(x, y, theta);
            let grid = drawn(pose, &ranges_m);
            let point = |bearing_rad: f64, range_m: f64| {
                let (sin, cos) = bearing_rad.sin_cos();
                grid.frame().cell_at(pose * Point2::new(range_m * cos, range_m * sin))
            };
            let beams: Vec<_> = LASER.readings(&ranges_m).filter_map(|(bearing_rad, reading)| {
                if let Reading::Hit(range_m) = reading { Some((bearing_rad, range_m)) } else { None }
            }).collect();
            let hits: Vec<Cell> = beams.iter().map(|&(bearing, range_m)| point(bearing, range_m)).collect();
            for hit in &hits {
                prop_assert_eq!(grid.log_odds(*hit), Some(BeamModel::INDOOR.log_odds_hit));
            }
            for (bearing_rad, range_m) in beams {
                for sample in 0..400 {
                    let cell = point(bearing_rad, range_m * f64::from(sample) / 400.0);
                    let free = grid.log_odds(cell) == Some(BeamModel::INDOOR.log_odds_miss);
                    prop_assert!(free || hits.contains(&cell), "{cell:?} is crossed");
                }
            }
        }
    }
}
