//! Parts and the portals between them: what plans over parts are made in.
//!
//! A portal is steps between two parts. By [`Grouping::Pairs`] all steps between the same two parts
//! are one. By [`Grouping::Openings`] two steps belong together if the robot can go from the one to
//! the other beside the line, one cell along on both sides: two doors between the same two rooms are
//! two portals, and so are the two gaps beside a table that stands on a critical line. Time O(cells
//! + steps · log steps), space O(steps).

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::parts::{PartIndex, Parts};
use crate::space::Space;

/// Which steps between two parts are one portal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grouping {
    /// All of them.
    Pairs,
    /// Those that lie side by side.
    Openings,
}

/// A portal gone through in one of its two directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Transit(u32);

impl Transit {
    /// The same portal in the other direction.
    pub fn back(self) -> Self {
        Self(self.0 ^ 1)
    }

    pub(crate) fn place(self) -> usize {
        self.0 as usize
    }
}

/// Parts of a space and the portals between them.
#[derive(Clone, Debug)]
pub struct PartGraph {
    space: Arc<Space>,
    parts: Arc<Parts>,
    portals: Vec<Portal>,
    /// Sorted steps from the part with the smaller index, and the portal of each.
    of_step: Vec<(Step, u32)>,
    /// Ways out of every part, ascending.
    exits: Vec<Vec<Transit>>,
}

/// A cell and the number of the step that leaves it.
type Step = (u32, u8);

#[derive(Clone, Debug, PartialEq)]
struct Portal {
    /// The smaller index first.
    parts: [PartIndex; 2],
    /// From the first of them, ascending.
    steps: Vec<Step>,
}

impl PartGraph {
    /// Of `parts` in `space`. `is_open` tells of a cell and the step that leaves it for another part
    /// whether it may be taken, and has to say the same of both directions.
    pub fn new(
        space: Arc<Space>,
        parts: Arc<Parts>,
        grouping: Grouping,
        is_open: impl Fn(usize, usize) -> bool,
    ) -> Self {
        let steps = steps_between(&space, &parts, is_open);
        let group = match grouping {
            Grouping::Pairs => by_pair(&steps),
            Grouping::Openings => by_opening(&space, &parts, &steps),
        };
        let exits = vec![vec![]; parts.n_parts()];
        let mut found = Self { space, parts, portals: vec![], of_step: vec![], exits };
        let mut name = BTreeMap::new();
        for (&(step, sides), group) in steps.iter().zip(group) {
            let portal = *name.entry(group).or_insert_with(|| found.open(sides));
            found.portals[portal as usize].steps.push(step);
            found.of_step.push((step, portal));
        }
        found
    }

    #[expect(clippy::cast_possible_truncation, reason = "fewer portals than cells")]
    fn open(&mut self, parts: [PartIndex; 2]) -> u32 {
        let portal = self.portals.len() as u32;
        self.portals.push(Portal { parts, steps: vec![] });
        for (part, transit) in parts.into_iter().zip([2 * portal, 2 * portal + 1]) {
            self.exits[part.place()].push(Transit(transit));
        }
        portal
    }

    /// Where the robot can go.
    pub fn space(&self) -> &Arc<Space> {
        &self.space
    }

    /// The nodes.
    pub fn parts(&self) -> &Arc<Parts> {
        &self.parts
    }

    /// Number of portals: of pairs of neighbours, by [`Grouping::Pairs`].
    pub fn n_portals(&self) -> usize {
        self.portals.len()
    }

    /// All portals in both directions.
    pub(crate) fn transits(&self) -> impl Iterator<Item = Transit> + use<> {
        let n_transits = u32::try_from(2 * self.portals.len()).unwrap_or(u32::MAX);
        (0..n_transits).map(Transit)
    }

    /// Ways out of a part.
    ///
    /// # Panics
    /// If there is no such part.
    pub fn exits(&self, part: PartIndex) -> &[Transit] {
        &self.exits[part.place()]
    }

