//! Searches in the grid against the equation that costs fulfil.

use meetpoint_geometry::{Cell, GridFrame, GridInfo};
use meetpoint_planning::{Cost, Search, Space, UNREACHABLE};
use proptest::prelude::*;

/// Cells with random weights, some of which cannot be entered.
fn spaces() -> impl Strategy<Value = Space> {
    (1..22_u32, 1..22_u32).prop_flat_map(|(width, height)| {
        let weight = prop_oneof![2 => Just(0_u8), 5 => Just(16_u8), 2 => 16..=255_u8];
        proptest::collection::vec(weight, (width * height) as usize).prop_map(move |weights| {
            let frame = GridFrame::new(0.05).expect("a length");
            let info = GridInfo { frame, first: Cell { x: 4, y: -9 }, width, height };
            Space::new(info, weights).expect("a weight a cell")
        })
    })
}

/// R. Bellman's equation, applied until nothing changes.
fn reference(space: &Space, seeds: &[(usize, Cost)]) -> Vec<Cost> {
    let mut costs = vec![UNREACHABLE; space.info().n_cells()];
    for &(cell, cost) in seeds.iter().filter(|(cell, _)| space.is_enterable(*cell)) {
        costs[cell] = costs[cell].min(cost);
    }
    loop {
        let before = costs.clone();
        for cell in 0..costs.len() {
            for (step, next) in space.steps(cell) {
                costs[cell] = costs[cell].min(costs[next] + space.step_cost(cell, step));
            }
        }
        if costs == before {
            return costs;
        }
    }
}

/// What the steps along a path cost.
fn cost_of(space: &Space, path: &[usize]) -> Cost {
    let step = |ends: &[usize]| {
        let (step, _) = space.steps(ends[0]).find(|&(_, to)| to == ends[1]).expect("a step");
        space.step_cost(ends[0], step)
    };
    path.windows(2).map(step).sum()
}

proptest! {
    #[test]
    fn costs_fulfil_bellmans_equation(
        spaces in proptest::collection::vec(spaces(), 1..3),
        seeds in proptest::collection::vec((any::<prop::sample::Index>(), 0..60_000_u32), 0..4),
        cost_max in prop_oneof![Just(Cost::MAX), 0..40_000_u32],
    ) {
        let mut search = Search::default();
        for space in &spaces {
            let n_cells = space.info().n_cells();
            let seeds: Vec<_> = seeds.iter().map(|(at, cost)| (at.index(n_cells), *cost)).collect();
            search.flood(space, seeds.iter().copied(), cost_max);
            let truth = reference(space, &seeds);
            let mut n_reached = 0;
            for (cell, &cost) in truth.iter().enumerate() {
                let is_reached = cost <= cost_max && cost < UNREACHABLE;
                n_reached += usize::from(is_reached);
                let wanted = if is_reached { cost } else { UNREACHABLE };
                prop_assert_eq!(search.cost(cell), wanted, "cell {} from {:?}", cell, &seeds);
            }
            prop_assert_eq!(search.touched().len(), n_reached);
        }
    }

    #[test]
    fn from_cell_to_cell_as_from_cell_to_all(
        space in spaces(),
        pairs in proptest::collection::vec(any::<[prop::sample::Index; 2]>(), 1..5),
    ) {
        let mut search = Search::default();
        for pair in pairs {
            let [from, to] = pair.map(|at| at.index(space.info().n_cells()));
            let truth = reference(&space, &[(from, 0)])[to];
            let found = search.between(&space, from, to);
            prop_assert_eq!(found, Some(truth).filter(|&cost| cost < UNREACHABLE));
            let path = search.path(&space, to);
            prop_assert_eq!(path.is_empty(), found.is_none(), "a way, or none");
            if let Some(cost) = found {
                prop_assert_eq!([path[0], path[path.len() - 1]], [from, to], "from end to end");
                prop_assert_eq!(cost_of(&space, &path), cost, "the way costs what it is said to");
            }
        }
    }
}
