//! The step to take from every cell of a part.

use crate::cost::{Cost, UNREACHABLE};
use crate::part_graph::{PartGraph, Transit};
use crate::parts::PartIndex;
use crate::wave::{Ground, Wave};

/// Steps by the cells of a part, two in a byte.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Motions(Vec<u8>);

/// Four bits of a cell that leads nowhere.
const NOWHERE: u8 = 8;

impl Motions {
    /// The step from a cell, by its place in the part.
    pub(crate) fn step(&self, slot: u32) -> Option<usize> {
        let slot = slot as usize;
        let step = self.0[slot / 2] >> (4 * (slot % 2)) & 15;
        (step < NOWHERE).then_some(usize::from(step))
    }

    fn set(&mut self, slot: u32, step: usize) {
        let (byte, shift) = (&mut self.0[slot as usize / 2], 4 * (slot % 2));
        let step = u8::try_from(step).unwrap_or(NOWHERE);
        *byte = *byte & !(15 << shift) | step << shift;
    }

    pub(crate) fn n_bytes(&self) -> usize {
        self.0.len()
    }
}

/// One part, made ready for waves.
pub(crate) struct Field<'a> {
    graph: &'a PartGraph,
    part: PartIndex,
    ground: Ground,
    wave: Wave,
}

impl<'a> Field<'a> {
    pub(crate) fn new(graph: &'a PartGraph, part: PartIndex) -> Self {
        let parts = graph.parts();
        let slot = |cell: usize| parts.slot(part, cell);
        let ground = Ground::new(graph.space(), parts.cells(part), slot);
        Self { graph, part, ground, wave: Wave::default() }
    }

    /// Costs by slot from `cell`.
    pub(crate) fn around(&mut self, cell: usize) -> Vec<Cost> {
        let seeds: Vec<(u32, Cost)> =
            self.graph.parts().slot(self.part, cell).map(|slot| (slot, 0)).into_iter().collect();
        self.run(&seeds)
    }

    /// Costs by slot of going out by `transit`, which leaves this part, where `beyond` is what is
    /// left then to pay at a cell.
    pub(crate) fn towards(
        &mut self,
        transit: Transit,
        beyond: impl Fn(usize) -> Cost,
    ) -> Vec<Cost> {
        let (graph, part) = (self.graph, self.part);
        let seed = |(cell, step, to): (usize, usize, usize)| {
            let cost = beyond(to).saturating_add(graph.space().step_cost(cell, step));
            let slot = graph.parts().slot(part, cell)?;
            (cost < UNREACHABLE).then_some((slot, cost))
        };
        let mut seeds: Vec<(u32, Cost)> = graph.steps(transit).filter_map(seed).collect();
        // The wave begins at the cheapest: as many buckets as the seeds differ by are enough.
        let least = seeds.iter().map(|&(_, cost)| cost).min().unwrap_or(0);
        for (_, cost) in &mut seeds {
            *cost -= least;
        }
        let mut costs = self.run(&seeds);
        for cost in costs.iter_mut().filter(|cost| **cost < UNREACHABLE) {
            *cost = (*cost + least).min(UNREACHABLE);
        }
        costs
    }

    fn run(&mut self, seeds: &[(u32, Cost)]) -> Vec<Cost> {
        let mut costs = vec![UNREACHABLE; self.ground.n_cells()];
        self.wave.run(&self.ground, seeds, &mut costs);
        costs
    }

    /// Steps along `costs`, which [`Self::towards`] made of the same arguments. A step out is
    /// preferred to one that stays: beyond, more is known of what follows.
    pub(crate) fn motions(
        &self,
        costs: &[Cost],
        transit: Transit,
        beyond: impl Fn(usize) -> Cost,
    ) -> Motions {
        let (space, parts) = (self.graph.space(), self.graph.parts());
        let mut motions = Motions(vec![NOWHERE * 17; costs.len().div_ceil(2)]);
        for (&cell, slot) in parts.cells(self.part).iter().zip(0..) {
            let (cell, cost) = (cell as usize, costs[slot as usize]);
            let is_best = |&(step, to): &(usize, usize)| {
                let next = parts.slot(self.part, to).map_or(UNREACHABLE, |to| costs[to as usize]);
                next < UNREACHABLE && next + space.step_cost(cell, step) == cost
            };
            if let Some((step, _)) = space.steps(cell).find(is_best) {
                motions.set(slot, step);
            }
        }
        for (cell, step, to) in self.graph.steps(transit) {
            let cost = beyond(to).saturating_add(space.step_cost(cell, step));
            if let Some(slot) = parts.slot(self.part, cell)
                && cost < UNREACHABLE
                && cost == costs[slot as usize]
            {
                motions.set(slot, step);
            }
        }
        motions
    }
}
