//! Random pairs of cells, the same in every run.

use meetpoint_planning::{Cost, Search, Space, UNREACHABLE};

/// Starts of one goal.
pub(crate) struct GoalPairs {
    pub(crate) goal: usize,
    /// Cells from which the goal can be reached.
    /// Each with what a shortest path costs, by Dijkstra's algorithm in the grid.
    pub(crate) starts: Vec<(usize, Cost)>,
}

/// About as many goals as starts for each. A goal is any cell that can be entered and left, a start
/// any cell from which the goal can be reached.
pub(crate) fn pairs(space: &Space, n_pairs: usize) -> Vec<GoalPairs> {
    let cells: Vec<usize> =
        (0..space.info().n_cells()).filter(|&cell| space.moves(cell) != 0).collect();
    let mut random = Random(1998);
    let mut search = Search::default();
    let n_goals = n_pairs.isqrt().max(1);
    let mut found = vec![];
    while found.len() < n_goals && !cells.is_empty() {
        let goal = cells[random.below(cells.len())];
        search.flood(space, [(goal, 0)], UNREACHABLE);
        let reached: Vec<usize> = search.touched().filter(|&cell| cell != goal).collect();
        let start = |_| {
            let start = reached[random.below(reached.len())];
            (start, search.cost(start))
        };
        found.push(GoalPairs { goal, starts: (0..n_pairs.div_ceil(n_goals)).map(start).collect() });
    }
    found
}

/// G. L. Steele, D. Lea and C. H. Flood, "Fast splittable pseudorandom number generators", OOPSLA
/// (2014).
struct Random(u64);

impl Random {
    #[expect(clippy::cast_possible_truncation, reason = "below `end`, which is a usize")]
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.0;
        mixed = (mixed ^ mixed >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((u128::from(mixed ^ mixed >> 31) * end as u128) >> 64) as usize
    }
}
