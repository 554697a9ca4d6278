//! The planners compared on one map.

use std::collections::BTreeMap;
use std::sync::Arc;

use meetpoint_planning::{
    ArcCost, FinalGoalPlan, GridPath, Grouping, PartGraph, PartIndex, Parts, Plans, Scratch,
    TopologicalPlans, Transit, TripletPlans, backups,
};

use crate::map::{Map, Regions};
use crate::pairs::{GoalPairs, pairs};
use crate::tally::{N_BINS, Outcome, Tally, cells};

/// Memory for costs between all portal cells, in bytes.
const PAIR_BYTES_MAX: usize = 64 << 20;

/// Which graph is planned in.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum GraphKind {
    Regular,
    Pruned,
}

/// What was found in one graph.
pub(crate) struct Comparison {
    pub(crate) kind: GraphKind,
    /// Edge of a cell, in metres.
    pub(crate) resolution_m: f64,
    pub(crate) n_cells: usize,
    pub(crate) n_regions: usize,
    pub(crate) n_cycles: usize,
    pub(crate) n_triplets: usize,
    /// Cells of a shortest path, on average.
    pub(crate) mean_path_cells: f64,
    /// Regions of a topological plan, on average.
    pub(crate) mean_plan_regions: f64,
    pub(crate) grid_backups: f64,
    pub(crate) topological_backups: f64,
    /// Tables of paper, triplet and exact.
    pub(crate) n_bytes: [usize; 3],
    /// Losses of paper, triplet and exact.
    pub(crate) tallies: [Tally; 3],
}

pub(crate) const MODES: [&str; 3] = ["paper", "triplet", "exact"];

/// All planners on a map, in its graph as it is and pruned.
pub(crate) fn compared(map: &Map, n_pairs: usize) -> [Comparison; 2] {
    let pairs = pairs(&map.space, n_pairs);
    let width = bin_cells(map, &pairs);
    let kinds = [(GraphKind::Regular, map.regular()), (GraphKind::Pruned, map.pruned())];
    kinds.map(|(kind, regions)| {
        let mut run = Run::new(map, &regions, width);
        for pairs in &pairs {
            run.plan(pairs);
        }
        run.comparison(kind, &regions)
    })
}

/// Width of a bin, in cells: the longest shortest path fills them.
fn bin_cells(map: &Map, pairs: &[GoalPairs]) -> f64 {
    let costs = pairs.iter().flat_map(|pairs| &pairs.starts).map(|&(_, cost)| cost);
    let longest = cells(costs.max().unwrap_or(0));
    // Whole metres, a start that is easy to read.
    let metres = (longest * map.resolution_m / N_BINS as f64).ceil().max(1.0);
    metres / map.resolution_m
}

struct Run {
    /// As the paper plans.
    topological: TopologicalPlans,
    triplets: TripletPlans,
    /// Openings told apart.
    openings: TripletPlans,
    exact: Plans,
    scratch: Scratch,
    n_path_cells: usize,
    n_plan_regions: usize,
    tallies: [Tally; 3],
}

impl Run {
    fn new(map: &Map, regions: &Regions, bin_cells: f64) -> Self {
        let (space, partition) = (&map.space, &regions.partition);
        let parts = Arc::new(Parts::new(space, partition));
        let graph = |grouping| {
            let graph = PartGraph::new(space.clone(), parts.clone(), grouping, |_, _| true);
            Arc::new(graph)
        };
        let pairs = graph(Grouping::Pairs);
        let arcs = vec![ArcCost::Open(0); regions.graph.arcs.len()];
        Self {
            topological: TopologicalPlans::new(&pairs),
            triplets: TripletPlans::new(pairs),
            openings: TripletPlans::new(graph(Grouping::Openings)),
            exact: Plans::new(
                space.clone(),
                partition.clone(),
                &regions.graph,
                &arcs,
                PAIR_BYTES_MAX,
            ),
            scratch: Scratch::default(),
            n_path_cells: 0,
            n_plan_regions: 0,
            tallies: std::array::from_fn(|_| Tally::new(bin_cells)),
        }
    }

