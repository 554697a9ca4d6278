//! Configuration space against distances to all obstacle squares.

use meetpoint_planning::enterable;
use proptest::prelude::*;

use crate::squares::{RESOLUTION_M, center, distance, rooms, space_of};

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn a_cell_is_refused_if_and_only_if_a_square_is_too_near(
        free in rooms(),
        radius_m in prop_oneof![Just(0.0), Just(0.125), 0.0..0.4],
    ) {
        let rho = (radius_m / RESOLUTION_M).hypot(0.5);
        let is_enterable = enterable(&free, radius_m);
        for (cell, &is_enterable) in is_enterable.iter().enumerate() {
            let here = center(free.info(), cell);
            let nearest = distance(&free, here, here);
            if is_enterable {
                prop_assert!(rho - 1e-9 <= nearest, "cell {cell} is {nearest} cells from a square");
            } else {
                prop_assert!(nearest < rho + 1e-9, "cell {cell} is {nearest} cells from all");
            }
        }
    }

    #[test]
    fn no_step_comes_nearer_than_the_radius(
        free in rooms(),
        radius_m in prop_oneof![Just(0.0), Just(0.125), 0.0..0.4],
    ) {
        let space = space_of(&free, radius_m);
        for cell in 0..space.info().n_cells() {
            for (_, next) in space.steps(cell) {
                let [a, b] = [cell, next].map(|cell| center(free.info(), cell));
                let nearest = distance(&free, a, b) * RESOLUTION_M;
                prop_assert!(radius_m - 1e-9 <= nearest, "{nearest} m from {cell} to {next}");
            }
        }
    }
}
