//! Robots that do what the maps of their travel ask for, until nothing is left to do.

use std::collections::BTreeSet;

use meetpoint_places::{
    Assumptions, Errand, Gateway, MapTree, MapTreeParams, Observation, PlaceId, Selection, Step,
    View, World, next_errand, sightings,
};
use rand::SeedableRng;
use rand::seq::IndexedRandom;
use rand_chacha::ChaCha8Rng;

use crate::enumeration::told;

/// Robots that are not done after so many travels never will be.
const N_TRAVELS_MAX: usize = 400;
const N_WORLDS: u64 = 100;
const PARAMS: MapTreeParams =
    MapTreeParams { assumptions: Assumptions::HSSH_2004_PLANAR, n_hypotheses_max: 300 };

/// What one sees who knows home when he sees it, and nothing else.
fn seen(world: &World, at: Gateway, home: PlaceId) -> Observation {
    let is_unique = at.place == home;
    let name = if is_unique { "home" } else { "elsewhere" }.to_owned();
    Observation { view: Some(View { name, is_unique }), ..world.map().observation(at) }
}

/// Places that hang together with this one.
fn n_reachable(world: &World, from: PlaceId) -> usize {
    let (mut reached, mut queue) = (BTreeSet::from([from]), vec![from]);
    while let Some(place) = queue.pop() {
        let of = world.map().gateways().filter(|gateway| gateway.place == place);
        for next in of.filter_map(|gateway| world.map().leads_to(gateway)) {
            if reached.insert(next.place) {
                queue.push(next.place);
            }
        }
    }
    reached.len()
}

/// How a drive from home ended.
#[derive(Debug, Default)]
struct Driven {
    n_travels: usize,
    n_rehearsals: usize,
    /// The simplest map is the true one, all of it.
    is_true: bool,
    n_minimal: usize,
}

fn driven(world: &World, home: PlaceId, selection: Selection) -> Driven {
    let from = Gateway { place: home, index: 0 };
    let mut tree = MapTree::new(PARAMS, seen(world, from, home));
    let (mut at, mut driven) = (from, Driven::default());
    loop {
        let turn = match next_errand(&tree, selection) {
            Errand::Rehearse(decision) => {
                driven.n_rehearsals += 1;
                decision.rehearsal.turns[0]
            }
            Errand::Confirm { turns, .. } => {
                driven.n_rehearsals += 1;
                turns[0]
            }
            Errand::Explore { turns, .. } => turns[0],
            Errand::Explored => break,
            Errand::Refuted => panic!("the true map is lost"),
        };
        at = world.map().leads_to(world.map().turned(at, turn)).expect("a whole world");
        tree.extend(Step { turn, seen: seen(world, at, home) }).expect("a gateway");
        driven.n_travels += 1;
        assert!(driven.n_travels < N_TRAVELS_MAX, "an end: {driven:?}");
    }
    let truth = sightings(world.map(), from, tree.travel().turns()).expect("a whole world");
    let simplest = &tree.hypotheses()[0];
    driven.is_true = told(tree.travel(), simplest) == truth
        && simplest.map.n_places() == n_reachable(world, home)
        && simplest.map.agenda(simplest.at).is_empty();
    driven.n_minimal = tree.minimal().len();
    driven
}

#[test]
fn random_floors_are_explored_and_known() {
    for selection in [Selection::LeastRotation, Selection::MostRotation] {
        let (mut n_true, mut n_travels, mut n_rehearsals) = (0, 0, 0);
        for seed in 0..N_WORLDS {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let drawing = meetpoint_sim::nested_loops(&mut rng);
            let world = World::from_drawing(&drawing).expect("a drawing");
            let places: Vec<PlaceId> = world.map().places().map(|(id, _)| id).collect();
            let home = *places.choose(&mut rng).expect("places");
            let driven = driven(&world, home, selection);
            assert_eq!(driven.n_minimal, 1, "seed {seed}: one is simplest");
            n_true += u64::from(driven.is_true);
            n_travels += driven.n_travels;
            n_rehearsals += driven.n_rehearsals;
        }
        println!(
            "{selection:?}: {n_true} of {N_WORLDS} true, {n_travels} travels, {n_rehearsals} of them rehearsals"
        );
        assert!(N_WORLDS * 97 <= n_true * 100, "{selection:?}: {n_true} of {N_WORLDS}");
    }
}

/// Four corners that look alike but for home: where it comes again tells how many there are.
#[test]
fn a_loop_is_as_long_as_it_takes_to_come_home() {
    let world = World::from_drawing(
        "
        A---B
        |   |
        D---C",
    )
    .expect("a drawing");
    let driven = driven(&world, PlaceId(0), Selection::LeastRotation);
    assert!(driven.is_true && driven.n_minimal == 1, "{driven:?}");
}
