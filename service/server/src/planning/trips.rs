//! Paths by triplet plans, as S. Thrun, Artificial Intelligence 99 (1998), section 3.2, has them: for
//! comparison with the shortest, of which the loss is told.

use std::sync::Arc;

use meetpoint_planning::{
    Cost, FinalGoalPlan, Grouping, PartGraph, Parts, TopologicalPlans, TripletPlans, UNREACHABLE,
    stretches,
};

use super::ends::locate;
use super::field::{Field, Searches};
use super::paths::{Found, PathAnswer, PathQuery, Wanted, best, planned, tolls_of};

/// Triplet plans of one field and what they are chosen by.
pub(super) struct Trips {
    plans: TripletPlans,
    /// The fewest parts; of the paper's mode only.
    fewest: Option<TopologicalPlans>,
}

impl Trips {
    /// With openings told apart: to be followed along a shortest path.
    fn by_openings(field: &Field) -> Self {
        Self { plans: TripletPlans::new(graph(field, Grouping::Openings)), fewest: None }
    }

    /// With one portal a pair of neighbours, by the fewest parts.
    fn as_paper(field: &Field) -> Self {
        let graph = graph(field, Grouping::Pairs);
        let fewest = Some(TopologicalPlans::new(&graph));
        Self { plans: TripletPlans::new(graph), fewest }
    }

    /// Memory, in bytes.
    pub(super) fn n_bytes(&self) -> usize {
        self.plans.n_bytes() + self.fewest.as_ref().map_or(0, TopologicalPlans::n_bytes)
    }
}

/// Closed arcs are no portals.
fn graph(field: &Field, grouping: Grouping) -> Arc<PartGraph> {
    let parts = Arc::new(Parts::new(&field.space, &field.ground.partition));
    let is_open = |cell, step| field.tolls.of(cell, step) < UNREACHABLE;
    Arc::new(PartGraph::new(field.space.clone(), parts, grouping, is_open))
}

/// Answers by triplet plans along the regions of the shortest path, the last two planned together.
pub(crate) fn plan_by_triplets(field: &Field, query: &PathQuery) -> PathAnswer {
    followed(field, query, |exact| {
        let trips = field.triplets.get_or_init(|| Trips::by_openings(field));
        let graph = trips.plans.graph();
        let transits = graph.transits_of(&exact.cells);
        let goal = *exact.cells.last()? as usize;
        let last = &transits[transits.len().saturating_sub(1)..];
        let plan = FinalGoalPlan::along(graph, goal, last)?;
        let trip = trips.plans.trip(*exact.cells.first()? as usize, &transits, &plan)?;
        Some((trip.cost, trip.cells))
    })
}

/// Answers as the paper plans.
pub(crate) fn plan_as_paper(field: &Field, query: &PathQuery) -> PathAnswer {
    followed(field, query, |exact| {
        let trips = field.paper.get_or_init(|| Trips::as_paper(field));
        let graph = trips.plans.graph();
        let [start, goal] = [exact.cells.first()?, exact.cells.last()?].map(|&cell| cell as usize);
        let [from, to] = [graph.parts().at(start)?, graph.parts().at(goal)?];
        let transits = trips.fewest.as_ref()?.plan(graph, from, to)?;
        let plan = FinalGoalPlan::new(graph, goal)?;
        let trip = trips.plans.trip(start, &transits, &plan)?;
        Some((trip.cost, trip.cells))
    })
}

/// Answers by what `follow` makes of the shortest path: cost without tolls, and cells.
fn followed(
    field: &Field,
    query: &PathQuery,
    follow: impl FnOnce(&Found) -> Option<(Cost, Vec<u32>)>,
) -> PathAnswer {
    let start = locate(field, query.start, query.tolerance_m);
    let goal = locate(field, query.goal, query.tolerance_m);
    let mut answer = PathAnswer { start, goal, best: None, alternatives: vec![], by_tables: true };
    let (Ok(from), Ok(to)) = (start, goal) else { return answer };
    let plans = field.plans().map(AsRef::as_ref);
    answer.best = field.with_searches(|searches: &mut Searches| {
        let exact = best(field, plans, searches, [from.cell, to.cell], Wanted::Cells)?;
        let (cost, cells) = follow(&exact)?;
        let tolls = Cost::try_from(tolls_of(field, &cells)).unwrap_or(UNREACHABLE);
        let ground = &field.ground;
        let route = stretches(&field.space, &ground.partition, ground.topology.graph(), &cells);
        let route = route.iter().map(|stretch| (stretch.region, stretch.arc)).collect();
        let found = Found { cost: cost.saturating_add(tolls), route, cells };
        let loss = f64::from(found.cost) / f64::from(exact.cost.max(1)) - 1.0;
        Some(planned(field, query, searches, &found, [from, to], loss.max(0.0)))
    });
    answer
}
