//! A rectangle cut out of the grid, dense, for whoever draws or searches it.

use std::sync::Arc;

use meetpoint_geometry::{Cell, GridInfo};

use crate::grid::Grid;
use crate::tile::{TILE_CELLS, Tile, TileIndex};

/// Log-odds of a rectangle of cells.
#[derive(Clone, Debug)]
pub struct Raster {
    /// Which cells, and how they lie in the map.
    pub info: GridInfo,
    /// Natural logarithm of the odds of "occupied", one number a cell, row-major along +x, the
    /// lowest row first; NaN where no reading ever observed the cell.
    /// Invariant: `info.n_cells()` numbers.
    pub log_odds: Vec<f32>,
}

impl Raster {
    /// What [`Raster::percent`] says of a cell that was never observed.
    pub const PERCENT_UNKNOWN: u8 = 255;

    /// Probability of "occupied" in percent, 0..=100, rounded to the nearest; 255 where never
    /// observed. Same order as `log_odds`.
    pub fn percent(&self) -> Vec<u8> {
        self.log_odds.iter().map(|&log_odds| percent(log_odds)).collect()
    }
}

impl Grid {
    /// The grid of which these cells were observed. Where the odds are for "occupied", a hit in the
    /// middle of the cell is remembered, so that scans match against walls that no scan drew. Tiles
    /// beyond [`GRID_REACH_CELLS`](crate::GRID_REACH_CELLS) are left out. Time O(cells).
    pub fn from_raster(raster: &Raster) -> Self {
        let GridInfo { frame, first, width, height } = raster.info;
        let tiles_along = |first: i32, n_cells: u32| {
            let last = i64::from(first) + i64::from(n_cells) - 1;
            let last = i32::try_from(last).unwrap_or(i32::MAX);
            first.div_euclid(TILE_CELLS)..=last.div_euclid(TILE_CELLS)
        };
        if width == 0 || height == 0 {
            return Self::new(frame);
        }
        let indices = tiles_along(first.y, height)
            .flat_map(|y| tiles_along(first.x, width).map(move |x| TileIndex { x, y }));
        let observed = indices.filter_map(|index| Some((index, Arc::new(tile(raster, index)?))));
        Self::from_tiles(frame, observed)
    }
}

/// What of a raster lies in a tile; `None` if nothing of that was observed.
fn tile(raster: &Raster, index: TileIndex) -> Option<Tile> {
    let mut tile = None;
    let places = (0..TILE_CELLS).flat_map(|y| (0..TILE_CELLS).map(move |x| (x, y)));
    for (place, (x, y)) in places.enumerate() {
        let corner = [index.x, index.y].map(|tiles| tiles.saturating_mul(TILE_CELLS));
        let cell = Cell { x: corner[0].saturating_add(x), y: corner[1].saturating_add(y) };
        let log_odds = raster.info.index_of(cell).map_or(f32::NAN, |at| raster.log_odds[at]);
        if log_odds.is_nan() {
            continue;
        }
        let tile = tile.get_or_insert_with(Tile::unknown);
        tile.set_log_odds(place, log_odds);
        if 0.0 < log_odds {
            tile.add_hit(place, (0.5, 0.5), 1.0);
        }
    }
    tile
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a rounded percentage lies within 0..=100"
)]
fn percent(log_odds: f32) -> u8 {
    if log_odds.is_nan() {
        return Raster::PERCENT_UNKNOWN;
    }
    let probability = 1.0 / (1.0 + (-log_odds).exp());
    (100.0 * probability).round() as u8
}

#[cfg(test)]
mod tests {
    use meetpoint_geometry::{Cell, GridFrame};

    use super::*;

    #[test]
    fn even_odds_are_half_and_unknown_is_not_half() {
        let frame = GridFrame::new(0.05).expect("a length");
        let info = GridInfo { frame, first: Cell { x: 0, y: 0 }, width: 5, height: 1 };
        let log_odds = vec![0.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 2.0];
        let raster = Raster { info, log_odds };
        assert_eq!(raster.percent(), [50, 255, 100, 0, 88], "e^2 / (1 + e^2) is 0.88");
    }
}
