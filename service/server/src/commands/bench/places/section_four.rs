//! 6 paths, 9 places of 4 local topologies, 14 travels. The paper's own floor is not in its text.

use std::collections::BTreeSet;
use std::time::Instant;

use anyhow::Context;
use meetpoint_places::{Assumptions, MapTree, MapTreeParams, Star, Travel, World, sightings};

const FLOOR: &str = "
    A   B---C
    |   |   |
    D---E---F
    |   |   |
    G---H---I";
/// Tours of 14 travels each; all but the fourth and the last drive every way.
const TOURS: [&str; 6] = [
    "ADGHIFCBEHGDEFC",
    "ADEBCFEHGDGHIFE",
    "EBCFEDGHEHIFEDA",
    "GDADEHGDEFIHEBC",
    "ADGHIFCBEDGHEFI",
    "CBEHIFCBEHIFCBE",
];
/// Trees built for one time.
const N_REPEATED: u32 = 1000;

/// A star as read from whichever gateway makes it the least: the same for all that look alike.
fn local_topology(star: &Star) -> Option<Star> {
    (0..star.n_gateways()).map(|gateway| star.read_from(gateway)).min()
}

/// Milliseconds for one tree: the best of five rounds, since others use the machine too.
fn time_ms(params: MapTreeParams, travel: &Travel) -> f64 {
    let round = || {
        let begin = Instant::now();
        for _ in 0..N_REPEATED {
            let tree = MapTree::of_travel(params, std::hint::black_box(travel));
            let _ = std::hint::black_box(tree);
        }
        begin.elapsed().as_secs_f64() * 1e3 / f64::from(N_REPEATED)
    };
    (0..5).map(|_| round()).fold(f64::INFINITY, f64::min)
}

/// Prints the table.
pub(super) fn print() -> anyhow::Result<()> {
    let world = World::from_drawing(FLOOR).context("a drawing")?;
    let stars = world.map().places().map(|(_, place)| local_topology(&place.star));
    let n_topologies = stars.collect::<BTreeSet<_>>().len();
    let (n_places, n_paths) = (world.map().n_places(), world.map().n_paths());
    println!("{n_paths} paths, {n_places} places, {n_topologies} local topologies");
    println!("| tour | planar | consistent | minimal | true map among these | time, ms |");
    println!("|---|---|---|---|---|---|");
    for tour in TOURS {
        let (from, turns) = world.turns(tour).context("a route")?;
        let travel = world.travel(from, &turns);
        let truth = sightings(world.map(), from, turns.iter().copied());
        for assumptions in [Assumptions::HSSH_2004, Assumptions::HSSH_2004_PLANAR] {
            let params = MapTreeParams { assumptions, n_hypotheses_max: 100_000 };
            let tree = MapTree::of_travel(params, &travel).context("gateways that are there")?;
            anyhow::ensure!(!tree.is_truncated(), "room for all");
            let is_true = |leaf: &meetpoint_places::Hypothesis| leaf.sightings(&travel) == truth;
            anyhow::ensure!(tree.hypotheses().iter().any(is_true), "{tour}: the true map is lost");
            println!(
                "| {tour} | {} | {} | {} | {} | {:.3} |",
                if assumptions.is_planar { "yes" } else { "no" },
                tree.hypotheses().len(),
                tree.minimal().len(),
                if tree.minimal().iter().any(is_true) { "yes" } else { "no" },
                time_ms(params, &travel)
            );
        }
    }
    Ok(())
}
