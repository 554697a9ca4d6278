//! Smooth paths against exact distances and Euclidean shortest paths.

use meetpoint_geometry::Point2;
use meetpoint_planning::{
    Obstacles, Passage, Search, SmoothPath, SmoothScratch, Space, length_cells, smooth,
};
use meetpoint_topology::FreeSpace;
use proptest::prelude::*;

use crate::squares::{
    RESOLUTION_M, cells_of, center, distance, free_space, in_metres, rooms, space_of,
};
use crate::visibility::Visibility;

/// Chords of the truth a quarter turn.
const N_CHORDS: usize = 8;

/// A path of cells in a room, and where in its end cells it starts and ends.
#[derive(Debug)]
struct Trip {
    free: FreeSpace,
    space: Space,
    radius_m: f64,
    cells: Vec<usize>,
    grid_m: f64,
    ends: [Point2<f64>; 2],
}

impl Trip {
    /// `None` if there is no way.
    fn new(free: FreeSpace, radius_m: f64, ends: [Point2<f64>; 2]) -> Option<Self> {
        let space = space_of(&free, radius_m);
        let info = free.info();
        let [from, to] = ends.map(|end| info.index_of(info.frame.cell_at(in_metres(info, end))));
        let mut search = Search::default();
        let cost = search.between(&space, from?, to?)?;
        let cells = search.path(&space, to?);
        let grid_m = length_cells(cost) * RESOLUTION_M;
        Some(Self { free, space, radius_m, cells, grid_m, ends })
    }

    fn smooth(&self, weights: Option<&Space>) -> SmoothPath {
        let obstacles = Obstacles::new(&self.free);
        let [start, goal] = self.ends.map(|end| in_metres(self.free.info(), end));
        let passage =
            Passage { obstacles: &obstacles, radius_m: self.radius_m, weights, start, goal };
        smooth(&passage, self.cells.iter().copied(), &mut SmoothScratch::default())
    }

    /// In cells.
    fn points(&self, path: &SmoothPath) -> Vec<Point2<f64>> {
        let origin = self.free.info().origin();
        path.points.iter().map(|point| ((point - origin) / RESOLUTION_M).into()).collect()
    }

    /// Distance of every piece of the path from obstacles, in metres.
    fn clearances_m(&self, path: &SmoothPath) -> Vec<f64> {
        let points = self.points(path);
        let piece = |ends: &[Point2<f64>]| distance(&self.free, ends[0], ends[1]) * RESOLUTION_M;
        points.windows(2).map(piece).collect()
    }
}

/// Trips between cells, by chance also between any points of them.
fn trips() -> impl Strategy<Value = Trip> {
    let radius_m = prop_oneof![Just(0.0), Just(0.1), Just(0.125), 0.0..0.3];
    let index = any::<[prop::sample::Index; 2]>();
    let offset = prop_oneof![Just([0.0; 4]), prop::array::uniform4(-0.49..0.49)];
    (rooms(), radius_m, index, offset).prop_filter_map(
        "no way",
        |(free, radius_m, index, [a, b, c, d])| {
            let cells = cells_of(&space_of(&free, radius_m));
            if cells.is_empty() {
                return None;
            }
            let [start, goal] = index.map(|at| center(free.info(), cells[at.index(cells.len())]));
            let ends = [start + Point2::new(a, b).coords, goal + Point2::new(c, d).coords];
            Trip::new(free, radius_m, ends)
        },
    )
}

