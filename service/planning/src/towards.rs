//! A goal that is asked about again, by a robot under way or from many starts.
//!
//! ```text
//! cost(s, t) = min over gates a of s's region, nodes m of a of  table(s, m) + onward(m)
//! onward(m)  = min over gates b of t's region, nodes n of b of  all(m, n) + table(t, n)
//! ```
//!
//! The second line does not depend on the start: it is kept by region, from the first time that a
//! start lies there, and a look-up is left with the first. Space O(nodes of the regions asked from).

use crate::approach::{Approach, End};
use crate::cost::{Cost, UNREACHABLE};
use crate::gate_costs::NodeName;
use crate::gates::GATE_NODES_MAX;
use crate::inside::Scratch;
use crate::plans::{Place, Plans};

/// Costs and motions towards one goal. Answers are those of [`Plans::cost`] and
/// [`Plans::next_cell`], which of several best motions apart.
#[derive(Clone, Debug)]
pub struct Towards<'a> {
    plans: &'a Plans,
    goal: usize,
    place: Option<Place>,
    /// By region; `None` where nobody asked from yet.
    onward: Vec<Option<Vec<Exit>>>,
}

/// A gate to leave a region by.
#[derive(Clone, Debug)]
struct Exit {
    /// Its door, by its place among the region's.
    door: usize,
    /// From its nodes to the goal; [`UNREACHABLE`] beyond the last.
    onward: [Cost; GATE_NODES_MAX],
    /// The least of these.
    least: Cost,
}

impl Plans {
    /// What is asked about one goal, by the cell's index.
    pub fn towards(&self, goal: usize) -> Towards<'_> {
        let onward = vec![None; self.tables.len()];
        Towards { plans: self, goal, place: self.place(goal), onward }
    }
}

impl Towards<'_> {
    /// Cost of the best path from a cell, by index; [`UNREACHABLE`] if there is none.
    pub fn cost(&mut self, from: usize, scratch: &mut Scratch) -> Cost {
        let plans = self.plans;
        match self.ends(from) {
            Some((start, goal)) => self.meeting(start, goal).0,
            None => plans.cost(from, self.goal, scratch),
        }
    }

    /// The cell that a best path from a cell goes to next; `None` at the goal, and where there is
    /// no way.
    pub fn next_cell(&mut self, from: usize, scratch: &mut Scratch) -> Option<usize> {
        let plans = self.plans;
        let Some((start, goal)) = self.ends(from) else {
            return plans.next_cell(from, self.goal, scratch);
        };
        let (_, first) = self.meeting(start, goal);
        plans.next_cell_by(from, self.goal, first?, scratch)
    }

    /// Start and goal, if they lie in different regions between which costs are kept ready.
    fn ends(&self, from: usize) -> Option<(Place, Place)> {
        let (start, goal) = (self.plans.place(from)?, self.place?);
        let is_apart = start.region() != goal.region() && self.plans.pairs.has_blocks();
        is_apart.then_some((start, goal))
    }

    /// Least cost, and the node by which the start's region is left at that.
    fn meeting(&mut self, start: Place, goal: Place) -> (Cost, Option<NodeName>) {
        let plans = self.plans;
        let exits =
            self.onward[start.region()].get_or_insert_with(|| exits(plans, start.region(), goal));
        let here = End::new(plans, start);
        let (mut best, mut first) = (UNREACHABLE, None);
        for exit in exits {
            if best <= here.least(exit.door) + exit.least {
                continue;
            }
            let approach = here.approach(exit.door);
            let (costs, gate) = (approach.costs(), approach.gate);
            let sums = || costs.iter().zip(&exit.onward).map(|(cost, onward)| cost + onward);
            let cost = sums().min().unwrap_or(UNREACHABLE);
            if cost < best {
                best = cost;
                first = sums().position(|sum| sum == cost).map(|node| NodeName { gate, node });
            }
        }
        (best, first)
    }
}

/// The gates to leave a region by on the way to a cell of another, with what is left from there.
fn exits(plans: &Plans, region: usize, goal: Place) -> Vec<Exit> {
    let there = End::new(plans, goal);
    let [exits, entries] = [(region, goal.region()), (goal.region(), region)]
        .map(|(from, to)| plans.exits.of(from, to).unwrap_or_default());
    let entries: Vec<_> = entries.iter().map(|&door| there.approach(usize::from(door))).collect();
    let exit = |&door: &u16| {
        let door = usize::from(door);
        let gate = plans.layout.doors[region][door].gate;
        let mut onward = [UNREACHABLE; GATE_NODES_MAX];
        for entry in &entries {
            over_entry(plans, gate, entry, &mut onward);
        }
        let least = onward.iter().copied().min().unwrap_or(UNREACHABLE);
        Exit { door, onward, least }
    };
    exits.iter().map(exit).collect()
}

/// From the nodes of a gate over another to the goal, where that is less.
fn over_entry(
    plans: &Plans,
    gate: usize,
    entry: &Approach<'_>,
    onward: &mut [Cost; GATE_NODES_MAX],
) {
    let hierarchy = &plans.layout.hierarchy;
    let Some(block) = plans.pairs.block(hierarchy, gate, entry.gate) else { return };
    let after = entry.costs();
    let mut line = [UNREACHABLE; GATE_NODES_MAX];
    if block.is_turned {
        for (node, &after) in after.iter().enumerate().take(entry.n_nodes) {
            block.row(node, &mut line);
            for (onward, between) in onward.iter_mut().zip(&line) {
                *onward = (*onward).min(between + after);
            }
        }
        return;
    }
    for (node, onward) in onward.iter_mut().enumerate().take(hierarchy.n_nodes[gate]) {
        block.row(node, &mut line);
        let sums = line.iter().zip(&after).map(|(between, after)| between + after);
        *onward = sums.fold(*onward, Cost::min);
    }
}
