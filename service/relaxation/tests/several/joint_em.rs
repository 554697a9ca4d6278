//! Expectation maximisation over several travels, against dense matrices in double precision.

use meetpoint_geometry::{Point2, Pose};
use meetpoint_relaxation::{
    Area, Calibration, Em, JointEm, JointTravel, LandmarkKind, Start, StartBelief,
};
use proptest::prelude::*;

use crate::definition::{Map, World, probabilities};
use crate::worlds::{grid, params, random_landmarks, random_travel};

/// What a travel adds to the counts of (19) and (20): hits by kind, looks; and its log-likelihood. Written
/// for all paths at once; `None` if the travel is impossible.
fn counts(world: &World<'_>, map: &Map) -> Option<(Map, Vec<f64>, f64)> {
    let (posteriors, log_likelihood) = posteriors(world, map)?;
    let mut hits = vec![vec![0.0; world.nodes.len()]; world.kinds.len()];
    let mut looks = vec![0.0; world.nodes.len()];
    for (step, posterior) in world.travel.steps.iter().zip(&posteriors) {
        for (&from, &weight) in world.cells.iter().zip(posterior) {
            for (index, &node) in world.nodes.iter().enumerate() {
                looks[index] += if world.in_view(step, from, node) { weight } else { 0.0 };
                for sighting in &step.sightings {
                    let at = world.at(sighting, from, node) * weight;
                    if 0.0 < at {
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
    Some((hits, looks, log_likelihood))
}

/// `alpha beta` of all steps.
fn posteriors(world: &World<'_>, map: &Map) -> Option<(Vec<Vec<f64>>, f64)> {
    let (n, steps) = (world.cells.len(), &world.travel.steps);
    let sees = |step: usize, cell: usize| world.perception(map, &steps[step], world.cells[cell]);
    let moves = |step: usize, from: usize, to: usize| {
        world.motion(step, world.cells[from], world.cells[to])
    };
    let mut alphas: Vec<Vec<f64>> = Vec::new();
    let mut log_likelihood = 0.0;
    for step in 0..steps.len() {
        let reached = |to: usize| match alphas.last() {
            None => world.start(world.cells[to]),
            Some(before) => (0..n).map(|from| before[from] * moves(step - 1, from, to)).sum(),
        };
        let alpha: Vec<f64> = (0..n).map(|to| reached(to) * sees(step, to)).collect();
        let sum: f64 = alpha.iter().sum();
        if sum <= 1e-12 {
            return None;
        }
        log_likelihood += sum.ln();
        alphas.push(alpha.iter().map(|value| value / sum).collect());
    }
    let mut beta = vec![1.0; n];
    let mut posteriors = Vec::new();
    for step in (0..steps.len()).rev() {
        let product: Vec<f64> = alphas[step].iter().zip(&beta).map(|(a, b)| a * b).collect();
        let sum: f64 = product.iter().sum();
        posteriors.push(product.iter().map(|value| value / sum).collect());
        if 0 < step {
            let weighed: Vec<f64> = (0..n).map(|to| sees(step, to) * beta[to]).collect();
            let before = |from: usize| -> f64 {
                (0..n).map(|to| moves(step - 1, from, to) * weighed[to]).sum()
            };
            beta = (0..n).map(before).collect();
            let max = beta.iter().copied().fold(0.0, f64::max);
            for value in &mut beta {
                *value /= max;
            }
        }
    }
    posteriors.reverse();
    Some((posteriors, log_likelihood))
}

/// One map from the counts of all travels.
fn m_step(p: f64, all: &[(Map, Vec<f64>, f64)]) -> Map {
    let (n_kinds, n_nodes) = (all[0].0.len(), all[0].1.len());
    let hits = |kind: usize, node: usize| all.iter().map(|it| it.0[kind][node]).sum::<f64>();
    let of_node = |kind: usize, node: usize| {
        let n_hits: f64 = (0..n_kinds).map(|kind| hits(kind, node)).sum();
        let looks: f64 = all.iter().map(|it| it.1[node]).sum();
        let n = (p * looks).max(n_hits);
        if 0.0 < n { hits(kind, node) / n } else { 0.0 }
    };
    (0..n_kinds).map(|kind| (0..n_nodes).map(|node| of_node(kind, node)).collect()).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn equals_the_definition_and_never_falls(seed: u64, n_types in 1_u32..3) {
        let grid = grid(5, 5);
        let anywhere = Area { min: Point2::new(-1.0, -1.0), max: Point2::new(9.0, 9.0) };
        let covariance = [[2.0, 0.5, 0.1], [0.5, 1.0, 0.0], [0.1, 0.0, 0.3]];
        let second = if seed.is_multiple_of(2) {
            StartBelief::Within(anywhere)
        } else {
            StartBelief::About { pose: Pose::new(2.3, 1.8, 0.4), covariance }
        };
        let starts = [StartBelief::At(Pose::IDENTITY), second];
        let travels = [random_travel(seed, 5, n_types), random_travel(seed ^ 1, 4, n_types)];
        let params = starts.map(|start| params(grid, start));
        let landmarks = random_landmarks(seed, &grid, 4, n_types);
        let joint = |index: usize| JointTravel {
            travel: &travels[index],
            start: starts[index],
            calibration: Calibration::NONE,
        };
        let mut em = JointEm::new(&[joint(0), joint(1)], params[0], &landmarks);
        let worlds = [0, 1].map(|at| World::new(&travels[at], &params[at], em.map().kinds()));
        let mut map = probabilities(em.map());
        let mut before = f64::NEG_INFINITY;
        for _ in 0..3 {
            let all: Option<Vec<_>> = worlds.iter().map(|world| counts(world, &map)).collect();
            let Some(all) = all else { return Ok(()) };
            let log_likelihood: f64 = all.iter().map(|it| it.2).sum();
            prop_assert!(before <= log_likelihood + 1e-9, "{} after {}", log_likelihood, before);
            before = log_likelihood;
            map = m_step(1.0 - params[0].perception.missed, &all);
            let found = em.iterate().log_likelihood.expect("there was a map");
            prop_assert!((found - log_likelihood).abs() < 4e-3, "{} not {}", found, log_likelihood);
            for (fast, exact) in probabilities(em.map()).iter().flatten().zip(map.iter().flatten()) {
                prop_assert!((fast - exact).abs() < 2e-3, "{} not {}", fast, exact);
            }
        }
    }

    #[test]
    fn of_one_travel_it_is_what_it_was(seed: u64) {
        let grid = grid(5, 5);
        let params = params(grid, StartBelief::At(Pose::IDENTITY));
        let travel = random_travel(seed, 5, 2);
        let landmarks = random_landmarks(seed, &grid, 4, 2);
        let start = params.start;
        let one = JointTravel { travel: &travel, start, calibration: Calibration::NONE };
        let mut joint = JointEm::new(&[one], params, &landmarks);
        let mut alone = Em::new(&travel, params, Start::Map(&landmarks));
        for _ in 0..2 {
            prop_assert_eq!(joint.iterate().log_likelihood, alone.iterate().log_likelihood);
        }
        prop_assert_eq!(Some(joint.map()), alone.map());
        prop_assert_eq!(joint.paths()[0].clone(), alone.path());
    }
}
