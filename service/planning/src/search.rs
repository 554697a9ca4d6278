//! Shortest paths in the grid, without tables.
//!
//! ```text
//! cost(p) = min over steps q -> p of cost(q) + step(q, p)
//! ```
//!
//! E. W. Dijkstra, "A note on two problems in connexion with graphs", Numerische Mathematik 1
//! (1959), with buckets: R. B. Dial, "Algorithm 360: shortest-path forest with topological
//! ordering", Communications of the ACM 12 (1969). No step costs less than [`STRAIGHT`], so that
//! a bucket of that width is settled whole: none of its cells can make another one cheaper. From
//! cell to cell with a bound (`search/between.rs`). Time O(cells touched), resetting included.

mod between;

use std::cmp::Reverse;

use crate::cost::{Cost, STRAIGHT, UNREACHABLE};
use crate::space::Space;

/// More buckets than the dearest step is wide: 1393 * 255 / 16 is below 23 of them. A power of two.
const N_BUCKETS: usize = 32;

/// What searches write on: costs from the seeds of the last search.
#[derive(Clone, Debug, Default)]
pub struct Search {
    /// Invariant: [`UNREACHABLE`] but in the cells of `touched`.
    costs: Vec<Cost>,
    touched: Vec<u32>,
    queue: Buckets,
}

impl Search {
    /// Costs of all cells of `space` from the nearest seed, a cell and what it costs to be there,
    /// as far as they are at most `cost_max`. Seeds that cannot be entered are passed over.
    ///
    /// # Panics
    /// If a seed is not below the number of cells; true of every cell given to a search.
    pub fn flood(
        &mut self,
        space: &Space,
        seeds: impl IntoIterator<Item = (usize, Cost)>,
        cost_max: Cost,
    ) {
        self.reset(space);
        let cost_max = cost_max.min(UNREACHABLE - 1);
        let is_seed = |&(cell, cost): &(usize, Cost)| space.is_enterable(cell) && cost <= cost_max;
        let mut seeds: Vec<(usize, Cost)> = seeds.into_iter().filter(is_seed).collect();
        seeds.sort_unstable_by_key(|&(_, cost)| Reverse(cost));
        loop {
            self.feed(&mut seeds);
            let Some((cell, cost)) = self.queue.pop() else { return };
            if self.costs[cell] == cost {
                self.relax(space, cell, cost_max);
            }
        }
    }

    /// Queues the seeds whose turn it is; the cheapest is the last.
    fn feed(&mut self, seeds: &mut Vec<(usize, Cost)>) {
        while let Some(&(cell, cost)) = seeds.last() {
            if self.queue.next_key().is_some_and(|key| key < key_of(cost)) {
                return;
            }
            seeds.pop();
            self.reach(cell, cost, cost);
        }
    }

    /// What the last search found a cell to cost; [`UNREACHABLE`] where it did not go.
    pub fn cost(&self, cell: usize) -> Cost {
        self.costs[cell]
    }

    /// The cells that the last search came to, in the order of coming.
    pub fn touched(&self) -> impl ExactSizeIterator<Item = usize> + '_ {
        self.touched.iter().map(|&cell| cell as usize)
    }

    /// Cells of a cheapest way from a seed of the last search to `cell`, both included; empty where
    /// it did not go. Of equal ways that which turns last, seen from `cell`.
    pub fn path(&self, space: &Space, cell: usize) -> Vec<usize> {
        if self.costs.get(cell).is_none_or(|&cost| cost == UNREACHABLE) {
            return vec![];
        }
        let (mut path, mut last) = (vec![cell], 0);
        let mut here = cell;
        while let Some((step, before)) = self.before(space, here, last) {
            path.push(before);
            (here, last) = (before, step);
        }
        path.reverse();
        path
    }

    /// The cell that a cheapest way to `here` comes from, by step `last` if that is one of them.
    fn before(&self, space: &Space, here: usize, last: usize) -> Option<(usize, usize)> {
        let is_before = |&(step, cell): &(usize, usize)| {
            let cost = self.costs[cell];
            cost < self.costs[here] && cost + space.step_cost(here, step) == self.costs[here]
        };
        let ways = || space.steps(here).filter(is_before);
        ways().find(|&(step, _)| step == last).or_else(|| ways().next())
    }

    fn reset(&mut self, space: &Space) {
        let n_cells = space.info().n_cells();
        if self.costs.len() == n_cells {
            for &cell in &self.touched {
                self.costs[cell as usize] = UNREACHABLE;
            }
        } else {
            self.costs.clear();
            self.costs.resize(n_cells, UNREACHABLE);
        }
        self.touched.clear();
        self.queue.clear();
    }

    /// Notes a way to `cell`, if it is the cheapest so far; `rank` is where it is queued.
    fn reach(&mut self, cell: usize, cost: Cost, rank: Cost) {
        let known = self.costs[cell];
        if known <= cost {
            return;
        }
        let index = u32::try_from(cell).unwrap_or(u32::MAX);
        if known == UNREACHABLE {
            self.touched.push(index);
        }
        self.costs[cell] = cost;
        self.queue.push(index, cost, rank);
    }

    fn relax(&mut self, space: &Space, cell: usize, cost_max: Cost) {
        let here = self.costs[cell];
        for (step, next) in space.steps(cell) {
            let cost = here + space.step_cost(cell, step);
            if cost <= cost_max {
                self.reach(next, cost, cost);
            }
        }
    }
}

/// Which bucket a rank belongs to, counted from 0.
fn key_of(rank: Cost) -> usize {
    (rank / STRAIGHT) as usize
}

/// Cells in the order of their rank, to within [`STRAIGHT`].
#[derive(Clone, Debug)]
struct Buckets {
    /// Cells with what they cost when they were queued; bucket `key % N_BUCKETS`.
    buckets: [Vec<(u32, Cost)>; N_BUCKETS],
    /// No cell is queued in a bucket before this.
    key: usize,
    n_queued: usize,
}

impl Default for Buckets {
    fn default() -> Self {
        Self { buckets: std::array::from_fn(|_| vec![]), key: 0, n_queued: 0 }
    }
}

impl Buckets {
    fn clear(&mut self) {
        self.buckets.iter_mut().for_each(Vec::clear);
        (self.key, self.n_queued) = (0, 0);
    }

    /// All that is queued must lie within [`N_BUCKETS`] buckets.
    fn push(&mut self, cell: u32, cost: Cost, rank: Cost) {
        let key = key_of(rank);
        self.key = if self.n_queued == 0 { key } else { self.key.min(key) };
        debug_assert!(key < self.key + N_BUCKETS, "{key} is out of turn");
        self.buckets[key % N_BUCKETS].push((cell, cost));
        self.n_queued += 1;
    }

    /// Key of the first bucket that holds a cell.
    fn next_key(&mut self) -> Option<usize> {
        if self.n_queued == 0 {
            return None;
        }
        while self.buckets[self.key % N_BUCKETS].is_empty() {
            self.key += 1;
        }
        Some(self.key)
    }

    fn pop(&mut self) -> Option<(usize, Cost)> {
        self.next_key()?;
        let (cell, cost) = self.buckets[self.key % N_BUCKETS].pop()?;
        self.n_queued -= 1;
        Some((cell as usize, cost))
    }
}
