//! Trips: triplet plans and a final goal plan followed from cell to cell.
//!
//! "When the robot crosses the boundary of two topological regions, the next triplet plan is
//! activated": S. Thrun, Artificial Intelligence 99 (1998), section 3.2. Two ways to choose the
//! transits, and how many parts the final goal plan spans:
//!
//! * as the paper does: by the fewest parts ([`TopologicalPlans::plan`](crate::TopologicalPlans)),
//!   with one portal a pair of parts, and the final goal plan in the last part alone;
//! * those of a shortest path ([`PartGraph::transits_of`]), with one portal an opening, and the
//!   final goal plan in the last two parts.

use crate::cost::Cost;
use crate::final_goal::FinalGoalPlan;
use crate::part_graph::{PartGraph, Transit};
use crate::triplets::TripletPlans;

/// A path followed by look-up.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Trip {
    /// Its cells, by index, start and goal included.
    pub cells: Vec<u32>,
    /// What it costs.
    pub cost: Cost,
}

impl TripletPlans {
    /// Follows the plans from a cell through all `transits` to the goal of `last`, which spans the
    /// last parts of the way. `None` if the transits and the plan do not fit together, or the start
    /// does not lie where they begin.
    pub fn trip(&self, start: usize, transits: &[Transit], last: &FinalGoalPlan) -> Option<Trip> {
        let graph = self.graph().as_ref();
        let n_triplets = (transits.len() + 1).checked_sub(last.n_parts())?;
        let mut trip = Trip { cells: vec![u32::try_from(start).ok()?], cost: 0 };
        let mut cell = start;
        for at in 0..n_triplets {
            let (first, second) = (transits[at], transits.get(at + 1).copied());
            let part = graph.from(first);
            let step_from = self.steps(first, second)?;
            while graph.parts().at(cell) == Some(part) {
                cell = trip.go(graph, cell, step_from(cell)?);
            }
        }
        for (cell, step) in last.steps(graph, cell)? {
            trip.go(graph, cell, step);
        }
        Some(trip)
    }
}

impl Trip {
    fn go(&mut self, graph: &PartGraph, cell: usize, step: usize) -> usize {
        self.cost = self.cost.saturating_add(graph.space().step_cost(cell, step));
        let next = graph.space().neighbor(cell, step);
        self.cells.push(u32::try_from(next).unwrap_or(u32::MAX));
        next
    }
}
