//! What can be reached, against searches.

use meetpoint_planning::{Search, UNREACHABLE, components, reachable_area};
use proptest::prelude::*;

use crate::squares::{RESOLUTION_M, cells_of, rooms, space_of};

proptest! {
    #[test]
    fn cells_hang_together_if_there_is_a_way(
        free in rooms(),
        radius_m in 0.0..0.2,
        at in any::<prop::sample::Index>(),
    ) {
        let space = space_of(&free, radius_m);
        let components = components(&space);
        let cells = cells_of(&space);
        let n_cells: usize = components.n_cells().iter().sum();
        prop_assert_eq!(n_cells, cells.len(), "every cell is of one component");
        prop_assume!(!cells.is_empty());
        let from = cells[at.index(cells.len())];
        let mut search = Search::default();
        search.flood(&space, [(from, 0)], UNREACHABLE);
        for cell in 0..space.info().n_cells() {
            let is_reached = search.cost(cell) < UNREACHABLE;
            prop_assert_eq!(components.are_joined(from, cell), is_reached, "{} to {}", from, cell);
        }
        let component = components.of(from).expect("it can be entered");
        let of_component: Vec<usize> = components.cells(component).collect();
        let area = reachable_area(&space, from, UNREACHABLE, &mut search);
        let reached: Vec<usize> = area.cells.iter().map(|&(cell, _)| cell).collect();
        prop_assert_eq!(components.n_cells()[component.0 as usize], reached.len(), "counted");
        prop_assert_eq!(of_component, reached);
    }
}

#[test]
fn an_area_within_a_cost() {
    let free = crate::squares::free_space(9, 9, |_, _| true);
    let space = space_of(&free, 0.0);
    let middle = 5 * 11 + 5;
    let area =
        reachable_area(&space, middle, 2 * meetpoint_planning::STRAIGHT, &mut Search::default());
    assert_eq!(area.cells.len(), 13, "1, 3, 5, 3 and 1 cells: two diagonal steps cost more");
    assert!((area.area_m2 - 13.0 * RESOLUTION_M * RESOLUTION_M).abs() < 1e-12, "{}", area.area_m2);
    let rim = reachable_area(&space, 0, UNREACHABLE, &mut Search::default());
    assert!(rim.cells.is_empty(), "nothing from where nobody can be");
}
