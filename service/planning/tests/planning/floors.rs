//! Floors at random: obstacles, cuts into regions, and a robot that may be too wide for some gaps.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::Arc;

use meetpoint_geometry::{Cell, GridFrame, GridInfo};
use meetpoint_planning::{
    Cost, Grouping, PartGraph, Parts, Space, UNREACHABLE, WEIGHT_ONE, enterable,
};
use meetpoint_topology::{Crossing, FreeSpace, Partition, partition};
use proptest::prelude::*;

/// What a floor is drawn from.
#[derive(Clone, Debug)]
pub(crate) struct Floor {
    width: u32,
    height: u32,
    /// Row by row, 0 where nobody can be; more than the floor has cells.
    weights: Vec<u8>,
    /// Cuts: along x or y, at which row or column, and from where to where.
    cuts: Vec<(bool, u32, u32, u32)>,
    /// In tenths of a cell.
    radius: u32,
}

/// Floors of up to 22 by 22 cells.
pub(crate) fn floors() -> impl Strategy<Value = Floor> {
    let cut = (any::<bool>(), 1..22_u32, 0..22_u32, 1..22_u32);
    let weight = |n_free| prop_oneof![1 => Just(0_u8), n_free => Just(WEIGHT_ONE)];
    let dear = prop_oneof![1 => Just(0_u8), 8 => Just(WEIGHT_ONE), 2 => WEIGHT_ONE..80];
    let weights = prop_oneof![
        proptest::collection::vec(weight(4), 484),
        proptest::collection::vec(weight(24), 484),
        proptest::collection::vec(dear, 484),
    ];
    let radius = prop_oneof![2 => Just(0_u32), 1 => 1..16_u32];
    (5..22_u32, 5..22_u32, weights, proptest::collection::vec(cut, 0..6), radius).prop_map(
        |(width, height, weights, cuts, radius)| Floor { width, height, weights, cuts, radius },
    )
}

impl Floor {
    /// The space of the robot and the regions of the floor, whatever the robot.
    pub(crate) fn cut(&self) -> (Arc<Space>, Partition) {
        let frame = GridFrame::new(0.1).expect("a length");
        let first = Cell { x: -4, y: 9 };
        let info = GridInfo { frame, first, width: self.width, height: self.height };
        let is_free: Vec<bool> = self.weights.iter().map(|&weight| 0 < weight).collect();
        let free = FreeSpace::from_cells(info, &is_free[..info.n_cells()]);
        let rimmed = free.info();
        let partition = partition(&free, &self.crossings(rimmed));
        let mut weights = vec![0; rimmed.n_cells()];
        for (index, is_enterable) in
            enterable(&free, f64::from(self.radius) * 0.01).iter().enumerate()
        {
            let [x, y] = [index % rimmed.width as usize, index / rimmed.width as usize];
            if *is_enterable {
                weights[index] = self.weights[(y - 1) * self.width as usize + x - 1];
            }
        }
        let space = Space::new(rimmed, weights).expect("a weight a cell");
        (Arc::new(space), partition)
    }

    fn crossings(&self, info: GridInfo) -> Vec<Crossing> {
        let (width, height) = (info.width, info.height);
        let at = |x: u32, y: u32| (y * width + x) as usize;
        let mut crossings = vec![];
        for &(is_level, place, from, length) in &self.cuts {
            let long = if is_level { width } else { height } - 1;
            let place = place % (if is_level { height } else { width } - 1);
            for along in from.min(long)..(from + length).min(long) {
                crossings.push(if is_level {
                    Crossing { left: at(along, place), right: at(along, place + 1) }
                } else {
                    Crossing { left: at(place, along), right: at(place + 1, along) }
                });
            }
        }
        crossings
    }

    /// The floor with other weights in some cells.
    pub(crate) fn changed(&self, cells: &[(usize, u8)]) -> Self {
        let mut changed = self.clone();
        for &(cell, weight) in cells {
            let at = cell % (self.width * self.height) as usize;
            changed.weights[at] = weight;
        }
        changed
    }

    /// The parts, and the portals between them.
    pub(crate) fn graph(&self, grouping: Grouping) -> Arc<PartGraph> {
        let (space, partition) = self.cut();
        let parts = Arc::new(Parts::new(&space, &partition));
        Arc::new(PartGraph::new(space, parts, grouping, |_, _| true))
    }
}

/// Cells that can be entered.
pub(crate) fn open_cells(space: &Space) -> Vec<usize> {
    (0..space.info().n_cells()).filter(|&cell| space.is_enterable(cell)).collect()
}

/// Dijkstra's algorithm, word for word: from the seeds over cells for which `is_inside`.
pub(crate) fn costs_from(
    space: &Space,
    seeds: &[(usize, Cost)],
    is_inside: impl Fn(usize) -> bool,
) -> Vec<Cost> {
    let mut costs = vec![UNREACHABLE; space.info().n_cells()];
    let mut open = BinaryHeap::new();
    for &(cell, cost) in seeds.iter().filter(|&&(cell, _)| is_inside(cell)) {
        costs[cell] = costs[cell].min(cost);
        open.push(Reverse((cost, cell)));
    }
    while let Some(Reverse((cost, cell))) = open.pop() {
        if costs[cell] < cost {
            continue;
        }
        for (step, next) in space.steps(cell).filter(|&(_, next)| is_inside(next)) {
            let through = cost + space.step_cost(cell, step);
            if through < costs[next] {
                costs[next] = through;
                open.push(Reverse((through, next)));
            }
        }
    }
    costs
}

/// A best path along costs from its goal.
pub(crate) fn path_down(space: &Space, costs: &[Cost], start: usize) -> Vec<u32> {
    let mut cell = start;
    let mut path = vec![start];
    while 0 < costs[cell] {
        let is_best = |&(step, next): &(usize, usize)| {
            costs[next] + space.step_cost(cell, step) == costs[cell]
        };
        cell = space.steps(cell).find(is_best).expect("a best step").1;
        path.push(cell);
    }
    path.into_iter().map(|cell| u32::try_from(cell).expect("small")).collect()
}
