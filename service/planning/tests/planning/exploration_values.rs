//! Exploration against its definition: Dijkstra's algorithm on cells that are looked at one by one.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use meetpoint_geometry::{Cell, GridFrame, GridInfo, Point2};
use meetpoint_planning::{Errand, Exploration, ExplorationParams, Explored, Ground, Known, Way};
use proptest::prelude::*;

/// Edge of a cell, in metres: a power of two, so that nothing is rounded.
const SIDE_M: f64 = 0.25;

fn info(width: u32, height: u32) -> GridInfo {
    let frame = GridFrame::new(SIDE_M).expect("a length");
    GridInfo { frame, first: Cell { x: -3, y: 5 }, width, height }
}

/// A map at random, with a ring of cells about it as values have.
#[derive(Clone, Debug)]
struct Floor {
    info: GridInfo,
    log_odds: Vec<f32>,
    radius_m: f64,
    /// Probability from which on a cell is closed.
    closed_from: f32,
}

fn floor() -> impl Strategy<Value = Floor> {
    let log_odds = prop_oneof![
        8 => Just(-3.0_f32), 2 => Just(f32::NAN), 2 => -2.0_f32..-0.1, 2 => Just(2.0_f32),
        1 => 0.1_f32..0.8
    ];
    let radius = prop_oneof![3 => Just(0.0), 1 => 0.01_f64..0.6];
    (1..14_u32, 1..14_u32, prop::collection::vec(log_odds, 14 * 14), radius).prop_map(
        |(width, height, log_odds, radius_m)| {
            let info = info(width, height);
            let log_odds = log_odds[..info.n_cells()].to_vec();
            Floor { info, log_odds, radius_m, closed_from: 0.5 }
        },
    )
}

impl Floor {
    /// What is known of a cell beyond the ring: outside is closed.
    fn at(&self, x: i32, y: i32) -> Option<f32> {
        let Cell { x: x_first, y: y_first } = self.info.first;
        self.info.index_of(Cell { x: x + x_first, y: y + y_first }).map(|at| self.log_odds[at])
    }

    /// Whether the centre of the robot can be in a cell, by looking at the squares of all others.
    fn is_open(&self, x: i32, y: i32) -> bool {
        let rho = self.radius_m.hypot(SIDE_M / 2.0);
        let around = |at: i32| at - 5..=at + 5;
        let beside_m = |n: i32| (f64::from(n.abs()) - 0.5).max(0.0) * SIDE_M;
        let mut near = around(y).flat_map(|y| around(x).map(move |x| (x, y)));
        near.all(|(to_x, to_y)| {
            let closed_from = (self.closed_from / (1.0 - self.closed_from)).ln();
            let is_clear = self.at(to_x, to_y).is_some_and(|it| it.is_nan() || it < closed_from);
            is_clear || rho <= beside_m(to_x - x).hypot(beside_m(to_y - y))
        })
    }

    /// Costs and goals by the definition, with the ring.
    fn ground(&self, params: &ExplorationParams) -> Vec<Ground> {
        let (width, height) = (self.info.width.cast_signed(), self.info.height.cast_signed());
        let cells = (-1..=height).flat_map(|y| (-1..=width).map(move |x| (x, y)));
        let is_unexplored = |x, y| self.is_open(x, y) && self.at(x, y).is_some_and(f32::is_nan);
        let ground = |(x, y)| {
            let odds = self.at(x, y).unwrap_or(0.0).exp();
            let probability = if odds.is_nan() { 0.5 } else { odds / (1.0 + odds) };
            let probability = (100.0 * probability).round() / 100.0;
            let is_doubtful = 0.0 < odds && 0.5 <= probability;
            let dear = if is_doubtful { probability + params.doubt_cost } else { probability };
            let cost = if self.is_open(x, y) { params.step_cost + dear } else { f32::INFINITY };
            let is_goal = is_unexplored(x, y) && {
                let mut piece = vec![(x, y)];
                let mut n_done = 0;
                while let Some(&(x, y)) = piece.get(n_done) {
                    n_done += 1;
                    for to in [(x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)] {
                        if is_unexplored(to.0, to.1) && !piece.contains(&to) {
                            piece.push(to);
                        }
                    }
                }
                params.unexplored_min_m.powi(2) <= piece.len() as f64 * SIDE_M.powi(2)
            };
            Ground { cost, is_goal }
        };
        cells.map(ground).collect()
    }

    fn stride(&self) -> usize {
        self.info.width as usize + 2
    }

    fn explored(&self, exploration: &mut Exploration, robots: &[Point2<f64>]) -> Explored {
        let known = Known { info: self.info, log_odds: &self.log_odds, closed: &[] };
        exploration.explore(&known, robots).expect("fits")
    }
}

