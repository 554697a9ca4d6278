//! Metres become cells, and cells metres, in this file only.
//!
//! Cells are squares aligned with the frame's axes. Cell (0, 0) has its lower-left corner at the
//! frame's origin; indices grow along +x and +y and may be negative, so that a map grows in every
//! direction without renumbering.

use nalgebra::Point2;

/// A square of the plane, by its indices along x and y.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Cell {
    /// Index along +x.
    pub x: i32,
    /// Index along +y.
    pub y: i32,
}

/// The edge of a cell was not a usable length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InvalidResolution(
    /// What was given, in metres.
    pub f64,
);

/// How metres and cells relate, without any bounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridFrame {
    resolution_m: f64,
}

impl GridFrame {
    /// A frame with cells of `resolution_m` metres a side.
    ///
    /// # Errors
    /// [`InvalidResolution`] unless it is finite and positive.
    pub fn new(resolution_m: f64) -> Result<Self, InvalidResolution> {
        if resolution_m.is_finite() && 0.0 < resolution_m {
            Ok(Self { resolution_m })
        } else {
            Err(InvalidResolution(resolution_m))
        }
    }

    /// Edge of a cell, in metres.
    #[must_use]
    pub fn resolution_m(self) -> f64 {
        self.resolution_m
    }

    /// The cell that holds `point`. Points beyond ±2³¹ cells, infinities and NaN saturate.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "saturating on purpose, as documented")]
    pub fn cell_at(self, point: Point2<f64>) -> Cell {
        Cell {
            x: (point.x / self.resolution_m).floor() as i32,
            y: (point.y / self.resolution_m).floor() as i32,
        }
    }

    /// The middle of a cell, in metres.
    #[must_use]
    pub fn center_of(self, cell: Cell) -> Point2<f64> {
        Point2::new(
            (f64::from(cell.x) + 0.5) * self.resolution_m,
            (f64::from(cell.y) + 0.5) * self.resolution_m,
        )
    }

    /// The lower-left corner of a cell, in metres.
    #[must_use]
    pub fn corner_of(self, cell: Cell) -> Point2<f64> {
        Point2::new(f64::from(cell.x) * self.resolution_m, f64::from(cell.y) * self.resolution_m)
    }
}

/// A rectangle of cells: `width` by `height` from `first` (its lower-left cell) on.
///
/// Data that belongs to it is row-major along +x, the lowest row first: the cell `first + (x, y)`
/// is element `y * width + x`. No flip, no rotation, as in `nav_msgs/OccupancyGrid`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridInfo {
    /// How metres and cells relate.
    pub frame: GridFrame,
    /// The lower-left cell.
    pub first: Cell,
    /// Cells along x.
    pub width: u32,
    /// Cells along y.
    pub height: u32,
}

impl GridInfo {
    /// Number of cells.
    #[must_use]
    pub fn n_cells(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Lower-left corner of the lower-left cell, in metres.
    #[must_use]
    pub fn origin(&self) -> Point2<f64> {
        self.frame.corner_of(self.first)
    }

    /// All cells, in the order of their places in row-major data. Those beyond 2³¹ saturate.
    pub fn cells(&self) -> impl Iterator<Item = Cell> + use<> {
        let Self { first, width, height, .. } = *self;
        let along = |first: i32, n: u32| (0..n).map(move |at| first.saturating_add_unsigned(at));
        along(first.y, height).flat_map(move |y| along(first.x, width).map(move |x| Cell { x, y }))
    }

    /// The place of a cell in row-major data, or `None` outside.
    #[must_use]
    pub fn index_of(&self, cell: Cell) -> Option<usize> {
        let x = i64::from(cell.x) - i64::from(self.first.x);
        let y = i64::from(cell.y) - i64::from(self.first.y);
        let inside =
            (0..i64::from(self.width)).contains(&x) && (0..i64::from(self.height)).contains(&y);
        if !inside {
            return None;
        }
        usize::try_from(y * i64::from(self.width) + x).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn refuses_no_length() {
        for bad in [0.0, -0.05, f64::NAN, f64::INFINITY] {
            assert!(GridFrame::new(bad).is_err(), "{bad} is not a length");
        }
    }

    #[test]
    fn lower_left_first() {
        let frame = GridFrame::new(0.5).expect("a length");
        let info = GridInfo { frame, first: Cell { x: -2, y: -1 }, width: 4, height: 3 };
        assert_eq!(info.origin(), Point2::new(-1.0, -0.5), "corner of the lower-left cell");
        assert_eq!(info.index_of(Cell { x: -2, y: -1 }), Some(0), "lower left");
        let indices: Vec<_> = info.cells().map(|cell| info.index_of(cell)).collect();
        assert_eq!(indices, (0..12).map(Some).collect::<Vec<_>>(), "in the order of indices");
        assert_eq!(info.index_of(Cell { x: 1, y: -1 }), Some(3), "along x first");
        assert_eq!(info.index_of(Cell { x: 1, y: 1 }), Some(11), "upper right is last");
        assert_eq!(info.index_of(Cell { x: 2, y: 0 }), None, "one beyond");
    }

    proptest! {
        #[test]
        fn a_cells_center_lies_in_it(x in -100_000..100_000, y in -100_000..100_000) {
            let frame = GridFrame::new(0.05).expect("a length");
            let cell = Cell { x, y };
            prop_assert_eq!(frame.cell_at(frame.center_of(cell)), cell);
        }
    }
}
