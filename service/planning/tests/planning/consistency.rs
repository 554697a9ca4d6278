//! Section 4.1 of the paper, both ways: a plan for every path, a path for every plan.

use meetpoint_planning::{
    Cost, FinalGoalPlan, Grouping, PartGraph, TopologicalPlans, Transit, Trip, TripletPlans,
    UNREACHABLE,
};
use proptest::prelude::*;

use crate::floors::{costs_from, floors, open_cells, path_down};

/// What is known of one goal.
struct Goal {
    cell: usize,
    /// From every cell.
    costs: Vec<Cost>,
}

/// Legal steps from the start to the goal that add up to the trip's cost, no cheaper than can be.
fn check_trip(
    graph: &PartGraph,
    trip: &Trip,
    start: usize,
    goal: &Goal,
) -> Result<(), TestCaseError> {
    let space = graph.space();
    let cells: Vec<usize> = trip.cells.iter().map(|&cell| cell as usize).collect();
    prop_assert_eq!(cells.first(), Some(&start), "from the start");
    prop_assert_eq!(cells.last(), Some(&goal.cell), "to the goal");
    let mut sum = 0;
    for pair in cells.windows(2) {
        let step = space.steps(pair[0]).find(|&(_, next)| next == pair[1]);
        prop_assert!(step.is_some(), "{} to {} is no step", pair[0], pair[1]);
        sum += step.map_or(0, |(step, _)| space.step_cost(pair[0], step));
    }
    prop_assert_eq!(sum, trip.cost, "the sum of its steps");
    prop_assert!(goal.costs[start] <= trip.cost, "cheaper than the best path");
    Ok(())
}

/// The final goal plan in the last `n_parts` of a way, all if there are not so many.
fn last_of(graph: &PartGraph, transits: &[Transit], n_parts: usize, goal: usize) -> FinalGoalPlan {
    let first = (transits.len() + 1).saturating_sub(n_parts);
    FinalGoalPlan::along(graph, goal, &transits[first..]).expect("a goal in a part")
}

/// Regions by hops, triplets of regions, the final goal in the last.
fn check_paper(graph: &PartGraph, starts: &[usize], goal: &Goal) -> Result<(), TestCaseError> {
    let plans = TripletPlans::new(graph.clone().into());
    let topological = TopologicalPlans::new(graph);
    let part_of = |cell: usize| graph.parts().at(cell).expect("open");
    for &start in starts {
        let plan = topological.plan(graph, part_of(start), part_of(goal.cell));
        prop_assert_eq!(plan.is_some(), goal.costs[start] < UNREACHABLE, "a plan for every path");
        let Some(plan) = plan else { continue };
        let trip = plans.trip(start, &plan, &last_of(graph, &plan, 1, goal.cell));
        prop_assert!(trip.is_some(), "a path for every plan");
        check_trip(graph, &trip.expect("a path"), start, goal)?;
        let best = last_of(graph, &plan, plan.len() + 1, goal.cell).cost(graph, start);
        prop_assert!(goal.costs[start] <= best, "the best that keeps to the regions");
    }
    Ok(())
}

/// The openings of a best path, triplets of openings, the last two parts together.
fn check_triplet(graph: &PartGraph, starts: &[usize], goal: &Goal) -> Result<(), TestCaseError> {
    let plans = TripletPlans::new(graph.clone().into());
    for &start in starts.iter().filter(|&&start| goal.costs[start] < UNREACHABLE) {
        let path = path_down(graph.space(), &goal.costs, start);
        let transits = graph.transits_of(&path);
        let last = last_of(graph, &transits, 2, goal.cell);
        let trip = plans.trip(start, &transits, &last);
        prop_assert!(trip.is_some(), "a path for every plan");
        let trip = trip.expect("a path");
        check_trip(graph, &trip, start, goal)?;
        let is_crossing = |pair: &[u32]| {
            let [from, to] = [pair[0], pair[1]].map(|cell| graph.parts().at(cell as usize));
            from != to
        };
        let n_crossings = path.windows(2).filter(|pair| is_crossing(pair)).count();
        if transits.len() <= 1 && n_crossings == transits.len() {
            prop_assert_eq!(trip.cost, goal.costs[start], "no loss in the last two parts");
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn a_plan_for_every_path_and_a_path_for_every_plan(floor in floors(), seed in 0..1000_usize) {
        let [pairs, openings] = [Grouping::Pairs, Grouping::Openings].map(|by| floor.graph(by));
        let starts = open_cells(pairs.space());
        for at in 0..3.min(starts.len()) {
            let cell = starts[(seed + 31 * at) % starts.len()];
            let goal = Goal { cell, costs: costs_from(pairs.space(), &[(cell, 0)], |_| true) };
            check_paper(&pairs, &starts, &goal)?;
            check_triplet(&openings, &starts, &goal)?;
        }
    }

    /// A closed step is not taken, whatever the mode.
    #[test]
    fn closed_portals_are_kept_to(floor in floors()) {
        let graph = floor.graph(Grouping::Openings);
        let shut = |_: usize, _: usize| false;
        let closed = PartGraph::new(graph.space().clone(), graph.parts().clone(), Grouping::Openings, shut);
        prop_assert_eq!(closed.n_portals(), 0, "all are closed");
        let plans = TopologicalPlans::new(&closed);
        for from in closed.parts().indices() {
            for to in closed.parts().indices() {
                let plan = plans.plan(&closed, from, to);
                prop_assert_eq!(plan.is_some(), from == to, "no way out");
            }
        }
    }
}
