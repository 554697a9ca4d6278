//! What each cell is to robots that explore: closed, explored, unexplored, a goal.

use meetpoint_geometry::{Cell, GridInfo, Point2};
use meetpoint_topology::FreeSpace;

use super::{ExplorationParams, Known};
use crate::footprint::enterable;
use crate::nearest::{Nearest, nearest_enterable};
use crate::reachable::components;
use crate::smooth::{Obstacles, Passage};
use crate::space::Space;
use crate::value_iteration::Ground;

/// Probability of a cell that was never observed: even odds.
const PRIOR: f32 = 0.5;

/// Cells of a map with a ring of closed ones about them.
pub(super) struct Chart {
    pub(super) info: GridInfo,
    pub(super) params: ExplorationParams,
    /// What was observed to be occupied, or is closed by people.
    pub(super) obstacles: Obstacles,
    /// Where the centre of a robot can be for all that was observed, be it explored or not.
    pub(super) space: Space,
    /// What value iteration is told of each cell.
    pub(super) ground: Vec<Ground>,
}

/// What was observed of a cell.
#[derive(Clone, Copy, PartialEq)]
enum Sight {
    Unexplored,
    /// With its probability of being occupied, in steps of a hundredth: what changes by less
    /// changes no value.
    Explored(f32),
}

impl Chart {
    /// The chart for robots that stand at these points; `known` has one number a cell.
    pub(super) fn new(params: &ExplorationParams, known: &Known, robots: &[Point2<f64>]) -> Self {
        let closed_from = (params.closed_from / (1.0 - params.closed_from)).ln();
        let is_clear = |&log_odds: &f32| log_odds.is_nan() || log_odds < closed_from;
        let mut is_clear: Vec<bool> = known.log_odds.iter().map(is_clear).collect();
        for &cell in known.closed {
            if let Some(is_clear) = is_clear.get_mut(cell) {
                *is_clear = false;
            }
        }
        let clear = FreeSpace::from_cells(known.info, &is_clear);
        let info = clear.info();
        let is_open = enterable(&clear, params.radius_m);
        let mut sights = sights(known, info);
        for &robot in robots {
            stand(info, robot, params.radius_m, &mut sights);
        }
        let is_goal = goals(info, &is_open, &sights, params.unexplored_min_m);
        let ground = |(cell, &is_open): (usize, &bool)| {
            let dear = match sights[cell] {
                Sight::Explored(probability) if PRIOR <= probability => {
                    probability + params.doubt_cost
                }
                Sight::Explored(probability) => probability,
                Sight::Unexplored => PRIOR,
            };
            let cost = if is_open { params.step_cost + dear } else { f32::INFINITY };
            Ground { cost, is_goal: is_goal[cell] }
        };
        let ground = is_open.iter().enumerate().map(ground).collect();
        let (obstacles, space) = (Obstacles::new(&clear), space(info, &is_open));
        Self { info, params: *params, obstacles, space, ground }
    }

    /// The cell that a robot is in, or the nearest that it can be in.
    pub(super) fn locate(&self, robot: Point2<f64>) -> Option<Nearest> {
        nearest_enterable(&self.space, robot, self.params.tolerance_m)
    }

    /// Whether a point lies outside of the cells.
    pub(super) fn is_outside(&self, point: Point2<f64>) -> bool {
        let is_number = point.coords.iter().all(|axis| axis.is_finite());
        !is_number || self.info.index_of(self.info.frame.cell_at(point)).is_none()
    }

    pub(super) fn is_goal(&self, cell: usize) -> bool {
        self.ground[cell].is_goal
    }

    /// Goals that a robot will see when it is at one of them, itself included.
    pub(super) fn seen_from(&self, goal: usize) -> Vec<usize> {
        let width = self.info.width as usize;
        let reach = super::cells(self.params.sight_m, self.info).max(0).unsigned_abs() as usize;
        let (x, y) = (goal % width, goal / width);
        let columns = x.saturating_sub(reach)..(x + reach + 1).min(width);
        let rows = y.saturating_sub(reach)..(y + reach + 1).min(self.info.height as usize);
        let is_near = |&cell: &usize| {
            let [dx, dy] = [(cell % width).abs_diff(x), (cell / width).abs_diff(y)];
            dx * dx + dy * dy <= reach * reach
        };
        let nowhere = Point2::origin();
        let view = Passage {
            obstacles: &self.obstacles,
            radius_m: 0.0,
            weights: None,
            start: nowhere,
            goal: nowhere,
        };
        let cells = rows.flat_map(|y| columns.clone().map(move |x| y * width + x));
        let goals = cells.filter(|&cell| self.is_goal(cell)).filter(is_near);
        goals.filter(|&cell| cell == goal || view.is_clear(goal, cell)).collect()
    }
}

/// What was observed of the cells of `info`, which has a ring more than what is known.
fn sights(known: &Known, info: GridInfo) -> Vec<Sight> {
    let mut sights = vec![Sight::Unexplored; info.n_cells()];
    let width = known.info.width as usize;
    let rows = sights.chunks_exact_mut(info.width as usize).skip(1);
    for (to, from) in rows.zip(known.log_odds.chunks_exact(width.max(1))) {
        for (to, &log_odds) in to[1..=width].iter_mut().zip(from) {
            if !log_odds.is_nan() {
                let probability = 1.0 / (1.0 + (-log_odds).exp());
                *to = Sight::Explored((100.0 * probability).round() / 100.0);
            }
        }
    }
    sights
}

/// Where a robot stands is free, whether its sensors see it or not.
fn stand(info: GridInfo, robot: Point2<f64>, radius_m: f64, sights: &mut [Sight]) {
    if !robot.coords.iter().all(|axis| axis.is_finite()) {
        return;
    }
    let frame = info.frame;
    let here = frame.cell_at(robot);
    let reach = super::cells(radius_m.max(0.0), info);
    let around = |at: i32| at.saturating_sub(reach)..=at.saturating_add(reach);
    for (x, y) in around(here.y).flat_map(|y| around(here.x).map(move |x| (x, y))) {
        let cell = Cell { x, y };
        let is_under = cell == here || (frame.center_of(cell) - robot).norm() <= radius_m;
        if let Some(index) = info.index_of(cell).filter(|_| is_under)
            && sights[index] == Sight::Unexplored
        {
            sights[index] = Sight::Explored(0.0);
        }
    }
}

/// Unexplored cells that a robot can be at, but those of pieces that are too small.
fn goals(info: GridInfo, is_open: &[bool], sights: &[Sight], least_m: f64) -> Vec<bool> {
    let is_unexplored = |(&is_open, &sight): (&bool, &Sight)| is_open && sight == Sight::Unexplored;
    let is_unexplored: Vec<bool> = is_open.iter().zip(sights).map(is_unexplored).collect();
    let pieces = components(&space(info, &is_unexplored));
    let cell_m2 = info.frame.resolution_m().powi(2);
    let is_large = |cell: usize| {
        let n_cells = pieces.of(cell).map_or(0, |piece| pieces.n_cells()[piece.0 as usize]);
        least_m.powi(2) <= n_cells as f64 * cell_m2
    };
    (0..is_unexplored.len()).map(|cell| is_unexplored[cell] && is_large(cell)).collect()
}

/// # Panics
/// Never: there is one word a cell.
fn space(info: GridInfo, is_enterable: &[bool]) -> Space {
    Space::uniform(info, is_enterable).expect("one word a cell")
}
