//! Rectangles of cells with a rim: neighbours without asking for the edge.

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

    /// The cell that holds a point given in columns and rows, `None` outside.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "inside, checked")]
    pub(crate) fn index_at(self, [column, row]: [f64; 2]) -> Option<usize> {
        let is_inside = 0.0 <= column
            && column < f64::from(self.info.width)
            && 0.0 <= row
            && row < f64::from(self.info.height);
        is_inside.then(|| row as usize * self.width + column as usize)
    }
}
