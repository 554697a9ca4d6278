//! A hundred random floors with nested loops, at random travels and driven by the maps: whether the true map
//! is ever lost where nothing was given up, and whether it is known in the end.

use anyhow::Context;
use meetpoint_places::{Assumptions, Gateway, MapTree, MapTreeParams, PlaceId, World, sightings};
use meetpoint_sim::{ChaCha8Rng, nested_loops};
use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};

const N_WORLDS: u64 = 100;
const N_TRAVELS: usize = 24;
/// Hypotheses kept: enough for nearly all of these floors.
const N_HYPOTHESES_MAX: usize = 3000;

/// What became of the trees.
#[derive(Debug, Default)]
struct Kept {
    n_whole: usize,
    n_true: usize,
    n_minimal: usize,
    n_hypotheses: usize,
}

/// Prints the table.
pub(super) fn print() -> anyhow::Result<()> {
    println!(
        "| planar | floors | travels each | not truncated | the true map among these trees' | among the \
         minimal ones | hypotheses, mean |"
    );
    println!("|{}", "---|".repeat(7));
    for (is_planar, assumptions) in
        [("no", Assumptions::HSSH_2004), ("yes", Assumptions::HSSH_2004_PLANAR)]
    {
        let mut kept = Kept::default();
        for seed in 0..N_WORLDS {
            travel(seed, assumptions, &mut kept)?;
        }
        let Kept { n_whole, n_true, n_minimal, n_hypotheses } = kept;
        println!(
            "| {is_planar} | {N_WORLDS} | {N_TRAVELS} | {n_whole} | {n_true} | {n_minimal} | {:.0} |",
            n_hypotheses as f64 / n_whole.max(1) as f64
        );
    }
    Ok(())
}

/// One floor, turns at random, back only where nothing else is.
fn travel(seed: u64, assumptions: Assumptions, kept: &mut Kept) -> anyhow::Result<()> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let world = World::from_drawing(&nested_loops(&mut rng))?;
    let places: Vec<PlaceId> = world.map().places().map(|(id, _)| id).collect();
    let from = Gateway { place: *places.choose(&mut rng).context("places")?, index: 0 };
    let (mut at, mut turns) = (from, Vec::new());
    for _ in 0..N_TRAVELS {
        let n_gateways = world.map().observation(at).star.n_gateways();
        let turn = if n_gateways == 1 { 0 } else { rng.random_range(1..n_gateways) };
        turns.push(turn);
        at = world.map().leads_to(world.map().turned(at, turn)).context("a whole world")?;
    }
    let travel = world.travel(from, &turns);
    let truth = sightings(world.map(), from, turns).context("a whole world")?;
    let params = MapTreeParams { assumptions, n_hypotheses_max: N_HYPOTHESES_MAX };
    let tree = MapTree::of_travel(params, &travel)?;
    if tree.is_truncated() {
        return Ok(());
    }
    let has_truth = |leaves: &[meetpoint_places::Hypothesis]| {
        leaves.iter().any(|leaf| leaf.sightings(&travel).as_ref() == Some(&truth))
    };
    kept.n_whole += 1;
    kept.n_true += usize::from(has_truth(tree.hypotheses()));
    kept.n_minimal += usize::from(has_truth(tree.minimal()));
    kept.n_hypotheses += tree.hypotheses().len();
    Ok(())
}
