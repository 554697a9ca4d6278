//! The tree has exactly the maps that the axioms allow, and gives none up but for want of room.

use std::collections::BTreeSet;

use meetpoint_places::{
    Assumptions, Hypothesis, MapTree, MapTreeParams, Sighting, Travel, World, sightings,
};
use proptest::prelude::*;

use crate::definition::{Fitting, all_maps};

const ALL: [Assumptions; 4] = [
    Assumptions::NONE,
    Assumptions::HSSH_2004,
    Assumptions::HSSH_2004_PLANAR,
    Assumptions { has_ordered_paths: false, is_planar: true },
];

pub(crate) fn told(travel: &Travel, leaf: &Hypothesis) -> Vec<Sighting> {
    leaf.sightings(travel).expect("a map of the travel")
}

fn tree(travel: &Travel, assumptions: Assumptions, n_hypotheses_max: usize) -> MapTree {
    let params = MapTreeParams { assumptions, n_hypotheses_max };
    MapTree::of_travel(params, travel).expect("turns to gateways that are there")
}

fn fitting(tree: &MapTree) -> Vec<Fitting> {
    let leaf = |leaf: &Hypothesis| Fitting {
        n_places: leaf.map.n_places(),
        n_paths: leaf.map.n_paths(),
        sightings: told(tree.travel(), leaf),
    };
    tree.hypotheses().iter().map(leaf).collect()
}

fn check(travel: &Travel) {
    for assumptions in ALL {
        let tree = tree(travel, assumptions, usize::MAX / 2);
        for leaf in tree.hypotheses() {
            let paths = leaf.map.paths();
            assert_eq!(paths.len(), leaf.map.n_paths(), "{travel}: {paths:?}");
        }
        let (found, expected) = (fitting(&tree), all_maps(travel, assumptions));
        let simplicity = |map: &Fitting| (map.n_places, map.n_paths);
        assert!(found.is_sorted_by_key(simplicity), "{travel}: the simplest first");
        let least = expected.iter().map(simplicity).min();
        let n_minimal = expected.iter().filter(|map| Some(simplicity(map)) == least).count();
        assert_eq!(tree.minimal().len(), n_minimal, "{travel}: minimal models, {assumptions:?}");
        let n_found = found.len();
        let found: BTreeSet<Fitting> = found.into_iter().collect();
        assert_eq!(found.len(), n_found, "{travel}: no map twice");
        assert_eq!(found, expected, "{travel}: {assumptions:?}");
    }
}

/// Any travel, in a world or not: a star of few kinds, a turn, sometimes a view.
pub(crate) fn any_travel() -> impl Strategy<Value = Travel> {
    let star = prop::sample::select(vec!["a", "aa", "ab", "aba", "aab", "abab", "a>a"]);
    let view = prop::sample::select(vec!["", "", "", "@p", "@q", "@p!"]);
    let seen = (star, view).prop_map(|(star, view)| format!("{star}{view}"));
    let step = (any::<u8>(), seen.clone());
    (seen, prop::collection::vec(step, 0..5)).prop_map(|(first, steps)| {
        let mut words = vec![first.clone()];
        let mut before = first;
        for (turn, seen) in steps {
            let star = before.split('@').next().unwrap_or_default();
            let n_gateways = star.chars().filter(char::is_ascii_lowercase).count();
            words.push(format!("{}:{seen}", usize::from(turn) % n_gateways));
            before = seen;
        }
        words.join(" ").parse().expect("a travel")
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1500, failure_persistence: None, ..Default::default() })]

    #[test]
    fn the_tree_has_what_the_axioms_allow(travel in any_travel()) {
        check(&travel);
    }
}

#[test]
fn worlds_of_few_places() {
    let worlds = [
        ("A-B", "ABABA"),
        (
            "
            A---B---+
            |   |   |
            +---C---D",
            "ABCDBA",
        ),
        (
            "
            A---B---C
            |   |   |
            D---E---F",
            "ABCFED",
        ),
        (
            "
            +---+
            |   |
            A---B---C
            |   |
            +---+",
            "CBCBC",
        ),
    ];
    for (drawing, route) in worlds {
        let world = World::from_drawing(drawing).expect("a drawing");
        check(&world.travel_along(route).expect("a route"));
    }
}

/// A way that crosses another on a bridge: whoever assumes planarity loses the true map.
#[test]
fn bridges_are_not_planar() {
    let world = World::from_drawing(
        "
        A---B---C
        |   |   |
        |   D---#---+
        |   |   |   |
        E---F---G---H",
    )
    .expect("a drawing");
    let (from, turns) = world.turns("ABCGHDFGFEABD").expect("a route");
    let travel = world.travel(from, &turns);
    let truth = sightings(world.map(), from, turns.iter().copied()).expect("a whole world");
    let has_truth = |assumptions| {
        let tree = tree(&travel, assumptions, 100_000);
        assert!(!tree.is_truncated(), "room for all");
        tree.hypotheses().iter().any(|leaf| told(&travel, leaf) == truth)
    };
    assert!(has_truth(Assumptions::HSSH_2004), "the true map is one of them");
    assert!(!has_truth(Assumptions::HSSH_2004_PLANAR), "it cannot be drawn in the plane");
}

#[test]
fn what_is_given_up_is_counted() {
    let travel: Travel = "aa 1:aa 1:aa 1:aa 1:aa 1:aa 1:aa".parse().expect("a travel");
    let all = tree(&travel, Assumptions::NONE, 1000);
    let some = tree(&travel, Assumptions::NONE, 2);
    assert_eq!((all.hypotheses().len(), all.n_given_up()), (7, 0), "rings of 1 to 6, and none");
    assert!(!all.is_truncated(), "all are there");
    assert_eq!(some.hypotheses(), &all.hypotheses()[..2], "the simplest are kept");
    assert!(some.is_truncated(), "and it is said that others were not");
}
