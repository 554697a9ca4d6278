//! Triplet and final goal plans against their definitions.

use std::sync::Arc;

use meetpoint_planning::{
    Cost, FinalGoalPlan, Grouping, PartGraph, Transit, TripletPlans, UNREACHABLE,
};
use proptest::prelude::*;

use crate::floors::{costs_from, floors};

const GROUPINGS: [Grouping; 2] = [Grouping::Pairs, Grouping::Openings];

/// Steps of a transit, as cell, step and the cell beyond.
fn steps_of(graph: &PartGraph, transit: Transit) -> Vec<(usize, usize, usize)> {
    let space = graph.space();
    let cells = graph.parts().cells(graph.from(transit)).iter().map(|&cell| cell as usize);
    cells
        .flat_map(|cell| space.steps(cell).map(move |(step, next)| (cell, step, next)))
        .filter(|&(cell, step, _)| graph.transit(cell, step) == Some(transit))
        .collect()
}

/// Cost from the part that `transit` leaves through it, `beyond` being what is left there.
fn costs_through(graph: &PartGraph, transit: Transit, beyond: impl Fn(usize) -> Cost) -> Vec<Cost> {
    let part = graph.from(transit);
    let seeds: Vec<(usize, Cost)> = steps_of(graph, transit)
        .into_iter()
        .map(|(cell, step, next)| (cell, graph.space().step_cost(cell, step) + beyond(next)))
        .collect();
    costs_from(graph.space(), &seeds, |cell| graph.parts().at(cell) == Some(part))
}

/// All ways on, and to nowhere further.
fn seconds(graph: &PartGraph, first: Transit) -> Vec<Option<Transit>> {
    let exits = graph.exits(graph.to(first)).iter().copied();
    let onward = exits.filter(|&exit| exit != first.back()).map(Some);
    onward.chain([None]).collect()
}

/// Every step of a triplet leads down the costs of its definition.
fn check_triplet(
    plans: &TripletPlans,
    first: Transit,
    second: Option<Transit>,
) -> Result<(), TestCaseError> {
    let graph = plans.graph();
    let middle = match second {
        Some(second) => costs_through(graph, second, |_| 0),
        None => vec![0; graph.space().info().n_cells()],
    };
    let costs = costs_through(graph, first, |cell| middle[cell]);
    for &cell in graph.parts().cells(graph.from(first)) {
        let cell = cell as usize;
        let step = plans.step(first, second, cell);
        prop_assert_eq!(step.is_some(), costs[cell] < UNREACHABLE, "a step where there is a way");
        let Some(step) = step else { continue };
        prop_assert!(graph.space().moves(cell) >> step & 1 == 1, "a legal step");
        let next = graph.space().neighbor(cell, step);
        let is_inside = graph.parts().at(next) == Some(graph.from(first));
        prop_assert!(is_inside || graph.transit(cell, step) == Some(first), "within, or through");
        let onward = if is_inside { costs[next] } else { middle[next] };
        prop_assert_eq!(onward + graph.space().step_cost(cell, step), costs[cell], "a best step");
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn triplets_keep_to_their_definition(floor in floors()) {
        for grouping in GROUPINGS {
            let graph = floor.graph(grouping);
            let plans = TripletPlans::new(graph.clone());
            for part in graph.parts().indices() {
                for &first in graph.exits(part) {
                    for second in seconds(&graph, first) {
                        check_triplet(&plans, first, second)?;
                    }
                }
            }
        }
    }

    /// A plan in one part, and one through another before.
    #[test]
    fn final_goal_plans_keep_to_their_definition(floor in floors(), seed in 0..1000_usize) {
        let graph = floor.graph(Grouping::Openings);
        let n_parts = graph.parts().n_parts();
        let Some(part) = graph.parts().indices().nth(seed % n_parts.max(1)) else { return Ok(()) };
        let cells = graph.parts().cells(part);
        let goal = cells[seed % cells.len()] as usize;
        let plan = FinalGoalPlan::new(&graph, goal).expect("a goal in a part");
        let costs = costs_from(graph.space(), &[(goal, 0)], |cell| graph.parts().at(cell) == Some(part));
        for &cell in cells {
            prop_assert_eq!(plan.cost(&graph, cell as usize), costs[cell as usize], "in one part");
        }
        for &exit in graph.exits(part) {
            let longer = plan.from_before(&graph, exit.back());
            prop_assert_eq!(longer.n_parts(), 2, "parts");
            let before = costs_through(&graph, exit.back(), |cell| costs[cell]);
            for &cell in graph.parts().cells(graph.to(exit)) {
                let cell = cell as usize;
                prop_assert_eq!(longer.cost(&graph, cell), before[cell], "in two parts");
            }
        }
        prop_assert!(FinalGoalPlan::new(&graph, 0).is_none(), "no plan to the rim");
    }

    #[test]
    fn triplets_are_counted_as_pairs_of_neighbors(floor in floors()) {
        let graph = floor.graph(Grouping::Pairs);
        let counts = graph.parts().indices().map(|part| graph.exits(part).len());
        let expected: usize = counts.map(|n_neighbors| n_neighbors * n_neighbors.saturating_sub(1)).sum();
        prop_assert_eq!(TripletPlans::new(graph).n_triplets(), expected, "ordered pairs");
    }

    /// What is computed again after a change equals all computed afresh, and what did not change is
    /// shared.
    #[test]
    fn renewed_plans_equal_new_ones(
        floor in floors(),
        cells in proptest::collection::vec((0..484_usize, prop_oneof![Just(0), 16..60_u8]), 0..3),
    ) {
        for grouping in GROUPINGS {
            let before = TripletPlans::new(floor.graph(grouping));
            let graph = floor.changed(&cells).graph(grouping);
            let renewed = before.renewed(graph.clone());
            let afresh = TripletPlans::new(graph.clone());
            prop_assert_eq!(renewed.n_bytes(), afresh.n_bytes(), "as many tables");
            for part in graph.parts().indices() {
                for &first in graph.exits(part) {
                    for second in seconds(&graph, first) {
                        for &cell in graph.parts().cells(part) {
                            let step = |plans: &TripletPlans| plans.step(first, second, cell as usize);
                            prop_assert_eq!(step(&renewed), step(&afresh), "the same step");
                        }
                    }
                }
            }
            let same = before.renewed(Arc::clone(before.graph()));
            prop_assert_eq!(same.n_shared(&before), before.n_tables(), "nothing made again");
        }
    }
}
