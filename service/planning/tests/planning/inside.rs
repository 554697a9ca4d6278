//! Searches within a region against Dijkstra's algorithm there, on floors wider than a word of bits.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};
use std::sync::Arc;

use meetpoint_geometry::{Cell, GridFrame, GridInfo, Point2};
use meetpoint_planning::{ArcCost, Cost, Plans, Scratch, Space, UNREACHABLE, WEIGHT_ONE};
use meetpoint_topology::{Crossing, FreeSpace, Partition, Region, TopologicalGraph, partition};
use proptest::prelude::*;

/// What stands on a floor.
#[derive(Clone, Copy, Debug)]
enum Plan {
    /// So many cells of a hundred are walls.
    Speckle(u8),
    /// Passages one cell wide.
    Maze,
    /// Rooms of so many cells with a door in most walls.
    Rooms(usize),
    /// Speckle, and cells of all weights.
    Dear,
}

/// How a floor is cut into regions.
#[derive(Clone, Copy, Debug)]
enum Cuts {
    None,
    /// Blocks of so many cells with ragged edges.
    Ragged(usize),
    /// One region, from which so many cells of a thousand are cut out.
    Holes(u16),
}

#[derive(Clone, Debug)]
struct Floor {
    width: usize,
    height: usize,
    plan: Plan,
    cuts: Cuts,
    seed: u64,
}

const WIDTH_MAX: usize = 150;
const HEIGHT_MAX: usize = 70;

fn floors() -> impl Strategy<Value = Floor> {
    let plan = prop_oneof![
        (0..3_u8).prop_map(Plan::Speckle),
        (3..45_u8).prop_map(Plan::Speckle),
        Just(Plan::Maze),
        (5..30_usize).prop_map(Plan::Rooms),
        Just(Plan::Dear),
    ];
    let cuts = prop_oneof![
        Just(Cuts::None),
        (20..70_usize).prop_map(Cuts::Ragged),
        (1..40_u16).prop_map(Cuts::Holes),
    ];
    // Either way may be the longer one.
    (60..WIDTH_MAX, 3..HEIGHT_MAX, any::<bool>(), plan, cuts, any::<u64>()).prop_map(
        |(long, short, is_wide, plan, cuts, seed)| {
            let [width, height] = if is_wide { [long, short] } else { [short, long] };
            Floor { width, height, plan, cuts, seed }
        },
    )
}

struct Made {
    space: Arc<Space>,
    partition: Arc<Partition>,
    graph: TopologicalGraph,
}

