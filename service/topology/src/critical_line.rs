//! Critical lines: a critical point's two basis points joined, and what is known of the line.

use std::collections::HashMap;

use crate::clearance::Clearance;
use crate::critical::CriticalPoint;
use crate::cut::{Crossing, crossings};
use crate::free::FreeSpace;
use crate::lattice::Lattice;
use crate::opening::{opening, reach};

/// A line across free space at a critical point.
#[derive(Clone, Debug, PartialEq)]
pub struct CriticalLine {
    /// The point, with the basis points that are the ends of the line.
    pub point: CriticalPoint,
    /// Distance from the point to its basis points, in metres.
    pub clearance_m: f64,
    /// How far space opens up behind the line, on the side where it is less, as a multiple of the
    /// line's length; 0 if nothing is free there.
    pub opening: f64,
    /// Steps between neighbouring cells that the line cuts, none of which belongs to a wall.
    pub crossings: Vec<Crossing>,
}

/// The lines of critical points, in the same order. `open` is the space that the points were found
/// in; openings are looked for up to `depth_m` metres behind a line.
pub fn critical_lines(
    open: &FreeSpace,
    clearance: &Clearance,
    points: &[CriticalPoint],
    depth_m: f64,
) -> Vec<CriticalLine> {
    points.iter().map(|&point| line(open, clearance, point, depth_m)).collect()
}

/// The lines that were, brought to what they are of the space and the points now, given the cells,
/// ascending, that opened or closed; and the crossings of lines that came or went.
pub(crate) fn updated_lines(
    before: Vec<CriticalLine>,
    open: &FreeSpace,
    clearance: &Clearance,
    points: &[CriticalPoint],
    depth_m: f64,
    flipped: &[usize],
) -> (Vec<CriticalLine>, Vec<Crossing>) {
    let mut before: HashMap<CriticalPoint, CriticalLine> =
        before.into_iter().map(|line| (line.point, line)).collect();
    let depth = depth_m / open.info().frame.resolution_m();
    let lattice = Lattice::new(open.info());
    let (mut lines, mut changed) = (vec![], vec![]);
    for &point in points {
        let now = match before.remove(&point) {
            Some(line) if !sees(lattice, point.basis, depth, flipped) => line,
            Some(_) => line(open, clearance, point, depth_m),
            None => {
                let line = line(open, clearance, point, depth_m);
                changed.extend(&line.crossings);
                line
            }
        };
        lines.push(now);
    }
    changed.extend(before.into_values().flat_map(|line| line.crossings));
    (lines, changed)
}

fn line(
    open: &FreeSpace,
    clearance: &Clearance,
    point: CriticalPoint,
    depth_m: f64,
) -> CriticalLine {
    let depth = depth_m / open.info().frame.resolution_m();
    let mut crossings = crossings(Lattice::new(open.info()), point.basis[0], point.basis[1]);
    crossings.retain(|crossing| {
        [crossing.left, crossing.right].into_iter().all(|index| open.is_free()[index])
    });
    CriticalLine {
        point,
        clearance_m: clearance.at_m(point.index),
        opening: opening(open, point.basis, depth),
        crossings,
    }
}

/// Whether some of `cells`, ascending, are so near to a line that its opening may read them: no
/// farther behind it than `depth` cells, and no farther along it than a run is followed.
fn sees(lattice: Lattice, [from, to]: [usize; 2], depth: f64, cells: &[usize]) -> bool {
    let [dx, dy] = lattice.offset(from, to).map(|n| n as f64);
    let length = dx.hypot(dy);
    let middle = lattice.column_row(from).map(|n| n as f64);
    let middle = [middle[0] + dx / 2.0, middle[1] + dy / 2.0];
    // A cell is read where it is touched, up to half its diagonal from its centre.
    let (along_max, behind_max) = (reach(length) + 1.0, depth + 1.0);
    let is_near = |[x, y]: [f64; 2]| {
        let (along, behind) = ((x * dx + y * dy) / length, (x * dy - y * dx) / length);
        along.abs() <= along_max && behind.abs() <= behind_max
    };
    let rows_max = along_max.hypot(behind_max);
    let row_of = |index: usize| lattice.column_row(index)[1] as f64;
    let first = cells.partition_point(|&index| row_of(index) < middle[1] - rows_max);
    let near_rows = cells[first..].iter().take_while(|&&i| row_of(i) <= middle[1] + rows_max);
    near_rows
        .map(|&index| lattice.column_row(index))
        .any(|[x, y]| is_near([x as f64 - middle[0], y as f64 - middle[1]]))
}