/// E. W. Dijkstra's algorithm from the goals, by cells in rows of `stride`.
fn dijkstra(ground: &[Ground], stride: usize, diagonal: f32) -> Vec<f32> {
    let mut values = vec![f32::INFINITY; ground.len()];
    let mut ahead = BinaryHeap::new();
    for (cell, _) in ground.iter().enumerate().filter(|(_, ground)| ground.is_goal) {
        values[cell] = 0.0;
        ahead.push((Reverse(0_u32), cell));
    }
    let at = |x: i32, y: i32| {
        let (width, height) = (stride, ground.len() / stride);
        let [x, y] = [x, y].map(|at| usize::try_from(at).ok());
        Some((x.filter(|&x| x < width)?, y.filter(|&y| y < height)?)).map(|(x, y)| y * stride + x)
    };
    // Bits of floats that are not negative are ordered as they are.
    while let Some((Reverse(bits), to)) = ahead.pop() {
        if values[to].to_bits() < bits || !ground[to].cost.is_finite() {
            continue;
        }
        let [x, y] = [to % stride, to / stride].map(|at| i32::try_from(at).expect("small"));
        for (dx, dy) in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy))) {
            let Some(from) = at(x + dx, y + dy) else { continue };
            let is_closed =
                |cell: Option<usize>| cell.is_none_or(|at| ground[at].cost.is_infinite());
            let cost = ground[to].cost;
            let step = match (dx, dy) {
                (0, 0) => continue,
                (0, _) | (_, 0) => cost,
                _ if is_closed(at(x + dx, y)) || is_closed(at(x, y + dy)) => continue,
                _ => diagonal * cost,
            };
            let value = values[to] + step;
            if value < values[from] {
                values[from] = value;
                ahead.push((Reverse(value.to_bits()), from));
            }
        }
    }
    values
}

/// All values, and what they were made of.
fn kept(exploration: &Exploration) -> (Vec<u32>, Vec<Ground>) {
    let values = exploration.values().expect("asked");
    let n_cells = values.info().n_cells();
    let bits = (0..n_cells).map(|cell| values.value(cell).to_bits()).collect();
    (bits, exploration.ground().to_vec())
}

proptest! {
    #[test]
    fn values_are_those_of_the_definition(
        mut floor in floor(),
        kind in 0..3_usize,
        unexplored_min_m in prop_oneof![Just(0.0), Just(0.5)],
    ) {
        let kinds =
            [ExplorationParams::THRUN_1998, ExplorationParams::INDOOR, ExplorationParams::HEARD];
        let params = kinds[kind];
        floor.closed_from = params.closed_from;
        let params = ExplorationParams { radius_m: floor.radius_m, unexplored_min_m, ..params };
        let mut exploration = Exploration::new(params);
        floor.explored(&mut exploration, &[]);
        let ground = floor.ground(&params);
        prop_assert_eq!(exploration.ground(), &ground[..]);
        let values = dijkstra(&ground, floor.stride(), params.diagonal);
        let values: Vec<u32> = values.into_iter().map(f32::to_bits).collect();
        prop_assert_eq!(kept(&exploration).0, values);
    }

    #[test]
    fn what_is_kept_changes_nothing(
        first in floor(),
        changes in prop::collection::vec(
            (prop::collection::vec((any::<prop::sample::Index>(), -3.0_f32..3.0), 0..5),
             prop::collection::vec((0.0_f64..4.0, 0.0_f64..4.0), 0..4)), 1..5),
    ) {
        let params = ExplorationParams { radius_m: first.radius_m, ..ExplorationParams::INDOOR };
        let (mut floor, mut exploration) = (first, Exploration::new(params));
        for (changes, robots) in changes {
            for (at, log_odds) in changes {
                *at.get_mut(&mut floor.log_odds) = log_odds;
            }
            let origin = floor.info.origin();
            let robots: Vec<_> =
                robots.into_iter().map(|(x, y)| Point2::new(origin.x + x, origin.y + y)).collect();
            let mut fresh = Exploration::new(params);
            let of_fresh = floor.explored(&mut fresh, &robots);
            let of_kept = floor.explored(&mut exploration, &robots);
            prop_assert_eq!(kept(&exploration), kept(&fresh));
            prop_assert_eq!(of_kept.errands, of_fresh.errands);
            prop_assert_eq!(of_kept.frontiers, of_fresh.frontiers);
        }
    }

    #[test]
    fn goals_differ_and_ways_are_clear(
        floor in floor(),
        robots in prop::collection::vec((0.0_f64..4.0, 0.0_f64..4.0), 1..5),
    ) {
        let params = ExplorationParams {
            radius_m: floor.radius_m, sight_m: 0.6, unexplored_min_m: 0.0, ..ExplorationParams::INDOOR
        };
        let origin = floor.info.origin();
        let robots: Vec<_> =
            robots.into_iter().map(|(x, y)| Point2::new(origin.x + x, origin.y + y)).collect();
        let explored = floor.explored(&mut Exploration::new(params), &robots);
        let ways: Vec<&Way> = explored.errands.iter().filter_map(|errand| match errand {
            Errand::Go(way) => Some(way),
            _ => None,
        }).collect();
        for (number, way) in ways.iter().enumerate() {
            prop_assert!(ways[..number].iter().all(|other| other.goal != way.goal), "goals differ");
            let Cell { x, y } = floor.info.frame.cell_at(way.goal);
            let (x, y) = (x - floor.info.first.x, y - floor.info.first.y);
            prop_assert!(floor.is_open(x, y) && floor.at(x, y).is_some_and(f32::is_nan));
            let sum_m: f64 = way.points.windows(2).map(|ends| (ends[1] - ends[0]).norm()).sum();
            prop_assert!((sum_m - way.length_m).abs() < 1e-9, "{} m are {} m", sum_m, way.length_m);
        }
        let is_idle = explored.errands.iter().all(|errand| *errand != Errand::LeftToOthers);
        prop_assert!(is_idle || !ways.is_empty(), "left to others who go nowhere");
    }
}
