//! A hundred places, a thousand travels: hypotheses and time, with and without views.

use std::time::Instant;

use anyhow::Context;
use meetpoint_places::{
    Assumptions, Gateway, MapTree, MapTreeParams, PlaceId, Selection, Step, View, World,
    next_errand, sightings,
};
use meetpoint_sim::{ChaCha8Rng, street_grid};
use rand::{RngExt, SeedableRng};

/// Places of a side of the floor.
pub(super) const SIDE: u32 = 10;
const N_TRAVELS: usize = 1000;
/// After how many travels a row is printed.
const ROWS: [usize; 7] = [10, 20, 50, 100, 200, 500, 1000];
/// Hypotheses kept: as the service does, and as `meetpoint hypotheses` does without it.
const N_HYPOTHESES_MAX: [usize; 2] = [300, 1000];

/// Prints the table.
pub(super) fn print() -> anyhow::Result<()> {
    println!(
        "| kept at most | looks of places | travels | hypotheses | given up | places, paths of the simplest | true map kept | ms a travel | ms to choose the next | MB |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for n_hypotheses_max in N_HYPOTHESES_MAX {
        for n_views in [1, 10, 100] {
            drive(n_hypotheses_max, n_views)?;
        }
    }
    Ok(())
}

/// Drives at random, where every place has one of `n_views` looks.
fn drive(n_hypotheses_max: usize, n_views: u32) -> anyhow::Result<()> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let drawing = street_grid(SIDE, &mut rng);
    let world = World::from_drawing(&drawing).context("a drawing")?;
    let looks: Vec<u32> = world.map().places().map(|_| rng.random_range(0..n_views)).collect();
    let view = |at: Gateway| {
        let name = looks[at.place.0 as usize].to_string();
        Some(View { name, is_unique: false })
    };
    let from = Gateway { place: PlaceId(0), index: 0 };
    let mut first = world.map().observation(from);
    first.view = view(from);
    let assumptions = Assumptions::HSSH_2004_PLANAR;
    let mut tree = MapTree::new(MapTreeParams { assumptions, n_hypotheses_max }, first);
    let (mut at, mut turns, mut busy_s, mut n_timed) = (from, Vec::new(), 0.0, 0);
    for n_travels in 1..=N_TRAVELS {
        let n_gateways = world.map().observation(at).star.n_gateways();
        let turn = if n_gateways == 1 { 0 } else { rng.random_range(1..n_gateways) };
        turns.push(turn);
        at = world.map().leads_to(world.map().turned(at, turn)).context("a whole world")?;
        let mut seen = world.map().observation(at);
        seen.view = view(at);
        let begin = Instant::now();
        tree.extend(Step { turn, seen }).context("a gateway that is there")?;
        busy_s += begin.elapsed().as_secs_f64();
        n_timed += 1;
        if ROWS.contains(&n_travels) {
            let truth = sightings(world.map(), from, turns.iter().copied());
            let is_true =
                |leaf: &meetpoint_places::Hypothesis| leaf.sightings(tree.travel()) == truth;
            let is_kept = tree.hypotheses().iter().any(is_true);
            let simplest = tree.hypotheses().first().map_or_else(String::new, |leaf| {
                format!("{}, {}", leaf.map.n_places(), leaf.map.n_paths())
            });
            let begin = Instant::now();
            std::hint::black_box(next_errand(&tree, Selection::LeastRotation));
            let choosing_ms = begin.elapsed().as_secs_f64() * 1e3;
            println!(
                "| {n_hypotheses_max} | {n_views} | {n_travels} | {} | {} | {simplest} | {} | {:.3} | {choosing_ms:.3} | {:.1} |",
                tree.hypotheses().len(),
                tree.n_given_up(),
                if is_kept { "yes" } else { "no" },
                busy_s * 1e3 / f64::from(n_timed),
                tree.n_bytes() as f64 / 1e6
            );
            (busy_s, n_timed) = (0.0, 0);
        }
    }
    Ok(())
}
