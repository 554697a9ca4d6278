//! Sweeps: every key scan matched with those taken near it, all poses found together.
//!
//! A sweep makes of each pair of neighbours the two edges that say what one saw of the walls of the
//! other ([`pair_form`]), and optimises the poses over these and the edges of odometry and closures.
//! Since matching is linearised anew with every sweep, the sweeps together are Gauss-Newton steps of one
//! least-squares problem over all poses and all that was seen: F. Lu, E. Milios, "Globally consistent
//! range scan alignment for environment mapping", Autonomous Robots 4 (1997), with distances from
//! points to walls in place of those between points.

use std::num::NonZero;

use meetpoint_geometry::Pose;
use nalgebra::Matrix3;

use crate::graph::normal_equations::NormalEquations;
use crate::graph::pose_graph::{Edge, Optimised, PoseGraphParams, cost, optimise};
use crate::scans::believed_information::believed_information;
use crate::scans::key_scan::KeyScan;
use crate::scans::scan_pair::{PairParams, moved, pair_form};
use crate::side_by_side::in_chunks;

/// Two key scans that may have seen the same walls.
pub(crate) type Pair = (usize, usize);

/// Sweeps under way.
#[derive(Debug)]
pub(crate) struct Sweeps {
    pairs: Vec<Pair>,
    /// Two a pair, then the others.
    edges: Vec<Edge>,
    /// How each pair stood when it was last matched.
    matched_at: Vec<Option<Pose>>,
    /// Where landmarks are; edges count them after the key scans.
    landmarks: Vec<Pose>,
    equations: NormalEquations,
    next: usize,
}

/// Facets of a scan that a pair looks at, at most.
const N_FACETS_MAX: usize = 90;
/// Pairs with fewer facets that met say nothing.
const N_MET_MIN: u32 = 12;
/// The same for a smaller share of those that were asked.
const MET_SHARE_MIN: f64 = 0.15;
/// Pairs that a thread takes at once: some tenths of a millisecond.
const N_AT_ONCE: usize = 32;
/// A pair that moved by less, in metres and radians, is not matched again.
const MOVED_MIN: f64 = 1e-3;

impl Sweeps {
    /// Sweeps over some pairs, with edges that stay as they are, between key scans and, counted after
    /// them, from these to landmarks. The first key scan stays where it is, and so do those that are known.
    pub(crate) fn new(
        keys: &[KeyScan],
        mut pairs: Vec<Pair>,
        others: impl Iterator<Item = Edge>,
        landmarks: Vec<Pose>,
    ) -> Self {
        let mut held: Vec<bool> =
            keys.iter().enumerate().map(|(index, key)| index == 0 || key.is_known).collect();
        held.resize(keys.len() + landmarks.len(), false);
        pairs.retain(|&(a, b)| !(keys[a].is_known && keys[b].is_known));
        let unknown = |(from, to): Pair| Edge {
            from,
            to,
            from_to: Pose::IDENTITY,
            information: Matrix3::zeros(),
            chi2_turn: f64::INFINITY,
        };
        let mut edges: Vec<Edge> =
            pairs.iter().flat_map(|&(a, b)| [unknown((a, b)), unknown((b, a))]).collect();
        edges.extend(others);
        let equations = NormalEquations::holding(&held, &edges);
        let matched_at = vec![None; pairs.len()];
        Self { pairs, edges, matched_at, landmarks, equations, next: 0 }
    }

    /// Lets every pair be matched again, however little it moved.
    pub(crate) fn forget(&mut self) {
        self.matched_at.fill(None);
    }