    /// Ways on from a transit: out of the part that it enters, but by the same portal.
    pub(crate) fn onward(&self, transit: Transit) -> impl Iterator<Item = Transit> + '_ {
        let exits = self.exits(self.to(transit)).iter().copied();
        exits.filter(move |&exit| exit != transit.back())
    }

    /// The part that a transit leaves.
    ///
    /// # Panics
    /// If the transit is one of another graph.
    pub fn from(&self, transit: Transit) -> PartIndex {
        self.portals[transit.place() / 2].parts[transit.place() % 2]
    }

    /// The part that a transit enters.
    ///
    /// # Panics
    /// If the transit is one of another graph.
    pub fn to(&self, transit: Transit) -> PartIndex {
        self.from(transit.back())
    }

    /// The transit that a step between two parts belongs to; `None` if it stays within one.
    pub fn transit(&self, cell: usize, step: usize) -> Option<Transit> {
        if let Some(portal) = self.portal(as_step(cell, step)) {
            return Some(Transit(2 * portal));
        }
        let back = as_step(self.space.neighbor(cell, step), (step + 4) % 8);
        Some(Transit(2 * self.portal(back)? + 1))
    }

    fn portal(&self, step: Step) -> Option<u32> {
        let at = self.of_step.binary_search_by_key(&step, |&(step, _)| step).ok()?;
        Some(self.of_step[at].1)
    }

    /// The transits of a path of neighbouring cells. What goes through a portal and next comes back
    /// through the same is left out: the path kept to a line, or strayed across it.
    pub fn transits_of(&self, path: &[u32]) -> Vec<Transit> {
        let mut transits: Vec<Transit> = vec![];
        for pair in path.windows(2) {
            let [from, to] = [pair[0], pair[1]].map(|cell| cell as usize);
            if self.parts.at(from) == self.parts.at(to) {
                continue;
            }
            let taken = self.space.steps(from).find(|&(_, cell)| cell == to);
            let Some(transit) = taken.and_then(|(step, _)| self.transit(from, step)) else {
                continue;
            };
            if transits.last() == Some(&transit.back()) {
                transits.pop();
            } else {
                transits.push(transit);
            }
        }
        transits
    }

    /// The steps of a transit: cell, step, and the cell that it leads to.
    pub(crate) fn steps(
        &self,
        transit: Transit,
    ) -> impl Iterator<Item = (usize, usize, usize)> + '_ {
        let is_forth = transit.place().is_multiple_of(2);
        self.portals[transit.place() / 2].steps.iter().map(move |&(cell, step)| {
            let (cell, step) = (cell as usize, usize::from(step));
            let to = self.space.neighbor(cell, step);
            if is_forth { (cell, step, to) } else { (to, (step + 4) % 8, cell) }
        })
    }

    /// For every transit the one of `old` with the same steps at the same costs, out of a part that
    /// is unchanged; `None` if there is none.
    pub(crate) fn unchanged(&self, old: &Self) -> Vec<Option<Transit>> {
        let parts = self.parts.unchanged(&self.space, &old.parts, &old.space);
        let old_of = |transit: Transit| {
            let part = parts[self.from(transit).place()]?;
            let (cell, step, _) = self.steps(transit).next()?;
            let before = old.transit(cell, step).filter(|&before| old.from(before) == part)?;
            let is_same = self.steps(transit).eq(old.steps(before));
            let cost_is_same = |(cell, step, _): (usize, usize, usize)| {
                self.space.step_cost(cell, step) == old.space.step_cost(cell, step)
            };
            (is_same && self.steps(transit).all(cost_is_same)).then_some(before)
        };
        self.transits().map(old_of).collect()
    }
}

#[expect(clippy::cast_possible_truncation, reason = "eight steps; parts count cells in 32 bits")]
fn as_step(cell: usize, step: usize) -> Step {
    (cell as u32, step as u8)
}

/// All open steps to a part of greater index, ascending, with the two parts.
fn steps_between(
    space: &Space,
    parts: &Parts,
    is_open: impl Fn(usize, usize) -> bool,
) -> Vec<(Step, [PartIndex; 2])> {
    let mut steps = vec![];
    for cell in 0..space.info().n_cells() {
        let Some(part) = parts.at(cell) else { continue };
        for (step, to) in space.steps(cell) {
            if let Some(other) = parts.at(to).filter(|&other| part < other)
                && is_open(cell, step)
            {
                steps.push((as_step(cell, step), [part, other]));
            }
        }
    }
    steps
}

/// For every step the place of the first one between the same two parts.
fn by_pair(steps: &[(Step, [PartIndex; 2])]) -> Vec<usize> {
    let mut first = BTreeMap::new();
    let of_step = |(at, &(_, pair))| *first.entry(pair).or_insert(at);
    steps.iter().enumerate().map(of_step).collect()
}

/// For every step the place of the first one of its opening.
fn by_opening(space: &Space, parts: &Parts, steps: &[(Step, [PartIndex; 2])]) -> Vec<usize> {
    let near = |cell: usize| {
        let part = parts.at(cell);
        let beside = space.steps(cell).map(|(_, to)| to);
        std::iter::once(cell).chain(beside.filter(move |&to| parts.at(to) == part))
    };
    let mut group: Vec<usize> = (0..steps.len()).collect();
    for (at, &((cell, step), _)) in steps.iter().enumerate() {
        let (cell, step) = (cell as usize, usize::from(step));
        let ends: Vec<usize> = near(space.neighbor(cell, step)).collect();
        for other in near(cell) {
            for (step, _) in space.steps(other).filter(|(_, to)| ends.contains(to)) {
                let name = as_step(other, step);
                if let Ok(place) = steps.binary_search_by_key(&name, |&(step, _)| step) {
                    let [a, b] = [at, place].map(|at| root(&mut group, at));
                    group[a.max(b)] = a.min(b);
                }
            }
        }
    }
    (0..steps.len()).map(|at| root(&mut group, at)).collect()
}

fn root(group: &mut [usize], mut at: usize) -> usize {
    while group[at] != at {
        group[at] = group[group[at]];
        at = group[at];
    }
    at
}
