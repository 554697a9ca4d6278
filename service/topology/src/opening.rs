//! How much space opens up behind a line.
//!
//! Behind a door the walls turn away from its axis, however narrow the corridor is that it leads
//! to; behind a line across a corridor they go on as before. So the measure looks along the line:
//!
//! ```text
//! opening(side) = max over 0 < t <= depth of |free run through m + t n along the line| / |line|
//! ```
//!
//! with `m` the middle of the line and `n` its normal. The line's opening is that of the side
//! where it is less. Time O(depth · length), space O(1).

use crate::free::FreeSpace;
use crate::lattice::Lattice;

/// A run that is so many times as long as its line counts no more.
const OPENING_MAX: f64 = 4.0;

/// Steps of a walk, in cells: fine enough to hit every obstacle that is more than touched.
const STEP: f64 = 0.5;

/// Opening of the line between two obstacle cells; `depth` in cells.
pub(crate) fn opening(open: &FreeSpace, basis: [usize; 2], depth: f64) -> f64 {
    let lattice = Lattice::new(open.info());
    let [dx, dy] = lattice.offset(basis[0], basis[1]).map(|n| n as f64);
    let length = dx.hypot(dy);
    let along = [dx / length, dy / length];
    // From the corner of the first cell to the middle between the two centres.
    let middle = [dx, dy].map(|d| f64::midpoint(1.0, d));
    let walker = Walker { open, lattice, origin: lattice.column_row(basis[0]) };
    let of_side = |normal: [f64; 2]| {
        let mut widest = 0.0_f64;
        let mut away = 0.0;
        while away <= depth {
            let at = moved(middle, normal, away);
            if !walker.is_free(at) {
                break;
            }
            let reach = OPENING_MAX * length;
            let run = walker.run(at, along, reach) + walker.run(at, along.map(|d| -d), reach);
            widest = widest.max(run.min(reach));
            away += STEP;
        }
        widest / length
    };
    of_side([-along[1], along[0]]).min(of_side([along[1], -along[0]]))
}

/// How far a run along a line of that length is followed from its middle, both in cells.
pub(crate) fn reach(length: f64) -> f64 {
    OPENING_MAX * length + STEP
}

struct Walker<'a> {
    open: &'a FreeSpace,
    lattice: Lattice,
    /// Column and row from which points are counted: the line's own, lest rounding depend on where
    /// the rectangle begins.
    origin: [i64; 2],
}

impl Walker<'_> {
    fn is_free(&self, at: [f64; 2]) -> bool {
        let index = self.lattice.index_at(self.origin, at);
        index.is_some_and(|index| self.open.is_free()[index])
    }

    /// Free way from a point in a direction, at most `reach`, in cells.
    fn run(&self, from: [f64; 2], direction: [f64; 2], reach: f64) -> f64 {
        let mut way = 0.0;
        while way < reach && self.is_free(moved(from, direction, way + STEP)) {
            way += STEP;
        }
        way
    }
}

fn moved(from: [f64; 2], direction: [f64; 2], way: f64) -> [f64; 2] {
    [0, 1].map(|axis| from[axis] + way * direction[axis])
}
