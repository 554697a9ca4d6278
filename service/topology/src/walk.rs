//! A walk along a line of the Voronoi diagram, cell by cell.

use std::collections::BTreeSet;

use crate::lattice::Lattice;
use crate::voronoi::Voronoi;

/// Where a walk has come to.
pub(crate) struct Walk<'a> {
    lattice: Lattice,
    voronoi: &'a Voronoi,
    at: usize,
    passed: BTreeSet<usize>,
    length: f64,
}

impl<'a> Walk<'a> {
    /// A walk that begins at `start`, a cell of the diagram.
    pub(crate) fn new(voronoi: &'a Voronoi, start: usize) -> Self {
        let lattice = Lattice::new(voronoi.info());
        Self { lattice, voronoi, at: start, passed: BTreeSet::from([start]), length: 0.0 }
    }

    /// The same start again, the cells passed so far left out.
    pub(crate) fn back_to(self, start: usize) -> Self {
        Self { at: start, length: 0.0, ..self }
    }

    /// The next cell that was not passed yet; `None` at an end.
    pub(crate) fn step(&mut self) -> Option<usize> {
        // Straight steps before diagonal ones, lest a bend be cut and walked back.
        let order = [0, 2, 4, 6, 1, 3, 5, 7];
        let around = self.lattice.around(self.at);
        let is_next = |&direction: &usize| {
            self.voronoi.is_on()[around[direction]] && !self.passed.contains(&around[direction])
        };
        let direction = order.into_iter().find(is_next)?;
        self.length += if direction % 2 == 0 { 1.0 } else { std::f64::consts::SQRT_2 };
        self.at = around[direction];
        self.passed.insert(self.at);
        Some(self.at)
    }

    /// Way since the start, in cells.
    pub(crate) fn length(&self) -> f64 {
        self.length
    }
}
