//! Steps that cross closed or dear arcs, and shortest paths with them, without tables.
//!
//! ```text
//! cost(p) = min over steps q -> p of cost(q) + step(q, p) + toll(q, p)
//! ```
//!
//! The answers of [`Plans`](crate::Plans) with the same arcs, at the price of a search: for as long
//! as these are being made. P. Hart, N. Nilsson and B. Raphael, "A formal basis for the heuristic
//! determination of minimum cost paths", IEEE Transactions on Systems Science and Cybernetics 4
//! (1968); tolls differ too much for the buckets of [`Search`](crate::Search). Time O(cells log
//! cells), space 4 bytes a cell.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

use meetpoint_topology::{Partition, TopologicalGraph};

use crate::cost::{Cost, DIAGONAL, STRAIGHT, UNREACHABLE};
use crate::gates::Crossings;
use crate::plans::ArcCost;
use crate::space::Space;

/// What steps cost beyond their length where they cross arcs that are closed or dear.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tolls(HashMap<(usize, usize), Cost>);

impl Tolls {
    /// Of the steps between the regions of `partition`; `arcs` has one entry an arc of the graph.
    pub fn new(
        space: &Space,
        partition: &Partition,
        graph: &TopologicalGraph,
        arcs: &[ArcCost],
    ) -> Self {
        let mut tolls = HashMap::new();
        if arcs.iter().all(|&arc| arc == ArcCost::Open(0)) {
            return Self(tolls);
        }
        let crossings = Crossings::new(graph);
        for index in 0..space.info().n_cells() {
            let Some(region) = partition.region_at(index) else { continue };
            for (step, to) in space.steps(index) {
                let Some(other) = partition.region_at(to).filter(|&other| region < other) else {
                    continue;
                };
                let crossed = crossings.of_step(space, graph, [region, other], (index, step));
                let toll = sum(&crossed, arcs);
                if 0 < toll {
                    tolls.insert((index, step), toll);
                    tolls.insert((to, (step + 4) % 8), toll);
                }
            }
        }
        Self(tolls)
    }

    /// Whether all steps cost their length.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// What a step costs beyond its length; [`UNREACHABLE`] if it may not be taken.
    pub fn of(&self, cell: usize, step: usize) -> Cost {
        self.0.get(&(cell, step)).copied().unwrap_or(0)
    }
}

/// What searches with tolls write on.
#[derive(Clone, Debug, Default)]
pub struct TolledSearch {
    /// Invariant: [`UNREACHABLE`] but in the cells of `touched`.
    costs: Vec<Cost>,
    touched: Vec<u32>,
    waiting: BinaryHeap<Reverse<(Cost, Cost, u32)>>,
}

impl TolledSearch {
    /// What a cheapest way between two cells costs; `None` if there is none. [`Self::path`] tells
    /// the way.
    ///
    /// # Panics
    /// If a cell is not below the number of cells; true of every cell given to a search.
    pub fn between(
        &mut self,
        space: &Space,
        tolls: &Tolls,
        from: usize,
        to: usize,
    ) -> Option<Cost> {
        let width = space.info().width as usize;
        let bound = |cell| octile(width, cell, to);
        self.run((space, tolls), from, UNREACHABLE - 1, bound, |cell| cell == to);
        Some(self.costs[to]).filter(|&cost| cost < UNREACHABLE)
    }

    /// Costs of all cells from one, as far as they are at most `cost_max`.
    pub fn flood(&mut self, space: &Space, tolls: &Tolls, from: usize, cost_max: Cost) {
        self.run((space, tolls), from, cost_max.min(UNREACHABLE - 1), |_| 0, |_| false);
    }

    /// What the last search found a cell to cost; [`UNREACHABLE`] where it did not go.
    pub fn cost(&self, cell: usize) -> Cost {
        self.costs[cell]
    }

