//! Exact Euclidean distance transform, with basis points.
//!
//! For every cell `p`, the distance to the nearest obstacle cell,
//!
//! ```text
//! D(p) = min over obstacle cells q of |p - q|
//! ```
//!
//! and that cell, its basis point (S. Thrun, Artificial Intelligence 99 (1998), section 3.1 (ii)),
//! by one pass along columns and one of parabola envelopes along rows, all in whole numbers:
//! P. Felzenszwalb and D. Huttenlocher, "Distance transforms of sampled functions", Theory of
//! Computing 8 (2012), Algorithm 1. Time and space O(cells).

use meetpoint_geometry::GridInfo;

use crate::free::FreeSpace;

/// Clearance of every cell of a [`FreeSpace`].
#[derive(Clone, Debug)]
pub struct Clearance {
    info: GridInfo,
    squared: Vec<u32>,
    basis: Vec<u32>,
}

impl Clearance {
    /// Which cells: those of the free space.
    pub fn info(&self) -> GridInfo {
        self.info
    }

    /// From the centre of the cell at `index` to that of the nearest obstacle cell, in metres; 0
    /// on obstacles.
    ///
    /// # Panics
    /// If `index` is not below the number of cells.
    pub fn at_m(&self, index: usize) -> f64 {
        f64::from(self.squared[index]).sqrt() * self.info.frame.resolution_m()
    }

    /// The square of [`Self::at_m`] of every cell, in cells squared: exact.
    pub fn squared(&self) -> &[u32] {
        &self.squared
    }

    /// A nearest obstacle cell of every cell, by its index; its own on obstacles.
    pub fn basis(&self) -> &[u32] {
        &self.basis
    }
}

/// Clearance of every cell of `space`, the rim and what lies on it being obstacles.
pub fn clearance(space: &FreeSpace) -> Clearance {
    let info = space.info();
    let width = info.width as usize;
    let nearest_row = nearest_rows(space);
    let mut squared = vec![0; info.n_cells()];
    let mut basis = vec![0; info.n_cells()];
    let mut envelope = Envelope::default();
    for (y, rows) in nearest_row.chunks_exact(width).enumerate() {
        let heights = rows.iter().map(|&row| {
            let distance = i64::from(row) - i64::try_from(y).unwrap_or(i64::MAX);
            distance * distance
        });
        envelope.fill(heights);
        let cells = y * width..(y + 1) * width;
        let (squared, basis) = (&mut squared[cells.clone()], &mut basis[cells]);
        envelope.read(|x, (column, square)| {
            squared[x] = u32::try_from(square).unwrap_or(u32::MAX);
            let index = rows[column] as usize * width + column;
            basis[x] = u32::try_from(index).unwrap_or(u32::MAX);
        });
    }
    Clearance { info, squared, basis }
}

/// For every cell the row of the nearest obstacle cell in its column.
fn nearest_rows(space: &FreeSpace) -> Vec<u32> {
    let width = space.info().width as usize;
    let height = space.info().height;
    let mut nearest = vec![0; space.is_free().len()];
    for y in 0..height {
        let from = y as usize * width;
        for index in from..from + width {
            let below = if y == 0 { 0 } else { nearest[index - width] };
            nearest[index] = if space.is_free()[index] { below } else { y };
        }
    }
    for y in (0..height.saturating_sub(1)).rev() {
        let from = y as usize * width;
        for index in from..from + width {
            let above = nearest[index + width];
            if y.abs_diff(above) < y.abs_diff(nearest[index]) {
                nearest[index] = above;
            }
        }
    }
    nearest
}

/// Lower envelope of the parabolas `(x - q)^2 + height(q)`.
#[derive(Default)]
struct Envelope {
    heights: Vec<i64>,
    /// Parabolas of the envelope from left to right, each with the first column where it is lowest.
    parabolas: Vec<(usize, i64)>,
}

impl Envelope {
    fn fill(&mut self, heights: impl Iterator<Item = i64>) {
        self.heights.clear();
        self.heights.extend(heights);
        self.parabolas.clear();
        for q in 0..self.heights.len() {
            let mut first = 0;
            while let Some(&(top, from)) = self.parabolas.last() {
                first = self.crossing(top, q);
                if from < first {
                    break;
                }
                self.parabolas.pop();
            }
            self.parabolas.push((q, if self.parabolas.is_empty() { 0 } else { first }));
        }
    }

    /// The first column where the parabola of `right` lies below that of `left`.
    fn crossing(&self, left: usize, right: usize) -> i64 {
        let [l, r] = [left, right].map(|column| i64::try_from(column).unwrap_or(i64::MAX));
        let rise = self.heights[right] - self.heights[left] + r * r - l * l;
        rise.div_euclid(2 * (r - l)) + 1
    }

    /// Tells `cell` of every column: whose parabola is lowest there, and how high.
    fn read(&self, mut cell: impl FnMut(usize, (usize, i64))) {
        let mut at = 0;
        for x in 0..self.heights.len() {
            let place = i64::try_from(x).unwrap_or(i64::MAX);
            while self.parabolas.get(at + 1).is_some_and(|&(_, first)| first <= place) {
                at += 1;
            }
            let q = self.parabolas[at].0;
            let away = place - i64::try_from(q).unwrap_or(i64::MAX);
            cell(x, (q, away * away + self.heights[q]));
        }
    }
}
