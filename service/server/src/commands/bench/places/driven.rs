//! Floors of a hundred places, driven through by what the maps ask for: how often they are known in
//! the end, and how long it takes.

use anyhow::Context;
use meetpoint_places::{
    Assumptions, Errand, Gateway, MapTree, MapTreeParams, Observation, PlaceId, Selection, Step,
    View, World, is_isomorphic, next_errand,
};
use meetpoint_sim::{ChaCha8Rng, street_grid};
use rand::{RngExt, SeedableRng};

use super::growth::SIDE;

/// Robots that are not done after so many travels never will be.
const N_TRAVELS_MAX: usize = 3000;
/// Hypotheses kept: as the service does.
const N_HYPOTHESES_MAX: usize = 300;
const N_FLOORS: u64 = 20;

/// How a drive ended.
struct Driven {
    n_travels: usize,
    n_rehearsals: usize,
    n_given_up: u64,
    /// The simplest map is the true one.
    is_true: bool,
    /// No map was left that fits.
    is_refuted: bool,
}

/// Prints the table.
pub(super) fn print() -> anyhow::Result<()> {
    println!(
        "| looks of places | gateways chosen by | floors | the true map | none fits | travels | of these rehearsals | given up |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for n_views in [1, 3, 10, 30] {
        for selection in [Selection::LeastRotation, Selection::MostRotation] {
            let driven = (1..=N_FLOORS).map(|seed| drive(seed, n_views, selection));
            let driven: Vec<Driven> = driven.collect::<anyhow::Result<_>>()?;
            let mean = |of: &dyn Fn(&Driven) -> f64| {
                driven.iter().map(of).sum::<f64>() / driven.len() as f64
            };
            println!(
                "| {n_views} | {selection:?} | {N_FLOORS} | {} | {} | {:.0} | {:.0} | {:.0} |",
                driven.iter().filter(|driven| driven.is_true).count(),
                driven.iter().filter(|driven| driven.is_refuted).count(),
                mean(&|driven| driven.n_travels as f64),
                mean(&|driven| driven.n_rehearsals as f64),
                mean(&|driven| driven.n_given_up as f64)
            );
        }
    }
    Ok(())
}

/// From home, which looks like nothing else; the others have one of `n_views` looks.
fn drive(seed: u64, n_views: u32, selection: Selection) -> anyhow::Result<Driven> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let world = World::from_drawing(&street_grid(SIDE, &mut rng)).context("a drawing")?;
    let looks: Vec<u32> = world.map().places().map(|_| rng.random_range(0..n_views)).collect();
    let seen = |at: Gateway| {
        let is_unique = at.place == PlaceId(0);
        let look = looks[at.place.0 as usize];
        let name = if is_unique { "home".to_owned() } else { look.to_string() };
        Observation { view: Some(View { name, is_unique }), ..world.map().observation(at) }
    };
    let mut at = Gateway { place: PlaceId(0), index: 0 };
    let assumptions = Assumptions::HSSH_2004_PLANAR;
    let params = MapTreeParams { assumptions, n_hypotheses_max: N_HYPOTHESES_MAX };
    let (mut tree, mut n_rehearsals) = (MapTree::new(params, seen(at)), 0);
    while tree.travel().steps.len() < N_TRAVELS_MAX {
        let turns = match next_errand(&tree, selection) {
            Errand::Rehearse(decision) => {
                n_rehearsals += 1;
                decision.rehearsal.turns
            }
            Errand::Confirm { turns, .. } => {
                n_rehearsals += 1;
                turns
            }
            Errand::Explore { turns, .. } => turns,
            Errand::Explored | Errand::Refuted => break,
        };
        let turn = turns[0];
        at = world.map().leads_to(world.map().turned(at, turn)).context("a whole world")?;
        tree.extend(Step { turn, seen: seen(at) }).context("a gateway that is there")?;
    }
    let simplest = tree.hypotheses().first();
    Ok(Driven {
        n_travels: tree.travel().steps.len(),
        n_rehearsals,
        n_given_up: tree.n_given_up(),
        is_true: simplest.is_some_and(|leaf| is_isomorphic(&leaf.map, world.map())),
        is_refuted: simplest.is_none(),
    })
}
