//! Paths: from tables where they are made, else by search.

use std::collections::HashSet;

use meetpoint_geometry::Point2;
use meetpoint_planning::{Cost, Passage, Plans, Route, SmoothPath, smooth, stretches};
use meetpoint_topology::RegionIndex;

use super::alternatives::alternatives;
use super::ends::{Located, Nowhere, locate};
use super::field::{Field, Searches, metres};

/// How much farther from obstacles than the radius straight ways are looked for, in cells: rounding.
const MARGIN_CELLS: f64 = 1e-3;
/// Distance between the places at which a straight way is checked for closed arcs, in cells.
const SAMPLE_CELLS: f64 = 0.05;

/// Clearance beyond this is not told apart, in cells.
const CLEARANCE_CELLS: f64 = 20.0;

/// A question for a path.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PathQuery {
    pub(crate) start: Point2<f64>,
    pub(crate) goal: Point2<f64>,
    pub(crate) n_alternatives: usize,
    /// Whether the dense path is wanted.
    pub(crate) is_dense: bool,
    /// Whether the cells are wanted.
    pub(crate) with_cells: bool,
    /// How far start and goal may be moved, in metres.
    pub(crate) tolerance_m: f64,
}

/// What came of it.
#[derive(Clone, Debug)]
pub(crate) struct PathAnswer {
    pub(crate) start: Result<Located, Nowhere>,
    pub(crate) goal: Result<Located, Nowhere>,
    /// `None` if there is no way, or an end is nowhere.
    pub(crate) best: Option<Planned>,
    pub(crate) alternatives: Vec<Planned>,
    /// Whether tables answered.
    pub(crate) by_tables: bool,
}

/// A path.
#[derive(Clone, Debug)]
pub(crate) struct Planned {
    /// Regions, and the arcs by which they are entered, by place in the graph.
    pub(crate) route: Vec<(RegionIndex, Option<usize>)>,
    pub(crate) grid_length_m: f64,
    pub(crate) cost_m: f64,
    pub(crate) dense: Option<SmoothPath>,
    /// Centres, in metres.
    pub(crate) cells: Vec<Point2<f64>>,
    /// The cost is at most so much more than the best, as a share of it.
    pub(crate) loss_bound: f64,
}

/// A path's cost, regions and cells.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Found {
    pub(crate) cost: Cost,
    /// Regions, and the arcs by which they are entered, by place in the graph.
    pub(crate) route: Vec<(RegionIndex, Option<usize>)>,
    /// Start and goal included.
    pub(crate) cells: Vec<u32>,
}

/// Which cells of a path are wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wanted {
    /// None.
    Route,
    /// As many as a string is pulled along.
    Waypoints,
    /// All.
    Cells,
}

/// Answers a question.
pub(crate) fn plan(field: &Field, query: &PathQuery) -> PathAnswer {
    let plans = field.plans().map(AsRef::as_ref);
    let start = locate(field, query.start, query.tolerance_m);
    let goal = locate(field, query.goal, query.tolerance_m);
    let mut answer =
        PathAnswer { start, goal, best: None, alternatives: vec![], by_tables: plans.is_some() };
    let (Ok(from), Ok(to)) = (start, goal) else { return answer };
    let wanted = match query {
        // Tolls are told by the steps between neighbouring cells.
        _ if query.with_cells || !field.is_by_length() || !field.tolls.is_empty() => Wanted::Cells,
        _ if query.is_dense => Wanted::Waypoints,
        _ => Wanted::Route,
    };
    field.with_searches(|searches| {
        let Some(best) = best(field, plans, searches, [from.cell, to.cell], wanted) else { return };
        if let Some(plans) = plans {
            let others = alternatives(
                field,
                plans,
                searches,
                [from.cell, to.cell],
                &best,
                query.n_alternatives,
            );
            let share = |cost: Cost| f64::from(cost) / f64::from(best.cost.max(1)) - 1.0;
            let others = others.iter().map(|found| {
                let loss = share(found.cost);
                planned(field, query, searches, found, [from, to], loss)
            });
            answer.alternatives = others.collect();
        }
        answer.best = Some(planned(field, query, searches, &best, [from, to], 0.0));
    });
    answer
}

/// The best path between two cells; `None` if there is none.
pub(crate) fn best(
    field: &Field,
    plans: Option<&Plans>,
    searches: &mut Searches,
    [from, to]: [usize; 2],
    wanted: Wanted,
) -> Option<Found> {
    let Some(plans) = plans else { return searched(field, searches, [from, to]) };
    let scratch = &mut searches.tables;
    let (route, cells) = match wanted {
        Wanted::Route => (plans.route(from, to, scratch)?, vec![]),
        Wanted::Waypoints => {
            let width = field.info().width as usize;
            let place =
                |cell: usize| Point2::new((cell % width) as f64 + 0.5, (cell / width) as f64 + 0.5);
            let radius = field.profile.radius_m / field.ground.side_m() + MARGIN_CELLS;
            let is_clear = |a, b| field.obstacles.is_clear(place(a), place(b), radius);
            let path = plans.waypoints(from, to, scratch, is_clear)?;
            (path.route, path.cells)
        }
        Wanted::Cells => {
            let path = plans.path(from, to, scratch)?;
            (path.route, path.cells)
        }
    };
    Some(Found { cost: route.cost, route: arcs_of(plans, &route), cells })
}

fn arcs_of(plans: &Plans, route: &Route) -> Vec<(RegionIndex, Option<usize>)> {
    let arc = |gate| plans.arcs(gate).first().copied();
    route.steps.iter().map(|step| (step.region, step.gate.and_then(arc))).collect()
}

