//! What there is to see of a building.

use meetpoint_geometry::{Cell, Point2, Pose};
use meetpoint_occupancy::Grid;
use meetpoint_sim::Building;

/// A building, and where a robot can get to in it.
pub(crate) struct Floor<'a> {
    pub(crate) building: &'a Building,
    /// Cells that a robot's centre can reach from the first one, that one first.
    pub(crate) reachable: Vec<Point2<f64>>,
}

impl<'a> Floor<'a> {
    /// For a robot of that radius, in metres; it starts where there is room nearest to the corner.
    pub(crate) fn new(building: &'a Building, radius_m: f64) -> Self {
        let info = building.info();
        let center = |cell: Cell| info.frame.center_of(cell);
        let mut is_seen = vec![false; info.n_cells()];
        let mut reachable = vec![];
        let cells = (0..info.height.cast_signed())
            .flat_map(|y| (0..info.width.cast_signed()).map(move |x| Cell { x, y }));
        let fits = |cell: Cell| building.is_free(center(cell), radius_m);
        let mut ahead: Vec<Cell> = cells.into_iter().find(|&cell| fits(cell)).into_iter().collect();
        while let Some(cell) = ahead.pop() {
            let Some(index) = info.index_of(cell) else { continue };
            if !fits(cell) || std::mem::replace(&mut is_seen[index], true) {
                continue;
            }
            reachable.push(center(cell));
            let steps = [(1, 0), (-1, 0), (0, 1), (0, -1)];
            ahead.extend(steps.map(|(dx, dy)| Cell { x: cell.x + dx, y: cell.y + dy }));
        }
        Self { building, reachable }
    }

    /// Where robots start: beside each other, a metre apart or more.
    pub(crate) fn starts(&self, n: usize) -> Vec<Pose> {
        let mut starts: Vec<Point2<f64>> = vec![];
        for &point in &self.reachable {
            if starts.len() < n && starts.iter().all(|other| 1.0 < (other - point).norm()) {
                starts.push(point);
            }
        }
        starts.into_iter().map(|start| Pose::new(start.x, start.y, 0.0)).collect()
    }

    /// Share of what can be reached that was observed.
    pub(crate) fn seen_share(&self, grid: &Grid) -> f64 {
        let is_seen = |point: &&Point2<f64>| grid.log_odds(grid.frame().cell_at(**point)).is_some();
        self.reachable.iter().filter(is_seen).count() as f64 / self.reachable.len() as f64
    }
}
