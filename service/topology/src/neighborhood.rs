//! Cells of the Voronoi diagram that are near along its lines, whatever is near across a wall.

use std::collections::HashMap;

use crate::lattice::Lattice;
use crate::voronoi::Voronoi;

/// Finds cells near one of them; kept, it spares the memory of each search.
pub(crate) struct Neighborhood<'a> {
    lattice: Lattice,
    voronoi: &'a Voronoi,
    reached: HashMap<usize, f64>,
}

impl<'a> Neighborhood<'a> {
    pub(crate) fn new(voronoi: &'a Voronoi) -> Self {
        Self { lattice: Lattice::new(voronoi.info()), voronoi, reached: HashMap::new() }
    }

    /// Cells of the diagram within `reach` cells along it from `start`, that included, in no
    /// order.
    pub(crate) fn within(&mut self, start: usize, reach: f64) -> impl Iterator<Item = usize> {
        self.reached.clear();
        self.reached.insert(start, 0.0);
        let mut open = vec![start];
        while let Some(index) = open.pop() {
            let so_far = self.reached[&index];
            for (direction, neighbor) in self.lattice.around(index).into_iter().enumerate() {
                let step = if direction % 2 == 0 { 1.0 } else { std::f64::consts::SQRT_2 };
                let distance = so_far + step;
                let known = self.reached.get(&neighbor).copied().unwrap_or(f64::INFINITY);
                if self.voronoi.is_on()[neighbor] && distance <= reach && distance < known {
                    self.reached.insert(neighbor, distance);
                    open.push(neighbor);
                }
            }
        }
        self.reached.keys().copied()
    }
}
