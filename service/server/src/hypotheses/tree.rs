//! One tree of maps, grown visit by visit with what people said in between.

use meetpoint_places::{Hypothesis, MapTree, MapTreeParams, Sighting, Step};
use meetpoint_storage::SessionId;

use super::assertion::{Assertion, hypothesis_id};
use super::travelled::Visit;

/// All maps that fit the visits so far, under some assumptions.
#[derive(Debug)]
pub(crate) struct Tree {
    maps: MapTree,
    /// What was said, in the order of the visits that it is of, and whether a map was there of
    /// which it was said.
    assertions: Vec<(Assertion, bool)>,
}

impl Tree {
    /// Of the first visit, of which nobody has said anything yet.
    pub(crate) fn new(params: MapTreeParams, first: &Visit) -> Self {
        Self { maps: MapTree::new(params, first.seen.clone()), assertions: Vec::new() }
    }

    /// The maps.
    pub(crate) fn maps(&self) -> &MapTree {
        &self.maps
    }

    /// Visits that are in it.
    pub(crate) fn n_visits(&self) -> usize {
        self.maps.travel().steps.len() + 1
    }

    /// What was said of it, and whether it rests on that.
    pub(crate) fn assertions(&self) -> &[(Assertion, bool)] {
        &self.assertions
    }

    /// Whether it grows on by these assertions; otherwise it has to grow again from the first visit.
    pub(crate) fn can_grow_by(&self, assertions: &[Assertion]) -> bool {
        let n_known = self.assertions.len();
        let is_same = |(known, new): (&(Assertion, bool), &Assertion)| known.0 == *new;
        n_known <= assertions.len()
            && self.assertions.iter().zip(assertions).all(is_same)
            && assertions[n_known..].iter().all(|new| self.n_visits() <= new.sightings.len())
    }

    /// Takes in what it does not have yet of all visits of the travel, and of all that was said in the
    /// order of the visits that it is of.
    pub(crate) fn grow(&mut self, visits: &[Visit], assertions: &[Assertion]) {
        let mut pending = assertions.iter().skip(self.assertions.len()).peekable();
        loop {
            let n_visits = self.n_visits();
            while let Some(said) = pending.next_if(|said| said.sightings.len() <= n_visits) {
                self.assert(said);
            }
            let Some(visit) = visits.get(n_visits) else { break };
            let step = Step { turn: visit.turn, seen: visit.seen.clone() };
            if self.maps.extend(step).is_err() {
                debug_assert!(false, "turns are looked at when visits are read");
                break;
            }
        }
    }

    fn assert(&mut self, said: &Assertion) {
        let says_so = |map: &&Hypothesis| self.told(map) == said.sightings;
        let meant = self.maps.hypotheses().iter().find(says_so).map(|map| map.id);
        let is_in_force = meant.is_some_and(|id| self.maps.assert_hypothesis(id).is_ok());
        self.assertions.push((said.clone(), is_in_force));
    }

    /// What one of the maps says of every visit.
    pub(crate) fn told(&self, map: &Hypothesis) -> Vec<Sighting> {
        map.sightings(self.maps.travel()).unwrap_or_default()
    }

    /// The map of that id: its rank from 0, and itself; the first if the id is empty.
    pub(crate) fn find(&self, session: SessionId, id: &str) -> Option<(usize, &Hypothesis)> {
        let is_meant =
            |map: &Hypothesis| id.is_empty() || hypothesis_id(session, &self.told(map)) == id;
        self.maps.hypotheses().iter().enumerate().find(|(_, map)| is_meant(map))
    }
}