fn searched(field: &Field, searches: &mut Searches, [from, to]: [usize; 2]) -> Option<Found> {
    let (space, grid) = (&field.space, &mut searches.grid);
    let cost = grid.between(space, &field.tolls, from, to)?;
    let cells = grid.path(space, &field.tolls, to);
    let ground = &field.ground;
    let route = stretches(space, &ground.partition, ground.topology.graph(), &cells);
    let route = route.iter().map(|stretch| (stretch.region, stretch.arc)).collect();
    Some(Found { cost, route, cells })
}

pub(super) fn planned(
    field: &Field,
    query: &PathQuery,
    searches: &mut Searches,
    found: &Found,
    ends: [Located; 2],
    loss_bound: f64,
) -> Planned {
    let side_m = field.ground.side_m();
    let by_length = field.is_by_length();
    let grid_length_m = if by_length {
        metres(found.cost, side_m)
    } else {
        length_of(field, &found.cells) * side_m
    };
    let cost_m = metres(found.cost, side_m);
    let dense = query.is_dense.then(|| dense(field, searches, &found.cells, ends));
    let centers = found.cells.iter().filter(|_| query.with_cells);
    Planned {
        route: found.route.clone(),
        grid_length_m,
        cost_m,
        dense,
        cells: centers.map(|&cell| field.center(cell as usize)).collect(),
        loss_bound,
    }
}

/// Length of a path of neighbouring cells, in cells.
fn length_of(field: &Field, cells: &[u32]) -> f64 {
    let width = field.info().width;
    let is_straight = |a: u32, b: u32| a.abs_diff(b) == 1 || a.abs_diff(b) == width;
    let steps = cells.windows(2);
    let n_straight = steps.filter(|pair| is_straight(pair[0], pair[1])).count();
    let n_steps = cells.len().saturating_sub(1);
    n_straight as f64 + (n_steps - n_straight) as f64 * std::f64::consts::SQRT_2
}

/// The path pulled tight. A string knows nothing of closed arcs: where it would cross one, it is
/// held at the narrowest place of the path, and its two parts are pulled apart from each other.
fn dense(
    field: &Field,
    searches: &mut Searches,
    cells: &[u32],
    [start, goal]: [Located; 2],
) -> SmoothPath {
    let ends = [start.point, goal.point];
    let pulled = string(field, searches, cells, ends);
    if field.tolls.is_empty() || tolls_along(field, &pulled.points) <= tolls_of(field, cells) {
        return pulled;
    }
    let Some(held) = narrowest(field, cells) else { return pulled };
    let at = Located {
        cell: cells[held] as usize,
        point: field.center(cells[held] as usize),
        moved_m: 0.0,
    };
    let before = dense(field, searches, &cells[..=held], [start, at]);
    let after = dense(field, searches, &cells[held..], [at, goal]);
    let points = before.points.into_iter().chain(after.points.into_iter().skip(1)).collect();
    SmoothPath {
        points,
        length_m: before.length_m + after.length_m,
        clearance_min_m: before.clearance_min_m.min(after.clearance_min_m),
    }
}

fn string(
    field: &Field,
    searches: &mut Searches,
    cells: &[u32],
    [start, goal]: [Point2<f64>; 2],
) -> SmoothPath {
    let weights = (!field.is_by_length()).then(|| field.space.as_ref());
    let radius_m = field.profile.radius_m;
    let passage = Passage { obstacles: &field.obstacles, radius_m, weights, start, goal };
    smooth(&passage, cells.iter().map(|&cell| cell as usize), &mut searches.smooth)
}

/// The place of a path, its ends and what is near them left out, that is nearest to obstacles: a
/// tight string would pass there. `None` if the path is too short to be held.
fn narrowest(field: &Field, cells: &[u32]) -> Option<usize> {
    let margin = (cells.len() / 8).max(1);
    let inner = margin..cells.len().saturating_sub(margin);
    let clearance = |&at: &usize| {
        let place = field.obstacles.in_cells(field.center(cells[at] as usize));
        field.obstacles.distance(place, place, CLEARANCE_CELLS)
    };
    inner.min_by(|a, b| clearance(a).total_cmp(&clearance(b)))
}

/// Tolls that a path of cells pays.
pub(super) fn tolls_of(field: &Field, cells: &[u32]) -> u64 {
    let toll = |pair: &[u32]| toll_between(field, pair[0] as usize, pair[1] as usize);
    cells.windows(2).map(toll).sum()
}

fn toll_between(field: &Field, from: usize, to: usize) -> u64 {
    let step = field.space.steps(from).find(|&(_, cell)| cell == to);
    step.map_or(0, |(step, _)| u64::from(field.tolls.of(from, step)))
}

/// Tolls of the cells that a path of straight pieces goes through.
fn tolls_along(field: &Field, points: &[Point2<f64>]) -> u64 {
    let info = field.info();
    let cell_at = |point| info.index_of(info.frame.cell_at(point));
    let mut paid = 0;
    let mut seen = HashSet::new();
    let mut here = points.first().and_then(|&point| cell_at(point));
    for ends in points.windows(2) {
        let along = ends[1] - ends[0];
        let n = (along.norm() / (field.ground.side_m() * SAMPLE_CELLS)).ceil().max(1.0);
        let mut at = 0.0;
        while at < n {
            at += 1.0;
            let next = cell_at(ends[0] + along * (at / n));
            if next != here
                && let (Some(from), Some(to)) = (here, next)
                && seen.insert((from, to))
            {
                paid += toll_between(field, from, to);
            }
            here = next;
        }
    }
    paid
}
