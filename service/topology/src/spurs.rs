//! The diagram without the branches that end in the corners of walls.
//!
//! From every corner of a wall a branch of the Voronoi diagram leads into the room, on which no
//! robot ever drives. Between two walls that meet at an angle, clearance grows with the way by
//!
//! ```text
//! slope = (D(junction) - D(end)) / length = sin(angle / 2)
//! ```
//!
//! so a branch, from an end of the diagram to the first junction, is a spur if its slope is steep,
//! or if it is short. Behind a door that was looked through there may be a short way only, and the
//! branch that leads there from the middle of a room is as steep; but not at its end. All spurs are taken off at once; what was a junction may become part of a line
//! or an end, so it is done again until there are none. Time O(cells of the diagram) a round.

use crate::clearance::Clearance;
use crate::voronoi::Voronoi;
use crate::walk::Walk;

/// Slope from which on a branch leads into a corner: walls at 45 degrees to each other or more.
const SLOPE_MIN: f64 = 0.38;

/// The diagram without its spurs, and without branches shorter than `length_min_m`, in metres. The
/// slope of a branch is that of its last `reach_m` metres. A line that meets no other stays.
pub(crate) fn without_spurs(
    voronoi: &Voronoi,
    clearance: &Clearance,
    length_min_m: f64,
    reach_m: f64,
) -> Voronoi {
    let mut left = voronoi.clone();
    loop {
        let ends = left.cells().iter().copied().filter(|&index| left.degree(index) == 1);
        let is_spur = |branch: &Branch| {
            let rise_m = clearance.at_m(branch.inner) - clearance.at_m(branch.end);
            branch.length_m < length_min_m || SLOPE_MIN * branch.inner_m <= rise_m
        };
        let spurs = ends.filter_map(|end| branch(&left, end, reach_m)).filter(is_spur);
        let cells: Vec<usize> = spurs.flat_map(|branch| branch.cells).collect();
        if cells.is_empty() {
            return left;
        }
        left.take_off(&cells);
    }
}

/// A line from an end to a junction.
struct Branch {
    end: usize,
    /// Where its slope is measured to: the junction, or a cell before it.
    inner: usize,
    /// Way from the end to there.
    inner_m: f64,
    /// From the end on, the junction excluded.
    cells: Vec<usize>,
    length_m: f64,
}

/// The branch that begins at an end; `None` if it meets no junction.
fn branch(voronoi: &Voronoi, end: usize, reach_m: f64) -> Option<Branch> {
    let resolution_m = voronoi.info().frame.resolution_m();
    let mut walk = Walk::new(voronoi, end);
    let (mut cells, mut inner) = (vec![end], None);
    loop {
        let at = walk.step()?;
        let length_m = walk.length() * resolution_m;
        if inner.is_none() && reach_m <= length_m {
            inner = Some((at, length_m));
        }
        if 3 <= voronoi.degree(at) {
            let (inner, inner_m) = inner.unwrap_or((at, length_m));
            return Some(Branch { end, inner, inner_m, cells, length_m });
        }
        cells.push(at);
    }
}
