//! Final goal plans: from every cell of the last parts of a plan to the goal.
//!
//! S. Thrun, Artificial Intelligence 99 (1998), section 3.2 (iii), plans in the last part alone. Here
//! the plan may begin earlier: the last two parts planned together leave no loss in either, and with
//! all parts of a way its cost is that of the best path that keeps to them. Time and space O(cells
//! of the parts), whatever the size of the map.

use std::sync::Arc;

use crate::cost::{Cost, UNREACHABLE};
use crate::part_graph::{PartGraph, Transit};
use crate::parts::PartIndex;
use crate::triplets::Field;

/// Costs to one goal through a sequence of parts.
#[derive(Clone, Debug)]
pub struct FinalGoalPlan {
    goal: usize,
    /// In the order of travel; the last holds the goal.
    layers: Vec<Arc<Layer>>,
}

/// Costs in one part.
#[derive(Debug)]
struct Layer {
    part: PartIndex,
    /// The way to the next layer; `None` in the last.
    exit: Option<Transit>,
    /// By the part's cells.
    costs: Vec<Cost>,
}

impl FinalGoalPlan {
    /// To `goal` from its own part; `None` if the goal is in no part.
    pub fn new(graph: &PartGraph, goal: usize) -> Option<Self> {
        let part = graph.parts().at(goal)?;
        let costs = Field::new(graph, part).around(goal);
        Some(Self { goal, layers: vec![Arc::new(Layer { part, exit: None, costs })] })
    }

    /// To `goal` through all of `transits`, the last of which leads to its part; `None` if the goal
    /// is in no part.
    ///
    /// # Panics
    /// If a transit does not lead to where the next one begins.
    pub fn along(graph: &PartGraph, goal: usize, transits: &[Transit]) -> Option<Self> {
        let last = Self::new(graph, goal)?;
        Some(transits.iter().rev().fold(last, |plan, &transit| plan.from_before(graph, transit)))
    }

    /// The plan that begins one part earlier, in the one that `transit` leaves. The two share what
    /// they have in common.
    ///
    /// # Panics
    /// If the transit does not lead to the part where this plan begins.
    pub fn from_before(&self, graph: &PartGraph, transit: Transit) -> Self {
        assert_eq!(graph.to(transit), self.first(), "a plan goes on where a transit leads to");
        let part = graph.from(transit);
        let costs = Field::new(graph, part).towards(transit, |cell| self.cost(graph, cell));
        let mut layers = vec![Arc::new(Layer { part, exit: Some(transit), costs })];
        layers.extend(self.layers.iter().cloned());
        Self { goal: self.goal, layers }
    }

    /// Number of parts.
    pub fn n_parts(&self) -> usize {
        self.layers.len()
    }

    /// The part where the plan begins.
    fn first(&self) -> PartIndex {
        self.layers[0].part
    }

    /// Cost from a cell of the first part to the goal; [`UNREACHABLE`] elsewhere.
    pub fn cost(&self, graph: &PartGraph, cell: usize) -> Cost {
        self.layers[0].cost(graph, cell)
    }

    /// The steps from a cell of the first part to the goal, as pairs of a cell and the step that
    /// leaves it; `None` if there is no way.
    pub(crate) fn steps(&self, graph: &PartGraph, from: usize) -> Option<Vec<(usize, usize)>> {
        if UNREACHABLE <= self.cost(graph, from) {
            return None;
        }
        let mut steps = vec![];
        let mut cell = from;
        for (at, layer) in self.layers.iter().enumerate() {
            let next = self.layers.get(at + 1).map(AsRef::as_ref);
            while next.is_some() || cell != self.goal {
                let step = layer.step(graph, next, cell)?;
                steps.push((cell, step));
                cell = graph.space().neighbor(cell, step);
                if graph.parts().at(cell) != Some(layer.part) {
                    break;
                }
            }
        }
        Some(steps)
    }
}

impl Layer {
    fn cost(&self, graph: &PartGraph, cell: usize) -> Cost {
        let slot = graph.parts().slot(self.part, cell);
        slot.map_or(UNREACHABLE, |slot| self.costs[slot as usize])
    }

    /// The step on a best way from a cell of this layer.
    fn step(&self, graph: &PartGraph, next: Option<&Self>, cell: usize) -> Option<usize> {
        let space = graph.space();
        let cost = self.cost(graph, cell);
        let onward = |step: usize, to: usize| {
            let is_exit = || self.exit.is_some() && graph.transit(cell, step) == self.exit;
            match next {
                _ if graph.parts().at(to) == Some(self.part) => self.cost(graph, to),
                Some(next) if is_exit() => next.cost(graph, to),
                _ => UNREACHABLE,
            }
        };
        let is_best = |&(step, to): &(usize, usize)| {
            let onward = onward(step, to);
            onward < UNREACHABLE && onward + space.step_cost(cell, step) == cost
        };
        space.steps(cell).find(is_best).map(|(step, _)| step)
    }
}
