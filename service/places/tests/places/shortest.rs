//! Rehearsals and agendas against all sequences of turns, the shortest first.

use meetpoint_places::{Assumptions, Gateway, Hypothesis, MapTree, MapTreeParams, rehearsal};
use proptest::prelude::*;

use crate::enumeration::any_travel;

/// Longer sequences are not looked at.
const N_TURNS_MAX: usize = 5;

fn n_gateways(of: &Hypothesis, at: Gateway) -> u8 {
    of.map.observation(at).star.n_gateways()
}

fn next(of: &Hypothesis, at: Gateway, turn: u8) -> Option<Gateway> {
    of.map.leads_to(of.map.turned(at, turn))
}

/// A sequence of turns and where it leads in either map.
type Trial = (Vec<u8>, [Gateway; 2]);

/// All sequences, in the order of their lengths, then of their turns: the first that decides, or
/// else the first whose end one map knows and the other does not.
fn first_that_decides(a: &Hypothesis, b: &Hypothesis) -> Option<(bool, Vec<u8>)> {
    let mut uncertain = None;
    let mut level: Vec<Trial> = vec![(Vec::new(), [a.at, b.at])];
    for _ in 0..N_TURNS_MAX {
        let mut longer = Vec::new();
        for (turns, [at_a, at_b]) in level {
            for turn in 0..n_gateways(a, at_a) {
                let turns = [turns.as_slice(), &[turn]].concat();
                match (next(a, at_a, turn), next(b, at_b, turn)) {
                    (Some(in_a), Some(in_b)) => {
                        let [seen_a, seen_b] = [a.map.observation(in_a), b.map.observation(in_b)];
                        if seen_a.star != seen_b.star || !seen_a.fits(seen_b.view.as_ref()) {
                            return Some((true, turns));
                        }
                        longer.push((turns, [in_a, in_b]));
                    }
                    (None, None) => {}
                    _ => uncertain = uncertain.or(Some((false, turns))),
                }
            }
        }
        level = longer;
    }
    uncertain
}

/// All sequences in the same order: for every gateway that leads nowhere the first that ends there.
fn first_beyond(of: &Hypothesis) -> Vec<(Gateway, Vec<u8>)> {
    let mut found: Vec<(Gateway, Vec<u8>)> = Vec::new();
    let mut level = vec![(Vec::new(), of.at)];
    for _ in 0..N_TURNS_MAX {
        let mut longer = Vec::new();
        for (turns, at) in level {
            for turn in 0..n_gateways(of, at) {
                let turns = [turns.as_slice(), &[turn]].concat();
                let gateway = of.map.turned(at, turn);
                match of.map.leads_to(gateway) {
                    Some(next) => longer.push((turns, next)),
                    None if found.iter().all(|(known, _)| *known != gateway) => {
                        found.push((gateway, turns));
                    }
                    None => {}
                }
            }
        }
        level = longer;
    }
    found
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..Default::default() })]

    #[test]
    fn searches_find_the_first_of_all_sequences(travel in any_travel()) {
        let params = MapTreeParams { assumptions: Assumptions::NONE, n_hypotheses_max: 6 };
        let tree = MapTree::of_travel(params, &travel).expect("gateways that are there");
        for a in tree.hypotheses() {
            // After at most four travels no gateway is farther than the sequences are long.
            prop_assert_eq!(a.map.agenda(a.at), first_beyond(a), "{}", travel);
            for b in tree.hypotheses() {
                let found = rehearsal(a, b).map(|found| (found.is_certain(), found.turns));
                let is_short =
                    found.as_ref().is_none_or(|(_, turns)| turns.len() <= N_TURNS_MAX);
                if is_short {
                    prop_assert_eq!(found, first_that_decides(a, b), "{}", travel);
                }
            }
        }
    }
}
