//! Plan tables against Dijkstra in the grid, on random worlds cut into random regions.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap};
use std::sync::Arc;

use meetpoint_geometry::{Cell, GridFrame, GridInfo, Point2};
use meetpoint_planning::{ArcCost, Cost, Plans, Scratch, Space, TolledSearch, Tolls, UNREACHABLE};
use meetpoint_topology::{Crossing, FreeSpace, Partition, Region, TopologicalGraph, partition};
use proptest::prelude::*;

/// Cells, cuts between columns and rows, weights, and which arcs are closed or dear.
#[derive(Clone, Debug)]
struct World {
    width: u32,
    height: u32,
    weights: Vec<u8>,
    columns: BTreeSet<u32>,
    rows: BTreeSet<u32>,
    n_arcs_a_pair: usize,
    arc_costs: Vec<Option<u32>>,
}

fn worlds() -> impl Strategy<Value = World> {
    (4..26_u32, 4..26_u32).prop_flat_map(|(width, height)| {
        let n_cells = (width * height) as usize;
        let weight = prop_oneof![2 => Just(0_u8), 6 => Just(16_u8), 1 => 16..90_u8];
        let plain = prop_oneof![1 => Just(0_u8), 4 => Just(16_u8)];
        let weights = prop_oneof![
            proptest::collection::vec(weight, n_cells),
            proptest::collection::vec(plain, n_cells),
        ];
        let columns = proptest::collection::btree_set(1..width, 0..3);
        let rows = proptest::collection::btree_set(1..height, 0..3);
        let arc_cost =
            prop_oneof![4 => Just(Some(0)), 1 => (1..9000_u32).prop_map(Some), 1 => Just(None)];
        let arc_costs = proptest::collection::vec(arc_cost, 60);
        (Just(width), Just(height), weights, columns, rows, 1..4_usize, arc_costs).prop_map(
            |(width, height, weights, columns, rows, n_arcs_a_pair, arc_costs)| World {
                width,
                height,
                weights,
                columns,
                rows,
                n_arcs_a_pair,
                arc_costs,
            },
        )
    })
}

struct Made {
    space: Arc<Space>,
    partition: Arc<Partition>,
    graph: TopologicalGraph,
}

impl Made {
    fn plans(&self, arcs: &[ArcCost], pair_bytes_max: usize) -> Plans {
        let (space, partition) = (self.space.clone(), self.partition.clone());
        Plans::new(space, partition, &self.graph, arcs, pair_bytes_max)
    }
}

impl World {
    fn made(&self) -> Made {
        let frame = GridFrame::new(0.05).expect("a length");
        let first = Cell { x: -3, y: 11 };
        let info = GridInfo { frame, first, width: self.width, height: self.height };
        let is_free: Vec<bool> = self.weights.iter().map(|&weight| 0 < weight).collect();
        let free = FreeSpace::from_cells(info, &is_free);
        let rimmed = free.info();
        let mut weights = vec![0; rimmed.n_cells()];
        for y in 0..self.height {
            for x in 0..self.width {
                let to = ((y + 1) * rimmed.width + x + 1) as usize;
                weights[to] = self.weights[(y * self.width + x) as usize];
            }
        }
        let cuts = self.cuts(rimmed);
        let partition = partition(&free, &cuts);
        let graph = graph(&partition, &cuts, self.n_arcs_a_pair);
        let space = Arc::new(Space::new(rimmed, weights).expect("a weight a cell"));
        Made { space, partition: Arc::new(partition), graph }
    }

    fn cuts(&self, info: GridInfo) -> Vec<Crossing> {
        let at = |x: u32, y: u32| (y * info.width + x) as usize;
        let upright = self.columns.iter().flat_map(|&x| {
            (1..=self.height).map(move |y| Crossing { left: at(x, y), right: at(x + 1, y) })
        });
        let level = self.rows.iter().flat_map(|&y| {
            (1..=self.width).map(move |x| Crossing { left: at(x, y), right: at(x, y + 1) })
        });
        upright.chain(level).collect()
    }

    fn arc_costs(&self, graph: &TopologicalGraph) -> Vec<ArcCost> {
        let cost = |arc: usize| match self.arc_costs[arc % self.arc_costs.len()] {
            Some(toll) => ArcCost::Open(toll),
            None => ArcCost::Closed,
        };
        (0..graph.arcs.len()).map(cost).collect()
    }
}

/// Arcs between all pairs of regions, the crossings of a pair dealt out among several.
fn graph(partition: &Partition, cuts: &[Crossing], n_arcs_a_pair: usize) -> TopologicalGraph {
    let mut arcs: BTreeMap<_, Vec<Crossing>> = BTreeMap::new();
    for (at, &cut) in cuts.iter().enumerate() {
        let sides = [cut.left, cut.right].map(|index| partition.region_at(index));
        if let [Some(left), Some(right)] = sides
            && left != right
        {
            let pair = [left.min(right), left.max(right)];
            arcs.entry((pair, at / 3 % n_arcs_a_pair)).or_default().push(cut);
        }
    }
    let region = Region { area_m2: 0.0, center: Point2::origin(), clearance_m: 0.0 };
    let arc = |((regions, _), portal)| meetpoint_topology::Arc {
        regions,
        position: Point2::origin(),
        line: [Point2::origin(); 2],
        length_m: 0.0,
        width_m: 0.0,
        portal,
    };
    TopologicalGraph {
        regions: vec![region; partition.n_regions() as usize],
        arcs: arcs.into_iter().map(arc).collect(),
    }
}

