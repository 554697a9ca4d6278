//! Random rooms, and distances to obstacle squares by going through all of them.

use meetpoint_geometry::{Cell, GridFrame, GridInfo, Point2};
use meetpoint_planning::{Space, enterable};
use meetpoint_topology::FreeSpace;
use proptest::prelude::*;

/// Edge of a cell, in metres.
pub(crate) const RESOLUTION_M: f64 = 0.05;

/// A rectangle of free cells of 0.05 m with blocks standing in it.
pub(crate) fn rooms() -> impl Strategy<Value = FreeSpace> {
    (3..40_usize, 3..40_usize).prop_flat_map(|(width, height)| {
        let block = (0..width, 0..height, 1..8_usize, 1..8_usize);
        proptest::collection::vec(block, 0..12).prop_map(move |blocks| {
            let is_free = |x: usize, y: usize| {
                let is_in = |&(left, low, columns, rows): &(usize, usize, usize, usize)| {
                    (left..left + columns).contains(&x) && (low..low + rows).contains(&y)
                };
                !blocks.iter().any(is_in)
            };
            free_space(width, height, is_free)
        })
    })
}

/// The cells for which `is_free` says so, with a rim.
pub(crate) fn free_space(
    width: usize,
    height: usize,
    is_free: impl Fn(usize, usize) -> bool,
) -> FreeSpace {
    let frame = GridFrame::new(RESOLUTION_M).expect("a length");
    let [columns, rows] = [width, height].map(|n| u32::try_from(n).expect("small"));
    let info = GridInfo { frame, first: Cell { x: -5, y: 3 }, width: columns, height: rows };
    let cells: Vec<bool> =
        (0..width * height).map(|index| is_free(index % width, index / width)).collect();
    FreeSpace::from_cells(info, &cells)
}

/// Where a robot of that radius can go, at no more than length costs.
pub(crate) fn space_of(free: &FreeSpace, radius_m: f64) -> Space {
    Space::uniform(free.info(), &enterable(free, radius_m)).expect("a word a cell")
}

/// Cells that can be entered.
pub(crate) fn cells_of(space: &Space) -> Vec<usize> {
    (0..space.info().n_cells()).filter(|&cell| space.is_enterable(cell)).collect()
}

/// The centre of a cell, in cells.
pub(crate) fn center(info: GridInfo, cell: usize) -> Point2<f64> {
    let width = info.width as usize;
    Point2::new((cell % width) as f64 + 0.5, (cell / width) as f64 + 0.5)
}

/// In metres.
pub(crate) fn in_metres(info: GridInfo, point: Point2<f64>) -> Point2<f64> {
    info.origin() + point.coords * info.frame.resolution_m()
}

/// From a segment to the nearest obstacle square, in cells: the definition.
pub(crate) fn distance(free: &FreeSpace, a: Point2<f64>, b: Point2<f64>) -> f64 {
    let width = free.info().width as usize;
    let obstacles = free.is_free().iter().enumerate().filter(|&(_, &is_free)| !is_free);
    obstacles
        .map(|(index, _)| to_square(a, b, [(index % width) as f64, (index / width) as f64]))
        .fold(f64::INFINITY, f64::min)
}

/// From a segment to the square from `low` to `low + 1`.
fn to_square(a: Point2<f64>, b: Point2<f64>, low: [f64; 2]) -> f64 {
    if is_cut(a, b, low) {
        return 0.0;
    }
    let from_end = |end: Point2<f64>| {
        let nearest = [0, 1].map(|axis| end[axis].clamp(low[axis], low[axis] + 1.0));
        (end - Point2::from(nearest)).norm()
    };
    let from_corner = |x: f64, y: f64| {
        let corner = Point2::new(low[0] + x, low[1] + y);
        let along = b - a;
        let share = (corner - a).dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE);
        (corner - (a + along * share.clamp(0.0, 1.0))).norm()
    };
    let corners = [
        from_corner(0.0, 0.0),
        from_corner(0.0, 1.0),
        from_corner(1.0, 0.0),
        from_corner(1.0, 1.0),
    ];
    corners.into_iter().fold(from_end(a).min(from_end(b)), f64::min)
}

/// Whether the segment has points within the square: Y.-D. Liang and B. Barsky, "A new concept and
/// method for line clipping", ACM Transactions on Graphics 3 (1984).
fn is_cut(a: Point2<f64>, b: Point2<f64>, low: [f64; 2]) -> bool {
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for axis in 0..2 {
        let (start, along) = (a[axis], b[axis] - a[axis]);
        let ends = [low[axis] - start, low[axis] + 1.0 - start];
        if along == 0.0 {
            if 0.0 < ends[0] || ends[1] < 0.0 {
                return false;
            }
        } else {
            let [one, other] = ends.map(|end| end / along);
            (from, to) = (from.max(one.min(other)), to.min(one.max(other)));
        }
    }
    from <= to
}