    /// Matches the next pairs on some threads, until `n_max` of them have been. False, and nothing done,
    /// when none was left in this sweep.
    pub(crate) fn match_some(
        &mut self,
        keys: &[KeyScan],
        poses: &[Pose],
        params: &PairParams,
        (n_max, n_threads): (usize, NonZero<usize>),
    ) -> bool {
        if self.next == self.pairs.len() {
            return false;
        }
        let mut moved = Vec::new();
        while self.next < self.pairs.len() && moved.len() < n_max {
            let (a, b) = self.pairs[self.next];
            let seen = poses[a].step_to(poses[b]);
            if self.matched_at[self.next].is_none_or(|before| has_moved(before, seen)) {
                self.matched_at[self.next] = Some(seen);
                moved.push(self.next);
            }
            self.next += 1;
        }
        let edges = in_chunks(0..moved.len(), N_AT_ONCE, n_threads, |index| {
            let (a, b) = self.pairs[moved[index]];
            [(a, b), (b, a)].map(|pair| pair_edge(keys, poses, pair, params))
        });
        for (pair, both) in moved.into_iter().zip(edges) {
            self.edges[2 * pair..2 * pair + 2].copy_from_slice(&both);
        }
        true
    }

    /// Leaves out those of the first `n` of the other edges whose square is larger than `chi2_max`, and
    /// says of each whether it was kept.
    pub(crate) fn leave_out(&mut self, n: usize, poses: &[Pose], chi2_max: f64) -> Vec<bool> {
        let nodes = [poses, &self.landmarks].concat();
        let others = self.edges.iter_mut().skip(2 * self.pairs.len()).take(n);
        let kept = others.map(|edge| {
            let is_kept = edge.chi2(nodes[edge.from], nodes[edge.to]) <= chi2_max;
            if !is_kept {
                edge.information.fill(0.0);
            }
            is_kept
        });
        kept.collect()
    }

    /// Moves the poses by what was matched; the next sweep may begin.
    pub(crate) fn solve(&mut self, poses: &mut Vec<Pose>, params: &PoseGraphParams) -> Optimised {
        self.next = 0;
        let n_keys = poses.len();
        poses.append(&mut self.landmarks);
        let optimised = optimise(poses, &self.edges, &mut self.equations, params);
        self.landmarks = poses.split_off(n_keys);
        optimised
    }

    /// Square of all residuals in units of their deviations, at these poses of the key scans, with
    /// landmarks where these have them on average.
    pub(crate) fn chi2(&self, poses: &[Pose]) -> f64 {
        let mut nodes = [poses, &self.landmarks].concat();
        let mut seen = vec![(0.0, 0.0, 0.0); self.landmarks.len()];
        for edge in self.edges.iter().filter(|edge| poses.len() <= edge.to) {
            let at = poses[edge.from] * edge.from_to.position();
            let (weight, x_m, y_m) = &mut seen[edge.to - poses.len()];
            let information = edge.information[(0, 0)];
            *weight += information;
            *x_m += information * at.x;
            *y_m += information * at.y;
        }
        for (node, (weight, x_m, y_m)) in nodes[poses.len()..].iter_mut().zip(seen) {
            if 0.0 < weight {
                *node = Pose::new(x_m / weight, y_m / weight, 0.0);
            }
        }
        cost(&nodes, &self.edges)
    }
}

fn has_moved(before: Pose, now: Pose) -> bool {
    let step = before.step_to(now);
    MOVED_MIN < step.distance_m() || MOVED_MIN < step.theta_rad.abs()
}

/// What the scan of `to` says of where it lies seen from `from`, at the poses as they are; without
/// information if they saw too little in common.
fn pair_edge(keys: &[KeyScan], poses: &[Pose], (from, to): Pair, params: &PairParams) -> Edge {
    let seen = poses[from].step_to(poses[to]);
    let (here, there) = (&keys[from].surface, &keys[to].surface);
    let stride = there.facets().len().div_ceil(N_FACETS_MAX).max(1);
    let form = pair_form(here, there.facets(), seen, params, stride);
    let edge =
        Edge { from, to, from_to: seen, information: Matrix3::zeros(), chi2_turn: f64::INFINITY };
    if form.n_met < N_MET_MIN || form.met_share() < MET_SHARE_MIN {
        return edge;
    }
    Edge {
        from_to: moved(seen, form.step()),
        information: believed_information(&form.hessian),
        ..edge
    }
}
