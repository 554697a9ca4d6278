//! Clearance against all pairs of cells.

use meetpoint_topology::{FreeSpace, clearance};
use proptest::prelude::*;

use crate::building::any_space;

fn distance_squared(space: &FreeSpace, a: usize, b: usize) -> usize {
    let width = space.info().width as usize;
    (a % width).abs_diff(b % width).pow(2) + (a / width).abs_diff(b / width).pow(2)
}

/// The definition, word for word: slow and obviously right.
fn reference(space: &FreeSpace) -> Vec<usize> {
    let n_cells = space.info().n_cells();
    let obstacles: Vec<usize> = (0..n_cells).filter(|&index| !space.is_free()[index]).collect();
    let nearest =
        |index: usize| obstacles.iter().map(|&other| distance_squared(space, index, other)).min();
    (0..n_cells).map(|index| nearest(index).expect("the rim is an obstacle")).collect()
}

proptest! {
    #[test]
    fn clearance_is_the_least_of_all_distances(space in any_space()) {
        let found = clearance(&space);
        let width = space.info().width as usize;
        let squared: Vec<usize> = found.squared().iter().map(|&square| square as usize).collect();
        prop_assert_eq!(&squared, &reference(&space));
        for (index, &basis) in found.basis().iter().enumerate() {
            prop_assert!(!space.is_free()[basis as usize], "a basis point is an obstacle");
            let away = distance_squared(&space, index, basis as usize);
            prop_assert_eq!(away, squared[index], "and as far as the clearance says");
            let place = |other: usize| (other % width, other / width);
            let first = (0..squared.len())
                .filter(|&other| !space.is_free()[other])
                .filter(|&other| distance_squared(&space, index, other) == away)
                .min_by_key(|&other| place(other));
            prop_assert_eq!(first, Some(basis as usize), "of several the leftmost, then lowest");
        }
    }
}

#[test]
fn metres_follow_the_resolution() {
    let space = crate::building::drawn(".....\n.....\n.....\n.....\n.....", 1);
    let middle = 3 * 7 + 3;
    let middle_m = clearance(&space).at_m(middle);
    assert!((middle_m - 0.15).abs() < 1e-12, "three cells of 0.05 m to the rim, not {middle_m} m");
}
