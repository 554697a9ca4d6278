//! The nearest cell that a robot can be at.
//!
//! A point within a cell that can be entered is there already. Any other is moved to the centre of
//! a cell, where the robot keeps its radius from obstacles:
//!
//! ```text
//! nearest(p) = argmin over enterable cells c of |p - center(c)|
//! ```
//!
//! Of cells equally far, to a millionth of a cell, the lowest, then the leftmost. By rings of cells around the point, until
//! no cell of the next ring can be nearer. Time O((distance / resolution)²).

use meetpoint_geometry::{Cell, GridInfo, Point2};

use crate::space::Space;

/// Where a point that no robot can be at is moved to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// The cell, by its place in row-major data.
    pub cell: usize,
    /// The point itself, or the centre of the cell if it had to be moved, in metres.
    pub point: Point2<f64>,
    /// How far it was moved, in metres; 0 if it was not.
    pub moved_m: f64,
}

/// The enterable cell nearest to `point`, and `None` if the point would have to be moved by more
/// than `tolerance_m`.
pub fn nearest_enterable(space: &Space, point: Point2<f64>, tolerance_m: f64) -> Option<Nearest> {
    if !point.coords.iter().all(|axis| axis.is_finite()) {
        return None;
    }
    let info = space.info();
    let here = info.frame.cell_at(point);
    if let Some(cell) = info.index_of(here).filter(|&cell| space.is_enterable(cell)) {
        return Some(Nearest { cell, point, moved_m: 0.0 });
    }
    let mut best: Option<Nearest> = None;
    let mut radius = radius_of(info, here);
    while radius.start <= radius.end {
        let reach_m = best.map_or(tolerance_m, |best| best.moved_m.min(tolerance_m));
        // The point lies within its cell: centres `n` cells on are at least n - 1/2 cells away.
        let nearest_m = (f64::from(radius.start) - 0.5) * info.frame.resolution_m();
        // Rounding must not part what is equally far.
        if reach_m + 1e-6 * info.frame.resolution_m() < nearest_m || tolerance_m.is_nan() {
            break;
        }
        for cell in ring(info, here, radius.start) {
            let found = nearer(space, point, cell, tolerance_m);
            best = found.into_iter().chain(best).min_by_key(|found| rank(info, found));
        }
        radius.start += 1;
    }
    best
}

/// Rings around a cell, by their distance from it in cells.
struct Rings {
    start: i32,
    end: i32,
}

/// The rings around `here` that hold cells of the rectangle.
fn radius_of(info: GridInfo, here: Cell) -> Rings {
    let side = |n: u32| i32::try_from(n).unwrap_or(i32::MAX);
    let last = Cell {
        x: info.first.x.saturating_add(side(info.width)).saturating_sub(1),
        y: info.first.y.saturating_add(side(info.height)).saturating_sub(1),
    };
    let outside = |at: i32, first: i32, last: i32| {
        first.saturating_sub(at).max(at.saturating_sub(last)).max(0)
    };
    let farthest =
        |at: i32, first: i32, last: i32| at.saturating_sub(first).max(last.saturating_sub(at));
    Rings {
        start: outside(here.x, info.first.x, last.x).max(outside(here.y, info.first.y, last.y)),
        end: farthest(here.x, info.first.x, last.x).max(farthest(here.y, info.first.y, last.y)),
    }
}

/// Cells of the rectangle whose larger distance from `here`, by columns or rows, is `radius`.
fn ring(info: GridInfo, here: Cell, radius: i32) -> impl Iterator<Item = Cell> {
    let [left, right] = [here.x.saturating_sub(radius), here.x.saturating_add(radius)];
    let [low, high] = [here.y.saturating_sub(radius), here.y.saturating_add(radius)];
    let last = |first: i32, n: u32| first.saturating_add(i32::try_from(n).unwrap_or(i32::MAX));
    let columns =
        left.max(info.first.x)..right.saturating_add(1).min(last(info.first.x, info.width));
    let rows = low.max(info.first.y)..high.saturating_add(1).min(last(info.first.y, info.height));
    let across = move |y: i32| columns.clone().map(move |x| Cell { x, y });
    let beside = rows
        .filter(move |&y| y != low && y != high)
        .flat_map(move |y| [left, right].map(|x| Cell { x, y }));
    across(low).chain(across(high)).chain(beside)
}

/// The centre of `cell`, if a robot can be there and it is near enough.
fn nearer(space: &Space, from: Point2<f64>, cell: Cell, tolerance_m: f64) -> Option<Nearest> {
    let info = space.info();
    let index = info.index_of(cell).filter(|&index| space.is_enterable(index))?;
    let point = info.frame.center_of(cell);
    let moved_m = (point - from).norm();
    (moved_m <= tolerance_m).then_some(Nearest { cell: index, point, moved_m })
}

/// By distance, to a millionth of a cell, and then by cell.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturating")]
fn rank(info: GridInfo, found: &Nearest) -> (u64, usize) {
    ((found.moved_m / info.frame.resolution_m() * 1e6).round() as u64, found.cell)
}
