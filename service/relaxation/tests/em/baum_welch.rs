//! Iterations against dense matrices in double precision with an exact M-step: there the
//! likelihood never falls, and the fast ones do the same.

use meetpoint_relaxation::{Em, LandmarkKind, Start};
use proptest::prelude::*;

use crate::definition::{Map, World, probabilities};
use crate::worlds::{grid, params, random_landmarks, random_travel, start};

/// Probabilities of all cells at all steps, and the log-likelihood; `None` if it is impossible.
fn e_step(world: &World<'_>, map: &Map) -> Option<(Vec<Vec<f64>>, f64)> {
    let (n, steps) = (world.cells.len(), &world.travel.steps);
    let likelihood: Vec<Vec<f64>> = steps
        .iter()
        .map(|step| world.cells.iter().map(|&at| world.perception(map, step, at)).collect())
        .collect();
    let motion = |step: usize, from: usize, to: usize| {
        world.motion(step, world.cells[from], world.cells[to])
    };
    let mut log_likelihood = 0.0;
    let mut alphas: Vec<Vec<f64>> = Vec::new();
    for (step, likelihood) in likelihood.iter().enumerate() {
        let reached = |to: usize| match alphas.last() {
            None => world.start(world.cells[to]),
            Some(before) => (0..n).map(|from| before[from] * motion(step - 1, from, to)).sum(),
        };
        let mut alpha: Vec<f64> = (0..n).map(|to| reached(to) * likelihood[to]).collect();
        let sum: f64 = alpha.iter().sum();
        if sum <= 1e-12 {
            return None;
        }
        for value in &mut alpha {
            *value /= sum;
        }
        log_likelihood += sum.ln();
        alphas.push(alpha);
    }
    let mut beta = vec![1.0; n];
    let mut posteriors = Vec::new();
    for step in (0..steps.len()).rev() {
        let product: Vec<f64> = alphas[step].iter().zip(&beta).map(|(a, b)| a * b).collect();
        let sum: f64 = product.iter().sum();
        posteriors.push(product.iter().map(|value| value / sum).collect());
        if step > 0 {
            let weighed: Vec<f64> = (0..n).map(|to| likelihood[step][to] * beta[to]).collect();
            let before =
                |from: usize| (0..n).map(|to| motion(step - 1, from, to) * weighed[to]).sum();
            let mut before: Vec<f64> = (0..n).map(before).collect();
            let max = before.iter().copied().fold(0.0, f64::max);
            for value in &mut before {
                *value /= max;
            }
            beta = before;
        }
    }
    posteriors.reverse();
    Some((posteriors, log_likelihood))
}

/// The map that maximises the expected likelihood, by equations (19) and (20).
fn m_step(world: &World<'_>, map: &Map, posteriors: &[Vec<f64>]) -> Map {
    let n_kinds = world.kinds.len();
    let mut hits = vec![vec![0.0; world.nodes.len()]; n_kinds];
    let mut looks = vec![0.0; world.nodes.len()];
    for (step, posterior) in world.travel.steps.iter().zip(posteriors) {
        for (&from, &weight) in world.cells.iter().zip(posterior) {
            for (index, &node) in world.nodes.iter().enumerate() {
                if world.in_view(step, from, node) {
                    looks[index] += weight;
                }
                for sighting in &step.sightings {
                    let at = world.at(sighting, from, node) * weight;
                    if at > 0.0 {
                        let density = world.density(map, sighting, from);
                        for (is, hits) in hits.iter_mut().enumerate() {
                            let seen = LandmarkKind::of(sighting);
                            hits[index] += at * world.odds(map, seen, is, index) / density;
                        }
                    }
                }
            }
        }
    }
    let p = 1.0 - world.params.perception.missed;
    let of_kind = |is: usize| {
        let node = |index: usize| {
            let n_hits: f64 = hits.iter().map(|kind| kind[index]).sum();
            let n = (p * looks[index]).max(n_hits);
            if n > 0.0 { hits[is][index] / n } else { 0.0 }
        };
        (0..world.nodes.len()).map(node).collect()
    };
    (0..n_kinds).map(of_kind).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn likelihood_never_falls(seed: u64, start in start(), n_types in 1_u32..3) {
        let grid = grid(6, 5);
        let params = params(grid, start);
        let travel = random_travel(seed, 6, n_types);
        let landmarks = random_landmarks(seed, &grid, 4, n_types);
        let em = Em::new(&travel, params, Start::Map(&landmarks));
        let given = em.map().expect("given");
        let world = World::new(&travel, &params, given.kinds());
        let mut map = probabilities(given);
        let mut before = f64::NEG_INFINITY;
        for _ in 0..6 {
            let Some((posteriors, log_likelihood)) = e_step(&world, &map) else { return Ok(()) };
            prop_assert!(before <= log_likelihood + 1e-9, "{} after {}", log_likelihood, before);
            before = log_likelihood;
            map = m_step(&world, &map, &posteriors);
        }
    }

    #[test]
    fn the_fast_one_does_the_same(seed: u64, start in start(), n_types in 1_u32..3) {
        let grid = grid(6, 5);
        let params = params(grid, start);
        let travel = random_travel(seed, 6, n_types);
        let landmarks = random_landmarks(seed, &grid, 4, n_types);
        let mut em = Em::new(&travel, params, Start::Map(&landmarks));
        let given = em.map().expect("given");
        let world = World::new(&travel, &params, given.kinds());
        let mut map = probabilities(given);
        for _ in 0..3 {
            let Some((posteriors, log_likelihood)) = e_step(&world, &map) else { return Ok(()) };
            map = m_step(&world, &map, &posteriors);
            let found = em.iterate().log_likelihood.expect("there was a map");
            prop_assert!((found - log_likelihood).abs() < 2e-3, "{} not {}", found, log_likelihood);
            let fast = probabilities(em.map().expect("made"));
            for (fast, exact) in fast.iter().flatten().zip(map.iter().flatten()) {
                prop_assert!((fast - exact).abs() < 2e-3, "{} not {}", fast, exact);
            }
        }
    }
}
