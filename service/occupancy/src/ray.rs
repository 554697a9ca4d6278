//! The cells that a straight segment meets, in order.
//!
//! One step to the neighbour across the nearer cell edge at a time: J. Amanatides and A. Woo,
//! "A fast voxel traversal algorithm for ray tracing", Eurographics 1987. Time O(cells met).

use meetpoint_geometry::Cell;

/// A segment's way through the cells.
#[derive(Clone, Debug)]
pub(crate) struct Ray {
    cell: Cell,
    /// Cells still to come after `cell`.
    n_left: u32,
    started: bool,
    x: Axis,
    y: Axis,
}

/// One axis of the way: when the next edge is crossed, and what crossing does.
#[derive(Clone, Copy, Debug)]
struct Axis {
    step: i32,
    /// Share of the segment at which the next edge is crossed; +inf if none is.
    next: f64,
    /// Share of the segment between two edges.
    between: f64,
}

impl Axis {
    /// From and to in cells.
    fn new(from: f64, to: f64) -> Self {
        let way = to - from;
        if way == 0.0 {
            return Self { step: 0, next: f64::INFINITY, between: f64::INFINITY };
        }
        let edge = if way > 0.0 { from.floor() + 1.0 } else { from.floor() };
        let step = if way > 0.0 { 1 } else { -1 };
        Self { step, next: (edge - from) / way, between: 1.0 / way.abs() }
    }
}

impl Ray {
    /// The way from one point to another, both in cells (metres over the cell's edge), each
    /// coordinate finite and within ±2³⁰.
    #[expect(clippy::cast_possible_truncation, reason = "coordinates are within ±2³⁰")]
    pub(crate) fn new(from: (f64, f64), to: (f64, f64)) -> Self {
        let cell =
            |point: (f64, f64)| Cell { x: point.0.floor() as i32, y: point.1.floor() as i32 };
        let (first, last) = (cell(from), cell(to));
        Self {
            cell: first,
            n_left: last.x.abs_diff(first.x) + last.y.abs_diff(first.y),
            started: false,
            x: Axis::new(from.0, to.0),
            y: Axis::new(from.1, to.1),
        }
    }
}

impl Iterator for Ray {
    type Item = Cell;

    #[inline]
    fn next(&mut self) -> Option<Cell> {
        if !self.started {
            self.started = true;
            return Some(self.cell);
        }
        self.n_left = self.n_left.checked_sub(1)?;
        if self.x.next < self.y.next {
            self.cell.x += self.x.step;
            self.x.next += self.x.between;
        } else {
            self.cell.y += self.y.step;
            self.y.next += self.y.between;
        }
        Some(self.cell)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The definition: a cell is met if the segment has a point well inside it.
    fn met(from: (f64, f64), to: (f64, f64), cell: Cell, margin: f64) -> bool {
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        for (a, b, low) in [(from.0, to.0, f64::from(cell.x)), (from.1, to.1, f64::from(cell.y))] {
            let (low, high) = (low + margin, low + 1.0 - margin);
            if (b - a).abs() < 1e-12 {
                if a < low || high < a {
                    return false;
                }
                continue;
            }
            let (s, t) = ((low - a) / (b - a), (high - a) / (b - a));
            enter = enter.max(s.min(t));
            leave = leave.min(s.max(t));
        }
        enter <= leave
    }

    #[expect(clippy::cast_possible_truncation, reason = "within ±90")]
    fn cell_of(point: (f64, f64)) -> Cell {
        Cell { x: point.0.floor() as i32, y: point.1.floor() as i32 }
    }

    proptest! {
        #[test]
        fn meets_the_cells_that_the_segment_meets(
            from in (-9.0_f64..9.0, -9.0_f64..9.0),
            to in (-9.0_f64..9.0, -9.0_f64..9.0),
        ) {
            let cells: Vec<Cell> = Ray::new(from, to).collect();
            for cell in &cells {
                prop_assert!(met(from, to, *cell, -1e-6), "{cell:?} is not on the segment");
            }
            for x in -10..10 {
                for y in -10..10 {
                    let cell = Cell { x, y };
                    prop_assert!(!met(from, to, cell, 1e-6) || cells.contains(&cell), "{cell:?}");
                }
            }
        }

        #[test]
        fn leads_from_end_to_end_by_edges(
            from in (-90.0_f64..90.0, -90.0_f64..90.0),
            to in (-90.0_f64..90.0, -90.0_f64..90.0),
        ) {
            let cells: Vec<Cell> = Ray::new(from, to).collect();
            for pair in cells.windows(2) {
                let step = pair[0].x.abs_diff(pair[1].x) + pair[0].y.abs_diff(pair[1].y);
                prop_assert_eq!(step, 1, "neighbours share an edge");
            }
            let (last, end) = (cells.last().expect("the first cell at least"), cell_of(to));
            prop_assert!(last.x.abs_diff(end.x) + last.y.abs_diff(end.y) <= 1, "at the end");
        }
    }
}
