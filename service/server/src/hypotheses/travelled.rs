//! What the journal says of one session's travel: its visits, what people said of its maps, and the
//! trees of maps that fit.

use std::collections::BTreeMap;

use meetpoint_places::{Assumptions, MapTreeParams, Observation, Step, Travel, TravelRecord};
use meetpoint_proto::v1;
use meetpoint_storage::{BatchPayload, SessionId};
use prost::Message;
use v1::observation::Kind;

use super::assertion::{Assertion, hypothesis_id, visits_of_id};
use super::tree::Tree;
use crate::convert::place_visit;
use crate::error::Error;
use crate::settings::HypothesisSettings;

/// A visit to a place, as it was told.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Visit {
    /// 0 for the first.
    pub(crate) number: u32,
    /// How the place before was left.
    pub(crate) turn: u8,
    /// What was seen.
    pub(crate) seen: Observation,
    /// What was measured on the way there.
    pub(crate) record: TravelRecord,
}

/// Where in the journal a visit is, and when it was by the robot's clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Moment {
    /// Number of the batch.
    pub(crate) batch: u64,
    pub(crate) stamp_ns: i64,
}

/// A session's travel as far as it was read.
pub(crate) struct Travelled {
    session: SessionId,
    limits: HypothesisSettings,
    /// Batches up to this number are in.
    read_through: u64,
    visits: Vec<Visit>,
    /// One a visit.
    moments: Vec<Moment>,
    /// Whether the visits are those that an exploration made of firings.
    is_by_steps: bool,
    n_left_out: u32,
    left_out_reason: String,
    /// In the order of the visits that they are of.
    assertions: Vec<Assertion>,
    /// By [`key`].
    trees: BTreeMap<(bool, bool), Tree>,
}

impl Travelled {
    /// Nothing yet.
    pub(crate) fn new(session: SessionId, limits: &HypothesisSettings) -> Self {
        Self {
            session,
            limits: limits.clone(),
            read_through: 0,
            visits: Vec::new(),
            moments: Vec::new(),
            is_by_steps: false,
            n_left_out: 0,
            left_out_reason: String::new(),
            assertions: Vec::new(),
            trees: BTreeMap::new(),
        }
    }

    /// Whose travel it is.
    pub(crate) fn session(&self) -> SessionId {
        self.session
    }

    /// Batches up to this number are in.
    pub(crate) fn read_through(&self) -> u64 {
        self.read_through
    }

    /// Visits that were told of and are not in it, and why the last of them is not.
    pub(crate) fn left_out(&self) -> (u32, &str) {
        (self.n_left_out, &self.left_out_reason)
    }

    /// What was measured on each travel.
    pub(crate) fn records(&self) -> Vec<TravelRecord> {
        self.visits.iter().skip(1).map(|visit| visit.record).collect()
    }

    /// Where and when each visit was.
    pub(crate) fn moments(&self) -> &[Moment] {
        &self.moments
    }

    /// Whether the visits are those that an exploration made of firings.
    pub(crate) fn is_by_steps(&self) -> bool {
        self.is_by_steps
    }

    /// Whether the session itself told of any visit.
    pub(crate) fn is_told(&self) -> bool {
        !self.is_by_steps && (!self.visits.is_empty() || 0 < self.n_left_out)
    }

    /// All visits as a travel; `None` if there are none.
    pub(crate) fn travel(&self) -> Option<Travel> {
        let (first, others) = self.visits.split_first()?;
        let step = |visit: &Visit| Step { turn: visit.turn, seen: visit.seen.clone() };
        Some(Travel { first: first.seen.clone(), steps: others.iter().map(step).collect() })
    }

    /// Puts the arrivals of an exploration in place of those known so far; trees grow on if these were the first
    /// of them.
    pub(crate) fn follow(&mut self, arrivals: Vec<(Visit, Moment)>) {
        let limit = self.limits.n_visits_max;
        let n_left_out = arrivals.len().saturating_sub(limit);
        let (visits, moments): (Vec<Visit>, Vec<Moment>) = arrivals.into_iter().take(limit).unzip();
        if !visits.starts_with(&self.visits) {
            self.trees.clear();
        }
        (self.visits, self.moments, self.is_by_steps) = (visits, moments, true);
        self.n_left_out = u32::try_from(n_left_out).unwrap_or(u32::MAX);
        self.left_out_reason = match n_left_out {
            0 => String::new(),
            _ => too_long(limit),
        };
    }

