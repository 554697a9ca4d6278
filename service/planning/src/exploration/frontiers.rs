//! Where what is explored and can be reached meets what is not.

use meetpoint_geometry::Point2;

use super::chart::Chart;

/// Unexplored cells side by side that one step leads to from explored ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frontier {
    /// Centre of the one that is nearest to the middle of them, in metres.
    pub point: Point2<f64>,
    /// So many cells' edges, in metres.
    pub length_m: f64,
}

/// The frontiers of the ground that can be reached from any of `starts`, by their lowest cells, and
/// how many cells that ground has.
pub(super) fn frontiers(
    chart: &Chart,
    starts: impl Iterator<Item = usize>,
) -> (Vec<Frontier>, usize) {
    let (mut is_border, n_reached) = flooded(chart, starts);
    let mut frontiers = vec![];
    for cell in 0..is_border.len() {
        if is_border[cell] {
            frontiers.push(frontier(chart, cell, &mut is_border));
        }
    }
    (frontiers, n_reached)
}

/// Goals beside what can be reached, and the number of explored cells that can.
fn flooded(chart: &Chart, starts: impl Iterator<Item = usize>) -> (Vec<bool>, usize) {
    let n_cells = chart.ground.len();
    let (mut is_seen, mut is_border) = (vec![false; n_cells], vec![false; n_cells]);
    let (mut ahead, mut n_reached) = (vec![], 0);
    for start in starts {
        if !std::mem::replace(&mut is_seen[start], true) {
            ahead.push(start);
        }
    }
    while let Some(cell) = ahead.pop() {
        if chart.is_goal(cell) {
            is_border[cell] = true;
            continue;
        }
        n_reached += 1;
        for (_, next) in chart.space.steps(cell) {
            if !std::mem::replace(&mut is_seen[next], true) {
                ahead.push(next);
            }
        }
    }
    (is_border, n_reached)
}

/// The frontier that a cell belongs to; its cells are taken off.
fn frontier(chart: &Chart, first: usize, is_border: &mut [bool]) -> Frontier {
    let width = chart.info.width as usize;
    let mut cells = vec![first];
    is_border[first] = false;
    let mut n_done = 0;
    while let Some(&cell) = cells.get(n_done) {
        n_done += 1;
        // The outermost ring is closed, so that no goal lies on it.
        let rows = [cell - width, cell, cell + width];
        for beside in rows.into_iter().flat_map(|middle| middle - 1..=middle + 1) {
            if std::mem::replace(&mut is_border[beside], false) {
                cells.push(beside);
            }
        }
    }
    let place = |cell: usize| Point2::new((cell % width) as f64, (cell / width) as f64);
    let sum = cells.iter().fold(Point2::origin(), |sum, &cell| sum + place(cell).coords);
    let middle = sum / cells.len() as f64;
    let off = |cell: usize| (place(cell) - middle).norm_squared();
    let nearest = cells.iter().copied().min_by(|&a, &b| off(a).total_cmp(&off(b)).then(a.cmp(&b)));
    let side_m = chart.info.frame.resolution_m();
    let point = place(nearest.unwrap_or(first)).coords.add_scalar(0.5) * side_m;
    Frontier { point: chart.info.origin() + point, length_m: cells.len() as f64 * side_m }
}
