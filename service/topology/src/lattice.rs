//! Rectangles of cells with a rim: neighbours without asking for the edge.

use std::ops::Range;

use meetpoint_geometry::{Cell, GridInfo};

/// Row-major cells of a rectangle whose outermost ring is never stepped from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lattice {
    info: GridInfo,
    width: usize,
}

impl Lattice {
    pub(crate) fn new(info: GridInfo) -> Self {
        Self { info, width: info.width as usize }
    }

    pub(crate) fn info(self) -> GridInfo {
        self.info
    }

    /// All cells by name, row by row.
    pub(crate) fn cells(self) -> impl Iterator<Item = Cell> {
        let GridInfo { first, width, height, .. } = self.info;
        let along = |first: i32, n: u32| {
            (0..n).map(move |n| first.saturating_add(i32::try_from(n).unwrap_or(i32::MAX)))
        };
        along(first.y, height).flat_map(move |y| along(first.x, width).map(move |x| Cell { x, y }))
    }

    /// The eight neighbours counter-clockwise from +x. `index` must not lie on the rim.
    pub(crate) fn around(self, index: usize) -> [usize; 8] {
        let (above, below) = (index + self.width, index - self.width);
        [index + 1, above + 1, above, above - 1, index - 1, below - 1, below, below + 1]
    }

    /// The four neighbours counter-clockwise from +x. `index` must not lie on the rim.
    pub(crate) fn beside(self, index: usize) -> [usize; 4] {
        [index + 1, index + self.width, index - 1, index - self.width]
    }

    /// Column and row.
    pub(crate) fn column_row(self, index: usize) -> [i64; 2] {
        let (row, column) = (index / self.width, index % self.width);
        [column, row].map(|n| i64::try_from(n).unwrap_or(i64::MAX))
    }

    /// The cell's name in the map.
    pub(crate) fn cell(self, index: usize) -> Cell {
        let [column, row] = self.column_row(index);
        let along = |first: i32, n: i64| first.saturating_add(i32::try_from(n).unwrap_or(i32::MAX));
        Cell { x: along(self.info.first.x, column), y: along(self.info.first.y, row) }
    }

    /// From one cell's centre to another's, in cells.
    pub(crate) fn offset(self, from: usize, to: usize) -> [i64; 2] {
        let ([x, y], [to_x, to_y]) = (self.column_row(from), self.column_row(to));
        [to_x - x, to_y - y]
    }

    /// Between the centres of two cells, in cells squared.
    pub(crate) fn distance_squared(self, from: usize, to: usize) -> i64 {
        let [x, y] = self.offset(from, to);
        x * x + y * y
    }

    /// The cell so many columns and rows away; it must lie within the rectangle.
    pub(crate) fn moved(self, index: usize, [columns, rows]: [i64; 2]) -> usize {
        let steps = rows * i64::try_from(self.width).unwrap_or(i64::MAX) + columns;
        index.saturating_add_signed(isize::try_from(steps).unwrap_or(isize::MAX))
    }

    /// Whether the cell has all its neighbours, that is, does not lie on the rim.
    pub(crate) fn is_inside(self, index: usize) -> bool {
        let [column, row] = self.column_row(index);
        0 < column
            && column + 1 < i64::from(self.info.width)
            && 0 < row
            && row + 1 < i64::from(self.info.height)
    }

    /// Tells `row` of the cells up to so many columns and rows away, row by row, as far as they lie
    /// within the rectangle.
    pub(crate) fn for_each_row(self, index: usize, away: usize, mut row: impl FnMut(Range<usize>)) {
        let (column, middle) = (index % self.width, index / self.width);
        let last = (self.info.height as usize).saturating_sub(1);
        let end = (column.saturating_add(away).saturating_add(1)).min(self.width);
        for y in middle.saturating_sub(away)..=middle.saturating_add(away).min(last) {
            row(y * self.width + column.saturating_sub(away)..y * self.width + end);
        }
    }

    /// The cell that holds a point given in columns and rows from the corner of a cell at
    /// `origin`, `None` outside.
    pub(crate) fn index_at(self, origin: [i64; 2], at: [f64; 2]) -> Option<usize> {
        #[expect(clippy::cast_possible_truncation, reason = "saturates, and is outside then")]
        let [column, row] = [0, 1].map(|axis| origin[axis].saturating_add(at[axis].floor() as i64));
        let is_inside = (0..i64::from(self.info.width)).contains(&column)
            && (0..i64::from(self.info.height)).contains(&row);
        if !is_inside {
            return None;
        }
        usize::try_from(row * i64::from(self.info.width) + column).ok()
    }
}