    /// Takes the visits of the next batch in.
    ///
    /// # Errors
    /// [`Error::Internal`] if the journal holds what ingest never lets through.
    pub(crate) fn read(&mut self, batch: &BatchPayload) -> Result<(), Error> {
        let BatchPayload { number, payload, rejected } = batch;
        let v1::Batch { number: _, observations } =
            v1::Batch::decode(payload.as_slice()).map_err(Error::internal)?;
        let told = (0_u32..).zip(observations).filter(|(index, _)| !rejected.contains(index));
        let visits = told.filter_map(|(_, observation)| match observation.kind {
            Some(Kind::PlaceVisit(wire)) => {
                let moment = Moment { batch: *number, stamp_ns: observation.stamp_ns };
                Some(place_visit::visit(&wire).map(|visit| (visit, moment)))
            }
            _ => None,
        });
        // All of the batch or nothing.
        let visits: Result<Vec<(Visit, Moment)>, _> = visits.collect();
        let visits = visits.map_err(|(_, detail)| Error::internal(detail))?;
        if self.is_by_steps && !visits.is_empty() {
            // What the robot tells counts, now that it does.
            let read_through = self.read_through;
            *self = Self { read_through, ..Self::new(self.session, &self.limits.clone()) };
        }
        for (visit, moment) in visits {
            match self.objection(&visit) {
                None => {
                    self.visits.push(visit);
                    self.moments.push(moment);
                }
                Some(reason) => {
                    self.n_left_out += 1;
                    self.left_out_reason = reason;
                }
            }
        }
        self.read_through = *number;
        Ok(())
    }

    /// Why a visit is not the next of the travel.
    fn objection(&self, visit: &Visit) -> Option<String> {
        let (n_visits, limit) = (self.visits.len(), self.limits.n_visits_max);
        if limit <= n_visits {
            return Some(too_long(limit));
        }
        let Visit { number, turn, .. } = visit;
        if usize::try_from(*number).ok() != Some(n_visits) {
            return Some(format!("visit {number}, where {n_visits} was the next"));
        }
        let n_gateways = self.visits.last()?.seen.star.n_gateways();
        (n_gateways <= *turn).then(|| {
            format!("visit {number} by gateway {turn} of a place that has {n_gateways}, from 0")
        })
    }

    /// Puts what people said in place of what was known of it, in any order.
    pub(crate) fn set_assertions(&mut self, mut assertions: Vec<Assertion>) {
        assertions.sort_by_key(|said| said.sightings.len());
        self.assertions = assertions;
    }

    /// Brings the tree of these assumptions up to all visits and all that was said.
    pub(crate) fn grow(&mut self, assumptions: Assumptions) {
        let params = self.params(assumptions);
        let Some(first) = self.visits.first() else { return };
        let tree = self.trees.entry(key(assumptions)).or_insert_with(|| Tree::new(params, first));
        if !tree.can_grow_by(&self.assertions) {
            *tree = Tree::new(params, first);
        }
        tree.grow(&self.visits, &self.assertions);
    }

    /// The tree of these assumptions as it was grown last; `None` if there was no visit to grow from.
    pub(crate) fn tree(&self, assumptions: Assumptions) -> Option<&Tree> {
        self.trees.get(&key(assumptions))
    }

    /// What is to be recorded if somebody says that the map of this id is true (the first if it is
    /// empty), but for who and why; `None` if that was said.
    ///
    /// # Errors
    /// [`Error::NoSuchHypothesis`] if it is none of this travel, or does not fit any more.
    pub(crate) fn assertion(
        &self,
        assumptions: Assumptions,
        id: &str,
    ) -> Result<Option<Assertion>, Error> {
        if self.assertions.iter().any(|said| said.hypothesis == id) {
            return Ok(None);
        }
        let missing = || Error::NoSuchHypothesis(id.chars().take(64).collect());
        let (session, n_all) = (self.session, self.visits.len());
        let n_visits = if id.is_empty() { n_all } else { visits_of_id(id).ok_or_else(missing)? };
        let older;
        let tree = if n_visits == n_all {
            self.tree(assumptions).ok_or_else(missing)?
        } else {
            older = self.grown(assumptions, n_visits, &self.assertions).ok_or_else(missing)?;
            &older
        };
        let (_, map) = tree.find(session, id).ok_or_else(missing)?;
        let sightings = tree.told(map);
        let said = Assertion {
            hypothesis: hypothesis_id(session, &sightings),
            sightings,
            reason: String::new(),
            author: String::new(),
            time_ns: 0,
        };
        if self.assertions.iter().any(|known| known.hypothesis == said.hypothesis) {
            return Ok(None);
        }
        let mut assertions = self.assertions.clone();
        assertions.push(said.clone());
        assertions.sort_by_key(|said| said.sightings.len());
        let then = self.grown(assumptions, n_all, &assertions).ok_or_else(missing)?;
        if then.maps().hypotheses().is_empty() {
            return Err(missing());
        }
        Ok(Some(said))
    }

    /// A tree of the first visits, apart from those that are kept; `None` if there are not so many.
    fn grown(
        &self,
        assumptions: Assumptions,
        n_visits: usize,
        assertions: &[Assertion],
    ) -> Option<Tree> {
        let visits = self.visits.get(..n_visits)?;
        let mut tree = Tree::new(self.params(assumptions), visits.first()?);
        tree.grow(visits, assertions);
        Some(tree)
    }

    fn params(&self, assumptions: Assumptions) -> MapTreeParams {
        MapTreeParams { assumptions, n_hypotheses_max: self.limits.n_kept_max }
    }
}

fn too_long(limit: usize) -> String {
    format!("a travel of {limit} visits is as long as is taken")
}

/// By whether paths are ordered, and planarity.
fn key(assumptions: Assumptions) -> (bool, bool) {
    let Assumptions { has_ordered_paths, is_planar } = assumptions;
    (has_ordered_paths, is_planar)
}
