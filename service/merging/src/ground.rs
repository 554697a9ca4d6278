//! What a map says of each cell, on a lattice of its own: wall, free or not known.

use meetpoint_geometry::{Cell, GridFrame, GridInfo, Point2};
use meetpoint_occupancy::{Grid, HitMean, TILE_CELLS};

/// Edge of a cell, in metres, unless the map is larger than [`N_CELLS_MAX`]: half the width of the
/// narrowest things that tell places apart, and four times the error of a good laser map.
const EDGE_M: f64 = 0.1;
/// Cells of a ground, at most: 400 m by 400 m at 0.1 m.
const N_CELLS_MAX: u64 = 1 << 24;
/// Log-odds of a free cell, at most: three beams went through it.
const FREE_LOG_ODDS_MAX: f32 = -1.0;
/// Log-odds of a wall, at least.
const WALL_LOG_ODDS_MIN: f32 = 0.0;

/// What is known of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Known {
    /// Nothing, or too little to rely on.
    Unknown,
    /// Several beams went through it.
    Free,
    /// Something stands there.
    Wall,
}

/// A map's cells, coarse and dense.
#[derive(Clone, Debug)]
pub(crate) struct Ground {
    pub(crate) info: GridInfo,
    cells: Vec<Known>,
}

impl Ground {
    /// The ground of a grid of any resolution, with the places of its walls in metres, by tile and cell.
    pub(crate) fn of_grid(grid: &Grid) -> (Self, Vec<Point2<f64>>) {
        let mut ground = Self::unknown(grid);
        let mut walls = Vec::new();
        let fine = grid.frame();
        let edge_m = fine.resolution_m();
        for (index, tile) in grid.tiles() {
            for (place, &log_odds) in tile.log_odds().iter().enumerate() {
                let known = known(log_odds);
                if known == Known::Unknown {
                    continue;
                }
                let cell = cell_of(index.x, index.y, place);
                ground.draw(fine.corner_of(cell), edge_m, known);
                if known == Known::Wall {
                    let corner = fine.corner_of(cell);
                    let (x, y) = tile.hit_mean(place).map_or((0.5, 0.5), HitMean::offset);
                    walls
                        .push(corner + nalgebra::Vector2::new(f64::from(x), f64::from(y)) * edge_m);
                }
            }
        }
        (ground, walls)
    }

    fn unknown(grid: &Grid) -> Self {
        let fine_m = grid.frame().resolution_m();
        let bounds = grid.bounds();
        let sides =
            bounds.map_or((0.0, 0.0), |info| (f64::from(info.width), f64::from(info.height)));
        let mut edge_m = EDGE_M;
        while (N_CELLS_MAX as f64) < sides.0 * sides.1 * (fine_m / edge_m).powi(2) {
            edge_m *= 2.0;
        }
        let frame = GridFrame::new(edge_m).unwrap_or(grid.frame());
        let none = GridInfo { frame, first: Cell { x: 0, y: 0 }, width: 0, height: 0 };
        let info = bounds.map_or(none, |fine| {
            let first = frame.cell_at(fine.origin());
            let side = |n: u32| fine_m * f64::from(n);
            let end = fine.origin() + nalgebra::Vector2::new(side(fine.width), side(fine.height));
            let last = frame.cell_at(end);
            GridInfo {
                frame,
                first,
                width: last.x.abs_diff(first.x) + 1,
                height: last.y.abs_diff(first.y) + 1,
            }
        });
        Self { info, cells: vec![Known::Unknown; info.n_cells()] }
    }

    /// Draws a square of a grid's cell: walls over free, free over unknown.
    fn draw(&mut self, corner: Point2<f64>, edge_m: f64, known: Known) {
        let margin = nalgebra::Vector2::repeat(0.01 * edge_m);
        let low = self.info.frame.cell_at(corner + margin);
        let high = self.info.frame.cell_at(corner + nalgebra::Vector2::repeat(edge_m) - margin);
        for y in low.y..=high.y {
            for x in low.x..=high.x {
                if let Some(index) = self.info.index_of(Cell { x, y })
                    && self.cells[index] != Known::Wall
                {
                    self.cells[index] = known;
                }
            }
        }
    }

    /// What is known at a point.
    pub(crate) fn at(&self, point: Point2<f64>) -> Known {
        self.cell(self.info.frame.cell_at(point))
    }

    /// What is known of a cell.
    pub(crate) fn cell(&self, cell: Cell) -> Known {
        self.info.index_of(cell).map_or(Known::Unknown, |index| self.cells[index])
    }

    /// Edge of a cell, in metres.
    pub(crate) fn edge_m(&self) -> f64 {
        self.info.frame.resolution_m()
    }

    /// The cells in the order of memory.
    pub(crate) fn cells(&self) -> &[Known] {
        &self.cells
    }

    /// Middles of the known cells, those of every `stride`-th row and column.
    pub(crate) fn known_points(&self, stride: usize) -> Vec<Point2<f64>> {
        let width = self.info.width as usize;
        let rows = self.cells.chunks_exact(width.max(1)).enumerate().step_by(stride);
        let points = rows.flat_map(|(y, row)| {
            row.iter()
                .enumerate()
                .step_by(stride)
                .filter(|(_, known)| **known != Known::Unknown)
                .map(move |(x, _)| self.info.frame.center_of(self.cell_at_place(x, y)))
        });
        points.collect()
    }

    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_possible_wrap,
        reason = "within N_CELLS_MAX"
    )]
    fn cell_at_place(&self, x: usize, y: usize) -> Cell {
        Cell { x: self.info.first.x + x as i32, y: self.info.first.y + y as i32 }
    }
}

/// NaN, never observed, is not known.
fn known(log_odds: f32) -> Known {
    if WALL_LOG_ODDS_MIN < log_odds {
        Known::Wall
    } else if log_odds <= FREE_LOG_ODDS_MAX {
        Known::Free
    } else {
        Known::Unknown
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "below 4,096")]
fn cell_of(tile_x: i32, tile_y: i32, place: usize) -> Cell {
    let place = place as i32;
    Cell {
        x: tile_x * TILE_CELLS + place % TILE_CELLS,
        y: tile_y * TILE_CELLS + place / TILE_CELLS,
    }
}
