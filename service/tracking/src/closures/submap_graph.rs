//! The pose graph of submaps: the way driven, and the closures and landmarks that are believed.

use std::collections::BTreeSet;

use meetpoint_geometry::Pose;
use nalgebra::Matrix3;

use crate::closures::evidence::Evidence;
use crate::closures::joined::Joined;
use crate::closures::submap::{Submap, submaps};
use crate::closures::submap_charts::around;
use crate::graph::normal_equations::NormalEquations;
use crate::graph::pose_graph::{Edge, PoseGraphParams, TIGHTENING, cost, optimise};
use crate::graph::uncertainty::{Link, composed, covariances_from, inverted};
use crate::landmarks::landmark_nodes::LandmarkNodes;
use crate::scans::chain::Chain;

/// Two submaps, the earlier first.
pub(crate) type SubmapPair = (usize, usize);

/// The graph.
#[derive(Debug)]
pub(crate) struct SubmapGraph {
    pub(crate) submaps: Vec<Submap>,
    /// Of the submaps' anchors.
    pub(crate) poses: Vec<Pose>,
    /// For each submap the covariances of the edges that it is part of.
    links: Vec<Vec<Link>>,
    /// Of the way driven, from each submap to the next; to the first of a travel, of where it was placed.
    steps: Vec<Edge>,
    closures: Vec<Edge>,
    pub(crate) landmarks: LandmarkNodes,
}

/// What a graph gave up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum GivenUp {
    /// A closure.
    Closure(SubmapPair),
    /// Views of landmarks.
    Views,
}

impl SubmapGraph {
    /// The chains, cut into submaps; without closures.
    pub(crate) fn new(evidence: Evidence<'_>) -> Self {
        let Evidence { keys, chain, params, .. } = evidence;
        let submaps = submaps(keys, &params.submaps);
        let poses = submaps.iter().map(|submap| chain.poses[submap.anchor]).collect();
        let links = vec![Vec::new(); submaps.len()];
        let (steps, closures, landmarks) = (Vec::new(), Vec::new(), LandmarkNodes::default());
        let mut graph = Self { submaps, poses, links, steps, closures, landmarks };
        let mut starts = evidence.travels.start_edges(keys).into_iter();
        for to in 1..graph.submaps.len() {
            let from = to - 1;
            if graph.submaps[from].travel != graph.submaps[to].travel {
                let edge = starts.next().and_then(|start| graph.started(to, &start, chain));
                graph.steps.extend(edge);
                continue;
            }
            let anchors = (graph.submaps[from].anchor, graph.submaps[to].anchor);
            let step = graph.poses[from].step_to(graph.poses[to]);
            let edge = graph.joined_by((from, to), step, &along(chain, anchors));
            graph.steps.extend(edge.map(|edge| Edge { chi2_turn: f64::INFINITY, ..edge }));
        }
        graph
    }

    /// Ties the first submap of a travel to the first of all, as its first key scan is tied to where it
    /// was placed.
    fn started(&mut self, to: usize, start: &Edge, chain: &Chain) -> Option<Edge> {
        let (first, own) = (self.submaps[0].anchor, self.submaps[to].anchor);
        let back = chain.poses[start.from].step_to(chain.poses[first]).inverse();
        let by_back = inverted(back.inverse(), &along(chain, (start.from, first)));
        let placed = start.information.try_inverse()?;
        let by_start = composed((back, &by_back), (start.from_to, &placed));
        let there = back * start.from_to;
        let (on, by_on) = (chain.poses[start.to].step_to(chain.poses[own]), (start.to, own));
        let covariance = composed((there, &by_start), (on, &along(chain, by_on)));
        let edge = self.joined_by((0, to), self.poses[0].step_to(self.poses[to]), &covariance);
        edge.map(|edge| Edge { chi2_turn: start.chi2_turn, ..edge })
    }

