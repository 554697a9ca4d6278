//! Forward and backward against the sum over all paths of a three-node world, and the most likely
//! path against all of them.

use meetpoint_relaxation::{Em, PoseCell, Start};
use proptest::prelude::*;

use crate::definition::{Map, World, probabilities};
use crate::worlds::{grid, params, random_landmarks, random_travel, start};

const N_STEPS: usize = 4;

/// All paths, with their probabilities together with the observations.
fn paths(world: &World<'_>, map: &Map) -> Vec<(Vec<usize>, f64)> {
    let steps = &world.travel.steps;
    let perception =
        |step: usize, cell: usize| world.perception(map, &steps[step], world.cells[cell]);
    let first = (0..world.cells.len())
        .map(|cell| (vec![cell], world.start(world.cells[cell]) * perception(0, cell)));
    let mut paths: Vec<_> = first.collect();
    for step in 1..steps.len() {
        let mut longer = Vec::new();
        for (path, probability) in paths.into_iter().filter(|(_, probability)| *probability > 0.0) {
            for cell in 0..world.cells.len() {
                let from = world.cells[path[step - 1]];
                let motion = world.motion(step - 1, from, world.cells[cell]);
                let mut path = path.clone();
                path.push(cell);
                longer.push((path, probability * motion * perception(step, cell)));
            }
        }
        paths = longer;
    }
    paths
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn posterior_is_the_sum_over_all_paths(
        seed: u64,
        start in start(),
        n_types in 1_u32..3,
    ) {
        let grid = grid(3, 1);
        let params = params(grid, start);
        let travel = random_travel(seed, N_STEPS, n_types);
        let landmarks = random_landmarks(seed, &grid, 2, n_types);
        let em = Em::new(&travel, params, Start::Map(&landmarks));
        let map = em.map().expect("given");
        let world = World::new(&travel, &params, map.kinds());
        let paths = paths(&world, &probabilities(map));
        let total: f64 = paths.iter().map(|(_, probability)| probability).sum();
        prop_assume!(total > 1e-12);
        let posterior = em.posterior();
        prop_assert!(
            (posterior.log_likelihood - total.ln()).abs() < 1e-3,
            "{} is not {}", posterior.log_likelihood, total.ln()
        );
        for (step, belief) in posterior.beliefs.iter().enumerate() {
            for (index, &cell) in world.cells.iter().enumerate() {
                let through = paths.iter().filter(|(path, _)| path[step] == index);
                let expected = through.map(|(_, probability)| probability).sum::<f64>() / total;
                let found = f64::from(belief.at(cell));
                prop_assert!((found - expected).abs() < 1e-3, "{:?}: {} not {}", cell, found, expected);
            }
        }
        let best = paths.iter().map(|(_, probability)| *probability).fold(0.0, f64::max);
        let cells = em.most_likely_cells().expect("possible");
        let index = |cell: &PoseCell| world.cells.iter().position(|at| at == cell);
        let cells: Vec<usize> = cells.iter().filter_map(index).collect();
        let found = paths.iter().find(|(path, _)| *path == cells).map_or(0.0, |found| found.1);
        prop_assert!((found / best - 1.0).abs() < 1e-3, "{} of {}", found, best);
    }
}
