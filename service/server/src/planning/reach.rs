//! From many to many, and from one to everywhere.

use std::collections::BTreeMap;

use meetpoint_planning::UNREACHABLE;

use super::ends::{Located, Nowhere};
use super::field::{Field, cost_of, metres};

/// A start or goal.
type End = Result<Located, Nowhere>;

/// Costs in metres of the best paths from every start to every goal, negative where there is none;
/// and whether tables answered.
pub(crate) fn matrix(field: &Field, starts: &[End], goals: &[End]) -> (Vec<Vec<f64>>, bool) {
    let side_m = field.ground.side_m();
    let in_metres = |cost| if cost < UNREACHABLE { metres(cost, side_m) } else { -1.0 };
    let nothing = vec![-1.0; goals.len()];
    let plans = field.plans();
    let rows = field.with_searches(|searches| {
        let mut row = |start: &End| {
            let Ok(start) = start else { return nothing.clone() };
            if plans.is_none() {
                searches.grid.flood(&field.space, &field.tolls, start.cell, UNREACHABLE);
            }
            let mut cost = |goal: &End| match (goal, plans) {
                (Err(_), _) => UNREACHABLE,
                (Ok(goal), Some(plans)) => plans.cost(start.cell, goal.cell, &mut searches.tables),
                (Ok(goal), None) => searches.grid.cost(goal.cell),
            };
            goals.iter().map(|goal| in_metres(cost(goal))).collect()
        };
        starts.iter().map(&mut row).collect()
    });
    (rows, plans.is_some())
}

/// Areas in square metres that are reached from a cell at a cost of at most `length_max_m`, by the
/// id of the region; 0 is where there is none.
pub(crate) fn reached(field: &Field, from: usize, length_max_m: f64) -> BTreeMap<u64, f64> {
    let side_m = field.ground.side_m();
    let cost_max = cost_of(length_max_m, side_m);
    let mut n_cells: BTreeMap<u64, u64> = BTreeMap::new();
    field.with_searches(|searches| {
        searches.grid.flood(&field.space, &field.tolls, from, cost_max);
        for cell in searches.grid.touched() {
            *n_cells.entry(field.ground.region_id_at(cell)).or_default() += 1;
        }
    });
    n_cells.into_iter().map(|(region, n)| (region, n as f64 * side_m * side_m)).collect()
}
