//! Rehearsals: the travel whose outcome would tell two maps apart.
//!
//! A breadth-first search over pairs of places, one in each map, as the same turns lead to them.
//! B. Kuipers and Y.-T. Byun (1988, section 2.5) follow routes that one hypothesis predicts; with
//! two maps at hand the shortest route is known of which they predict different things.
//! Time and space O(gateways of one map × gateways of the other).

use std::collections::{HashSet, VecDeque};

use crate::map_tree::{Hypothesis, HypothesisId};
use crate::observation::Observation;
use crate::place_map::Gateway;

/// A travel, and what two maps predict at its end.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rehearsal {
    /// Turns, each followed by a travel, from where the robot is now.
    pub turns: Vec<u8>,
    /// What either map predicts that the robot will see at the end; `None` where the last edge is
    /// not known to it. Before the end both predict the same.
    pub predicted: [Option<Observation>; 2],
}

impl Rehearsal {
    /// Whether at least one of the two maps is refuted, whatever is seen (where only their views
    /// differ: if somebody compares it). Otherwise one of them predicts nothing, and the other is
    /// refuted unless its prediction is seen.
    pub fn is_certain(&self) -> bool {
        self.predicted.iter().all(Option::is_some)
    }
}

/// The shortest travel of which two maps predict different things; if there is none, the shortest
/// that ends where one of them predicts something and the other nothing; `None` if there is none
/// of these either, so that only exploration can help ([`crate::PlaceMap::agenda`]).
pub fn rehearsal(a: &Hypothesis, b: &Hypothesis) -> Option<Rehearsal> {
    let mut reached = HashSet::from([(a.at, b.at)]);
    let mut queue = VecDeque::from([(a.at, b.at, Vec::new())]);
    let mut uncertain = None;
    while let Some((at_a, at_b, turns)) = queue.pop_front() {
        // Both look alike from here: what differs was returned when it was met.
        for turn in 0..a.map.observation(at_a).star.n_gateways() {
            let next = [(a, at_a), (b, at_b)]
                .map(|(of, at): (&Hypothesis, Gateway)| of.map.leads_to(of.map.turned(at, turn)));
            let turns = || turns.iter().copied().chain([turn]).collect::<Vec<u8>>();
            let met = || Rehearsal {
                turns: turns(),
                predicted: [
                    next[0].map(|at| a.map.observation(at)),
                    next[1].map(|at| b.map.observation(at)),
                ],
            };
            match next {
                [Some(next_a), Some(next_b)] => {
                    if !a.map.may_look(next_a, &b.map.observation(next_b)) {
                        return Some(met());
                    }
                    if reached.insert((next_a, next_b)) {
                        queue.push_back((next_a, next_b, turns()));
                    }
                }
                [None, None] => {}
                _ => uncertain = uncertain.or_else(|| Some(met())),
            }
        }
    }
    uncertain
}

/// Which hypotheses a rehearsal is about.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Decision {
    /// The simplest, and the one it is told apart from, in the order of what is predicted.
    pub between: [HypothesisId; 2],
    /// What to do, and what either predicts.
    pub rehearsal: Rehearsal,
}

/// The next travel that would decide, of hypotheses in the order of simplicity: the simplest is
/// held against the next simplest that it can be told apart from for certain, or else, less
/// certainly, at all. `None` if there is one hypothesis only, or nothing but exploration helps.
pub fn next_decision(hypotheses: &[Hypothesis]) -> Option<Decision> {
    let (simplest, others) = hypotheses.split_first()?;
    let mut uncertain = None;
    for other in others {
        let Some(rehearsal) = rehearsal(simplest, other) else { continue };
        let is_certain = rehearsal.is_certain();
        let decision = Decision { between: [simplest.id, other.id], rehearsal };
        if is_certain {
            return Some(decision);
        }
        uncertain = uncertain.or(Some(decision));
    }
    uncertain
}
