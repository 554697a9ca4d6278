//! What tells hypotheses apart, and what operators and marks do.

use meetpoint_places::{
    HypothesisId, MapTree, Refused, Sighting, Travel, World, first_difference, next_decision,
    rehearsal,
};

use crate::figures::PARAMS;

/// Figure 1 (b): the robot came up a side street, under A or under B, or elsewhere.
fn ambiguous() -> MapTree {
    let world = World::from_drawing(
        "
        X---A---B---C
            |   |   |
            Y   +---D",
    )
    .expect("a drawing");
    let travel = world.travel_along("ABCDB").expect("a route");
    MapTree::of_travel(PARAMS, &travel).expect("gateways that are there")
}

#[test]
fn two_maps_differ_in_a_visit() {
    let tree = ambiguous();
    let [at_a, at_b, _] = tree.hypotheses() else { panic!("three maps") };
    let difference = first_difference(tree.travel(), at_a, at_b).expect("two maps");
    assert_eq!(difference.visit, 4, "where the robot came back");
    let [said_a, said_b] = difference.sightings;
    // The side street of A is the first clockwise from the one that the robot stood at.
    assert_eq!(said_a, Sighting { first_visit: 0, gateway: 1 }, "one says it is A");
    assert_eq!(said_b, Sighting { first_visit: 1, gateway: 2 }, "one says it is B");
    assert_eq!(first_difference(tree.travel(), at_a, at_a), None, "a map is itself");
}

/// Turning right out of the side street, one comes to C from B, which is a corner, and from A
/// to B, which is not.
#[test]
fn the_shortest_rehearsal_decides() {
    let mut tree = ambiguous();
    let [at_a, at_b, _] = tree.hypotheses() else { panic!("three maps") };
    let asked = rehearsal(at_a, at_b).expect("something to try");
    assert!(asked.is_certain(), "both know where that leads");
    assert_eq!(asked.turns, [2], "to the right");
    let [of_a, of_b] = &asked.predicted;
    assert_eq!(of_a.as_ref().map(ToString::to_string).as_deref(), Some("aab"), "B, from the left");
    assert_eq!(of_b.as_ref().map(ToString::to_string).as_deref(), Some("ab"), "the corner C");
    let decision = next_decision(tree.hypotheses()).expect("something to try");
    assert_eq!(decision.between, [at_a.id, at_b.id], "the two simplest");
    assert_eq!(decision.rehearsal, asked, "as for these two");
    let seen = of_b.clone().expect("known");
    tree.extend(meetpoint_places::Step { turn: 2, seen }).expect("a gateway that is there");
    let left: Vec<usize> = tree.hypotheses().iter().map(|leaf| leaf.map.n_places()).collect();
    assert_eq!(left, [4, 6], "E = B, or it and what follows were never seen");
}

#[test]
fn what_only_one_map_knows_is_uncertain() {
    let tree = ambiguous();
    let [_, at_b, elsewhere] = tree.hypotheses() else { panic!("three maps") };
    let asked = rehearsal(at_b, elsewhere).expect("something to try");
    assert!(!asked.is_certain(), "a new place predicts nothing");
    assert_eq!(asked.turns.len(), 1, "at once");
    let decision = next_decision(&tree.hypotheses()[1..]).expect("something to try");
    assert_eq!(decision.rehearsal, asked, "where nothing certain is left");
}

#[test]
fn maps_that_know_nothing_more_leave_exploration() {
    let travel: Travel = "aa 1:aa".parse().expect("a travel");
    let tree = MapTree::of_travel(PARAMS, &travel).expect("gateways that are there");
    let [only] = tree.hypotheses() else { panic!("one map") };
    assert_eq!(rehearsal(only, only), None, "a map is itself");
    assert_eq!(next_decision(tree.hypotheses()), None, "nothing to decide");
    let agenda = only.map.agenda(only.at);
    let turns: Vec<&[u8]> = agenda.iter().map(|(_, turns)| turns.as_slice()).collect();
    assert_eq!(turns, [&[1][..], &[0, 1][..]], "on, or back and beyond the start");
}

#[test]
fn an_operator_decides() {
    let mut tree = ambiguous();
    let last = tree.hypotheses()[2].id;
    tree.assert_hypothesis(last).expect("it is one of them");
    assert_eq!((tree.hypotheses().len(), tree.n_ruled_out()), (1, 2), "the others are ruled out");
    assert!(!tree.is_truncated(), "which is not for want of room");
    let unknown = HypothesisId(99);
    assert_eq!(
        tree.assert_hypothesis(unknown),
        Err(Refused::NoSuchHypothesis(unknown)),
        "no other"
    );
    assert_eq!(tree.hypotheses()[0].id, last, "and it stands");
}

#[test]
fn home_is_one_place_only() {
    let n_maps = |travel: &str| {
        let travel: Travel = travel.parse().expect("a travel");
        let tree = MapTree::of_travel(PARAMS, &travel).expect("gateways that are there");
        tree.hypotheses().len()
    };
    assert_eq!(n_maps("ab 0:ab 1:ab 1:ab"), 3, "the loop may be closed by two ways or none");
    assert_eq!(n_maps("ab@home! 0:ab 1:ab 1:ab@home"), 1, "it is");
    assert_eq!(n_maps("ab@home! 0:ab 1:ab 1:ab@other"), 2, "it is not, but the one before may be");
    assert_eq!(n_maps("ab@home! 0:ab 1:ab@other 1:ab@other"), 1, "neither is");
    assert_eq!(n_maps("ab@p 0:ab 1:ab 1:ab@p"), 3, "places may look alike");
}
