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
//! Computing 8 (2012), Algorithm 1. Of several nearest cells the basis point is the leftmost, then
//! the lowest, so that it depends on nothing but the obstacles. Time and space O(cells).

use std::ops::Range;

use meetpoint_geometry::GridInfo;

use crate::free::FreeSpace;
use crate::relocation::Relocation;

/// Clearance of every cell of a [`FreeSpace`].
#[derive(Clone, Debug, PartialEq)]
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

    /// The nearest obstacle cell of every cell, by its index; its own on obstacles.
    pub fn basis(&self) -> &[u32] {
        &self.basis
    }

    /// The same in another rectangle; cells that are new have no clearance.
    pub(crate) fn relocated(self, relocation: &Relocation) -> Self {
        if relocation.is_nothing() {
            return self;
        }
        let basis = self.basis.iter().map(|&basis| relocation.index_u32(basis)).collect();
        let mut basis = relocation.cells(basis, u32::MAX);
        for (index, basis) in basis.iter_mut().enumerate() {
            if *basis == u32::MAX {
                *basis = u32::try_from(index).unwrap_or(u32::MAX);
            }
        }
        Self { info: relocation.to(), squared: relocation.cells(self.squared, 0), basis }
    }

    /// Puts in what of one row is known now; tells `changed` of the cells where that is news.
    pub(crate) fn put_row(
        &mut self,
        row: &Row,
        columns: Range<usize>,
        mut changed: impl FnMut(usize),
    ) {
        let from = row.y * self.info.width as usize;
        row.envelope.read(columns, |x, (column, square)| {
            let index = from + x;
            let squared = u32::try_from(square).unwrap_or(u32::MAX);
            let basis = row.nearest[column - row.first_column] as usize * self.width() + column;
            let basis = u32::try_from(basis).unwrap_or(u32::MAX);
            if (self.squared[index], self.basis[index]) != (squared, basis) {
                (self.squared[index], self.basis[index]) = (squared, basis);
                changed(index);
            }
        });
    }

    fn width(&self) -> usize {
        self.info.width as usize
    }
}

/// Clearance of every cell of `space`, the rim and what lies on it being obstacles.
pub fn clearance(space: &FreeSpace) -> Clearance {
    let info = space.info();
    let (width, height) = (info.width as usize, info.height as usize);
    let n_cells = info.n_cells();
    let mut clearance = Clearance { info, squared: vec![0; n_cells], basis: vec![0; n_cells] };
    let nearest = nearest_rows(space, 0..width, 0..height);
    let mut envelope = Envelope::default();
    for (y, nearest) in nearest.chunks_exact(width.max(1)).enumerate() {
        envelope.fill(nearest, 0, y);
        let row = Row { y, first_column: 0, nearest, envelope: &envelope };
        clearance.put_row(&row, 0..width, |_| {});
    }
    clearance
}

/// What decides the clearance within one row.
pub(crate) struct Row<'a> {
    /// Which row.
    pub(crate) y: usize,
    /// The first column that `nearest` speaks of.
    pub(crate) first_column: usize,
    /// The row of the nearest obstacle in each column.
    pub(crate) nearest: &'a [u32],
    /// Filled with those.
    pub(crate) envelope: &'a Envelope,
}

/// For every cell of a window the row of the nearest obstacle cell in its column, wherever that
/// is; of two the lower.
pub(crate) fn nearest_rows(
    space: &FreeSpace,
    columns: Range<usize>,
    rows: Range<usize>,
) -> Vec<u32> {
    let width = space.info().width as usize;
    let is_free = |column: usize, row: usize| space.is_free()[row * width + column];
    let row_u32 = |row: usize| u32::try_from(row).unwrap_or(u32::MAX);
    let n_columns = columns.len();
    let mut nearest = vec![0; n_columns * rows.len()];
    if nearest.is_empty() {
        return nearest;
    }
    for (y, row) in rows.clone().enumerate() {
        for (x, column) in columns.clone().enumerate() {
            let at = y * n_columns + x;
            nearest[at] = if !is_free(column, row) {
                row_u32(row)
            } else if y == 0 {
                // The rim is an obstacle: there is one below, and one above.
                let below = (0..row).rev().find(|&below| !is_free(column, below));
                row_u32(below.unwrap_or(0))
            } else {
                nearest[at - n_columns]
            };
        }
    }
    let height = space.info().height as usize;
    let mut above: Vec<u32> = columns
        .clone()
        .map(|column| {
            (rows.end..height).find(|&row| !is_free(column, row)).map_or(u32::MAX, row_u32)
        })
        .collect();
    for (y, row) in rows.enumerate().rev() {
        for (nearest, above) in nearest[y * n_columns..][..n_columns].iter_mut().zip(&mut above) {
            if above.abs_diff(row_u32(row)) < nearest.abs_diff(row_u32(row)) {
                *nearest = *above;
            }
            *above = if *nearest == row_u32(row) { *nearest } else { *above };
        }
    }
    nearest
}

/// Lower envelope of the parabolas `(x - q)^2 + height(q)`.
#[derive(Default)]
pub(crate) struct Envelope {
    first_column: usize,
    heights: Vec<i64>,
    /// Parabolas of the envelope from left to right, each with the first column where it is
    /// lowest.
    parabolas: Vec<(usize, i64)>,
}

impl Envelope {
    /// Takes the rows of the nearest obstacles in the columns from `first_column` on, as seen from
    /// the row `y`.
    pub(crate) fn fill(&mut self, nearest: &[u32], first_column: usize, y: usize) {
        let row = i64::try_from(y).unwrap_or(i64::MAX);
        self.first_column = first_column;
        self.heights.clear();
        self.heights.extend(nearest.iter().map(|&nearest| (i64::from(nearest) - row).pow(2)));
        self.parabolas.clear();
        for q in first_column..first_column + self.heights.len() {
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

    fn height(&self, column: usize) -> i64 {
        self.heights[column - self.first_column]
    }

    /// The first column where the parabola of `right` lies below that of `left`.
    fn crossing(&self, left: usize, right: usize) -> i64 {
        let [l, r] = [left, right].map(|column| i64::try_from(column).unwrap_or(i64::MAX));
        let rise = self.height(right) - self.height(left) + r * r - l * l;
        rise.div_euclid(2 * (r - l)) + 1
    }

    /// Tells `cell` of the columns asked for: whose parabola is lowest there, and how high.
    fn read(&self, columns: Range<usize>, mut cell: impl FnMut(usize, (usize, i64))) {
        let place = |column: usize| i64::try_from(column).unwrap_or(i64::MAX);
        let mut at = 0;
        for x in columns {
            while self.parabolas.get(at + 1).is_some_and(|&(_, first)| first <= place(x)) {
                at += 1;
            }
            let Some(&(q, _)) = self.parabolas.get(at) else { return };
            let away = place(x) - place(q);
            cell(x, (q, away * away + self.height(q)));
        }
    }
}
