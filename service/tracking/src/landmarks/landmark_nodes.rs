//! Landmarks as nodes of the graph of submaps, and the edges that lead to them.
//!
//! A landmark has a place and no heading: an edge to it has information about two numbers of three, and
//! the third stays 0. The edges are robust, because names can be wrong. One that is far from what the
//! graph says when it is new is tightened step by step, each time by a solution (see [`TIGHTENING`]).

use meetpoint_geometry::{Point2, Pose};
use nalgebra::{Matrix3, Vector3};

use crate::graph::pose_graph::{Edge, TIGHTENING};
use crate::landmarks::landmark_view::LandmarkView;

/// Square of its residual at which an edge is half doubted: three deviations.
const CHI2_TURN: f64 = 9.0;
/// Edges that are wrong by this share of the worst are given up with it.
const WRONG_SHARE: f64 = 0.25;

/// The landmarks of a graph.
#[derive(Debug, Default)]
pub(crate) struct LandmarkNodes {
    /// Where they are; headings are 0.
    pub(crate) poses: Vec<Pose>,
    /// From a submap to a landmark.
    edges: Vec<Edge>,
    /// For each edge the view that it stands for.
    views: Vec<usize>,
}

impl LandmarkNodes {
    /// A landmark more.
    pub(crate) fn add(&mut self, at: Point2<f64>) -> usize {
        self.poses.push(Pose::new(at.x, at.y, 0.0));
        self.poses.len() - 1
    }

    /// Believes that a view is of a landmark, as far as the residual allows. `anchor` is the pose of its
    /// submap. The square of the residual as it is now.
    pub(crate) fn see(
        &mut self,
        landmark: usize,
        (index, view): (usize, &LandmarkView),
        anchor: Pose,
    ) -> f64 {
        let mut edge = sighting_edge((view.submap, landmark), view.seen, view.variance_m2);
        let chi2 = edge.chi2(anchor, self.poses[landmark]);
        edge.chi2_turn = edge.chi2_turn.max(chi2);
        self.edges.push(edge);
        self.views.push(index);
        chi2
    }

    /// The edges, from submaps to landmarks that are counted from `n_before` on.
    pub(crate) fn edges(&self, n_before: usize) -> impl Iterator<Item = Edge> + '_ {
        self.edges.iter().map(move |edge| Edge { to: n_before + edge.to, ..*edge })
    }

    /// Tightens the edges that are to be; `graph_edges` are the same as they stand among all of a graph.
    /// False if none was.
    pub(crate) fn tighten(&mut self, graph_edges: &mut [Edge]) -> bool {
        let mut is_tightened = false;
        for (edge, of_graph) in self.edges.iter_mut().zip(graph_edges) {
            is_tightened |= CHI2_TURN < edge.chi2_turn;
            edge.chi2_turn = (edge.chi2_turn / TIGHTENING).max(CHI2_TURN);
            of_graph.chi2_turn = edge.chi2_turn;
        }
        is_tightened
    }

    /// The largest square of a residual, with the submaps' anchors at `anchors`.
    pub(crate) fn worst_chi2(&self, anchors: &[Pose]) -> f64 {
        self.edges.iter().map(|edge| self.chi2(edge, anchors)).fold(0.0, f64::max)
    }

    /// Gives up the edges that are about as wrong as the worst, but none whose square is at most
    /// `chi2_max`.
    pub(crate) fn remove_worst(&mut self, anchors: &[Pose], chi2_max: f64) {
        let chi2_max = chi2_max.max(WRONG_SHARE * self.worst_chi2(anchors));
        let is_right = |edge: &Edge| self.chi2(edge, anchors) <= chi2_max;
        let kept: Vec<bool> = self.edges.iter().map(is_right).collect();
        self.keep(&kept);
    }

    /// Gives up all edges but those.
    pub(crate) fn keep(&mut self, kept: &[bool]) {
        let mut of_edge = kept.iter();
        self.edges.retain(|_| of_edge.next().copied().unwrap_or(true));
        let mut of_view = kept.iter();
        self.views.retain(|_| of_view.next().copied().unwrap_or(true));
    }

    /// The views that are believed.
    pub(crate) fn believed(&self) -> &[usize] {
        &self.views
    }

    /// For each of so many submaps the landmarks that it is believed to have seen, in order.
    pub(crate) fn of_submaps(&self, n_submaps: usize) -> Vec<Vec<usize>> {
        let mut landmarks = vec![Vec::new(); n_submaps];
        for edge in &self.edges {
            landmarks[edge.from].push(edge.to);
        }
        for landmarks in &mut landmarks {
            landmarks.sort_unstable();
        }
        landmarks
    }

    fn chi2(&self, edge: &Edge, anchors: &[Pose]) -> f64 {
        edge.chi2(anchors[edge.from], self.poses[edge.to])
    }
}