/// Cost of every single step, by the definition.
struct Steps<'a> {
    made: &'a Made,
    arc_of: BTreeMap<(usize, usize), usize>,
    arcs: Vec<ArcCost>,
}

impl<'a> Steps<'a> {
    fn new(made: &'a Made, arcs: &[ArcCost]) -> Self {
        let mut arc_of = BTreeMap::new();
        for (at, arc) in made.graph.arcs.iter().enumerate() {
            for crossing in &arc.portal {
                arc_of.insert((crossing.left, crossing.right), at);
                arc_of.insert((crossing.right, crossing.left), at);
            }
        }
        Self { made, arc_of, arcs: arcs.to_vec() }
    }

    /// `None` where an arc on the way is closed.
    fn cost(&self, from: usize, step: usize) -> Option<Cost> {
        let Made { space, partition, graph } = self.made;
        let to = space.neighbor(from, step);
        let cost = space.step_cost(from, step);
        let [a, b] = [from, to].map(|cell| partition.region_at(cell).expect("free"));
        if a == b {
            return Some(cost);
        }
        let arc = |a, b| self.arc_of.get(&(a, b)).copied();
        let mut crossed: Vec<usize> = if step.is_multiple_of(2) {
            arc(from, to).into_iter().collect()
        } else {
            let beside = [space.neighbor(from, step - 1), space.neighbor(from, (step + 1) % 8)];
            beside.iter().flat_map(|&cell| [arc(from, cell), arc(cell, to)]).flatten().collect()
        };
        crossed.sort_unstable();
        crossed.dedup();
        // One arc that joins the two regions is enough, the first if there are several.
        if let Some(&one) = crossed.iter().find(|&&c| graph.arcs[c].regions == [a.min(b), a.max(b)])
        {
            crossed = vec![one];
        }
        crossed.into_iter().try_fold(cost, |sum, arc| match self.arcs[arc] {
            ArcCost::Open(toll) => Some(sum + toll),
            ArcCost::Closed => None,
        })
    }

    /// Dijkstra's algorithm, word for word.
    fn costs_from(&self, start: usize) -> Vec<Cost> {
        let space = &self.made.space;
        let mut costs = vec![UNREACHABLE; space.info().n_cells()];
        if !space.is_enterable(start) {
            return costs;
        }
        costs[start] = 0;
        let mut waiting = BinaryHeap::from([Reverse((0, start))]);
        while let Some(Reverse((cost, cell))) = waiting.pop() {
            if costs[cell] < cost {
                continue;
            }
            for (step, next) in space.steps(cell) {
                let Some(step) = self.cost(cell, step) else { continue };
                if cost + step < costs[next] {
                    costs[next] = cost + step;
                    waiting.push(Reverse((cost + step, next)));
                }
            }
        }
        costs
    }

    fn cost_of_path(&self, cells: &[u32]) -> Option<Cost> {
        let space = &self.made.space;
        cells.windows(2).try_fold(0, |sum, pair| {
            let [from, to] = [pair[0], pair[1]].map(|cell| cell as usize);
            let (step, _) = space.steps(from).find(|&(_, next)| next == to)?;
            Some(sum + self.cost(from, step)?)
        })
    }
}

/// Every pair of a few starts with all cells.
fn check(plans: &Plans, steps: &Steps<'_>, seed: usize) -> Result<(), TestCaseError> {
    let space = &steps.made.space;
    let n_cells = space.info().n_cells();
    let enterable: Vec<usize> = (0..n_cells).filter(|&cell| space.is_enterable(cell)).collect();
    let mut scratch = Scratch::default();
    for at in 0..3.min(enterable.len()) {
        let start = enterable[(seed + at * 37) % enterable.len()];
        let costs = steps.costs_from(start);
        for &goal in &enterable {
            let cost = plans.cost(start, goal, &mut scratch);
            prop_assert_eq!(cost, costs[goal], "from {} to {}", start, goal);
            let path = plans.path(start, goal, &mut scratch);
            prop_assert_eq!(path.is_some(), cost < UNREACHABLE, "a path where there is a cost");
            let Some(path) = path else { continue };
            prop_assert_eq!(path.route.cost, cost, "the route's");
            prop_assert_eq!(path.cells.first().map(|&cell| cell as usize), Some(start), "start");
            prop_assert_eq!(path.cells.last().map(|&cell| cell as usize), Some(goal), "goal");
            prop_assert_eq!(steps.cost_of_path(&path.cells), Some(cost), "legal, and as long");
            let next = plans.next_cell(start, goal, &mut scratch);
            prop_assert_eq!(next.is_none(), start == goal, "a motion but at the goal");
            let Some(next) = next else { continue };
            let step = [start, next].map(|cell| u32::try_from(cell).expect("few cells"));
            let step = steps.cost_of_path(&step).expect("a legal step");
            let onward = plans.cost(next, goal, &mut scratch);
            prop_assert_eq!(step + onward, cost, "no motion leads astray");
        }
        // Costs are the same both ways.
        check_towards(plans, steps, start, &costs)?;
    }
    Ok(())
}

