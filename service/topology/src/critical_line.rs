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

/// Whether some of `cells`, ascending, are so near to a line that its opening may read them.
fn sees(lattice: Lattice, [from, to]: [usize; 2], depth: f64, cells: &[usize]) -> bool {
    let [dx, dy] = lattice.offset(from, to);
    let length = (dx as f64).hypot(dy as f64);
    let middle = lattice.moved(from, [dx / 2, dy / 2]);
    // The middle is rounded to a cell, and so is what is read.
    let reach = reach(length, depth).ceil().min(f64::from(u32::MAX)) as usize + 2;
    let mut is_near = false;
    lattice.for_each_row(middle, reach, |row| {
        is_near |= cells[cells.partition_point(|&cell| cell < row.start)..]
            .first()
            .is_some_and(|&cell| cell < row.end);
    });
    is_near
}
