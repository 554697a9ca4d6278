//! The tree of all maps that fit a travel.
//!
//! Its leaves are pairs of a map and where the robot is in it. Each travel takes every leaf on
//! (B. Kuipers et al., ICRA 2004, Fig. 4):
//!
//! 1. If the map knows where the gateway leads, the robot is there now, and the leaf stays if
//!    what it sees is what the map says; otherwise it is refuted.
//! 2. If not, the robot may be at every gateway that leads nowhere yet and from which its place
//!    looks as seen, or at a new place: a leaf for each that the axioms allow
//!    ([`Assumptions`] has them written out).
//!
//! Leaves are kept in the order of simplicity: fewest places, then fewest paths, then oldest. The
//! paper orders by prioritised circumscription and does not print the policy; this is ours.
//!
//! **What is guaranteed.** Every step keeps the leaf that says what happened, as long as the
//! assumptions hold, so that the true map, as far as it was travelled, is among the leaves;
//! unless [`MapTree::is_truncated`], where leaves were given up because there were too many.
//!
//! Time and space O(leaves × gateways) a step; leaves grow exponentially where places look alike.

use crate::assumptions::Assumptions;
use crate::difference::{Sighting, sightings};
use crate::observation::Observation;
use crate::place_map::{Gateway, Place, PlaceId, PlaceMap};
use crate::travel::{Step, Travel};

/// The name of a leaf of one tree, never given to another map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct HypothesisId(pub u64);

/// A map that fits the travel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Hypothesis {
    /// Its name in this tree. What a hypothesis becomes by a step has its name; where it becomes
    /// several, only the first of them has.
    pub id: HypothesisId,
    /// The map. Its place 0 is where the travel began.
    pub map: PlaceMap,
    /// Where the robot came in last.
    pub at: Gateway,
}

impl Hypothesis {
    /// What this map says of every visit of the travel it fits; `None` if of another travel.
    pub fn sightings(&self, travel: &Travel) -> Option<Vec<Sighting>> {
        sightings(&self.map, Gateway { place: PlaceId(0), index: 0 }, travel.turns())
    }

    /// What is least in the simplest map.
    fn complexity(&self) -> (usize, usize) {
        (self.map.n_places(), self.map.n_paths())
    }
}

/// Tunables of a [`MapTree`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MapTreeParams {
    /// What is taken for granted about the building.
    pub assumptions: Assumptions,
    /// Leaves kept, at most; the simplest ones. At least 1. While a step is taken there are up to
    /// twice as many, and what one leaf becomes.
    pub n_hypotheses_max: usize,
}

/// What a tree was asked for and cannot do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refused {
    /// The place where the robot is has not that many gateways.
    #[error("gateway {turn} of {n_gateways}")]
    Turn {
        /// Which was asked for.
        turn: u8,
        /// How many there are.
        n_gateways: u8,
    },
    /// No leaf has that name, or not any more.
    #[error("no map hypothesis {}", .0.0)]
    NoSuchHypothesis(HypothesisId),
}

/// All maps that fit a travel.
#[derive(Clone, Debug)]
pub struct MapTree {
    params: MapTreeParams,
    travel: Travel,
    /// Simplest first.
    leaves: Vec<Hypothesis>,
    next_id: u64,
    n_given_up: u64,
    n_ruled_out: u64,
}

impl MapTree {
    /// The tree of a robot that has not travelled yet.
    pub fn new(params: MapTreeParams, first: Observation) -> Self {
        let mut map = PlaceMap::default();
        let at = Gateway { place: map.add_place(&first), index: 0 };
        let leaves = vec![Hypothesis { id: HypothesisId(0), map, at }];
        let travel = Travel { first, steps: Vec::new() };
        Self { params, travel, leaves, next_id: 1, n_given_up: 0, n_ruled_out: 0 }
    }

    /// The tree of a whole travel.
    ///
    /// # Errors
    /// [`Refused::Turn`] if a step leaves by a gateway that its place does not have.
    pub fn of_travel(params: MapTreeParams, travel: &Travel) -> Result<Self, Refused> {
        let mut tree = Self::new(params, travel.first.clone());
        for step in &travel.steps {
            tree.extend(step.clone())?;
        }
        Ok(tree)
    }

    /// Takes a step of the travel in.
    ///
    /// # Errors
    /// [`Refused::Turn`] if the place where the robot is has no such gateway; the tree is as it
    /// was.
    pub fn extend(&mut self, step: Step) -> Result<(), Refused> {
        let n_gateways = self.here().star.n_gateways();
        if n_gateways <= step.turn {
            return Err(Refused::Turn { turn: step.turn, n_gateways });
        }
        let mut after = Vec::with_capacity(self.leaves.len());
        for leaf in std::mem::take(&mut self.leaves) {
            self.successors(leaf, &step, &mut after);
            if self.params.n_hypotheses_max.saturating_mul(2) <= after.len() {
                self.give_up(&mut after);
            }
        }
        self.give_up(&mut after);
        self.leaves = after;
        self.travel.steps.push(step);
        Ok(())
    }

