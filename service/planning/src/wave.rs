//! Dijkstra's algorithm within one region.
//!
//! ```text
//! d(c) = min over seeds and steps c - n within the region of d(n) + cost(c, n)
//! ```
//!
//! E. W. Dijkstra, "A note on two problems in connexion with graphs", Numerische Mathematik 1
//! (1959), with the buckets of R. B. Dial, "Algorithm 360", Communications of the ACM 12 (1969):
//! no step costs less than [`STRAIGHT`], so that all cells of a bucket as wide as that are final
//! when it is reached, in any order. Time O(cells + steps).

use crate::cost::{Cost, STRAIGHT, UNREACHABLE};
use crate::space::Space;

const NONE: u32 = u32::MAX;

/// The cells of a region, and the steps between them.
pub(crate) struct Ground {
    /// For every cell its neighbours by step; [`NONE`] where none can be reached within the region.
    neighbors: Vec<[u32; 8]>,
    /// For every cell what the eight steps cost; one row for all if every cell weighs the same.
    costs: Vec<[Cost; 8]>,
    /// Buckets that a step may reach ahead, and the current one.
    n_buckets: usize,
}

impl Ground {
    /// Of the given cells; `slot` tells the place of a cell among them.
    pub(crate) fn new(space: &Space, cells: &[u32], slot: impl Fn(usize) -> Option<u32>) -> Self {
        let mut neighbors = vec![[NONE; 8]; cells.len()];
        let mut costs = vec![[STRAIGHT; 8]; cells.len()];
        let (mut cost_max, mut is_uniform) = (STRAIGHT, true);
        for (at, &cell) in cells.iter().enumerate() {
            for (step, to) in space.steps(cell as usize) {
                if let Some(to) = slot(to) {
                    neighbors[at][step] = to;
                    costs[at][step] = space.step_cost(cell as usize, step);
                    cost_max = cost_max.max(costs[at][step]);
                    is_uniform &= costs[at][step] == UNIFORM[step];
                }
            }
        }
        if is_uniform {
            costs = vec![UNIFORM];
        }
        let n_buckets = (cost_max / STRAIGHT) as usize + 2;
        Self { neighbors, costs, n_buckets }
    }

    pub(crate) fn n_cells(&self) -> usize {
        self.neighbors.len()
    }

    fn costs(&self, slot: u32) -> &[Cost; 8] {
        if self.costs.len() == 1 { &self.costs[0] } else { &self.costs[slot as usize] }
    }
}

const UNIFORM: [Cost; 8] = {
    use crate::cost::DIAGONAL;
    [STRAIGHT, DIAGONAL, STRAIGHT, DIAGONAL, STRAIGHT, DIAGONAL, STRAIGHT, DIAGONAL]
};

/// Buckets kept from one wave to the next.
#[derive(Default)]
pub(crate) struct Wave {
    buckets: Vec<Vec<u32>>,
}

impl Wave {
    /// Costs from the seeds to every cell of `ground`, [`UNREACHABLE`] where there is no way.
    pub(crate) fn run(&mut self, ground: &Ground, seeds: &[(u32, Cost)], costs: &mut [Cost]) {
        costs.fill(UNREACHABLE);
        let seed_max = seeds.iter().map(|&(_, cost)| cost).max().unwrap_or(0);
        let n_buckets = ground.n_buckets.max((seed_max / STRAIGHT) as usize + 2);
        self.buckets.resize(n_buckets.max(self.buckets.len()), vec![]);
        let n_buckets = self.buckets.len();
        let mut n_waiting = 0;
        for &(slot, cost) in seeds {
            let known = &mut costs[slot as usize];
            if cost < *known {
                *known = cost;
                self.buckets[(cost / STRAIGHT) as usize].push(slot);
                n_waiting += 1;
            }
        }
        let mut level = 0;
        while 0 < n_waiting {
            let at = level as usize % n_buckets;
            let mut bucket = std::mem::take(&mut self.buckets[at]);
            n_waiting -= bucket.len();
            for &slot in &bucket {
                let cost = costs[slot as usize];
                // Reached cheaper since, and done then.
                if cost / STRAIGHT != level {
                    continue;
                }
                let steps = ground.costs(slot);
                for (&to, step) in ground.neighbors[slot as usize].iter().zip(steps) {
                    if to == NONE {
                        continue;
                    }
                    let through = cost + step;
                    let known = &mut costs[to as usize];
                    if through < *known {
                        *known = through;
                        self.buckets[(through / STRAIGHT) as usize % n_buckets].push(to);
                        n_waiting += 1;
                    }
                }
            }
            bucket.clear();
            self.buckets[at] = bucket;
            level += 1;
        }
    }
}
