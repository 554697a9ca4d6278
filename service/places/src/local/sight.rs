//! What is seen from a point of a grid: how far walls are, and how much of the floor is in view.
//!
//! The isovist of a point is all that is seen from it: M. Benedikt, "To take hold of space: isovist
//! fields", Environment and Planning B 6 (1979); HSSH 2004, section III-B, would measure gateways by
//! it. Here it is the free cells that rays meet, one to every cell at the edge of sight. Time
//! O((sight / cell)²) an isovist.

use meetpoint_geometry::{Cell, GridInfo, Point2, Vector2};
use meetpoint_topology::FreeSpace;

/// Steps of a look along a line, in cells: fine enough to hit every obstacle that is more than
/// touched.
const STEP: f64 = 0.5;

/// The cell at a point, if it is free.
fn free_at(space: &FreeSpace, at: Point2<f64>) -> Option<usize> {
    let info = space.info();
    info.index_of(info.frame.cell_at(at)).filter(|&index| space.is_free()[index])
}

/// How far one sees from a point in a direction, up to `sight_m`, in metres.
pub(crate) fn free_way_m(
    space: &FreeSpace,
    from: Point2<f64>,
    heading_rad: f64,
    sight_m: f64,
) -> f64 {
    let step_m = STEP * space.info().frame.resolution_m();
    let (sin, cos) = heading_rad.sin_cos();
    let along = Vector2::new(cos, sin);
    let mut way_m = 0.0;
    while way_m < sight_m && free_at(space, from + (way_m + step_m) * along).is_some() {
        way_m += step_m;
    }
    way_m.min(sight_m)
}

/// The cells in view from a point, by their places in row-major data, ascending.
pub(crate) fn isovist(space: &FreeSpace, from: Point2<f64>, sight_m: f64) -> Vec<usize> {
    let info = space.info();
    let resolution_m = info.frame.resolution_m();
    #[expect(clippy::cast_possible_truncation, reason = "sight is some metres")]
    let reach = ((sight_m / resolution_m).ceil() as i32).max(1);
    let Cell { x, y } = info.frame.cell_at(from);
    let first = Cell { x: x.saturating_sub(reach), y: y.saturating_sub(reach) };
    let side = 2 * reach.unsigned_abs() + 1;
    let square = GridInfo { first, width: side, height: side, ..info };
    let mut is_seen = vec![false; square.n_cells()];
    let (width, side) = (info.width as usize, side as usize);
    // Where the square begins among the columns and rows of the space, and the eye in both.
    let corner = (square.origin() - info.origin()) / resolution_m;
    let eye = (from - square.origin()) / resolution_m;
    let n_steps = sight_m / (STEP * resolution_m);
    for Cell { x, y } in edge(reach) {
        let along = Vector2::new(f64::from(x), f64::from(y)).normalize() * STEP;
        let (mut at, mut step) = (eye, 0.0);
        while step <= n_steps {
            // The outermost cells of a space are never free, so that no ray leaves it.
            let [column, row] = cell_in(at + corner);
            if !space.is_free().get(row * width + column).is_some_and(|&is_free| is_free) {
                break;
            }
            let [column, row] = cell_in(at);
            is_seen[row * side + column] = true;
            step += 1.0;
            at = eye + step * along;
        }
    }
    let seen = square.cells().zip(is_seen).filter(|(_, is_seen)| *is_seen);
    seen.filter_map(|(cell, _)| info.index_of(cell)).collect()
}

/// Column and row of a point given in cells.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
fn cell_in(at: Vector2<f64>) -> [usize; 2] {
    [at.x as usize, at.y as usize]
}

/// The cells at the edge of a square around (0, 0).
fn edge(reach: i32) -> impl Iterator<Item = Cell> {
    (-reach..reach).flat_map(move |at| {
        [
            Cell { x: at, y: -reach },
            Cell { x: reach, y: at },
            Cell { x: -at, y: reach },
            Cell { x: -reach, y: -at },
        ]
    })
}

/// How many of the elements of two ascending lists are in one of them only.
pub(crate) fn n_different(mut a: &[usize], mut b: &[usize]) -> usize {
    let mut n = 0;
    while let ([first_a, rest_a @ ..], [first_b, rest_b @ ..]) = (a, b) {
        n += usize::from(first_a != first_b);
        if first_a <= first_b {
            a = rest_a;
        }
        if first_b <= first_a {
            b = rest_b;
        }
    }
    n + a.len() + b.len()
}

#[cfg(test)]
mod tests {
    use meetpoint_geometry::GridFrame;

    use super::*;

    #[test]
    fn walls_hide_what_is_behind_them() {
        let frame = GridFrame::new(1.0).expect("a length");
        let info = GridInfo { frame, first: Cell { x: 0, y: 0 }, width: 5, height: 3 };
        let rows = [".....", "..#..", "....."];
        let cells: Vec<bool> =
            rows.iter().rev().flat_map(|row| row.bytes().map(|sign| sign == b'.')).collect();
        let space = FreeSpace::from_cells(info, &cells);
        let eye = Point2::new(0.5, 1.5);
        assert_eq!(free_way_m(&space, eye, 0.0, 9.0), 1.0, "to the middle block, in half cells");
        assert_eq!(free_way_m(&space, eye, 0.0, 0.3), 0.3, "as far as sight goes");
        let seen = isovist(&space, eye, 9.0);
        let index = |x, y| space.info().index_of(Cell { x, y }).expect("inside");
        assert!(seen.contains(&index(1, 1)) && seen.contains(&index(4, 2)), "past the block");
        assert!(!seen.contains(&index(4, 1)), "behind the block");
        assert_eq!(n_different(&[1, 2, 5], &[2, 6]), 3, "1, 5 and 6");
    }
}
