//! Other routes than the best: by way of arcs that it does not take.
//!
//! For every arc the best path that crosses its middle is looked up in two halves. Of those that are
//! not much longer, do not cross themselves, take an arc that none before takes and leave the
//! neighbourhood of those before for a while, the shortest are given. I. Abraham, D. Delling, A. Goldberg and R.
//! Werneck, "Alternative routes in road networks", ACM Journal of Experimental Algorithmics 18
//! (2013), section 4 ("single-via paths"). Time O(arcs) look-ups.

use std::collections::HashSet;

use meetpoint_planning::{ArcCost, Cost, Plans, UNREACHABLE, nearest_enterable};

use super::field::{Field, Searches};
use super::paths::{Found, Wanted, best};

/// No alternative costs more than so many times the best.
const STRETCH_MAX: f64 = 1.5;
/// An alternative is off the paths before it for at least this share of its cells.
const APART_MIN: f64 = 0.1;
/// Side of the squares in which paths are neighbours, in metres: a robot evades another within.
const NEIGHBOR_M: f64 = 1.0;
/// Candidates that are looked at, the shortest first.
const N_TRIED_MAX: usize = 64;

/// Up to `n` paths besides `first`, the shortest first.
pub(super) fn alternatives(
    field: &Field,
    plans: &Plans,
    searches: &mut Searches,
    [from, to]: [usize; 2],
    first: &Found,
    n: usize,
) -> Vec<Found> {
    if n == 0 {
        return vec![];
    }
    let mut known: HashSet<usize> = arcs(first).collect();
    let Some(first) = best(field, Some(plans), searches, [from, to], Wanted::Cells) else {
        return vec![];
    };
    let mut beaten = Beaten::new(field);
    beaten.add(&first);
    let mut found = vec![];
    for (_, via) in candidates(field, plans, searches, [from, to], &first, &known) {
        if found.len() == n {
            break;
        }
        let mut half = |ends| best(field, Some(plans), searches, ends, Wanted::Cells);
        let (Some(there), Some(on)) = (half([from, via]), half([via, to])) else { continue };
        let path = joined(there, &on);
        let is_new = arcs(&path).any(|arc| !known.contains(&arc));
        if is_new && goes_on(&path) && APART_MIN <= beaten.share_apart(&path) {
            known.extend(arcs(&path));
            beaten.add(&path);
            found.push(path);
        }
    }
    found
}

/// Squares that paths go through, and those around them.
struct Beaten {
    squares: HashSet<(usize, usize)>,
    width: usize,
    cells_a_square: usize,
}

impl Beaten {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
    fn new(field: &Field) -> Self {
        let cells_a_square = ((NEIGHBOR_M / field.ground.side_m()).round() as usize).max(1);
        Self { squares: HashSet::new(), width: field.info().width as usize, cells_a_square }
    }

    /// From 1 on, so that there is one before each.
    fn square(&self, cell: u32) -> (usize, usize) {
        let (x, y) = (cell as usize % self.width, cell as usize / self.width);
        (x / self.cells_a_square + 1, y / self.cells_a_square + 1)
    }

    fn add(&mut self, path: &Found) {
        for &cell in &path.cells {
            let (x, y) = self.square(cell);
            let around = (x - 1..=x + 1).flat_map(|x| (y - 1..=y + 1).map(move |y| (x, y)));
            self.squares.extend(around);
        }
    }

    /// Share of a path's cells that lie elsewhere.
    fn share_apart(&self, path: &Found) -> f64 {
        let is_apart = |cell: &&u32| !self.squares.contains(&self.square(**cell));
        path.cells.iter().filter(is_apart).count() as f64 / path.cells.len().max(1) as f64
    }
}

/// Whether a path neither crosses itself nor leaves a region by the arc that it came by.
fn goes_on(path: &Found) -> bool {
    let (mut seen, mut crossed) = (HashSet::new(), HashSet::new());
    arcs(path).all(|arc| crossed.insert(arc)) && path.cells.iter().all(|cell| seen.insert(*cell))
}

/// Cells to go by, with what that costs, the cheapest first.
fn candidates(
    field: &Field,
    plans: &Plans,
    searches: &mut Searches,
    [from, to]: [usize; 2],
    first: &Found,
    known: &HashSet<usize>,
) -> Vec<(Cost, usize)> {
    let cost_max = f64::from(first.cost) * STRETCH_MAX;
    let mut candidates = vec![];
    for (place, arc) in field.ground.topology.graph().arcs.iter().enumerate() {
        let is_closed = field.arcs().get(place) == Some(&ArcCost::Closed);
        if is_closed || known.contains(&place) {
            continue;
        }
        let reach_m = f64::midpoint(arc.width_m, field.ground.side_m());
        let Some(via) = nearest_enterable(&field.space, arc.position, reach_m) else { continue };
        let mut cost = |from, to| plans.cost(from, to, &mut searches.tables);
        let cost = cost(from, via.cell).saturating_add(cost(via.cell, to));
        if cost < UNREACHABLE && f64::from(cost) <= cost_max {
            candidates.push((cost, via.cell));
        }
    }
    candidates.sort_unstable();
    candidates.truncate(N_TRIED_MAX);
    candidates
}

fn arcs(found: &Found) -> impl Iterator<Item = usize> + '_ {
    found.route.iter().filter_map(|(_, arc)| *arc)
}

/// Two paths, one after the other.
fn joined(mut there: Found, on: &Found) -> Found {
    there.cost = there.cost.saturating_add(on.cost);
    there.cells.extend(on.cells.iter().skip(1));
    there.route.extend(on.route.iter().skip(1));
    there
}