    /// Believes a closure, as far as its residual allows.
    pub(crate) fn add_closure(
        &mut self,
        pair: SubmapPair,
        (from_to, covariance): (Pose, &Matrix3<f64>),
        chi2_turn: f64,
    ) {
        let edge = self.joined_by(pair, from_to, covariance);
        self.closures.extend(edge.map(|edge| Edge { chi2_turn, ..edge }));
    }

    /// Links a pair, and returns its edge.
    fn joined_by(
        &mut self,
        (from, to): SubmapPair,
        from_to: Pose,
        covariance: &Matrix3<f64>,
    ) -> Option<Edge> {
        let information = covariance.try_inverse()?;
        self.links[from].push((to, *covariance));
        self.links[to].push((from, inverted(from_to, covariance)));
        Some(Edge { from, to, from_to, information, chi2_turn: f64::INFINITY })
    }

    /// Notes how sure it is where the second lies seen from the first, as the poses are.
    pub(crate) fn link(&mut self, (from, to): SubmapPair, covariance: &Matrix3<f64>) {
        let from_to = self.poses[from].step_to(self.poses[to]);
        self.links[from].push((to, *covariance));
        self.links[to].push((from, inverted(from_to, covariance)));
    }

    /// A bound of the covariance of every submap seen from one.
    pub(crate) fn covariances_from(&self, start: usize) -> Vec<Option<Matrix3<f64>>> {
        covariances_from(start, &self.poses, &self.links)
    }

    /// Finds the poses anew, of submaps and landmarks: from where they are, and by graduated
    /// non-convexity ([`TIGHTENING`]). The first gives up all closures of a way that comes back
    /// elsewhere than was thought, right and wrong; the second bends the way to any. It is taken if it
    /// is better by more than one closure can say: then at least two want it, and the way allows it.
    pub(crate) fn optimise(&mut self, params: &PoseGraphParams) {
        let (n_submaps, n_steps) = (self.poses.len(), self.steps.len());
        let n_firm = n_steps + self.closures.len();
        let mut edges: Vec<Edge> = self.steps.iter().chain(&self.closures).copied().collect();
        edges.extend(self.landmarks.edges(n_submaps));
        let start = [self.poses.as_slice(), &self.landmarks.poses].concat();
        let mut equations = NormalEquations::new(start.len(), &edges);
        let mut nodes = start.clone();
        let one_says = self.closures.iter().map(|closure| closure.chi2_turn).fold(0.0, f64::max);
        let mut chi2_turn = self.worst_chi2();
        let is_doubted = self.closures.iter().any(|closure| closure.chi2_turn < chi2_turn);
        loop {
            let mut is_tightened = false;
            for (edge, closure) in edges[n_steps..n_firm].iter_mut().zip(&self.closures) {
                edge.chi2_turn = closure.chi2_turn.max(chi2_turn);
                is_tightened |= closure.chi2_turn < edge.chi2_turn;
            }
            optimise(&mut nodes, &edges, &mut equations, params);
            is_tightened |= self.landmarks.tighten(&mut edges[n_firm..]);
            if !is_tightened {
                break;
            }
            chi2_turn /= TIGHTENING;
        }
        if is_doubted {
            let mut near = start;
            let optimised = optimise(&mut near, &edges, &mut equations, params);
            if optimised.cost_after < cost(&nodes, &edges) + one_says {
                nodes = near;
            }
        }
        self.landmarks.poses = nodes.split_off(n_submaps);
        self.poses = nodes;
    }

    /// The largest square of a closure's residual.
    fn worst_chi2(&self) -> f64 {
        let chi2 = |edge: &Edge| edge.chi2(self.poses[edge.from], self.poses[edge.to]);
        self.closures.iter().map(chi2).fold(0.0, f64::max)
    }

