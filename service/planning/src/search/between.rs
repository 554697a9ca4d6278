//! From cell to cell.
//!
//! ```text
//! rank(p) = cost(p) + 985 |dx - dy| + 1393 min(dx, dy)
//! ```
//!
//! with dx, dy the columns and rows that are left: no way is cheaper than through cells of weight
//! one. P. Hart, N. Nilsson and B. Raphael, "A formal basis for the heuristic determination of
//! minimum cost paths", IEEE Transactions on Systems Science and Cybernetics 4 (1968). A bucket is
//! emptied before the search ends, and a cell taken up again when it becomes cheaper meanwhile.

use super::{Search, key_of};
use crate::cost::{Cost, DIAGONAL, STRAIGHT, UNREACHABLE};
use crate::space::Space;

impl Search {
    /// What a cheapest way between two cells costs; `None` if there is none. [`Search::path`] tells
    /// the way.
    pub fn between(&mut self, space: &Space, from: usize, to: usize) -> Option<Cost> {
        self.reset(space);
        if !space.is_enterable(from) || !space.is_enterable(to) {
            return None;
        }
        let width = space.info().width as usize;
        let goal = (to % width, to / width);
        let bound = |cell: usize| bound((cell % width, cell / width), goal);
        self.reach(from, 0, bound(from));
        while let Some(key) = self.queue.next_key() {
            if self.costs[to] != UNREACHABLE && key_of(self.costs[to]) < key {
                break;
            }
            let Some((cell, cost)) = self.queue.pop() else { break };
            if self.costs[cell] != cost {
                continue;
            }
            for (step, next) in space.steps(cell) {
                let cost = cost + space.step_cost(cell, step);
                if cost < UNREACHABLE {
                    self.reach(next, cost, cost + bound(next));
                }
            }
        }
        Some(self.costs[to]).filter(|&cost| cost != UNREACHABLE)
    }
}

/// No way between the two places costs less.
fn bound(a: (usize, usize), b: (usize, usize)) -> Cost {
    let (columns, rows) = (a.0.abs_diff(b.0), a.1.abs_diff(b.1));
    let [short, long] =
        [columns.min(rows), columns.max(rows)].map(|n| Cost::try_from(n).unwrap_or(Cost::MAX));
    STRAIGHT.saturating_mul(long - short).saturating_add(DIAGONAL.saturating_mul(short))
}
