//! Losses added up.

use meetpoint_planning::{Cost, STRAIGHT};

/// Bins of path length.
pub(crate) const N_BINS: usize = 16;

/// What one pair cost.
#[derive(Clone, Copy)]
pub(crate) struct Outcome {
    /// Of a shortest path in the grid.
    pub(crate) optimum: Cost,
    /// Of the best path through the parts of the plan.
    pub(crate) best_in_plan: Cost,
    /// Of the path that was followed.
    pub(crate) followed: Cost,
}

/// Sums over many pairs, in cells.
#[derive(Clone, Copy, Default)]
pub(crate) struct Sums {
    pub(crate) n_pairs: usize,
    pub(crate) optimum: f64,
    pub(crate) topological_loss: f64,
    pub(crate) triplet_loss: f64,
    pub(crate) worst: f64,
    pub(crate) n_loss_free: usize,
}

/// Sums over all pairs, and by path length.
#[derive(Clone)]
pub(crate) struct Tally {
    pub(crate) all: Sums,
    pub(crate) bins: [Sums; N_BINS],
    /// Width of a bin, in cells.
    pub(crate) bin_cells: f64,
}

impl Tally {
    pub(crate) fn new(bin_cells: f64) -> Self {
        Self { all: Sums::default(), bins: [Sums::default(); N_BINS], bin_cells }
    }

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small count")]
    pub(crate) fn add(&mut self, outcome: Outcome) {
        let bin = cells(outcome.optimum) / self.bin_cells;
        self.all.add(outcome);
        self.bins[(bin as usize).min(N_BINS - 1)].add(outcome);
    }
}

impl Sums {
    fn add(&mut self, Outcome { optimum, best_in_plan, followed }: Outcome) {
        assert!(optimum <= best_in_plan && best_in_plan <= followed, "better than the best");
        let loss = cells(followed - optimum);
        self.n_pairs += 1;
        self.optimum += cells(optimum);
        self.topological_loss += cells(best_in_plan - optimum);
        self.triplet_loss += cells(followed - best_in_plan);
        self.worst = self.worst.max(loss);
        self.n_loss_free += usize::from(followed == optimum);
    }

    /// Share of the length of shortest paths, in percent.
    pub(crate) fn percent(&self, cells: f64) -> f64 {
        if self.optimum == 0.0 { 0.0 } else { 100.0 * cells / self.optimum }
    }

    /// Mean length of a shortest path, in cells along an axis.
    pub(crate) fn mean_cells(&self) -> f64 {
        self.optimum / self.n_pairs.max(1) as f64
    }
}

/// Cost as a number of cells along an axis.
pub(crate) fn cells(cost: Cost) -> f64 {
    f64::from(cost) / f64::from(STRAIGHT)
}
