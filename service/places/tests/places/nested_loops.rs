//! A hundred random floors with nested loops, driven through at random: the true map is never
//! lost.

use meetpoint_places::{Assumptions, Gateway, MapTree, MapTreeParams, PlaceId, World, sightings};
use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::enumeration::told;

const N_WORLDS: u64 = 100;
const N_TRAVELS: usize = 24;
/// Turns at random, back only where nothing else is.
fn turns(world: &World, from: Gateway, rng: &mut ChaCha8Rng) -> Vec<u8> {
    let (mut at, mut turns) = (from, Vec::new());
    for _ in 0..N_TRAVELS {
        let n_gateways = world.map().place(at.place).expect("a place").star.n_gateways();
        let turn = if n_gateways == 1 { 0 } else { rng.random_range(1..n_gateways) };
        turns.push(turn);
        at = world.map().leads_to(world.map().turned(at, turn)).expect("a whole world");
    }
    turns
}

#[test]
fn the_true_map_is_never_lost() {
    let (mut n_whole, mut n_minimal) = (0, 0);
    for seed in 0..N_WORLDS {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let drawing = meetpoint_sim::nested_loops(&mut rng);
        let world = World::from_drawing(&drawing).expect("a drawing");
        let places: Vec<PlaceId> = world.map().places().map(|(id, _)| id).collect();
        let from = Gateway { place: *places.choose(&mut rng).expect("places"), index: 0 };
        let turns = turns(&world, from, &mut rng);
        let travel = world.travel(from, &turns);
        let truth = sightings(world.map(), from, turns).expect("a whole world");
        for assumptions in [Assumptions::HSSH_2004, Assumptions::HSSH_2004_PLANAR] {
            let params = MapTreeParams { assumptions, n_hypotheses_max: 3000 };
            let tree = MapTree::of_travel(params, &travel).expect("gateways that are there");
            let has_truth = |leaves: &[_]| leaves.iter().any(|leaf| told(&travel, leaf) == truth);
            if !tree.is_truncated() {
                n_whole += 1;
                n_minimal += u64::from(has_truth(tree.minimal()));
                let is_kept = has_truth(tree.hypotheses());
                assert!(is_kept, "seed {seed}, {assumptions:?}: {travel} in\n{drawing}");
            }
        }
    }
    println!("{n_whole} of {} trees not truncated, in {n_minimal} minimal", 2 * N_WORLDS);
    assert!(N_WORLDS <= n_whole, "{n_whole} trees were not truncated, too few to judge by");
}
