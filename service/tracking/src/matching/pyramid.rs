//! A likelihood field with its bounds at several scales.
//!
//! ```text
//! level h:   M_h(cell) = max over the 2^h by 2^h cells from `cell` on of the field
//! ```
//!
//! so that the sum of `M_h` over some points' cells bounds what the field can be at the points shifted by
//! 0 to 2^h - 1 cells along either axis: W. Hess, D. Kohler, H. Rapp, D. Andor, "Real-time loop closure
//! in 2D LIDAR SLAM", ICRA 2016, section V-B. Each level is made of the one before by doubling the
//! squares. Space: a byte a cell and level.

use meetpoint_geometry::Cell;
use meetpoint_occupancy::{TILE_CELLS, TileIndex};

use crate::matching::field::{Field, FieldTile, STRIDE};

/// Scales, from the coarsest, as powers of two; the last is the field itself.
pub(crate) const LEVELS: [u32; 4] = [5, 3, 1, 0];

/// What of a field lies in a square about the origin, at all of [`LEVELS`].
#[derive(Clone, Debug)]
pub struct Pyramid {
    first: Cell,
    half: i32,
    width: usize,
    height: usize,
    levels: [Vec<u8>; LEVELS.len()],
}

impl Pyramid {
    /// Of the cells up to `half` from the origin along each axis.
    pub fn new(field: &Field, half: i32) -> Self {
        // Squares begin up to a coarsest square's edge before what they bound.
        let margin = 1 << LEVELS[0];
        let (low, high) = drawn_part(field, half);
        let first = Cell { x: low.x - margin, y: low.y - margin };
        let (width, height) = (len(high.x - first.x + 1), len(high.y - first.y + 1));
        let mut finest = vec![0; width * height];
        for (index, tile) in field.tiles() {
            copy_tile(index, tile, first, (&mut finest, (width, height)));
        }
        let mut levels: [Vec<u8>; LEVELS.len()] = Default::default();
        let (mut scale, mut now) = (0, finest);
        for (level, values) in LEVELS.into_iter().zip(&mut levels).rev() {
            while scale < level {
                double(&mut now, width, 1 << scale);
                scale += 1;
            }
            values.clone_from(&now);
        }
        Self { first, half, width, height, levels }
    }

    /// How far it reaches along each axis, in cells.
    pub(crate) fn half(&self) -> i32 {
        self.half
    }

    /// Sum of a level's values at some cells, all shifted by the same.
    #[inline]
    pub(crate) fn sum(&self, level: usize, cells: &[Cell], shift: Cell) -> u32 {
        let values = &self.levels[level];
        let (x, y) = (shift.x - self.first.x, shift.y - self.first.y);
        cells
            .iter()
            .map(|cell| {
                let (x, y) = (cell.x + x, cell.y + y);
                #[expect(clippy::cast_sign_loss, reason = "what is negative becomes too large")]
                let (x, y) = (x as u32 as usize, y as u32 as usize);
                if x < self.width && y < self.height {
                    u32::from(values[y * self.width + x])
                } else {
                    0
                }
            })
            .sum()
    }
}

/// Lowest and highest cells of the tiles of a field, as far as they lie up to `half` from the origin; of
/// an empty field, a highest below the lowest.
fn drawn_part(field: &Field, half: i32) -> (Cell, Cell) {
    let (mut low, mut high) = (Cell { x: half, y: half }, Cell { x: -half - 1, y: -half - 1 });
    for (index, _) in field.tiles() {
        let (x, y) = (index.x * TILE_CELLS, index.y * TILE_CELLS);
        low = Cell { x: low.x.min(x), y: low.y.min(y) };
        high = Cell { x: high.x.max(x + TILE_CELLS - 1), y: high.y.max(y + TILE_CELLS - 1) };
    }
    (
        Cell { x: low.x.max(-half), y: low.y.max(-half) },
        Cell { x: high.x.min(half), y: high.y.min(half) },
    )
}

/// Copies what a tile has of the rectangle whose first cell and size are given.
fn copy_tile(
    index: TileIndex,
    tile: &FieldTile,
    first: Cell,
    (values, (width, height)): (&mut [u8], (usize, usize)),
) {
    let end = |n: usize| i32::try_from(n).unwrap_or(0);
    let (x, y) = (index.x * TILE_CELLS - first.x, index.y * TILE_CELLS - first.y);
    let (low, high) = (x.max(0), (x + TILE_CELLS).min(end(width)));
    for row in y.max(0)..(y + TILE_CELLS).min(end(height)) {
        if high <= low {
            return;
        }
        let at = |x: i32, y: i32, stride: usize| len(y) * stride + len(x);
        let from = at(low - x, row - y, STRIDE);
        let to = at(low, row, width);
        let n = len(high - low);
        values[to..to + n].copy_from_slice(&tile.values[from..from + n]);
    }
}

fn len(n: i32) -> usize {
    usize::try_from(n).unwrap_or(0)
}

/// Makes maxima of squares of `edge` cells into those of squares of twice the edge, in a rectangle of
/// rows of `width`.
fn double(values: &mut [u8], width: usize, edge: usize) {
    // Each value is joined with one that stands later and is not changed yet.
    for row in values.chunks_exact_mut(width.max(1)) {
        for x in 0..width.saturating_sub(edge) {
            row[x] = row[x].max(row[x + edge]);
        }
    }
    let height = values.len() / width.max(1);
    for y in 0..height.saturating_sub(edge) {
        let (here, later) = values[y * width..].split_at_mut(edge * width);
        for (value, &next) in here[..width].iter_mut().zip(&later[..width]) {
            *value = next.max(*value);
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]

        #[test]
        fn doubled_squares_hold_the_greatest(
            values in prop::collection::vec(any::<u8>(), 20 * 30),
            scale in 0_u32..4,
        ) {
            let (width, height, edge) = (20_usize, 30_usize, 1_usize << scale);
            let mut found = values.clone();
            for doubling in 0..scale {
                double(&mut found, width, 1 << doubling);
            }
            for y in 0..height {
                for x in 0..width {
                    let rows = y..(y + edge).min(height);
                    let square = rows.flat_map(|row| &values[row * width + x..row * width + (x + edge).min(width)]);
                    let expected = square.copied().max().unwrap_or(0);
                    prop_assert_eq!(found[y * width + x], expected, "at {}, {}", x, y);
                }
            }
        }
    }
}