/// Whether all that is asked about one goal is as `costs`, which lead there.
fn check_towards(
    plans: &Plans,
    steps: &Steps,
    goal: usize,
    costs: &[Cost],
) -> Result<(), TestCaseError> {
    let mut scratch = Scratch::default();
    let mut towards = plans.towards(goal);
    let enterable = (0..costs.len()).filter(|&cell| plans.space().is_enterable(cell));
    for from in enterable {
        let cost = towards.cost(from, &mut scratch);
        prop_assert_eq!(cost, costs[from], "from {} towards {}", from, goal);
        let next = towards.next_cell(from, &mut scratch);
        prop_assert_eq!(next.is_some(), from != goal && cost < UNREACHABLE, "a motion");
        let Some(next) = next else { continue };
        let step = [from, next].map(|cell| u32::try_from(cell).expect("few cells"));
        let step = steps.cost_of_path(&step).expect("a legal step");
        prop_assert_eq!(step + costs[next], cost, "no motion leads astray");
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    /// Tables, routes and cells equal the optimum in the grid, whatever is closed or dear.
    #[test]
    fn tables_equal_dijkstra(world in worlds(), seed in 0..1000_usize) {
        let made = world.made();
        let arcs = world.arc_costs(&made.graph);
        for pair_bytes_max in [usize::MAX / 2, 0] {
            let plans = made.plans(&arcs, pair_bytes_max);
            check(&plans, &Steps::new(&made, &arcs), seed)?;
        }
    }

    /// Tables after changes equal the optimum, and tables made afresh.
    #[test]
    fn changed_tables_equal_dijkstra(
        world in worlds(),
        seed in 0..1000_usize,
        blocked in proptest::collection::vec(0..900_usize, 0..12),
        dear in proptest::collection::vec((0..900_usize, 16..200_u8), 0..6),
    ) {
        let made = world.made();
        let open = vec![ArcCost::Open(0); made.graph.arcs.len()];
        let before = [usize::MAX / 2, 0].map(|bytes_max| made.plans(&open, bytes_max));
        let info = made.space.info();
        let mut weights: Vec<u8> = (0..info.n_cells()).map(|cell| made.space.weight(cell)).collect();
        for cell in blocked {
            let at = cell % weights.len();
            weights[at] = 0;
        }
        for (cell, weight) in dear {
            let at = cell % weights.len();
            weights[at] = if 0 < weights[at] { weight } else { 0 };
        }
        let space = Arc::new(Space::new(info, weights).expect("a weight a cell"));
        let arcs = world.arc_costs(&made.graph);
        let changed = before.map(|plans| plans.with_costs(space.clone(), &arcs));
        let opened = [0, 1].map(|at| changed[at].with_costs(made.space.clone(), &open));
        for plans in opened {
            check(&plans, &Steps::new(&made, &open), seed)?;
        }
        let made = Made { space, ..made };
        for plans in changed {
            check(&plans, &Steps::new(&made, &arcs), seed)?;
        }
    }

    /// So does a search without tables.
    #[test]
    fn search_with_tolls_equals_dijkstra(world in worlds(), seed in 0..1000_usize) {
        let made = world.made();
        let arcs = world.arc_costs(&made.graph);
        let (space, steps) = (&*made.space, Steps::new(&made, &arcs));
        let tolls = Tolls::new(space, &made.partition, &made.graph, &arcs);
        let (mut search, mut flood) = (TolledSearch::default(), TolledSearch::default());
        let start = seed % space.info().n_cells();
        let costs = steps.costs_from(start);
        flood.flood(space, &tolls, start, Cost::MAX);
        for (goal, &expected) in costs.iter().enumerate() {
            prop_assert_eq!(flood.cost(goal), expected, "from {} to {}", start, goal);
            let cost = search.between(space, &tolls, start, goal);
            prop_assert_eq!(cost.unwrap_or(UNREACHABLE), expected, "to {} alone", goal);
            let path = search.path(space, &tolls, goal);
            prop_assert_eq!(path.is_empty(), cost.is_none(), "a path where there is a cost");
            if cost.is_some() {
                prop_assert_eq!(path.first().map(|&cell| cell as usize), Some(start), "start");
                prop_assert_eq!(path.last().map(|&cell| cell as usize), Some(goal), "goal");
                prop_assert_eq!(steps.cost_of_path(&path), cost, "legal, and as long");
            }
        }
    }
}