    /// Gives up what has the largest residual, if its square is larger than `chi2_max`, and says what it
    /// was.
    pub(crate) fn remove_worst(&mut self, chi2_max: f64) -> Option<GivenUp> {
        let chi2 = |edge: &Edge| edge.chi2(self.poses[edge.from], self.poses[edge.to]);
        let all = self.closures.iter().enumerate().map(|(index, edge)| (chi2(edge), index));
        let of_closure = all.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|worst| chi2_max < worst.0);
        let of_view = self.landmarks.worst_chi2(&self.poses);
        match of_closure {
            Some((worst, index)) if of_view <= worst => {
                let edge = self.closures.remove(index);
                Some(GivenUp::Closure((edge.from, edge.to)))
            }
            _ if chi2_max < of_view => {
                self.landmarks.remove_worst(&self.poses, chi2_max);
                Some(GivenUp::Views)
            }
            _ => None,
        }
    }

    /// The closures, as edges between the key scans that are the submaps' anchors.
    pub(crate) fn anchor_edges(&self) -> Vec<Edge> {
        let anchor = |submap: usize| self.submaps[submap].anchor;
        let edge = |edge: &Edge| Edge { from: anchor(edge.from), to: anchor(edge.to), ..*edge };
        self.closures.iter().map(edge).collect()
    }

    /// What is believed of landmarks, as edges from the key scans that are the submaps' anchors;
    /// landmarks are counted from `n_before` on.
    pub(crate) fn landmark_edges(&self, n_before: usize) -> impl Iterator<Item = Edge> + '_ {
        let anchor = |submap: usize| self.submaps[submap].anchor;
        self.landmarks.edges(n_before).map(move |edge| Edge { from: anchor(edge.from), ..edge })
    }

    /// Which submap each key scan belongs to.
    pub(crate) fn submap_of(&self) -> Vec<usize> {
        let keys = self.submaps.iter().enumerate();
        keys.flat_map(|(index, submap)| submap.keys.clone().map(move |_| index)).collect()
    }

    /// The submaps that landmarks join, or closures that `joins` says do, and their neighbours along the
    /// way; `apart` are not.
    pub(crate) fn joined(
        &self,
        joins: impl Fn(SubmapPair) -> bool,
        apart: BTreeSet<SubmapPair>,
    ) -> Joined {
        let around = |submap: usize| around(submap, &self.submaps);
        let pairs = |edge: &Edge| {
            let to = around(edge.to);
            around(edge.from).flat_map(move |from| to.clone().map(move |to| (from, to)))
        };
        let joining = self.closures.iter().filter(|edge| joins((edge.from, edge.to)));
        let pairs = joining.flat_map(pairs).collect();
        let seen = self.landmarks.of_submaps(self.submaps.len());
        let near = |submap: usize| around(submap).flat_map(|near| seen[near].iter().copied());
        Joined::new(pairs, (0..seen.len()).map(|submap| near(submap).collect()).collect(), apart)
    }

    /// Poses of the key scans: those of the chain, bent so that the anchors are where they were found.
    pub(crate) fn key_poses(&self, evidence: Evidence<'_>) -> Vec<Pose> {
        let chain = evidence.chain;
        let at = |submap: usize, key: usize| {
            let anchor = self.submaps[submap].anchor;
            self.poses[submap] * chain.poses[anchor].step_to(chain.poses[key])
        };
        let pose = |key: usize| {
            let after = self.submaps.partition_point(|submap| submap.anchor <= key);
            let of = evidence.keys[key].travel;
            let is_own =
                |other: &usize| self.submaps.get(*other).is_some_and(|submap| submap.travel == of);
            let (before, after) = (after.checked_sub(1).filter(is_own), Some(after).filter(is_own));
            let (Some(before), Some(after)) = (before.or(after), after.or(before)) else {
                return chain.poses[key];
            };
            let (first, last) = (self.submaps[before].anchor, self.submaps[after].anchor);
            if before == after || key <= first {
                return at(before, key);
            }
            let share = (key - first) as f64 / (last - first) as f64;
            at(before, key).interpolate(at(after, key), share)
        };
        (0..chain.poses.len()).map(pose).collect()
    }
}