    /// Plans from all starts to a goal.
    fn plan(&mut self, GoalPairs { goal, starts }: &GoalPairs) {
        let mut paper = PaperGoal::new(*goal);
        let mut together = BTreeMap::new();
        for &(start, optimum) in starts {
            let exact = self.exact.path(start, *goal, &mut self.scratch).expect("there is a way");
            let cost = self.exact.cost(start, *goal, &mut self.scratch);
            assert_eq!([cost, exact.route.cost], [optimum; 2], "exact from {start} to {goal}");
            let found = [
                paper.outcome(self, start),
                self.triplet_outcome(*goal, &exact, &mut together),
                [optimum; 2],
            ];
            for (tally, [best_in_plan, followed]) in self.tallies.iter_mut().zip(found) {
                tally.add(Outcome { optimum, best_in_plan, followed });
            }
            self.n_path_cells += exact.cells.len();
        }
    }

    /// Cost of the best path through the plan's parts, and of the one followed.
    fn triplet_outcome(
        &self,
        goal: usize,
        exact: &GridPath,
        together: &mut BTreeMap<Option<Transit>, FinalGoalPlan>,
    ) -> [u32; 2] {
        let graph = self.openings.graph();
        let transits = graph.transits_of(&exact.cells);
        let plan_from = |transits: &[Transit]| {
            FinalGoalPlan::along(graph, goal, transits).expect("a goal in a part")
        };
        let last = transits.last().copied();
        let last = together.entry(last).or_insert_with(|| plan_from(last.as_slice()));
        let start = exact.cells[0] as usize;
        let followed = self.openings.trip(start, &transits, last).expect("a plan for every path");
        let parts = graph.parts();
        let part = |cell: &u32| parts.at(*cell as usize);
        let n_crossed = exact.cells.windows(2).filter(|pair| part(&pair[0]) != part(&pair[1]));
        // A path that goes back and forth over a line is not what the plan says.
        let best_in_plan = if n_crossed.count() == transits.len() {
            exact.route.cost
        } else {
            plan_from(&transits).cost(graph, start)
        };
        [best_in_plan, followed.cost]
    }

    fn comparison(self, kind: GraphKind, regions: &Regions) -> Comparison {
        let size = self.exact.size();
        let n_pairs = self.tallies[0].all.n_pairs.max(1) as f64;
        let mean_path_cells = self.n_path_cells as f64 / n_pairs;
        let mean_plan_regions = self.n_plan_regions as f64 / n_pairs;
        let n_regions = self.triplets.graph().parts().n_parts();
        Comparison {
            kind,
            resolution_m: self.exact.space().info().frame.resolution_m(),
            n_cells: size.n_cells,
            n_regions,
            n_cycles: regions.n_cycles(),
            n_triplets: self.triplets.n_triplets(),
            mean_path_cells,
            mean_plan_regions,
            grid_backups: backups(size.n_cells, mean_path_cells),
            topological_backups: backups(n_regions, mean_plan_regions),
            n_bytes: [
                self.topological.n_bytes() + self.triplets.n_bytes(),
                self.openings.n_bytes(),
                size.region_bytes + size.gate_bytes,
            ],
            tallies: self.tallies,
        }
    }
}

/// Plans of the paper to one goal. What follows a part is the same in all of them.
struct PaperGoal {
    goal: usize,
    last: Option<FinalGoalPlan>,
    /// Best paths from every part through the parts of its plan.
    through: BTreeMap<PartIndex, FinalGoalPlan>,
}

impl PaperGoal {
    fn new(goal: usize) -> Self {
        Self { goal, last: None, through: BTreeMap::new() }
    }

    /// Cost of the best path through the plan's parts, and of the one followed.
    fn outcome(&mut self, run: &mut Run, start: usize) -> [u32; 2] {
        let graph = run.triplets.graph();
        let part = |cell| graph.parts().at(cell).expect("in a part");
        let plan = run.topological.plan(graph, part(start), part(self.goal));
        let plan = plan.expect("a plan for every path");
        let new = || FinalGoalPlan::new(graph, self.goal).expect("a goal in a part");
        let last = self.last.get_or_insert_with(new).clone();
        let followed = run.triplets.trip(start, &plan, &last).expect("a path for every plan");
        let mut through = last;
        for &transit in plan.iter().rev() {
            let longer = || through.from_before(graph, transit);
            through = self.through.entry(graph.from(transit)).or_insert_with(longer).clone();
        }
        run.n_plan_regions += plan.len() + 1;
        [through.cost(graph, start), followed.cost]
    }
}
