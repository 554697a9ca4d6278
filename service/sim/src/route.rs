//! Paths for simulated robots: shortest on the drawing's grid, then smoothed.
//!
//! Dijkstra over characters, eight neighbours, no cutting of corners; a step costs its length
//! times `1 + WALL_PENALTY (1 - clearance / CLEARANCE_WISHED_M)`, so that robots drive down the
//! middle of corridors and doors. E. W. Dijkstra, "A note on two problems in connexion with
//! graphs", Numerische Mathematik 1 (1959). Smoothing moves each point towards the middle of its
//! neighbours as long as it stays clear. Time O(characters log characters) a leg.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use meetpoint_geometry::{Cell, Point2, Vector2};

use crate::building::Building;

/// Walls nearer than this make a step dearer, in metres: half a corridor.
const CLEARANCE_WISHED_M: f64 = 1.0;
/// How much dearer a step along a wall is, as a multiple of its length.
const WALL_PENALTY: f64 = 3.0;
/// Cost of a metre; whole numbers add up the same in every order.
const COST_PER_M: f64 = 1.0e4;
/// Rounds of smoothing: corners of the grid's 45 degrees become curves of about a metre.
const N_SMOOTHING_ROUNDS: u32 = 20;
/// Distance between the points of a finished path, in metres.
const SPACING_M: f64 = 0.05;

const NEIGHBOURS: [(i32, i32); 8] =
    [(1, 0), (0, 1), (-1, 0), (0, -1), (1, 1), (-1, 1), (-1, -1), (1, -1)];

/// A path through all waypoints in their order that keeps `clearance_m` metres off the walls:
/// points of the building's frame a few centimetres apart. `None` if there is none, or fewer than
/// two waypoints.
pub fn route(
    building: &Building,
    waypoints: &[Point2<f64>],
    clearance_m: f64,
) -> Option<Vec<Point2<f64>>> {
    if waypoints.len() < 2 {
        return None;
    }
    let costs = step_costs(building, clearance_m);
    let mut points = vec![waypoints[0]];
    for leg in waypoints.windows(2) {
        let frame = building.info().frame;
        let cells = cheapest_path(building, &costs, frame.cell_at(leg[0]), frame.cell_at(leg[1]))?;
        points.extend(cells.into_iter().skip(1).map(|cell| frame.center_of(cell)));
    }
    for _ in 0..N_SMOOTHING_ROUNDS {
        smooth(building, clearance_m, &mut points);
    }
    Some(filled(&points))
}

/// Cost of a metre through each cell; `None` where a robot cannot be.
fn step_costs(building: &Building, clearance_m: f64) -> Vec<Option<f64>> {
    let info = building.info();
    let cost = |cell: Cell| {
        let center = info.frame.center_of(cell);
        let wished_m = CLEARANCE_WISHED_M.max(clearance_m);
        let clear_m = building.clearance_m(center, wished_m);
        building
            .is_free(center, clearance_m)
            .then(|| COST_PER_M * (1.0 + WALL_PENALTY * (1.0 - clear_m / wished_m)))
    };
    let side = |n: u32| 0..i32::try_from(n).unwrap_or(i32::MAX);
    side(info.height).flat_map(|y| side(info.width).map(move |x| cost(Cell { x, y }))).collect()
}

/// Cells from `start` to `goal`, both included.
fn cheapest_path(
    building: &Building,
    costs: &[Option<f64>],
    start: Cell,
    goal: Cell,
) -> Option<Vec<Cell>> {
    let info = building.info();
    let is_open = |cell: Cell| info.index_of(cell).is_some_and(|index| costs[index].is_some());
    let mut best = vec![u64::MAX; costs.len()];
    let mut before = vec![None; costs.len()];
    let mut queue = BinaryHeap::from([Reverse((0, start))]);
    best[info.index_of(start).filter(|_| is_open(start))?] = 0;
    while let Some(Reverse((cost, cell))) = queue.pop() {
        if cell == goal {
            break;
        }
        for (dx, dy) in NEIGHBOURS {
            let next = Cell { x: cell.x + dx, y: cell.y + dy };
            let sides = [Cell { x: next.x, y: cell.y }, Cell { x: cell.x, y: next.y }];
            let Some(index) = info.index_of(next).filter(|_| sides.into_iter().all(is_open)) else {
                continue;
            };
            let Some(per_m) = costs[index] else { continue };
            let cost = cost + step_cost(per_m * info.frame.resolution_m(), dx != 0 && dy != 0);
            if cost < best[index] {
                best[index] = cost;
                before[index] = Some(cell);
                queue.push(Reverse((cost, next)));
            }
        }
    }
    let mut path = vec![goal];
    while path[path.len() - 1] != start {
        path.push(before[info.index_of(path[path.len() - 1])?]?);
    }
    path.reverse();
    Some(path)
}

/// Cost of a step in whole numbers.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a small positive number, rounded"
)]
fn step_cost(straight: f64, is_diagonal: bool) -> u64 {
    let length = if is_diagonal { std::f64::consts::SQRT_2 } else { 1.0 };
    (straight * length).round() as u64
}

