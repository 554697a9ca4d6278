//! The nearest cell against all of them.

use meetpoint_geometry::Point2;
use meetpoint_planning::nearest_enterable;
use proptest::prelude::*;

use crate::squares::{RESOLUTION_M, cells_of, center, in_metres, rooms, space_of};

proptest! {
    #[test]
    fn nearest_of_all_cells(
        free in rooms(),
        radius_m in 0.0..0.3,
        (x, y) in (-20.0..60.0, -20.0..60.0),
        halves in any::<bool>(),
        tolerance_m in prop_oneof![Just(f64::INFINITY), 0.0..0.5],
    ) {
        let space = space_of(&free, radius_m);
        let info = space.info();
        // Halves make ties.
        let place = if halves { Point2::new(x, y).map(f64::floor) } else { Point2::new(x, y) };
        let point = in_metres(info, place);
        let here = info.index_of(info.frame.cell_at(point));
        let found = nearest_enterable(&space, point, tolerance_m);
        if let Some(cell) = here.filter(|&cell| space.is_enterable(cell)) {
            let found = found.expect("it is there");
            prop_assert_eq!((found.cell, found.point, found.moved_m), (cell, point, 0.0));
            return Ok(());
        }
        let away = |cell: usize| (center(info, cell) - place).norm() * RESOLUTION_M;
        let least = cells_of(&space).into_iter().map(away).fold(f64::INFINITY, f64::min);
        match found {
            None => prop_assert!(tolerance_m - 1e-9 < least || least.is_infinite(), "{least} m"),
            Some(found) => {
                prop_assert!((found.moved_m - least).abs() < 1e-9, "{} m", found.moved_m);
                prop_assert!(found.moved_m <= tolerance_m, "{} m", found.moved_m);
                let is_center = (in_metres(info, center(info, found.cell)) - found.point).norm();
                prop_assert!(is_center < 1e-9, "the centre of its cell");
            }
        }
    }
}

#[test]
fn of_equal_cells_the_lowest_then_the_leftmost() {
    // A block of two by two cells in the middle; its centre is as far from eight cells.
    let free =
        crate::squares::free_space(6, 6, |x, y| !(2..4).contains(&x) || !(2..4).contains(&y));
    let space = space_of(&free, 0.0);
    let middle = in_metres(space.info(), Point2::new(4.0, 4.0));
    let found = nearest_enterable(&space, middle, 1.0).expect("cells around");
    assert_eq!(found.cell, 2 * 8 + 3, "below the block, on the left");
}

#[test]
fn nowhere_and_no_number() {
    let free = crate::squares::free_space(6, 6, |_, _| true);
    let space = space_of(&free, 0.0);
    for point in [Point2::new(f64::NAN, 0.3), Point2::new(f64::INFINITY, 0.0)] {
        assert_eq!(nearest_enterable(&space, point, 1.0), None, "{point} is nowhere");
    }
    let inside = in_metres(space.info(), Point2::new(0.5, 0.5));
    assert_eq!(nearest_enterable(&space, inside, f64::NAN), None, "no tolerance");
    assert_eq!(nearest_enterable(&space, Point2::new(1e9, 1e9), 1.0), None, "far outside");
}
