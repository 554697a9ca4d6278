//! One tree of maps, grown visit by visit with what people said in between.

use meetpoint_places::{
    ConsistentFrame, FrameParams, Hypothesis, MapTree, MapTreeParams, Sighting, Step, TravelRecord,
    consistent_frame,
};
use meetpoint_storage::SessionId;

use super::assertion::{Assertion, hypothesis_id};
use super::travelled::Visit;
use crate::error::Error;

/// Visits times places squared, summed over maps, up to which their frames are computed for one answer:
/// the time of a step of all frames grows with it, and the answer keeps others of its kind waiting. Enough
/// for thirty places, 300 visits and all 300 maps that are kept; or for one map of 200 places and 2000 visits.
const FRAME_WORK_MAX: u64 = 100_000_000;

/// All maps that fit the visits so far, under some assumptions.
#[derive(Clone, Debug)]
pub(crate) struct Tree {
    maps: MapTree,
    /// What was said, in the order of the visits that it is of, and whether a map was there of
    /// which it was said.
    assertions: Vec<(Assertion, bool)>,
    /// Maps that odometry spoke against and that are left out.
    n_contradicted: u64,
    /// Whether it was to be asked and is not known.
    is_unmeasured: bool,
}

impl Tree {
    /// Of the first visit, of which nobody has said anything yet.
    pub(crate) fn new(params: MapTreeParams, first: &Visit) -> Self {
        let maps = MapTree::new(params, first.seen.clone());
        Self { maps, assertions: Vec::new(), n_contradicted: 0, is_unmeasured: false }
    }

    /// The maps.
    pub(crate) fn maps(&self) -> &MapTree {
        &self.maps
    }

    /// The same without the maps that odometry speaks against.
    ///
    /// # Errors
    /// [`Error::TravelTooLarge`] if a frame for each map were too much work.
    pub(crate) fn metrical(&self, records: &[TravelRecord]) -> Result<Self, Error> {
        let mut tree = self.clone();
        tree.is_unmeasured = !self.is_measured(records);
        if !tree.is_unmeasured {
            self.check_work(self.maps.hypotheses())?;
            let travel = self.maps.travel();
            let speaks_against = |map: &Hypothesis| {
                let frame = consistent_frame(map, travel, records, &FrameParams::WHEELS);
                frame.is_some_and(|frame| frame.is_contradicted())
            };
            tree.n_contradicted = tree.maps.leave_out(speaks_against) as u64;
        }
        Ok(tree)
    }

    /// Where the places of one of its maps lie by odometry.
    ///
    /// # Errors
    /// [`Error::TravelNotMeasured`] if visits are without, [`Error::TravelTooLarge`] if it were too much
    /// work.
    pub(crate) fn frame(
        &self,
        map: &Hypothesis,
        records: &[TravelRecord],
    ) -> Result<ConsistentFrame, Error> {
        if !self.is_measured(records) {
            return Err(Error::TravelNotMeasured);
        }
        self.check_work(std::slice::from_ref(map))?;
        let frame = consistent_frame(map, self.maps.travel(), records, &FrameParams::WHEELS);
        frame.ok_or_else(|| Error::internal("a map that does not fit its own travel"))
    }

    /// Whether every visit but the first has odometry.
    fn is_measured(&self, records: &[TravelRecord]) -> bool {
        let steps = records.get(..self.maps.travel().steps.len());
        steps.is_some_and(|steps| steps.iter().all(|record| record.moved.is_some()))
    }

    fn check_work(&self, maps: &[Hypothesis]) -> Result<(), Error> {
        let n_visits = self.n_visits() as u64;
        let of_map = |map: &Hypothesis| n_visits * (map.map.n_places() as u64).pow(2);
        let work = maps.iter().map(of_map).sum();
        if FRAME_WORK_MAX < work {
            return Err(Error::TravelTooLarge { work, limit_work: FRAME_WORK_MAX });
        }
        Ok(())
    }

    /// Maps that odometry spoke against and that are left out.
    pub(crate) fn n_contradicted(&self) -> u64 {
        self.n_contradicted
    }

    /// Whether odometry was to be asked and visits are without.
    pub(crate) fn is_unmeasured(&self) -> bool {
        self.is_unmeasured
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
