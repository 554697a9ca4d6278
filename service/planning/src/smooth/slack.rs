//! A string with few turns along a path of cells.
//!
//! From the first corner of the path to the last if that is clear, else in two at the corner
//! farthest from the straight line: U. Ramer, "An iterative procedure for the polygonal
//! approximation of plane curves", Computer Graphics and Image Processing 1 (1972), asking for
//! clear ways instead of near ones. Single runs of the path are clear as they are.

use meetpoint_geometry::Point2;

use super::terrain::Terrain;

/// Corners of a path of cells, by the centres of the cells; first and last included. In cells.
pub(crate) fn corners_of(
    cells: impl Iterator<Item = usize>,
    width: usize,
    corners: &mut Vec<Point2<f64>>,
) {
    corners.clear();
    let center =
        |cell: usize| Point2::new((cell % width) as f64 + 0.5, (cell / width) as f64 + 0.5);
    let (mut last, mut last_step) = (None, 0);
    for cell in cells {
        let Some(before) = last.replace(cell) else {
            corners.push(center(cell));
            continue;
        };
        let step = cell.wrapping_sub(before);
        if step != last_step && last_step != 0 {
            corners.push(center(before));
        }
        last_step = step;
    }
    if let Some(cell) = last.filter(|_| last_step != 0) {
        corners.push(center(cell));
    }
}

/// Which corners a string may turn at so that it stays clear and costs no more than the path;
/// first and last included.
pub(crate) fn slack(terrain: &Terrain, corners: &[Point2<f64>]) -> Vec<usize> {
    let along = prefix_costs(terrain, corners);
    let mut kept = vec![0];
    let mut open = vec![corners.len().saturating_sub(1)];
    let mut from = 0;
    while let Some(&to) = open.last() {
        let [a, b] = [corners[from], corners[to]];
        let is_no_dearer =
            || along.as_ref().is_none_or(|along| terrain.cost(a, b) <= along[to] - along[from]);
        if to <= from + 1 || terrain.is_clear(a, b) && is_no_dearer() {
            kept.push(to);
            from = to;
            open.pop();
        } else {
            open.push(farthest(corners, from, to));
        }
    }
    kept
}

/// What the path costs up to each corner; `None` where that is its length, which no straight way
/// exceeds.
fn prefix_costs(terrain: &Terrain, corners: &[Point2<f64>]) -> Option<Vec<f64>> {
    terrain.weights?;
    let mut sum = 0.0;
    let costs = corners.windows(2).map(|ends| {
        sum += terrain.cost(ends[0], ends[1]);
        sum
    });
    Some(std::iter::once(0.0).chain(costs).collect())
}

/// The corner between two that is farthest from the line between them.
fn farthest(corners: &[Point2<f64>], from: usize, to: usize) -> usize {
    let [a, b] = [corners[from], corners[to]];
    let along = b - a;
    let middle = usize::midpoint(from, to);
    let (mut best, mut height) = (middle, 1e-9);
    for (at, corner) in corners.iter().enumerate().take(to).skip(from + 1) {
        let here = along.perp(&(corner - a)).abs();
        if height < here {
            (best, height) = (at, here);
        }
    }
    best
}