impl Floor {
    /// Evenly below 1000: `SplitMix64` of the cell.
    fn noise(&self, x: usize, y: usize, salt: u64) -> u16 {
        let cell = (y * WIDTH_MAX + x) as u64;
        let mut bits = (self.seed ^ salt).wrapping_add(cell.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        bits = (bits ^ bits >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ bits >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        u16::try_from((bits ^ bits >> 31) % 1000).expect("below 1000")
    }

    fn weight(&self, x: usize, y: usize) -> u8 {
        let noise = self.noise(x, y, 0);
        let is_wall = match self.plan {
            Plan::Speckle(percent) => noise < 10 * u16::from(percent),
            Plan::Maze => match [x % 2, y % 2] {
                [1, 1] => false,
                [0, 0] => true,
                _ => noise < 480,
            },
            Plan::Rooms(side) => (x.is_multiple_of(side) || y.is_multiple_of(side)) && 120 < noise,
            Plan::Dear => noise < 150,
        };
        match self.plan {
            _ if is_wall => 0,
            Plan::Dear if noise < 400 => u8::try_from(noise % 100).expect("below 100") + WEIGHT_ONE,
            _ => WEIGHT_ONE,
        }
    }

    /// A name for the cells that may be of one region.
    fn label(&self, x: usize, y: usize) -> usize {
        let noise = usize::from(self.noise(x, y, 1 << 40));
        match self.cuts {
            Cuts::None => 0,
            Cuts::Ragged(side) => (x + noise % 3) / side + (y + noise % 4) / side * 1000,
            Cuts::Holes(permille) => usize::from(noise < usize::from(permille)),
        }
    }

    fn made(&self) -> Made {
        let frame = GridFrame::new(0.05).expect("a length");
        let size = [self.width, self.height].map(|n| u32::try_from(n).expect("small"));
        let first = Cell { x: 5, y: -7 };
        let info = GridInfo { frame, first, width: size[0], height: size[1] };
        let places = (0..self.height).flat_map(|y| (0..self.width).map(move |x| (x, y)));
        let is_free: Vec<bool> = places.clone().map(|(x, y)| 0 < self.weight(x, y)).collect();
        let free = FreeSpace::from_cells(info, &is_free);
        let rimmed = free.info();
        let at = |x: usize, y: usize| (y + 1) * rimmed.width as usize + x + 1;
        let mut weights = vec![0; rimmed.n_cells()];
        let mut cuts = vec![];
        for (x, y) in places {
            weights[at(x, y)] = self.weight(x, y);
            for (right, up) in [(x + 1, y), (x, y + 1)] {
                let is_inside = right < self.width && up < self.height;
                if is_inside && self.label(x, y) != self.label(right, up) {
                    cuts.push(Crossing { left: at(x, y), right: at(right, up) });
                }
            }
        }
        let partition = partition(&free, &cuts);
        let graph = graph(&partition, &cuts);
        let space = Arc::new(Space::new(rimmed, weights).expect("a weight a cell"));
        Made { space, partition: Arc::new(partition), graph }
    }
}

/// One arc for all crossings between two regions.
fn graph(partition: &Partition, cuts: &[Crossing]) -> TopologicalGraph {
    let mut portals: BTreeMap<_, Vec<Crossing>> = BTreeMap::new();
    for &cut in cuts {
        let sides = [cut.left, cut.right].map(|index| partition.region_at(index));
        if let [Some(left), Some(right)] = sides
            && left != right
        {
            portals.entry([left.min(right), left.max(right)]).or_default().push(cut);
        }
    }
    let region = Region { area_m2: 0.0, center: Point2::origin(), clearance_m: 0.0 };
    let arc = |(regions, portal)| meetpoint_topology::Arc {
        regions,
        position: Point2::origin(),
        line: [Point2::origin(); 2],
        length_m: 0.0,
        width_m: 0.0,
        portal,
    };
    TopologicalGraph {
        regions: vec![region; partition.n_regions() as usize],
        arcs: portals.into_iter().map(arc).collect(),
    }
}

impl Made {
    fn may_step(&self, from: usize, to: usize, is_open: bool) -> bool {
        is_open || self.partition.region_at(from) == self.partition.region_at(to)
    }

    /// Dijkstra's algorithm, word for word, within regions unless arcs are open.
    fn costs_from(&self, start: usize, is_open: bool) -> Vec<Cost> {
        let mut costs = vec![UNREACHABLE; self.space.info().n_cells()];
        costs[start] = 0;
        let mut waiting = BinaryHeap::from([Reverse((0, start))]);
        while let Some(Reverse((cost, cell))) = waiting.pop() {
            if costs[cell] < cost {
                continue;
            }
            for (step, next) in self.space.steps(cell) {
                let through = cost + self.space.step_cost(cell, step);
                if through < costs[next] && self.may_step(cell, next, is_open) {
                    costs[next] = through;
                    waiting.push(Reverse((through, next)));
                }
            }
        }
        costs
    }

    fn cost_of_path(&self, cells: &[u32], is_open: bool) -> Option<Cost> {
        cells.windows(2).try_fold(0, |sum, pair| {
            let [from, to] = [pair[0], pair[1]].map(|cell| cell as usize);
            let (step, _) = self.space.steps(from).find(|&(_, next)| next == to)?;
            self.may_step(from, to, is_open).then(|| sum + self.space.step_cost(from, step))
        })
    }
}

fn check(floor: &Floor, is_open: bool, picks: &[usize]) -> Result<(), TestCaseError> {
    let made = floor.made();
    let arc = if is_open { ArcCost::Open(0) } else { ArcCost::Closed };
    let arcs = vec![arc; made.graph.arcs.len()];
    let plans =
        Plans::new(made.space.clone(), made.partition.clone(), &made.graph, &arcs, PAIR_BYTES_MAX);
    let n_cells = made.space.info().n_cells();
    let enterable: Vec<usize> =
        (0..n_cells).filter(|&cell| made.space.is_enterable(cell)).collect();
    let mut scratch = Scratch::default();
    for &pick in picks.iter().filter(|_| !enterable.is_empty()) {
        let start = enterable[pick % enterable.len()];
        let costs = made.costs_from(start, is_open);
        let region = made.partition.region_at(start);
        let is_near = |&&cell: &&usize| made.partition.region_at(cell) == region;
        for &goal in enterable.iter().filter(is_near).step_by(19) {
            let cost = plans.cost(start, goal, &mut scratch);
            prop_assert_eq!(cost, costs[goal], "from {} to {}", start, goal);
            let path = plans.path(start, goal, &mut scratch);
            prop_assert_eq!(path.is_some(), cost < UNREACHABLE, "a path where there is a cost");
            let Some(path) = path else { continue };
            prop_assert_eq!(path.cells.first().map(|&cell| cell as usize), Some(start), "start");
            prop_assert_eq!(path.cells.last().map(|&cell| cell as usize), Some(goal), "goal");
            prop_assert_eq!(made.cost_of_path(&path.cells, is_open), Some(cost), "as long");
        }
    }
    Ok(())
}

/// Enough for some floors, not for others.
const PAIR_BYTES_MAX: usize = 1 << 20;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// With all arcs closed, nothing but the search within the region answers.
    #[test]
    fn alone_equals_dijkstra(
        floor in floors(),
        picks in proptest::collection::vec(any::<usize>(), 4),
    ) {
        check(&floor, false, &picks)?;
    }

    /// With all arcs open, it answers below what ways around cost.
    #[test]
    fn below_a_limit_equals_dijkstra(
        floor in floors(),
        picks in proptest::collection::vec(any::<usize>(), 4),
    ) {
        check(&floor, true, &picks)?;
    }
}
