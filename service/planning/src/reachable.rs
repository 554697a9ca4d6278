//! What can be reached: connected components, and cells within a cost.
//!
//! A diagonal step needs both cells beside it, so that cells which hang together at all do so by
//! steps along the axes. Time O(cells), for what lies within a cost O(cells within).

use crate::cost::Cost;
use crate::search::Search;
use crate::space::Space;

/// Which cells hang together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Components {
    /// Invariant: below the length of `n_cells`, or [`NONE`].
    of_cell: Vec<u32>,
    n_cells: Vec<usize>,
}

/// Component of a cell that cannot be entered.
const NONE: u32 = u32::MAX;

/// A component, counted from 0 in the order of its lowest cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ComponentIndex(
    /// Counted from 0.
    pub u32,
);

impl Components {
    /// The component of a cell; `None` if it cannot be entered.
    ///
    /// # Panics
    /// If `cell` is not below the number of cells; true of all functions here that take one.
    pub fn of(&self, cell: usize) -> Option<ComponentIndex> {
        let component = self.of_cell[cell];
        (component != NONE).then_some(ComponentIndex(component))
    }

    /// Whether there is a way between two cells.
    pub fn are_joined(&self, a: usize, b: usize) -> bool {
        self.of(a).is_some_and(|component| self.of(b) == Some(component))
    }

    /// Number of cells of each component.
    pub fn n_cells(&self) -> &[usize] {
        &self.n_cells
    }

    /// Cells of a component, lowest first.
    pub fn cells(&self, component: ComponentIndex) -> impl Iterator<Item = usize> + '_ {
        let is_of = move |&(_, &of): &(usize, &u32)| of == component.0;
        self.of_cell.iter().enumerate().filter(is_of).map(|(cell, _)| cell)
    }
}

/// The components of `space`.
pub fn components(space: &Space) -> Components {
    let mut of_cell = vec![NONE; space.info().n_cells()];
    let (mut n_cells, mut open) = (vec![], vec![]);
    for start in 0..of_cell.len() {
        if of_cell[start] != NONE || !space.is_enterable(start) {
            continue;
        }
        let component = u32::try_from(n_cells.len()).unwrap_or(NONE);
        let mut n = 0;
        of_cell[start] = component;
        open.push(start);
        while let Some(cell) = open.pop() {
            n += 1;
            for (_, next) in space.steps(cell).filter(|&(step, _)| step % 2 == 0) {
                if of_cell[next] == NONE {
                    of_cell[next] = component;
                    open.push(next);
                }
            }
        }
        n_cells.push(n);
    }
    Components { of_cell, n_cells }
}

/// Cells within a cost of a place.
#[derive(Clone, Debug, PartialEq)]
pub struct ReachableArea {
    /// Every cell with what it costs to get there, sorted by cell.
    pub cells: Vec<(usize, Cost)>,
    /// Their area, in square metres.
    pub area_m2: f64,
}

/// What can be reached from `cell` at a cost of at most `cost_max`; the cell itself included.
///
/// # Panics
/// If `cell` is not below the number of cells.
pub fn reachable_area(
    space: &Space,
    cell: usize,
    cost_max: Cost,
    search: &mut Search,
) -> ReachableArea {
    search.flood(space, [(cell, 0)], cost_max);
    let mut cells: Vec<_> = search.touched().map(|cell| (cell, search.cost(cell))).collect();
    cells.sort_unstable();
    let area_m2 = cells.len() as f64 * space.info().frame.resolution_m().powi(2);
    ReachableArea { cells, area_m2 }
}
