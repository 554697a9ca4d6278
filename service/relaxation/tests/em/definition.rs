//! The model, word for word: slow and obviously right.

use meetpoint_relaxation::{
    EmParams, LandmarkKind, LandmarkMap, MotionModel, PoseCell, PoseGrid, Sighting, StartBelief,
    Step, Travel,
};
use nalgebra::{Matrix3, Point2, Vector2, Vector3};

use meetpoint_geometry::Pose;

/// Probabilities by kind and node.
pub(crate) type Map = Vec<Vec<f64>>;

/// A travel over a grid, and the parameters.
pub(crate) struct World<'a> {
    pub(crate) travel: &'a Travel,
    pub(crate) params: &'a EmParams,
    pub(crate) cells: Vec<PoseCell>,
    pub(crate) nodes: Vec<(i32, i32)>,
    pub(crate) kinds: Vec<LandmarkKind>,
    motions: Vec<MotionModel>,
}

impl<'a> World<'a> {
    pub(crate) fn new(travel: &'a Travel, params: &'a EmParams, kinds: &[LandmarkKind]) -> Self {
        let (nodes, cells) = nodes_and_cells(&params.grid);
        let motions = travel.steps[1..].iter().map(|step| {
            MotionModel::new(&params.grid, &step.motion, &params.calibration, &params.motion, 0.0)
        });
        let motions = motions.collect();
        Self { travel, params, cells, nodes, kinds: kinds.to_vec(), motions }
    }

    /// `P(xi' | u, xi)`.
    pub(crate) fn motion(&self, step: usize, from: PoseCell, to: PoseCell) -> f64 {
        let turn =
            i32::try_from(to.heading).expect("small") - i32::try_from(from.heading).expect("small");
        let way = (to.x - from.x, to.y - from.y, turn);
        f64::from(self.motions[step].probability(&self.params.grid, from.heading, way))
    }

    /// The first belief.
    pub(crate) fn start(&self, cell: PoseCell) -> f64 {
        let pose = self.params.grid.pose_of(cell);
        match self.params.start {
            StartBelief::At(at) => {
                let split = |distance: f64| (1.0 - distance.abs()).max(0.0);
                let turn = meetpoint_geometry::angle_between(at.theta_rad, pose.theta_rad);
                split(pose.x_m - at.x_m)
                    * split(pose.y_m - at.y_m)
                    * split(turn / self.params.grid.heading_step_rad())
            }
            StartBelief::About { pose: about, covariance } => {
                let weight = |cell| self.about(cell, about, covariance);
                weight(cell) / self.cells.iter().map(|&cell| weight(cell)).sum::<f64>()
            }
            StartBelief::Within(_) => 1.0 / self.cells.len() as f64,
        }
    }

    /// A normal distribution as far as four deviations, not normalised; what lies within a cell is one.
    fn about(&self, cell: PoseCell, about: Pose, covariance: [[f64; 3]; 3]) -> f64 {
        let grid = &self.params.grid;
        let edges = [grid.resolution_m(), grid.resolution_m(), grid.heading_step_rad()];
        let spread = Matrix3::from_fn(|row, column| {
            let of_cell = if row == column { edges[row] * edges[row] / 12.0 } else { 0.0 };
            covariance[row][column] + of_cell
        });
        let pose = grid.pose_of(cell);
        let turn = meetpoint_geometry::angle_between(about.theta_rad, pose.theta_rad);
        let off = Vector3::new(pose.x_m - about.x_m, pose.y_m - about.y_m, turn);
        let squares = off.dot(&spread.lu().solve(&off).expect("positive"));
        if squares <= 16.0 { (-squares / 2.0).exp() } else { 0.0 }
    }

    /// Whether a place is in view from a pose, at a step where something is.
    pub(crate) fn in_view(&self, step: &Step, from: PoseCell, node: (i32, i32)) -> bool {
        let range_m = self.travel.detector.range_max_m;
        let (dx, dy) = (f64::from(node.0 - from.x), f64::from(node.1 - from.y));
        match (range_m > 0.0, step.sightings.is_empty()) {
            (true, _) => dx.hypot(dy) <= range_m,
            (false, true) => false,
            (false, false) => dx.hypot(dy) <= self.params.perception.radius_m,
        }
    }

    /// `g(z | c, xi)`: errors are below a node's size, so that one node is it.
    pub(crate) fn at(&self, sighting: &Sighting, from: PoseCell, node: (i32, i32)) -> f64 {
        let pose = self.params.grid.pose_of(from);
        let seen: Point2<f64> = pose * sighting.offset_m();
        let off: Vector2<f64> = seen - self.params.grid.point_of(node.0, node.1);
        if off.norm() < 1e-6 { 1.0 } else { 0.0 }
    }

    /// `P(t | l)`.
    pub(crate) fn taken_for(&self, seen: LandmarkKind, is: LandmarkKind) -> f64 {
        match (self.kinds.len(), seen == is) {
            (1, _) => 1.0,
            (_, true) => 1.0 - self.params.perception.mistaken,
            (n, false) => self.params.perception.mistaken / (n - 1) as f64,
        }
    }

    /// `odds_t(c)`, of one kind of landmark only.
    pub(crate) fn odds(&self, map: &Map, seen: LandmarkKind, is: usize, node: usize) -> f64 {
        let p = 1.0 - self.params.perception.missed;
        let any: f64 = map.iter().map(|kind| kind[node]).sum();
        p * self.taken_for(seen, self.kinds[is]) * map[is][node] / (1.0 - p * any)
    }

    /// A sighting's density from a pose.
    pub(crate) fn density(&self, map: &Map, sighting: &Sighting, from: PoseCell) -> f64 {
        let seen = LandmarkKind::of(sighting);
        let mut density = self.params.perception.false_per_m2;
        for (index, &node) in self.nodes.iter().enumerate() {
            for is in 0..self.kinds.len() {
                density += self.at(sighting, from, node) * self.odds(map, seen, is, index);
            }
        }
        density
    }

    /// `P(o | xi, m)`.
    pub(crate) fn perception(&self, map: &Map, step: &Step, from: PoseCell) -> f64 {
        let p = 1.0 - self.params.perception.missed;
        let mut likelihood = 1.0;
        for (index, &node) in self.nodes.iter().enumerate() {
            if self.in_view(step, from, node) {
                likelihood *= 1.0 - p * map.iter().map(|kind| kind[index]).sum::<f64>();
            }
        }
        let densities = step.sightings.iter().map(|seen| self.density(map, seen, from));
        likelihood * densities.product::<f64>()
    }
}

/// What a map says, by kind and node.
pub(crate) fn probabilities(map: &LandmarkMap) -> Map {
    let (nodes, _) = nodes_and_cells(map.grid());
    let of_kind =
        |&kind: &LandmarkKind| nodes.iter().map(|&(x, y)| f64::from(map.at(kind, x, y))).collect();
    map.kinds().iter().map(of_kind).collect()
}

fn nodes_and_cells(grid: &PoseGrid) -> (Vec<(i32, i32)>, Vec<PoseCell>) {
    let last = grid.area().max;
    let last = grid.cell_at(Pose::new(last.x, last.y, 0.0));
    let nodes: Vec<_> = (0..=last.y).flat_map(|y| (0..=last.x).map(move |x| (x, y))).collect();
    let headings = 0..grid.n_headings();
    let cells = headings
        .flat_map(|heading| nodes.iter().map(move |&(x, y)| PoseCell { x, y, heading }))
        .collect();
    (nodes, cells)
}
