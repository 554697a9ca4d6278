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
    let mut rows = vec![vec![-1.0; goals.len()]; starts.len()];
    let plans = field.plans();
    field.with_searches(|searches| match plans {
        // What is left from every region to a goal is found once a goal.
        Some(plans) => {
            for (column, goal) in goals.iter().enumerate() {
                let Ok(goal) = goal else { continue };
                let mut towards = plans.towards(goal.cell);
                for (row, start) in rows.iter_mut().zip(starts) {
                    let Ok(start) = start else { continue };
                    row[column] = in_metres(towards.cost(start.cell, &mut searches.tables));
                }
            }
        }
        None => {
            for (row, start) in rows.iter_mut().zip(starts) {
                let Ok(start) = start else { continue };
                searches.grid.flood(&field.space, &field.tolls, start.cell, UNREACHABLE);
                for (length_m, goal) in row.iter_mut().zip(goals) {
                    let Ok(goal) = goal else { continue };
                    *length_m = in_metres(searches.grid.cost(goal.cell));
                }
            }
        }
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