    /// All hypotheses, the simplest first. None if what was assumed does not hold, or what was
    /// seen or asserted is wrong.
    pub fn hypotheses(&self) -> &[Hypothesis] {
        &self.leaves
    }

    /// The minimal models: those of the least places and, among these, paths.
    pub fn minimal(&self) -> &[Hypothesis] {
        let least = self.leaves.first().map(Hypothesis::complexity);
        let is_least = |leaf: &Hypothesis| Some(leaf.complexity()) == least;
        &self.leaves[..self.leaves.partition_point(is_least)]
    }

    /// The hypothesis of that name, if it still fits.
    pub fn hypothesis(&self, id: HypothesisId) -> Option<&Hypothesis> {
        self.leaves.iter().find(|leaf| leaf.id == id)
    }

    /// What was travelled.
    pub fn travel(&self) -> &Travel {
        &self.travel
    }

    /// Whether hypotheses were given up for want of memory, so that the true map may be missing.
    pub fn is_truncated(&self) -> bool {
        0 < self.n_given_up
    }

    /// Hypotheses that were given up for want of memory, each with all it would have become.
    pub fn n_given_up(&self) -> u64 {
        self.n_given_up
    }

    /// Hypotheses that fitted and were ruled out by somebody who asserted another.
    pub fn n_ruled_out(&self) -> u64 {
        self.n_ruled_out
    }

    /// Memory that the leaves take, in bytes: what they share, and the travel, is little beside.
    pub fn n_bytes(&self) -> usize {
        let leaf = |leaf: &Hypothesis| leaf.map.n_bytes() + size_of::<Hypothesis>();
        self.leaves.iter().map(leaf).sum()
    }

    /// Somebody says that this hypothesis is true: all others are ruled out. What it becomes by
    /// further travels is told apart as before.
    ///
    /// # Errors
    /// [`Refused::NoSuchHypothesis`] if there is none of that name.
    pub fn assert_hypothesis(&mut self, id: HypothesisId) -> Result<(), Refused> {
        if self.hypothesis(id).is_none() {
            return Err(Refused::NoSuchHypothesis(id));
        }
        self.n_ruled_out += self.leaves.len() as u64 - 1;
        self.leaves.retain(|leaf| leaf.id == id);
        Ok(())
    }

    /// Leaves those out against which something else speaks than what was seen; says how many.
    pub fn leave_out(&mut self, speaks_against: impl Fn(&Hypothesis) -> bool) -> usize {
        let n_before = self.leaves.len();
        self.leaves.retain(|leaf| !speaks_against(leaf));
        n_before - self.leaves.len()
    }

    /// What was seen last.
    fn here(&self) -> &Observation {
        self.travel.steps.last().map_or(&self.travel.first, |step| &step.seen)
    }

    /// What a leaf becomes.
    fn successors(&mut self, leaf: Hypothesis, step: &Step, into: &mut Vec<Hypothesis>) {
        let Hypothesis { id, mut map, at } = leaf;
        let left = map.turned(at, step.turn);
        if let Some(at) = map.leads_to(left) {
            if map.may_look(at, &step.seen) && may_be_at(&map, Some(at.place), &step.seen) {
                map.learn_view(at.place, &step.seen);
                into.push(Hypothesis { id, map, at });
            }
            return;
        }
        let mut id = Some(id);
        let mut next_id = || {
            id.take().unwrap_or_else(|| {
                self.next_id += 1;
                HypothesisId(self.next_id - 1)
            })
        };
        for gateway in map.gateways() {
            let is_possible = map.leads_to(gateway).is_none()
                && map.may_look(gateway, &step.seen)
                && may_be_at(&map, Some(gateway.place), &step.seen)
                && self.params.assumptions.allow(&map, left, gateway);
            if is_possible {
                let mut map = map.clone();
                map.link(left, gateway);
                map.learn_view(gateway.place, &step.seen);
                into.push(Hypothesis { id: next_id(), map, at: gateway });
            }
        }
        if may_be_at(&map, None, &step.seen) {
            let at = Gateway { place: map.add_place(&step.seen), index: 0 };
            map.link(left, at);
            into.push(Hypothesis { id: next_id(), map, at });
        }
    }

    /// Sorts, and keeps no more than there is room for.
    fn give_up(&mut self, leaves: &mut Vec<Hypothesis>) {
        leaves.sort_by_key(|leaf| (leaf.complexity(), leaf.id));
        let n_kept = leaves.len().min(self.params.n_hypotheses_max.max(1));
        self.n_given_up += (leaves.len() - n_kept) as u64;
        leaves.truncate(n_kept);
    }
}

/// Whether a robot that sees `seen` may be at `place`, or at a new one, as far as unique views
/// tell (axiom 5).
fn may_be_at(map: &PlaceMap, place: Option<PlaceId>, seen: &Observation) -> bool {
    let Some(view) = seen.view.as_ref() else { return true };
    // Said once is said of all who have the name.
    let has_it = |known: &Place| {
        known
            .view
            .as_ref()
            .is_some_and(|known| known.name == view.name && (known.is_unique || view.is_unique))
    };
    map.places().all(|(id, known)| Some(id) == place || !has_it(known))
}
