//! What a robot is to do next that is driven by the maps that fit what it saw: find out which of
//! them is true, or explore.
//!
//! After B. Kuipers and Y.-T. Byun (AAAI 1988, sections 2.5 and 3), who rehearse wherever a place
//! may be a known one, and explore otherwise. With all maps at hand:
//!
//! 1. While several maps are simplest, the shortest travel that refutes one of them for certain.
//! 2. After an edge that nobody had gone has led to what the simplest map says is a known place,
//!    some travels on along known edges: it says what is there, and maps in which the place is new
//!    do not. This is the rehearsal of the paper, with a fixed radius as there.
//! 3. The nearest gateway that nobody has been through, by the simplest map.
//! 4. If there is none, the simplest map is taken to be true.
//!
//! Nothing guarantees 4: "For any fixed search radius of this topological match, it is possible to
//! construct an environment that will yield a false positive match" (section 2.5). Other maps are
//! always left in which the robot was in ever new places, and no travel refutes all of these.
//!
//! A robot asks again after each travel: what it sees changes what is to be done.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

use crate::map_tree::{Hypothesis, MapTree};
use crate::place_map::{Gateway, PlaceId};
use crate::rehearsal::{Decision, next_decision};
use crate::travel::Travel;

/// Which of several gateways nobody has been through is taken, of those that are equally near
/// (Kuipers and Byun 1988, section 3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Selection {
    /// The one that takes the least rotation. "This selection rule, of course, would cause NX to
    /// lose badly in an infinite environment."
    LeastRotation,
    /// The one that takes the most, so that what is explored grows roughly concentrically.
    MostRotation,
}

/// What a robot is to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Errand {
    /// A travel that tells two maps apart.
    Rehearse(Decision),
    /// A travel to a gateway of the simplest map that nobody has been through, and beyond it.
    Explore {
        /// The gateway.
        gateway: Gateway,
        /// Turns, each followed by a travel, from where the robot is now.
        turns: Vec<u8>,
    },
    /// A travel along a known edge, to see whether it leads where the simplest map says.
    Confirm {
        /// Where the edge begins.
        gateway: Gateway,
        /// Turns, each followed by a travel, from where the robot is now.
        turns: Vec<u8>,
    },
    /// Nothing: the simplest map has no such gateway.
    Explored,
    /// Nothing that would help: no map fits what was seen.
    Refuted,
}

/// What the robot of a tree is to do next. Searches through pairs of the simplest maps.
pub fn next_errand(tree: &MapTree, selection: Selection) -> Errand {
    let Some(simplest) = tree.hypotheses().first() else { return Errand::Refuted };
    if let Some(decision) = certain_decision(tree.minimal()) {
        return Errand::Rehearse(decision);
    }
    if let Some((gateway, turns)) = unconfirmed(simplest, tree.travel()) {
        return Errand::Confirm { gateway, turns };
    }
    let agenda = simplest.map.agenda(simplest.at);
    let chosen = agenda.into_iter().min_by_key(|(gateway, turns)| {
        let rotation = rotation(simplest, *gateway, turns);
        let (least, most) = match selection {
            Selection::LeastRotation => (rotation, Reverse(0)),
            Selection::MostRotation => (0, Reverse(rotation)),
        };
        (turns.len(), least, most)
    });
    if let Some((gateway, turns)) = chosen {
        return Errand::Explore { gateway, turns };
    }
    Errand::Explored
}

/// Travels after a match that have to lead where the simplest map says.
const N_CONFIRMING: u32 = 2;

/// The next travel along known edges by one who has just come, by an edge that nobody had gone, to
/// what the simplest map says is a known place; `None` if it was confirmed that it is.
fn unconfirmed(simplest: &Hypothesis, travel: &Travel) -> Option<(Gateway, Vec<u8>)> {
    let map = &simplest.map;
    let mut at = Gateway { place: PlaceId(0), index: 0 };
    let mut n_taken = BTreeMap::from([(at, 0_u32)]);
    let mut known = BTreeSet::from([at.place]);
    // Travels since the match, and the edge that led to it.
    let mut matched = None;
    for turn in travel.turns() {
        let left = map.turned(at, turn);
        at = map.leads_to(left)?;
        // An edge is known by the lesser of its two ends.
        let edge = left.min(at);
        let n = n_taken.entry(edge).or_default();
        matched = match matched {
            _ if *n == 0 => (!known.insert(at.place)).then_some((0, edge)),
            Some((n_since, closing)) if closing != edge => Some((n_since + 1, closing)),
            other => other,
        };
        *n += 1;
    }
    let (n_since, closing) = matched?;
    if N_CONFIRMING <= n_since {
        return None;
    }
    let n_gateways = map.place(at.place)?.star.n_gateways();
    let ways = (0..n_gateways).filter_map(|turn| {
        let gateway = map.turned(at, turn);
        let edge = gateway.min(map.leads_to(gateway)?);
        (edge != closing && turn != 0).then(|| (n_taken.get(&edge).copied(), turn, gateway))
    });
    ways.min().map(|(_, turn, gateway)| (gateway, vec![turn]))
}

fn certain_decision(hypotheses: &[Hypothesis]) -> Option<Decision> {
    next_decision(hypotheses).filter(|decision| decision.rehearsal.is_certain())
}

/// How far from straight ahead the last turn of a travel is, in gateways: straight ahead is where
/// the path goes on, or halfway around.
fn rotation(of: &Hypothesis, gateway: Gateway, turns: &[u8]) -> u8 {
    let Some((&turn, _)) = turns.split_last() else { return 0 };
    let came_in = of.map.turned_back(gateway, turn);
    let n_gateways = of.map.place(gateway.place).map_or(1, |place| place.star.n_gateways());
    let ahead = of
        .map
        .continuation(came_in)
        .map_or(n_gateways / 2, |ahead| (ahead.index + n_gateways - came_in.index) % n_gateways);
    turn.abs_diff(ahead)
}
