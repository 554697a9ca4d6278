//! Causal schemas, as travels that can be read.

use std::collections::BTreeSet;

use meetpoint_places::{
    Action, CausalWorld, MapTree, Outcome, ToldApart, Travel, TurnSide, World, causal_world,
    told_apart,
};
use proptest::prelude::*;

use crate::enumeration::any_travel;
use crate::figures::PARAMS;

fn action(action: Action) -> String {
    match action {
        Action::Travel => "travel".to_owned(),
        Action::Turn { gateways, side } => {
            let side = match side {
                TurnSide::Around => "around",
                TurnSide::Straight => "straight on",
                TurnSide::Left => "left",
                TurnSide::Right => "right",
                TurnSide::Ended => "turn",
            };
            format!("{side} {gateways}")
        }
    }
}

fn told(world: &CausalWorld) -> Vec<String> {
    let rows = world.schemas.iter().map(|schema| {
        let outcome =
            |Outcome { view, visits }: &Outcome| format!("{} {visits:?}", world.views[*view]);
        let outcomes: Vec<String> = schema.outcomes.iter().map(outcome).collect();
        let view = &world.views[schema.view];
        format!("{view}, {}: {}", action(schema.action), outcomes.join(" or "))
    });
    rows.collect()
}

/// Figure 1 (a): D looks just like A, and what follows tells them apart.
#[test]
fn what_follows_tells_places_apart_that_look_alike() {
    let world = World::from_drawing(
        "
                W
                |
            C---B---A---X
            |   |   |
            |   Z   |
            |       |
        Y---D-------E",
    )
    .expect("a drawing");
    let travel = world.travel_along("ABCDEA").expect("a route");
    assert_eq!(travel.to_string(), "aba 2:abab 2:ab 1:abb 1:ab 1:abb", "what is seen");
    // A is seen from its west, where the robot leaves; D from north. The next but one looks like A again.
    assert_eq!(told_apart(&travel), [], "nothing was done alike");
    let twice: Travel = "abb 1:abab 2:ab 1:abb 1:ab 1:abb".parse().expect("a travel");
    let world = causal_world(&twice);
    assert_eq!(
        told(&world),
        [
            "in abb, turn 1: out aab [0, 3]",
            "out aab, travel: in abab [0] or in ab [3]",
            "in abab, straight on 2: out abab [1]",
            "out abab, travel: in ab [1]",
            "in ab, turn 1: out ab [2, 4]",
            "out ab, travel: in abb [2, 4]",
        ],
        "the second schema tells the first visit and the fourth apart"
    );
    let apart: Vec<bool> = world.schemas.iter().map(|schema| world.tells_apart(schema)).collect();
    assert_eq!(apart, [false, true, false, false, false, false], "that one");
    assert_eq!(
        told_apart(&twice),
        [ToldApart { visit: 3, earlier: 0, n_travels: 1 }],
        "after one travel"
    );
}

#[test]
fn sides_are_told_by_the_order_alone() {
    let turn = |turn: u8| {
        let travel: Travel = format!("abab {turn}:a").parse().expect("a travel");
        action(causal_world(&travel).schemas[0].action)
    };
    assert_eq!(
        [0, 1, 2, 3].map(turn),
        ["around 0", "left 1", "straight on 2", "right 3"],
        "a crossing"
    );
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..Default::default() })]

    /// A longer travel adds to what is numbered, turns have one outcome, every visit but the last is in one
    /// schema of either kind, and no map that fits says that visits are the same which are told apart.
    #[test]
    fn schemas_are_those_of_the_travel(travel in any_travel()) {
        let world = causal_world(&travel);
        for kind in [true, false] {
            let of_kind = world.schemas.iter().filter(|schema| (schema.action == Action::Travel) == kind);
            let visits = of_kind.flat_map(|schema| &schema.outcomes).flat_map(|outcome| &outcome.visits);
            let mut visits: Vec<usize> = visits.copied().collect();
            visits.sort_unstable();
            prop_assert!(visits.iter().copied().eq(0..travel.steps.len()), "{visits:?}");
        }
        let is_turn = |action: Action| action != Action::Travel;
        prop_assert!(world.schemas.iter().all(|schema| !(is_turn(schema.action) && world.tells_apart(schema))));
        let mut shorter = travel.clone();
        if shorter.steps.pop().is_some() {
            let before = causal_world(&shorter);
            prop_assert!(world.views.starts_with(&before.views), "numbers stay");
            let names = |world: &CausalWorld| {
                world.schemas.iter().map(|schema| (schema.view, schema.action)).collect::<Vec<_>>()
            };
            prop_assert!(names(&world).starts_with(&names(&before)), "numbers stay");
        }
        let apart: BTreeSet<(usize, usize)> =
            told_apart(&travel).iter().map(|pair| (pair.earlier, pair.visit)).collect();
        prop_assert_eq!(&apart, &by_walking(&travel), "as one finds by walking on from both");
        let tree = MapTree::of_travel(PARAMS, &travel).expect("turns to gateways that are there");
        for map in tree.hypotheses() {
            let told = map.sightings(tree.travel()).expect("a map of the travel");
            let is_one = |&(a, b): &(usize, usize)| told[a] == told[b];
            prop_assert!(!apart.iter().any(is_one), "{travel}: {told:?}");
        }
    }
}

/// The definition: walks on from both visits, step by step.
fn by_walking(travel: &Travel) -> BTreeSet<(usize, usize)> {
    let n_visits = travel.steps.len() + 1;
    let pairs = (0..n_visits).flat_map(|b| (0..b).map(move |a| (a, b)));
    let is_apart = |&(a, b): &(usize, usize)| {
        for n in 0.. {
            let (Some(one), Some(other)) = (travel.seen(a + n), travel.seen(b + n)) else {
                return false;
            };
            if one.star != other.star || !one.fits(other.view.as_ref()) {
                return 0 < n;
            }
            let (Some(one), Some(other)) = (travel.steps.get(a + n), travel.steps.get(b + n))
            else {
                return false;
            };
            if one.turn != other.turn {
                return false;
            }
        }
        false
    };
    pairs.filter(is_apart).collect()
}
