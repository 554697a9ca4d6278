//! One sweep over the rows of a box, in the direction whose turn it is.

use super::ValueIteration;
use super::rectangle::Rectangle;

/// Columns of a row, first and last.
type Columns = (usize, usize);

impl ValueIteration {
    /// Lowers values to what their neighbours offer; the box of those that changed.
    pub(super) fn sweep_lower(&mut self, within: Rectangle) -> Option<Rectangle> {
        self.sweep(within, Self::lower_row)
    }

    /// Makes values infinite that are smaller than what their neighbours offer; the box of those.
    pub(super) fn sweep_reset(&mut self, within: Rectangle) -> Option<Rectangle> {
        self.sweep(within, Self::reset_row)
    }

    /// Goes through the rows of `within`, and beyond it in its direction as long as rows change.
    fn sweep(
        &mut self,
        within: Rectangle,
        on_row: impl Fn(&mut Self, usize, Columns) -> Option<Columns>,
    ) -> Option<Rectangle> {
        let inner = self.inner();
        let is_upward = self.n_sweeps.is_multiple_of(2);
        self.n_sweeps = self.n_sweeps.wrapping_add(1);
        let (mut changed, mut before): (Option<Rectangle>, Option<Rectangle>) = (None, None);
        let (mut row, last) = if is_upward { within.y } else { (within.y.1, within.y.0) };
        let mut columns = within.x;
        loop {
            let is_beyond = if is_upward { last < row } else { row < last };
            if is_beyond && before.is_none() || row < inner.y.0 || inner.y.1 < row {
                return changed;
            }
            if let Some(before) = before.and_then(|before| before.grown().within(inner)) {
                columns = (columns.0.min(before.x.0), columns.1.max(before.x.1));
            }
            let found = on_row(self, row, columns);
            before = found.map(|x| Rectangle { x, y: (row, row) });
            changed = Rectangle::union(changed, before);
            row = if is_upward { row + 1 } else { row - 1 };
        }
    }

    /// Lowers the values of a row; the columns of those that changed.
    fn lower_row(&mut self, row: usize, (first, last): Columns) -> Option<Columns> {
        self.offered_by_rows(row, (first, last));
        let start = row * self.stride;
        let mut changed = (usize::MAX, 0);
        // To the right: what the cell on the left offers, and beyond the box while that lowers.
        let mut x = first;
        while x + 1 < self.stride {
            let at = start + x;
            let offered = if x <= last { self.offered[x] } else { f32::INFINITY };
            let best = offered.min(self.straight[at - 1]);
            if best < self.value[at] {
                self.value[at] = best;
                self.offer(at);
                changed = (changed.0.min(x), changed.1.max(x));
            } else if last <= x {
                break;
            }
            x += 1;
        }
        let mut x = last.max(changed.1);
        while 0 < x {
            let at = start + x;
            let best = self.straight[at + 1];
            if best < self.value[at] {
                self.value[at] = best;
                self.offer(at);
                changed = (changed.0.min(x), changed.1.max(x));
            } else if x <= first {
                break;
            }
            x -= 1;
        }
        (changed.0 <= changed.1).then_some(changed)
    }

    /// What the two rows beside a row offer to its cells, left in `offered`.
    fn offered_by_rows(&mut self, row: usize, (first, last): Columns) {
        let stride = self.stride;
        let n = last + 1 - first;
        let of = |row: usize| row * stride + first;
        let offered = &mut self.offered[first..=last];
        let sides = &self.closed[of(row) - 1..=of(row) + n];
        offered.fill(f32::INFINITY);
        for beside in [row - 1, row + 1] {
            let from = of(beside) - 1;
            let straight = &self.straight[from + 1..=from + n];
            let closed = &self.closed[from + 1..=from + n];
            let slanted = &self.slanted[from..from + n + 2];
            for x in 0..n {
                let left = slanted[x] + sides[x] + closed[x];
                let right = slanted[x + 2] + sides[x + 2] + closed[x];
                offered[x] = offered[x].min(straight[x]).min(left).min(right);
            }
        }
    }

    /// Resets the values of a row that are too small; the columns of those.
    fn reset_row(&mut self, row: usize, (first, last): Columns) -> Option<Columns> {
        self.offered_by_rows(row, (first, last));
        let start = row * self.stride;
        let mut changed = (usize::MAX, 0);
        for x in (first..=last).chain((first..=last).rev()) {
            let at = start + x;
            let offered = self.offered[x].min(self.straight[at - 1]).min(self.straight[at + 1]);
            if !self.is_goal[at] && self.value[at] < offered {
                self.value[at] = f32::INFINITY;
                self.offer(at);
                changed = (changed.0.min(x), changed.1.max(x));
            }
        }
        (changed.0 <= changed.1).then_some(changed)
    }
}