/// Covariance of one key scan seen from another before it, along the chain.
fn along(chain: &Chain, (from, to): (usize, usize)) -> Matrix3<f64> {
    (from + 1..=to).fold(Matrix3::zeros(), |sum, next| {
        let there = chain.poses[from].step_to(chain.poses[next - 1]);
        let step = chain.poses[next - 1].step_to(chain.poses[next]);
        composed((there, &sum), (step, &chain.covariances[next]))
    })
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    const PARAMS: PoseGraphParams = PoseGraphParams { n_iterations_max: 50, fall_min: 1e-9 };
    const N_ROUND: usize = 20;
    const SURE: f64 = 1e4;

    fn edge((from, to): SubmapPair, from_to: Pose, information: f64, chi2_turn: f64) -> Edge {
        Edge { from, to, from_to, information: Matrix3::identity() * information, chi2_turn }
    }

    /// Twice around a circle of 5 m, as it is.
    fn truth() -> Vec<Pose> {
        let at = |index: usize| TAU * index as f64 / N_ROUND as f64;
        let on = |angle: f64| Pose::new(5.0 * angle.cos(), 5.0 * angle.sin(), angle);
        (0..2 * N_ROUND).map(|index| on(at(index))).collect()
    }

    /// The same way, each step of which errs a little to one side.
    fn way() -> SubmapGraph {
        let truth = truth();
        let mut poses = vec![truth[0]];
        let mut steps = Vec::new();
        for to in 1..truth.len() {
            let step = truth[to - 1].step_to(truth[to]) * Pose::new(0.04, 0.0, 0.02);
            steps.push(edge((to - 1, to), step, 400.0, f64::INFINITY));
            poses.push(poses[to - 1] * step);
        }
        SubmapGraph {
            submaps: Vec::new(),
            links: vec![Vec::new(); poses.len()],
            poses,
            steps,
            closures: Vec::new(),
            landmarks: LandmarkNodes::default(),
        }
    }

    fn off_m(graph: &SubmapGraph) -> f64 {
        let pairs = graph.poses.iter().zip(truth());
        pairs.map(|(found, truth)| truth.step_to(*found).distance_m()).fold(0.0, f64::max)
    }

    #[test]
    fn closures_that_agree_are_believed_though_the_way_says_otherwise() {
        let mut graph = way();
        assert!(1.0 < off_m(&graph), "the way errs: {} m", off_m(&graph));
        let truth = truth();
        for from in [0, 4, 8] {
            let to = from + N_ROUND;
            graph.closures.push(edge((from, to), truth[from].step_to(truth[to]), SURE, 16.0));
        }
        let wrong = truth[6].step_to(truth[6 + N_ROUND]) * Pose::new(1.0, 0.0, 0.0);
        graph.closures.push(edge((6, 6 + N_ROUND), wrong, SURE, 16.0));
        graph.optimise(&PARAMS);
        let chi2 = |edge: &Edge| edge.chi2(graph.poses[edge.from], graph.poses[edge.to]);
        let chi2: Vec<f64> = graph.closures.iter().map(chi2).collect();
        assert!(chi2[..3].iter().all(|chi2| *chi2 < 16.0), "right ones: {chi2:?}");
        assert!(1000.0 < chi2[3], "the wrong one: {chi2:?}");
        assert_eq!(graph.remove_worst(16.0), Some(GivenUp::Closure((6, 6 + N_ROUND))), "given up");
        assert_eq!(graph.remove_worst(16.0), None, "and no other");
    }

    #[test]
    fn one_closure_does_not_bend_a_way_that_is_surer() {
        let mut graph = way();
        let before = graph.poses.clone();
        let back = before[0].step_to(before[N_ROUND]) * Pose::new(4.0, 0.0, 0.0);
        graph.closures.push(edge((0, N_ROUND), back, SURE, 16.0));
        graph.optimise(&PARAMS);
        let moved = graph.poses.iter().zip(&before);
        let moved_m = moved.map(|(a, b)| a.step_to(*b).distance_m()).fold(0.0, f64::max);
        assert!(moved_m < 0.1, "bent by {moved_m} m");
    }
}