    /// The cells that the last search came to.
    pub fn touched(&self) -> impl ExactSizeIterator<Item = usize> + '_ {
        self.touched.iter().map(|&cell| cell as usize)
    }

    /// Cells of a cheapest way of the last search to `cell`, both ends included; empty where it did
    /// not go.
    pub fn path(&self, space: &Space, tolls: &Tolls, cell: usize) -> Vec<u32> {
        if self.costs.get(cell).is_none_or(|&cost| cost == UNREACHABLE) {
            return vec![];
        }
        let (mut path, mut here, mut last) = (vec![name(cell)], cell, 0);
        loop {
            let is_before = |&(step, cell): &(usize, usize)| {
                let step_cost = space.step_cost(here, step).saturating_add(tolls.of(here, step));
                self.costs[cell].saturating_add(step_cost) == self.costs[here]
                    && self.costs[cell] < self.costs[here]
            };
            let ways = || space.steps(here).filter(is_before);
            let straight = ways().find(|&(step, _)| step == last);
            let Some((step, before)) = straight.or_else(|| ways().next()) else { break };
            path.push(name(before));
            (here, last) = (before, step);
        }
        path.reverse();
        path
    }

    fn run(
        &mut self,
        (space, tolls): (&Space, &Tolls),
        from: usize,
        cost_max: Cost,
        bound: impl Fn(usize) -> Cost,
        is_goal: impl Fn(usize) -> bool,
    ) {
        self.reset(space.info().n_cells());
        if !space.is_enterable(from) {
            return;
        }
        self.reach(from, 0, bound(from));
        while let Some(Reverse((_, left, cell))) = self.waiting.pop() {
            let cell = cell as usize;
            let cost = self.costs[cell];
            if is_goal(cell) {
                return;
            }
            if left != Cost::MAX - cost {
                continue;
            }
            for (step, to) in space.steps(cell) {
                let step_cost = space.step_cost(cell, step).saturating_add(tolls.of(cell, step));
                let next = cost.saturating_add(step_cost);
                if next <= cost_max && next < self.costs[to] {
                    self.reach(to, next, next.saturating_add(bound(to)));
                }
            }
        }
    }

    /// Of equal ranks the cell farthest from the start is taken first.
    fn reach(&mut self, cell: usize, cost: Cost, rank: Cost) {
        let cell_name = name(cell);
        if self.costs[cell] == UNREACHABLE {
            self.touched.push(cell_name);
        }
        self.costs[cell] = cost;
        self.waiting.push(Reverse((rank, Cost::MAX - cost, cell_name)));
    }

    fn reset(&mut self, n_cells: usize) {
        if self.costs.len() == n_cells {
            for &cell in &self.touched {
                self.costs[cell as usize] = UNREACHABLE;
            }
        } else {
            self.costs.clear();
            self.costs.resize(n_cells, UNREACHABLE);
        }
        self.touched.clear();
        self.waiting.clear();
    }
}

/// What crossing all of these arcs costs; [`UNREACHABLE`] if one is closed.
fn sum(crossed: &[usize], arcs: &[ArcCost]) -> Cost {
    let toll = |&arc: &usize| match arcs.get(arc) {
        Some(ArcCost::Closed) => UNREACHABLE,
        Some(&ArcCost::Open(toll)) => toll,
        None => 0,
    };
    let tolls = crossed.iter().map(toll);
    tolls.fold(0, |sum: Cost, toll| sum.saturating_add(toll).min(UNREACHABLE))
}

/// No way between two cells costs less.
fn octile(width: usize, a: usize, b: usize) -> Cost {
    let columns = (a % width).abs_diff(b % width);
    let rows = (a / width).abs_diff(b / width);
    let cost = |n: usize, step: Cost| Cost::try_from(n).unwrap_or(Cost::MAX).saturating_mul(step);
    cost(columns.abs_diff(rows), STRAIGHT).saturating_add(cost(columns.min(rows), DIAGONAL))
}

fn name(cell: usize) -> u32 {
    u32::try_from(cell).unwrap_or(u32::MAX)
}
