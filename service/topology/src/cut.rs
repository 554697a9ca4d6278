//! Cutting space along a critical line.
//!
//! A line from the centre of one obstacle cell to that of another crosses steps between cells. A
//! step from `c` to its neighbour `d` is cut if `c` lies to the left of the line or on it, `d` to
//! the right, and the line passes between them. No walk from one side to the other over free cells
//! and along the axes avoids the cut but around the obstacles at its ends. Time O(length).

use crate::lattice::Lattice;

/// A step cut by a line: from a cell on its left (or on the line) to one on its right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crossing {
    /// Left of the line from its first to its second basis point, by index.
    pub left: usize,
    /// Right of it.
    pub right: usize,
}

/// Steps along the axes that the line between the centres of two cells cuts, in the order of the
/// cells on the left.
pub(crate) fn crossings(lattice: Lattice, from: usize, to: usize) -> Vec<Crossing> {
    let [dx, dy] = lattice.offset(from, to);
    let side = |index: usize| {
        let [x, y] = lattice.offset(from, index);
        dx * y - dy * x
    };
    let mut crossings = vec![];
    for index in near(lattice, from, to) {
        if side(index) < 0 {
            continue;
        }
        for neighbor in lattice.beside(index) {
            if side(neighbor) < 0 && passes_between(lattice, index, neighbor, from, to) {
                crossings.push(Crossing { left: index, right: neighbor });
            }
        }
    }
    crossings.sort_unstable_by_key(|crossing| (crossing.left, crossing.right));
    crossings.dedup();
    crossings
}

/// Whether the ends of the line lie on either side of, or on, the row or column of the step.
fn passes_between(lattice: Lattice, left: usize, right: usize, from: usize, to: usize) -> bool {
    let [step_x, _] = lattice.offset(left, right);
    let axis = usize::from(step_x != 0);
    let [a, b] = [from, to].map(|end| lattice.offset(left, end)[axis]);
    a.min(b) <= 0 && 0 <= a.max(b)
}

/// Cells that the line passes through or beside, rim excluded.
fn near(lattice: Lattice, from: usize, to: usize) -> Vec<usize> {
    let [dx, dy] = lattice.offset(from, to);
    let n_steps = dx.abs().max(dy.abs());
    let mut cells = vec![];
    for step in 0..=n_steps {
        // Rounded down; the cells around take in the other rounding.
        let along = |d: i64| (d * step).div_euclid(n_steps.max(1));
        let middle = lattice.moved(from, [along(dx), along(dy)]);
        if lattice.is_inside(middle) {
            cells.push(middle);
            cells.extend(lattice.around(middle).into_iter().filter(|&c| lattice.is_inside(c)));
        }
    }
    cells.sort_unstable();
    cells.dedup();
    cells
}

#[cfg(test)]
mod tests {
    use meetpoint_geometry::{Cell, GridFrame, GridInfo};
    use proptest::prelude::*;

    use super::*;
    use crate::free::FreeSpace;
    use crate::regions::partition;

    /// Cells along a side of the room that is cut.
    const SIDE: usize = 12;

    fn room() -> (FreeSpace, Lattice) {
        let frame = GridFrame::new(0.05).expect("a length");
        let first = Cell { x: 0, y: 0 };
        let info = GridInfo { frame, first, width: 12, height: 12 };
        let space = FreeSpace::from_cells(info, &[true; SIDE * SIDE]);
        let lattice = Lattice::new(space.info());
        (space, lattice)
    }

    proptest! {
        /// A line from wall to wall leaves the cells on its two sides, and no way between them.
        #[test]
        fn a_line_parts_its_two_sides(from in 0..=SIDE + 1, to in 0..=SIDE + 1, turned: bool) {
            let (space, lattice) = room();
            let width = SIDE + 2;
            // Between the lower and the upper wall, or between the left and the right.
            let ends = if turned {
                [from * width, to * width + width - 1]
            } else {
                [from, (width - 1) * width + to]
            };
            for [from, to] in [ends, [ends[1], ends[0]]] {
                let [dx, dy] = lattice.offset(from, to);
                let is_left = |index: usize| {
                    let [x, y] = lattice.offset(from, index);
                    0 <= dx * y - dy * x
                };
                let found = partition(&space, &crossings(lattice, from, to));
                let free = (0..width * width).filter(|&index| space.is_free()[index]);
                let mut of_side = [vec![], vec![]];
                for index in free {
                    of_side[usize::from(is_left(index))].push(found.region_at(index));
                }
                for side in &mut of_side {
                    side.dedup();
                    prop_assert!(side.len() <= 1, "a side is whole");
                }
                let n_sides = of_side.iter().filter(|side| !side.is_empty()).count();
                prop_assert_eq!(found.n_regions() as usize, n_sides, "and shut off");
            }
        }
    }
}