/// An edge to a landmark seen from a pose.
fn sighting_edge((from, to): (usize, usize), seen: Point2<f64>, variance_m2: f64) -> Edge {
    let information = Vector3::new(1.0 / variance_m2, 1.0 / variance_m2, 0.0);
    Edge {
        from,
        to,
        from_to: Pose::new(seen.x, seen.y, 0.0),
        information: Matrix3::from_diagonal(&information),
        chi2_turn: CHI2_TURN,
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    use super::*;
    use crate::graph::normal_equations::NormalEquations;
    use crate::graph::pose_graph::{PoseGraphParams, optimise};

    const PARAMS: PoseGraphParams = PoseGraphParams { n_iterations_max: 100, fall_min: 1e-14 };

    fn view(seen: Point2<f64>, variance_m2: f64, submap: usize) -> LandmarkView {
        LandmarkView { submap, name: 0, seen, variance_m2, n_sightings: 1 }
    }

    /// Poses, steps between them, and two landmarks that all see with small errors.
    fn world(turns: &[f64], errors: &[(f64, f64)]) -> (Vec<Pose>, Vec<Edge>, LandmarkNodes) {
        let mut poses = vec![Pose::new(1.0, -2.0, 0.5)];
        for &turn in turns {
            poses.push(poses[poses.len() - 1] * Pose::new(2.0, 0.3, turn));
        }
        let step = |to: usize| Edge {
            from: to - 1,
            to,
            from_to: poses[to - 1].step_to(poses[to]),
            information: Matrix3::new(50.0, 5.0, 2.0, 5.0, 80.0, 1.0, 2.0, 1.0, 90.0),
            chi2_turn: f64::INFINITY,
        };
        let steps = (1..poses.len()).map(step).collect();
        let mut nodes = LandmarkNodes::default();
        for (landmark, at) in [Point2::new(3.0, 4.0), Point2::new(-2.0, 1.0)].iter().enumerate() {
            nodes.add(*at);
            for (submap, pose) in poses.iter().enumerate() {
                let (x_m, y_m) = errors[(2 * submap + landmark) % errors.len()];
                let seen = pose.inverse() * *at + nalgebra::Vector2::new(x_m, y_m);
                let index = 2 * submap + landmark;
                nodes.see(landmark, (index, &view(seen, 0.1, submap)), *pose);
            }
        }
        (poses, steps, nodes)
    }

    /// The definition: dense normal equations in which a landmark has two numbers and no heading, with
    /// derivatives by differences; the step that they ask for.
    fn reference(poses: &[Pose], landmarks: &[Point2<f64>], edges: &[Edge]) -> DVector<f64> {
        let (n_poses, n_own) = (poses.len(), 3 * (poses.len() - 1));
        let n = n_own + 2 * landmarks.len();
        let error = |edge: &Edge, step: &DVector<f64>| {
            let pose = |index: usize| {
                let part = |axis: usize| if index == 0 { 0.0 } else { step[3 * index - 3 + axis] };
                let pose = poses[index];
                Pose::new(pose.x_m + part(0), pose.y_m + part(1), pose.theta_rad + part(2))
            };
            if edge.to < n_poses {
                return edge.error(pose(edge.from), pose(edge.to));
            }
            let (landmark, from) = (edge.to - n_poses, n_own + 2 * (edge.to - n_poses));
            let at = landmarks[landmark] + nalgebra::Vector2::new(step[from], step[from + 1]);
            let off = pose(edge.from).inverse() * at - edge.from_to.position();
            Vector3::new(off.x, off.y, 0.0)
        };
        let (mut hessian, mut gradient) = (DMatrix::zeros(n, n), DVector::zeros(n));
        for edge in edges {
            let here = error(edge, &DVector::zeros(n));
            let mut by = DMatrix::zeros(3, n);
            for column in 0..n {
                let mut step = DVector::zeros(n);
                step[column] = 1e-6;
                let slope = (error(edge, &step) - error(edge, &-step)) / 2e-6;
                by.column_mut(column).copy_from(&slope);
            }
            let weight = edge.weight(here.dot(&(edge.information * here)));
            hessian += by.transpose() * (edge.information * weight) * &by;
            gradient += by.transpose() * (edge.information * weight) * here;
        }
        hessian.lu().solve(&-gradient).expect("the chain joins all poses")
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]

        #[test]
        fn ends_where_dense_equations_without_headings_do(
            turns in prop::collection::vec(-1.0..1.0_f64, 2..6),
            errors in prop::collection::vec((-0.4..0.4_f64, -0.4..0.4_f64), 3..8),
        ) {
            let (poses, mut edges, landmarks) = world(&turns, &errors);
            edges.extend(landmarks.edges(poses.len()));
            let mut nodes = [poses.as_slice(), &landmarks.poses].concat();
            let mut equations = NormalEquations::new(nodes.len(), &edges);
            optimise(&mut nodes, &edges, &mut equations, &PARAMS);
            let landmarks = nodes.split_off(poses.len());
            prop_assert!(landmarks.iter().all(|pose| pose.theta_rad.abs() < 1e-12), "no heading");
            let at: Vec<Point2<f64>> = landmarks.iter().map(|pose| pose.position()).collect();
            let left = reference(&nodes, &at, &edges);
            prop_assert!(left.amax() < 1e-4, "a step is left: {left}");
        }
    }

    #[test]
    fn what_is_far_off_is_tightened_and_what_stays_so_given_up() {
        let at = Point2::new(0.0, 0.0);
        let mut nodes = LandmarkNodes::default();
        let landmark = nodes.add(at);
        let anchors = [Pose::IDENTITY; 3];
        for (index, x_m) in [0.1, 8.0, 3.0].into_iter().enumerate() {
            let chi2 = nodes.see(
                landmark,
                (index, &view(Point2::new(x_m, 0.0), 0.04, index)),
                anchors[index],
            );
            assert!((chi2 - x_m * x_m / 0.04).abs() < 1e-9, "{chi2}");
        }
        let mut of_graph: Vec<Edge> = nodes.edges(3).collect();
        assert!(of_graph[1].chi2_turn > 1000.0, "it pulls although it is far: {of_graph:?}");
        let mut n_times = 0;
        while nodes.tighten(&mut of_graph) {
            n_times += 1;
        }
        assert!(n_times <= 5, "{n_times}");
        assert!(of_graph.iter().all(|edge| edge.chi2_turn <= CHI2_TURN), "{of_graph:?}");
        assert_eq!(nodes.of_submaps(3), [[landmark], [landmark], [landmark]], "by all");
        nodes.remove_worst(&anchors, 16.0);
        assert_eq!(nodes.believed(), [0, 2], "the worst");
        nodes.remove_worst(&anchors, 16.0);
        assert_eq!(nodes.believed(), [0], "and the next");
        nodes.remove_worst(&anchors, 16.0);
        assert_eq!(nodes.believed(), [0], "that one is right");
    }
}
