//! Clearance where obstacles came or went.
//!
//! An obstacle changes the distance along its column, from the obstacle below it to that above. In
//! a row where column `c` changed, basis points lie in order,
//!
//! ```text
//! x < x'  implies  column of basis(x) <= column of basis(x')
//! ```
//!
//! so that a cell left of `c` whose basis point lies left of `c` and as near as `c` itself bounds
//! what can change; on the right likewise. Rows are computed again between the two bounds by the
//! envelopes of [`clearance`](crate::clearance), and cells end up with the same bits. Time O(cells
//! between the bounds + obstacles · length of their columns), space O(cells of the rows).

use std::ops::Range;

use crate::clearance::{Clearance, Envelope, Row, nearest_rows};
use crate::free::FreeSpace;

/// Brings `clearance` to what it is in `open`, given the cells, ascending, where that differs from
/// the space that it was of; returns the cells where clearance or basis point changed, ascending.
pub(crate) fn update_clearance(
    clearance: &mut Clearance,
    open: &FreeSpace,
    flipped: &[usize],
) -> Vec<usize> {
    let spans = changed_columns(open, flipped);
    let mut changed = vec![];
    let mut envelope = Envelope::default();
    let mut rows = 0..0;
    while rows.end < spans.len() {
        rows.start = rows.end;
        rows.end += 1;
        let Some(window) = Window::new(clearance, &spans, rows.start) else { continue };
        let mut columns = window.columns.clone();
        let mut windows = vec![window];
        // Rows that follow each other are one block, whose columns are walked once.
        while rows.end < spans.len()
            && let Some(more) = Window::new(clearance, &spans, rows.end)
        {
            columns = columns.start.min(more.columns.start)..columns.end.max(more.columns.end);
            windows.push(more);
            rows.end += 1;
        }
        let nearest = nearest_rows(open, columns.clone(), rows.clone());
        let of_row = nearest.chunks_exact(columns.len());
        for ((y, window), nearest) in rows.clone().zip(windows).zip(of_row) {
            let first_column = window.columns.start;
            let nearest =
                &nearest[first_column - columns.start..window.columns.end - columns.start];
            envelope.fill(nearest, first_column, y);
            let row = Row { y, first_column, nearest, envelope: &envelope };
            clearance.put_row(&row, window.cells, |index| changed.push(index));
        }
    }
    changed
}

/// For every row the first and last column whose nearest obstacle may have changed.
fn changed_columns(open: &FreeSpace, flipped: &[usize]) -> Vec<Option<[usize; 2]>> {
    let width = open.info().width as usize;
    let mut spans: Vec<Option<[usize; 2]>> = vec![None; open.info().height as usize];
    let has_flipped = |index: usize| flipped.binary_search(&index).is_ok();
    let stays_obstacle = |index: usize| !open.is_free()[index] && !has_flipped(index);
    let mut by_column: Vec<[usize; 2]> =
        flipped.iter().map(|&index| [index % width, index / width]).collect();
    by_column.sort_unstable();
    let mut done = [usize::MAX, 0];
    for [column, row] in by_column {
        if done[0] == column && row <= done[1] {
            continue;
        }
        let is_end = |&row: &usize| stays_obstacle(row * width + column);
        let below = (0..row).rev().find(is_end).map_or(0, |end| end + 1);
        let above = (row + 1..spans.len()).find(is_end).unwrap_or(spans.len());
        for span in &mut spans[below..above] {
            let [first, last] = span.unwrap_or([column, column]);
            *span = Some([first.min(column), last.max(column)]);
        }
        done = [column, above];
    }
    spans
}

/// What must be computed again in a row.
struct Window {
    /// Columns of the cells that may change.
    cells: Range<usize>,
    /// Columns that have a say there.
    columns: Range<usize>,
}

impl Window {
    /// `None` if no column of the row changed.
    fn new(clearance: &Clearance, spans: &[Option<[usize; 2]>], y: usize) -> Option<Self> {
        let [first, last] = spans[y]?;
        let width = clearance.info().width as usize;
        let row = y * width..(y + 1) * width;
        let (squared, basis) = (&clearance.squared()[row.clone()], &clearance.basis()[row]);
        let basis_column = |x: usize| basis[x] as usize % width;
        // Of columns as near the leftmost counts: on the right the bound must be nearer.
        let is_left_bound =
            |&x: &usize| basis_column(x) < first && squared[x] as usize <= (first - x).pow(2);
        let is_right_bound =
            |&x: &usize| last < basis_column(x) && (squared[x] as usize) < (x - last).pow(2);
        let left = (0..first).rev().find(is_left_bound);
        let right = (last + 1..width).find(is_right_bound);
        let cells = left.map_or(0, |x| x + 1)..right.unwrap_or(width);
        let start = left.map_or(0, basis_column).min(cells.start);
        let end = right.map_or(width, |x| basis_column(x) + 1).max(cells.end);
        Some(Self { cells, columns: start..end })
    }
}
