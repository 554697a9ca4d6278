//! Costs to one goal, put together from plan tables.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::f64::consts::{FRAC_PI_4, SQRT_2};

use meetpoint_proto::v1::{PlanGate, Point};

use super::{DIAGONAL, PlanTables, STRAIGHT, UNREACHABLE};

/// The next motion of a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlannedMotion {
    /// Where to head for, in radians in the map's frame; `None` in the goal's cell.
    pub heading_rad: Option<f64>,
    /// Cost of what is left, in metres of free travel.
    pub distance_left_m: f64,
    /// Centre of the cell to go to, in the map's frame.
    pub next: Point,
    /// Id of the region that the robot is in; 0 if it is in none.
    pub region: u64,
}

/// Costs to one goal.
#[derive(Clone, Debug)]
pub struct GoalPlan<'a> {
    pub(super) tables: &'a PlanTables,
    pub(super) goal: usize,
    /// From the nodes of every gate.
    pub(super) nodes: Vec<Vec<u32>>,
    /// From the cells of the goal's region, by ways inside it.
    pub(super) inside: Vec<u32>,
}

impl GoalPlan<'_> {
    /// The next motion of a robot at a point in metres in the map's frame; `None` if it cannot be
    /// there, or there is no way.
    pub fn next_motion(&self, position: Point) -> Option<PlannedMotion> {
        let tables = self.tables;
        let cell = tables.cell_at(position)?;
        let cost = self.cost(cell);
        if UNREACHABLE <= cost {
            return None;
        }
        let region = tables.region(cell).and_then(|place| tables.header.regions.get(place));
        let (mut heading_rad, mut next) = (None, tables.center(cell));
        if let Some((_, step, to)) = self.onward(cell) {
            #[expect(clippy::cast_precision_loss, reason = "below 8")]
            let eighths = if step <= 4 { step as f64 } else { step as f64 - 8.0 };
            heading_rad = Some(eighths * FRAC_PI_4);
            next = tables.center(to);
        }
        Some(PlannedMotion {
            heading_rad,
            distance_left_m: length_cells(cost) * tables.header.resolution_m,
            next,
            region: region.copied().unwrap_or(0),
        })
    }

    /// Cost of the way from a cell; [`UNREACHABLE`] if there is none.
    fn cost(&self, cell: usize) -> u32 {
        let tables = self.tables;
        let by_node = tables.to_nodes(cell).map(|(gate, node, cost)| cost + self.nodes[gate][node]);
        let by_gates = by_node.min().unwrap_or(UNREACHABLE).min(UNREACHABLE);
        if tables.region(cell) != tables.region(self.goal) {
            return by_gates;
        }
        let inside = tables.slots.get(cell).and_then(|&slot| self.inside.get(slot as usize));
        by_gates.min(inside.copied().unwrap_or(UNREACHABLE))
    }

    /// The best step from a cell, with what is left before it; `None` at the goal.
    fn onward(&self, cell: usize) -> Option<(u32, usize, usize)> {
        if cell == self.goal {
            return None;
        }
        let tables = self.tables;
        let ways = (0..8).filter_map(|step| {
            let to = tables.step(cell, step)?;
            let toll = tables.tolls.get(&(cell, step)).copied().unwrap_or(0);
            let cost = tables.step_cost(cell, to, step).saturating_add(toll);
            Some((cost.saturating_add(self.cost(to)), step, to))
        });
        ways.min()
    }

    /// Spreads costs from the goal over the nodes of all gates.
    pub(super) fn spread(&mut self) {
        let tables = self.tables;
        let mut waiting = BinaryHeap::new();
        for (gate, node, cost) in tables.to_nodes(self.goal) {
            waiting.push(Reverse((cost, gate, node)));
        }
        while let Some(Reverse((cost, gate, node))) = waiting.pop() {
            if self.nodes[gate][node] <= cost {
                continue;
            }
            self.nodes[gate][node] = cost;
            let PlanGate { nodes, across, toll, .. } = &tables.header.gates[gate];
            let cell = usize::try_from(nodes[node]).unwrap_or(usize::MAX);
            let mut from = |cell: usize, extra: u32| {
                for (next_gate, next_node, more) in tables.to_nodes(cell) {
                    let cost = cost.saturating_add(extra).saturating_add(more);
                    if cost < self.nodes[next_gate][next_node] {
                        waiting.push(Reverse((cost, next_gate, next_node)));
                    }
                }
            };
            if UNREACHABLE <= *toll {
                continue;
            }
            from(cell, 0);
            for step in (0..8).filter(|step| across[node] >> step & 1 == 1) {
                if let Some(to) = tables.step(cell, step) {
                    from(to, tables.step_cost(cell, to, step).saturating_add(*toll));
                }
            }
        }
    }
}

/// Length of a path of that cost through cells that cost their length, in cells: the cost tells the
/// numbers of straight and diagonal steps, as 577 is the inverse of 1393 modulo 985.
fn length_cells(cost: u32) -> f64 {
    let cost = u64::from(cost);
    let diagonal = cost * 577 % u64::from(STRAIGHT);
    let of_diagonal = diagonal * u64::from(DIAGONAL);
    if cost < of_diagonal {
        return cost as f64 / f64::from(STRAIGHT);
    }
    ((cost - of_diagonal) / u64::from(STRAIGHT)) as f64 + diagonal as f64 * SQRT_2
}