/// Moves each point between its neighbours where the way there stays clear; the ends stay.
fn smooth(building: &Building, clearance_m: f64, points: &mut [Point2<f64>]) {
    for i in 1..points.len().saturating_sub(1) {
        let (a, b, c) = (points[i - 1].coords, points[i].coords, points[i + 1].coords);
        let between = Point2::from((a + b * 2.0 + c) / 4.0);
        let way = filled(&[points[i - 1], between, points[i + 1]]);
        if way.into_iter().all(|point| building.is_free(point, clearance_m)) {
            points[i] = between;
        }
    }
}

/// The same path with points every few centimetres.
pub(crate) fn filled(points: &[Point2<f64>]) -> Vec<Point2<f64>> {
    let mut path = Vec::new();
    for pair in points.windows(2) {
        let step: Vector2<f64> = pair[1] - pair[0];
        let n_pieces = (step.norm() / SPACING_M).ceil().max(1.0);
        let shares = (0_u32..).map(f64::from).take_while(|&i| i < n_pieces);
        path.extend(shares.map(|i| pair[0] + step * (i / n_pieces)));
    }
    path.extend(points.last());
    path
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::tests::any_building;
    use proptest::prelude::*;

    fn length_m(path: &[Point2<f64>]) -> f64 {
        path.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum()
    }

    #[test]
    fn around_a_wall() {
        let building = Building::from_drawing(
            "#########
             #   #   #
             # A # B #
             #   #   #
             #       #
             #       #
             #########",
            0.5,
        )
        .expect("a drawing");
        let places = building.places("AB").expect("two places");
        let path = route(&building, &places, 0.2).expect("a way around");
        let straight_m = (places[1] - places[0]).norm();
        assert!(straight_m + 0.8 < length_m(&path), "{} m is a detour", length_m(&path));
        assert!(path.iter().all(|&point| building.is_free(point, 0.2)), "clear all the way");
        assert_eq!((path[0], path[path.len() - 1]), (places[0], places[1]), "the ends stay");
        assert_eq!(route(&building, &places, 0.6), None, "no way for a robot of that size");
        assert_eq!(route(&building, &places[..1], 0.2), None, "one place is no way");
    }

    /// Bellman and Ford's definition: relax every edge until nothing changes.
    fn reference_cost(building: &Building, costs: &[Option<f64>], start: Cell) -> Vec<u64> {
        let info = building.info();
        let cell_of = |index: usize| {
            let (x, y) = (index % info.width as usize, index / info.width as usize);
            Cell { x: i32::try_from(x).expect("small"), y: i32::try_from(y).expect("small") }
        };
        let is_open = |cell: Cell| info.index_of(cell).is_some_and(|i| costs[i].is_some());
        let mut best = vec![u64::MAX; costs.len()];
        best[info.index_of(start).expect("inside")] = 0;
        for _ in 0..costs.len() {
            for from in (0..costs.len()).filter(|&i| costs[i].is_some()) {
                let cell = cell_of(from);
                for (dx, dy) in NEIGHBOURS {
                    let to = Cell { x: cell.x + dx, y: cell.y + dy };
                    let sides = [Cell { x: to.x, y: cell.y }, Cell { x: cell.x, y: to.y }];
                    if best[from] < u64::MAX && is_open(to) && sides.into_iter().all(is_open) {
                        let index = info.index_of(to).expect("open");
                        let per_m = costs[index].expect("open") * info.frame.resolution_m();
                        let cost = best[from] + step_cost(per_m, dx != 0 && dy != 0);
                        best[index] = best[index].min(cost);
                    }
                }
            }
        }
        best
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        #[test]
        fn as_cheap_as_the_definition(
            building in any_building(),
            ends in (any::<prop::sample::Index>(), any::<prop::sample::Index>()),
        ) {
            let costs = step_costs(&building, 0.1);
            let info = building.info();
            let side = |n: u32| 0..i32::try_from(n).expect("small");
            let open: Vec<Cell> = side(info.height)
                .flat_map(|y| side(info.width).map(move |x| Cell { x, y }))
                .filter(|&cell| info.index_of(cell).is_some_and(|i| costs[i].is_some()))
                .collect();
            prop_assume!(!open.is_empty());
            let (start, goal) = (*ends.0.get(&open), *ends.1.get(&open));
            let path = cheapest_path(&building, &costs, start, goal);
            let best = reference_cost(&building, &costs, start)[info.index_of(goal).expect("open")];
            let cost = path.map_or(u64::MAX, |path| {
                let step = |pair: &[Cell]| {
                    let index = info.index_of(pair[1]).expect("inside");
                    let is_diagonal = pair[0].x != pair[1].x && pair[0].y != pair[1].y;
                    let per_m = costs[index].expect("open") * info.frame.resolution_m();
                    step_cost(per_m, is_diagonal)
                };
                path.windows(2).map(step).sum()
            });
            prop_assert_eq!(cost, best);
        }
    }
}
