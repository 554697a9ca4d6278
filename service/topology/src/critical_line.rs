//! Critical lines: a critical point's two basis points joined, and what is known of the line.

use crate::clearance::Clearance;
use crate::critical::CriticalPoint;
use crate::cut::{Crossing, crossings};
use crate::free::FreeSpace;
use crate::lattice::Lattice;
use crate::opening::opening;

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
    /// Steps between neighbouring cells that the line cuts, free or not.
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
    let lattice = Lattice::new(open.info());
    let depth = depth_m / open.info().frame.resolution_m();
    let line = |&point: &CriticalPoint| CriticalLine {
        point,
        clearance_m: clearance.at_m(point.index),
        opening: opening(open, point.basis, depth),
        crossings: crossings(lattice, point.basis[0], point.basis[1]),
    };
    points.iter().map(line).collect()
}
