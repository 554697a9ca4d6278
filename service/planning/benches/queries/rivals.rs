//! Searches of other crates in the same space.

use grid_pathfinding::PathingGrid;
use grid_util::ValueGrid;
use grid_util::point::Point;
use meetpoint_planning::{Cost, DIAGONAL, STRAIGHT, Space};
use pathfinding::directed::{astar, dijkstra};

/// A* of `pathfinding`, with the octile bound.
pub(crate) fn astar(space: &Space, from: usize, to: usize) -> Option<Cost> {
    let found = astar::astar(&from, |&c| steps(space, c), |&c| octile(space, c, to), |&c| c == to);
    found.map(|(_, cost)| cost)
}

/// Dijkstra's algorithm of `pathfinding`.
pub(crate) fn dijkstra(space: &Space, from: usize, to: usize) -> Option<Cost> {
    dijkstra::dijkstra(&from, |&c| steps(space, c), |&c| c == to).map(|(_, cost)| cost)
}

fn steps(space: &Space, cell: usize) -> impl Iterator<Item = (usize, Cost)> + '_ {
    space.steps(cell).map(move |(step, next)| (next, space.step_cost(cell, step)))
}

fn octile(space: &Space, a: usize, b: usize) -> Cost {
    let width = space.info().width as usize;
    let [dx, dy] = [(a % width).abs_diff(b % width), (a / width).abs_diff(b / width)];
    let cost = |n: usize| Cost::try_from(n).unwrap_or(Cost::MAX);
    cost(dx.min(dy)) * DIAGONAL + cost(dx.abs_diff(dy)) * STRAIGHT
}

/// Jump point search of `grid_pathfinding`. It cuts corners, so that its paths may be shorter.
pub(crate) struct JumpPoints {
    grid: PathingGrid,
    width: usize,
}

impl JumpPoints {
    pub(crate) fn new(space: &Space) -> Self {
        let info = space.info();
        let (width, height) = (info.width as usize, info.height as usize);
        let mut grid = PathingGrid::new(width, height, false);
        for cell in (0..info.n_cells()).filter(|&cell| !space.is_enterable(cell)) {
            grid.set_point(point(width, cell), true);
        }
        grid.generate_components();
        Self { grid, width }
    }

    /// Corners of a path.
    pub(crate) fn waypoints(&self, from: usize, to: usize) -> Option<usize> {
        let [from, to] = [from, to].map(|cell| point(self.width, cell));
        let found = self.grid.get_waypoints_single_goal(from, to, false)?;
        Some(found.len())
    }
}

fn point(width: usize, cell: usize) -> Point {
    let [x, y] = [cell % width, cell / width].map(|n| i32::try_from(n).unwrap_or(i32::MAX));
    Point::new(x, y)
}