proptest! {
    #[test]
    fn never_nearer_to_a_square_than_the_radius(trip in trips()) {
        let path = trip.smooth(None);
        let points = trip.points(&path);
        for (at, end) in [(0, trip.ends[0]), (points.len() - 1, trip.ends[1])] {
            prop_assert!((points[at] - end).norm() < 1e-9, "from and to where it was asked");
        }
        let nearest_end_m = trip.ends.map(|end| distance(&trip.free, end, end) * RESOLUTION_M);
        let clearances_m = trip.clearances_m(&path);
        let last = clearances_m.len().saturating_sub(1);
        for (at, &clearance_m) in clearances_m.iter().enumerate() {
            let is_near = at == 0 && nearest_end_m[0] < trip.radius_m
                || at == last && nearest_end_m[1] < trip.radius_m;
            prop_assert!(0.0 < clearance_m, "piece {at} touches a square");
            if !is_near {
                let near_m = trip.radius_m - 1e-9;
                prop_assert!(near_m <= clearance_m, "piece {at} is {clearance_m} m from a square");
            }
        }
        let least_m = clearances_m.into_iter().chain(nearest_end_m).fold(f64::INFINITY, f64::min);
        prop_assert!((path.clearance_min_m - least_m).abs() < 1e-9, "{}", path.clearance_min_m);
        let length: f64 = points.windows(2).map(|ends| (ends[1] - ends[0]).norm()).sum();
        prop_assert!((path.length_m - length * RESOLUTION_M).abs() < 1e-9, "{}", path.length_m);
    }

    #[test]
    fn between_the_truth_and_the_grid(trip in trips()) {
        let path = trip.smooth(None);
        let is_center = |end: &Point2<f64>| end.coords.iter().all(|at| at.fract() == 0.5);
        if trip.ends.iter().all(is_center) {
            prop_assert!(path.length_m <= trip.grid_m + 1e-9, "{} m in the grid", trip.grid_m);
        }
        let is_near = |&end: &Point2<f64>| {
            distance(&trip.free, end, end) * RESOLUTION_M < trip.radius_m
        };
        if !trip.ends.iter().any(is_near) {
            let truth = Visibility::new(&trip.free, trip.radius_m / RESOLUTION_M, N_CHORDS);
            let [a, b] = trip.ends;
            let least = truth.length(a, b, path.length_m / RESOLUTION_M * (1.0 + 1e-9) + 1e-9);
            prop_assert!(least.is_some(), "{} m are shorter than the truth", path.length_m);
        }
    }

    #[test]
    fn straight_ways_that_are_clear(
        free in rooms(),
        [a, b] in prop::array::uniform2((0.5..42.0, 0.5..42.0)),
        radius in 0.0..7.0,
        lattice in any::<bool>(),
    ) {
        let [a, b] = [a, b].map(|(x, y)| Point2::new(x, y));
        let [a, b] = if lattice { [a, b].map(|p| p.map(f64::floor)) } else { [a, b] };
        let obstacles = Obstacles::new(&free);
        let truth = distance(&free, a, b);
        let found = obstacles.distance(a, b, radius);
        prop_assert!((found - truth.min(radius)).abs() < 1e-9, "{found}, not {truth}");
        if 1e-9 < (truth - radius).abs() && 0.0 < radius {
            prop_assert_eq!(obstacles.is_clear(a, b, radius), radius < truth);
        }
    }

    #[test]
    fn weights_are_not_thrown_away(
        trip in trips(),
        dear in proptest::collection::vec(16..=120_u8, 7),
    ) {
        // Bands of cells of one weight.
        let info = trip.space.info();
        let width = info.width as usize;
        let weight = |cell: usize| {
            let band = (cell % width + cell / width) / 6 % dear.len();
            if trip.space.is_enterable(cell) { dear[band] } else { 0 }
        };
        let space = Space::new(info, (0..info.n_cells()).map(weight).collect()).expect("weights");
        let ends = trip.ends.map(|end| end.coords.map(f64::floor).add_scalar(0.5).into());
        let [from, to] = [0, trip.cells.len() - 1].map(|at| trip.cells[at]);
        let mut search = Search::default();
        let cost = search.between(&space, from, to).expect("the same cells as before");
        let cells = search.path(&space, to);
        let trip = Trip { cells, ends, ..trip };
        let path = trip.smooth(Some(&space));
        let found = integral(&space, &trip.points(&path));
        let grid = f64::from(cost) / f64::from(meetpoint_planning::STRAIGHT);
        prop_assert!(found <= grid * 1.001 + 0.01, "{found} on the path, {grid} in the grid");
    }
}

/// Steps that a piece of a path is summed up in: some hundred a cell.
const N_STEPS: u32 = 4000;

/// Cost along a path by small steps, in cells of weight one. What cannot be entered weighs as much
/// as the heaviest cell around.
fn integral(space: &Space, points: &[Point2<f64>]) -> f64 {
    let info = space.info();
    let weight = |point: Point2<f64>| {
        let cell = info.index_of(info.frame.cell_at(in_metres(info, point)));
        cell.map_or(0, |cell| space.weight(cell))
    };
    let around = [-1.0, 0.0, 1.0].map(|y| [-1.0, 0.0, 1.0].map(|x| Point2::new(x, y).coords));
    let mut sum = 0.0;
    for ends in points.windows(2) {
        let along = ends[1] - ends[0];
        for step in 0..N_STEPS {
            let here = ends[0] + along * ((f64::from(step) + 0.5) / f64::from(N_STEPS));
            let heaviest = || around.iter().flatten().map(|&offset| weight(here + offset)).max();
            let weight = Some(weight(here)).filter(|&weight| 0 < weight).or_else(heaviest);
            let weight = f64::from(weight.expect("nine cells"));
            sum += along.norm() / f64::from(N_STEPS) * weight / 16.0;
        }
    }
    sum
}

#[test]
fn around_one_corner_on_an_arc() {
    // A wall from below, 20 cells high, between start and goal at its foot.
    let free = free_space(60, 60, |x, y| !(28..32).contains(&x) || 30 <= y);
    for radius_m in [0.0, 0.1, 0.3] {
        let ends = [Point2::new(10.5, 10.5), Point2::new(51.5, 10.5)];
        let trip = Trip::new(free.clone(), radius_m, ends).expect("over the wall");
        let path = trip.smooth(None);
        // Tangent from the start to the disc around the upper left corner, arc, along the top.
        let (radius, to) = (radius_m / RESOLUTION_M, Point2::new(29.0, 31.0) - ends[0]);
        let tangent = (to.norm_squared() - radius * radius).sqrt();
        let turn = to.y.atan2(to.x) + (radius / to.norm()).asin();
        let length = 2.0 * (tangent + radius * turn) + 4.0;
        let ratio = path.length_m / RESOLUTION_M / length;
        assert!((1.0 - 1e-9..1.003).contains(&ratio), "{ratio} times the truth at {radius_m} m");
        let truth = Visibility::new(&free, radius, N_CHORDS).length(ends[0], ends[1], 1e3);
        let ratio = truth.expect("a way") / length;
        assert!((0.998..=1.0 + 1e-4).contains(&ratio), "the truth is {ratio} times itself");
    }
}
