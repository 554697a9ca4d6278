//! Map tiles: square pictures of a grid that keep its walls at every level, for panning and zooming.
//!
//! At level `z` a pixel stands for the block of `2^z` by `2^z` cells at `(x 2^z, y 2^z)` and shows the
//! most occupied cell observed there,
//!
//! ```text
//! pixel(x, y) = max over observed cells c of the block of log_odds(c)
//! ```
//!
//! or "never observed" if none was. A wall of one cell survives every level; an average would turn it
//! into free space. Time O(observed cells of the area), whatever the level.

use meetpoint_geometry::{Cell, GridFrame, GridInfo, InvalidResolution};

use crate::{Grid, Raster, TILE_CELLS, TileIndex};

/// Pixels along each side of a picture.
pub const MAP_TILE_PIXELS: i32 = 256;
/// The coarsest level: a picture of 65 536 cells a side, 3.3 km at 0.05 m.
pub const MAP_TILE_LEVEL_MAX: u8 = 8;

/// Picture `(x, y)` of a level: `MAP_TILE_PIXELS` pixels a side, its lower-left corner at
/// `(x, y) * MAP_TILE_PIXELS * 2^level` cells, y up.
///
/// # Errors
/// [`InvalidResolution`] if a pixel of that level has no length that a grid can have.
pub fn map_tile(grid: &Grid, level: u8, x: i32, y: i32) -> Result<Raster, InvalidResolution> {
    let pixel_m = grid.frame().resolution_m() * f64::from(1_u32 << level);
    let first = Cell { x: x.saturating_mul(MAP_TILE_PIXELS), y: y.saturating_mul(MAP_TILE_PIXELS) };
    let side = MAP_TILE_PIXELS.unsigned_abs();
    let info = GridInfo { frame: GridFrame::new(pixel_m)?, first, width: side, height: side };
    let mut log_odds = vec![f32::NAN; info.n_cells()];
    for (index, tile) in grid.tiles().filter(|(index, _)| touches(*index, &info, level)) {
        for (place, &observed) in (0_i32..).zip(tile.log_odds()) {
            // The corner of a tile and the cells in it lie within the grid's reach.
            let cell_x = index.x * TILE_CELLS + place % TILE_CELLS;
            let cell_y = index.y * TILE_CELLS + place / TILE_CELLS;
            let pixel = info.index_of(Cell { x: cell_x >> level, y: cell_y >> level });
            if let Some(pixel) = pixel.and_then(|pixel| log_odds.get_mut(pixel)) {
                // NaN, which stands for never observed, gives way to any number.
                *pixel = pixel.max(observed);
            }
        }
    }
    Ok(Raster { info, log_odds })
}

/// True if a tile of the grid has cells in the picture.
fn touches(tile: TileIndex, info: &GridInfo, level: u8) -> bool {
    let overlap = |tile: i32, first: i32, n_pixels: u32| {
        let lowest = tile.saturating_mul(TILE_CELLS);
        let highest = lowest.saturating_add(TILE_CELLS - 1);
        let (lowest, highest) = (i64::from(lowest >> level), i64::from(highest >> level));
        let first = i64::from(first);
        lowest < first + i64::from(n_pixels) && first <= highest
    };
    overlap(tile.x, info.first.x, info.width) && overlap(tile.y, info.first.y, info.height)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use crate::Tile;
    use proptest::prelude::*;

    use super::*;

    /// A tile whose cells are as given, written as its stored bytes are: format, log-odds, no hits.
    fn tile(log_odds: &[f32]) -> Arc<Tile> {
        let unknown = Tile::unknown().to_bytes();
        let head = unknown.len() - 4 * log_odds.len();
        let mut bytes = unknown[..head].to_vec();
        bytes.extend(log_odds.iter().flat_map(|value| value.to_le_bytes()));
        Arc::new(Tile::from_bytes(&bytes).expect("as stored"))
    }

    fn any_grid() -> impl Strategy<Value = Grid> {
        let n_cells = (TILE_CELLS * TILE_CELLS) as usize;
        let cell = prop_oneof![4 => Just(f32::NAN), 1 => -4.0_f32..4.0];
        let cells = proptest::collection::vec(cell, 97);
        let tiles = proptest::collection::vec((-5..5_i32, -5..5_i32, cells), 1..4);
        tiles.prop_map(move |tiles| {
            let frame = GridFrame::new(0.05).expect("a length");
            Grid::from_tiles(
                frame,
                tiles.into_iter().map(|(x, y, pattern)| {
                    let cells: Vec<f32> = pattern.into_iter().cycle().take(n_cells).collect();
                    (TileIndex { x, y }, tile(&cells))
                }),
            )
        })
    }

    /// The definition, word for word.
    fn pixel(grid: &Grid, level: u8, x: i32, y: i32) -> f32 {
        let side = 1 << level;
        let block = (0..side).flat_map(|dy| (0..side).map(move |dx| (dx, dy)));
        block
            .filter_map(|(dx, dy)| grid.log_odds(Cell { x: x * side + dx, y: y * side + dy }))
            .fold(f32::NAN, f32::max)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]
        #[test]
        fn shows_the_most_occupied_cell(grid in any_grid(), level in 0..4_u8, x in -2..2, y in -2..2) {
            let raster = map_tile(&grid, level, x, y).expect("a length");
            let bits: Vec<u32> = raster.log_odds.iter().map(|value| value.to_bits()).collect();
            let rows = (0..MAP_TILE_PIXELS).map(|row| y * MAP_TILE_PIXELS + row);
            let pixels = rows.flat_map(|py| (0..MAP_TILE_PIXELS).map(move |px| (x * MAP_TILE_PIXELS + px, py)));
            let expected: Vec<u32> =
                pixels.map(|(px, py)| pixel(&grid, level, px, py).to_bits()).collect();
            prop_assert!(bits == expected, "level {level} of picture ({x}, {y})");
        }
    }

    #[test]
    fn far_away_is_nothing() {
        let grid = Grid::new(GridFrame::new(0.05).expect("a length"));
        for far in [i32::MIN, i32::MAX] {
            let raster = map_tile(&grid, MAP_TILE_LEVEL_MAX, far, far).expect("a length");
            assert!(raster.log_odds.iter().all(|value| value.is_nan()), "never observed");
        }
    }
}
