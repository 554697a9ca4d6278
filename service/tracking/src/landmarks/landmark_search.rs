//! Which views are of one landmark: those of one name that the graph can believe to be.
//!
//! A name is not proof: labels are misread, and two things may carry the same. So a view is held against
//! those of the same name before it, with the odds that matching gives a candidate that may as well be
//! something else anywhere on the site,
//!
//! ```text
//! log odds = ln((1 - p) A / p) - ln(2 pi) - ln det(S) / 2 - e' S^-1 e / 2
//! ```
//!
//! of the difference e from where the graph has the landmark, its covariance S by the graph and both views,
//! the share p of wrong names and the area A of a site: Y. Bar-Shalom, T. Fortmann, "Tracking and data
//! association", 1988, sections 5.3 and 6.4 (gate, clutter). The surer the graph, the more may speak
//! against a name. What is not likely enough by itself waits until another name says the same, whose odds
//! given the first are added; what may be one of several landmarks of the name waits until the graph is
//! surer; what can be none of them is another one. So a name that two things have mostly does no more harm
//! than none.
//!
//! What a view says is told to the graph's bounds too, as a measurement of the pose of the one submap
//! seen from the other (the Kalman filter's update in Joseph's form), so that closures are looked for
//! where they can be.

use std::cell::LazyCell;
use std::collections::{BTreeMap, VecDeque};
use std::f64::consts::TAU;

use meetpoint_geometry::Pose;
use nalgebra::{Matrix2, Matrix2x3, Matrix3};

use crate::closures::evidence::Evidence;
use crate::closures::submap::Submap;
use crate::closures::submap_graph::SubmapGraph;
use crate::graph::uncertainty::{composed, inverted};
use crate::landmarks::landmark_view::{LandmarkView, landmark_views};
use crate::scans::scan_pair::moved;

/// Share of names that are wrong.
const WRONG_SHARE: f64 = 0.02;
/// Where what a wrong name belongs to may be, in square metres: a hall of 50 m by 50 m.
const SITE_M2: f64 = 2500.0;
/// Logarithm of the odds from which on a view is believed, and of those between two landmarks of one name:
/// 20 to 1.
const LOG_ODDS_MIN: f64 = 3.0;
/// Square of the difference, in units of its covariance, up to which another name's word is waited for:
/// six deviations. The bounds take the errors of steps for independent, which odometry's are not.
const SUPPORTED_CHI2_MAX: f64 = 36.0;
/// Views that wait and are asked whether they say the same, at most: the latest.
const N_WAITING_MAX: usize = 8;
/// A view whose square is larger, where the graph has the landmark, moves the graph by what matters.
const NEWS_CHI2_MIN: f64 = 1.0;

/// A search under way.
#[derive(Debug)]
pub(crate) struct LandmarkSearch {
    /// Submap by submap.
    views: Vec<LandmarkView>,
    landmarks: Vec<Landmark>,
    by_name: BTreeMap<usize, Vec<usize>>,
    /// Which landmark each view was taken for.
    landmark_of: Vec<Option<usize>>,
    /// Views that wait for another name to say the same, and what they said when they began to.
    waiting: VecDeque<(usize, Match)>,
}

/// Views that are taken for one thing.
#[derive(Debug, Default)]
struct Landmark {
    views: Vec<usize>,
    /// Its node, once there is more than one view.
    node: Option<usize>,
}

/// What came of the views of a submap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Judged {
    /// Views that were held against others.
    pub(crate) n_asked: usize,
    /// Those that were taken for what others saw.
    pub(crate) n_joined: usize,
    /// Whether one of these was not where the graph had it.
    pub(crate) is_news: bool,
}

/// A view as one of a landmark.
#[derive(Clone, Copy, Debug)]
struct Match {
    /// The view of it that the graph is surest of. Invariant: it was taken for a landmark.
    other: usize,
    said: Said,
}

/// What two views say if they are of one landmark.
#[derive(Clone, Copy, Debug)]
struct Said {
    /// Logarithm of the odds that they are.
    log_odds: f64,
    /// Square of the difference in units of its covariance.
    chi2: f64,
    /// The sum of its variances along both axes, in square metres.
    variance_m2: f64,
    /// The other's submap seen from the own one's, if they are, and its covariance.
    from_other: Pose,
    covariance: Matrix3<f64>,
}

impl LandmarkSearch {
    /// Gathers what the submaps saw; nothing is judged yet.
    pub(crate) fn new(submaps: &[Submap], evidence: Evidence<'_>) -> Self {
        let views = landmark_views(submaps, evidence);
        let landmark_of = vec![None; views.len()];
        Self {
            views,
            landmarks: Vec::new(),
            by_name: BTreeMap::new(),
            landmark_of,
            waiting: VecDeque::new(),
        }
    }

    /// Judges what a submap saw, as far as it was not taken for what others saw before.
    pub(crate) fn judge(&mut self, submap: usize, graph: &mut SubmapGraph) -> Judged {
        let first = self.views.partition_point(|view| view.submap < submap);
        let end = self.views.partition_point(|view| view.submap <= submap);
        let open: Vec<usize> = (first..end).filter(|&view| !self.is_joined(view)).collect();
        let mut judged = Judged { n_asked: open.len(), ..Judged::default() };
        if open.is_empty() {
            return judged;
        }
        let covariances = graph.covariances_from(submap);
        for view in open {
            for (view, found) in self.believed(view, (graph, &covariances)) {
                judged.n_joined += 1;
                judged.is_news |= NEWS_CHI2_MIN < self.join(view, &found, graph);
            }
        }
        judged
    }

    /// What is believed now that a view is looked at: that it is of a landmark, or that and what another
    /// view waited to say, or nothing yet.
    fn believed(
        &mut self,
        view: usize,
        (graph, covariances): (&SubmapGraph, &[Option<Matrix3<f64>>]),
    ) -> Vec<(usize, Match)> {
        let found = self.matches(view, (&graph.poses, covariances));
        let [nearest, others @ ..] = found.as_slice() else {
            self.begin(view);
            return Vec::new();
        };
        let lead = |other: &Match| nearest.said.log_odds - other.said.log_odds;
        if others.iter().any(|other| lead(other) < LOG_ODDS_MIN) {
            return Vec::new();
        }
        if LOG_ODDS_MIN <= nearest.said.log_odds {
            return vec![(view, *nearest)];
        }
        match self.supporter(view, nearest, (graph, covariances)) {
            Some(supporter) => vec![(view, *nearest), supporter],
            None => {
                self.wait(view, *nearest);
                Vec::new()
            }
        }
    }

    /// Notes that a view waits for another name to say the same.
    fn wait(&mut self, view: usize, found: Match) {
        self.waiting.retain(|&(other, _)| other != view);
        if self.waiting.len() == N_WAITING_MAX {
            self.waiting.pop_front();
        }
        self.waiting.push_back((view, found));
    }

    /// A view that waits, of another name, that makes this one likely enough and is made so by it.
    fn supporter(
        &self,
        view: usize,
        found: &Match,
        (graph, by_own): (&SubmapGraph, &[Option<Matrix3<f64>>]),
    ) -> Option<(usize, Match)> {
        let (own, other) = (&self.views[view], &self.views[found.other]);
        let poses = &graph.poses;
        let by_other = LazyCell::new(|| graph.covariances_from(other.submap));
        let waits = |&&(waiting, _): &&(usize, Match)| {
            !self.is_joined(waiting) && self.views[waiting].name != own.name
        };
        let supports = |&&(waiting, Match { other: seen, said: first }): &&(usize, Match)| {
            // From the own submap to that which waits, by what that says, and back to the other.
            let (from, to) = (self.views[waiting].submap, self.views[seen].submap);
            let there = poses[own.submap].step_to(poses[from]);
            let back = poses[to].step_to(poses[other.submap]);
            let by_there = by_own[from].as_ref();
            let by_back = by_other[to].as_ref().map(|by| inverted(back.inverse(), by));
            by_there.zip(by_back).is_some_and(|(by_there, by_back)| {
                let by_said = composed((there, by_there), (first.from_other, &first.covariance));
                let there = there * first.from_other;
                let covariance = composed((there, &by_said), (back, &by_back));
                said(own, other, there * back, &covariance)
                    .is_some_and(|given| LOG_ODDS_MIN <= given.log_odds + first.log_odds)
            })
        };
        self.waiting.iter().rev().filter(waits).find(supports).copied()
    }

    /// Whether a view was taken for what another one saw.
    fn is_joined(&self, view: usize) -> bool {
        self.landmark_of[view].is_some_and(|of| self.landmarks[of].node.is_some())
    }

    /// A view held against every landmark of its name, the likeliest first; none that cannot be.
    fn matches(
        &self,
        view: usize,
        (poses, covariances): (&[Pose], &[Option<Matrix3<f64>>]),
    ) -> Vec<Match> {
        let own = &self.views[view];
        let named = self.by_name.get(&own.name).into_iter().flatten();
        let others = named.copied().filter(|&landmark| self.landmark_of[view] != Some(landmark));
        let surest = |landmark: usize| {
            let of_view = |&other: &usize| {
                let theirs = &self.views[other];
                let from_other = poses[own.submap].step_to(poses[theirs.submap]);
                let said = said(own, theirs, from_other, covariances[theirs.submap].as_ref()?)?;
                Some(Match { other, said })
            };
            let all = self.landmarks[landmark].views.iter().filter_map(of_view);
            all.min_by(|a, b| a.said.variance_m2.total_cmp(&b.said.variance_m2))
        };
        let mut found: Vec<Match> = others.filter_map(surest).collect();
        found.retain(|found| found.said.chi2 <= SUPPORTED_CHI2_MAX);
        found.sort_by(|a, b| b.said.log_odds.total_cmp(&a.said.log_odds));
        found
    }

    /// Takes a view for a landmark that was not seen before.
    fn begin(&mut self, view: usize) {
        if self.landmark_of[view].is_none() {
            self.landmark_of[view] = Some(self.landmarks.len());
            self.by_name.entry(self.views[view].name).or_default().push(self.landmarks.len());
            self.landmarks.push(Landmark { views: vec![view], node: None });
        }
    }

    /// Takes a view for one of the landmark that another is of, and tells the graph; the square of its
    /// residual there.
    fn join(&mut self, view: usize, found: &Match, graph: &mut SubmapGraph) -> f64 {
        let of = self.landmark_of[found.other];
        if let Some(own) = std::mem::replace(&mut self.landmark_of[view], of) {
            // Nobody else is of it.
            self.landmarks[own].views.clear();
        }
        let Some(landmark) = of.map(|of| &mut self.landmarks[of]) else { return 0.0 };
        let (own, theirs) = (&self.views[view], &self.views[found.other]);
        let node = *landmark.node.get_or_insert_with(|| {
            let node = graph.landmarks.add(graph.poses[theirs.submap] * theirs.seen);
            graph.landmarks.see(node, (found.other, theirs), graph.poses[theirs.submap]);
            node
        });
        landmark.views.push(view);
        let chi2 = graph.landmarks.see(node, (view, own), graph.poses[own.submap]);
        graph.link((own.submap, theirs.submap), &found.said.covariance);
        chi2
    }

    /// Sightings of the landmarks that the graph rests on, and sightings of others that were seen again
    /// but not where they were, by travel.
    pub(crate) fn counts(&self, graph: &SubmapGraph, n_travels: usize) -> Vec<(usize, usize)> {
        let mut is_believed = vec![false; self.views.len()];
        for &view in graph.landmarks.believed() {
            is_believed[view] = true;
        }
        let mut counts = vec![(0, 0); n_travels];
        for (view, is_believed) in self.views.iter().zip(is_believed) {
            let (believed, doubted) = &mut counts[graph.submaps[view.submap].travel];
            *(if is_believed { believed } else { doubted }) += view.n_sightings;
        }
        counts
    }
}

/// What two views say if they are of one landmark, where the other's submap lies seen from the own one's
/// with that covariance.
fn said(
    own: &LandmarkView,
    other: &LandmarkView,
    from_other: Pose,
    covariance: &Matrix3<f64>,
) -> Option<Said> {
    let expected = from_other * other.seen;
    let arm = expected - from_other.position();
    let by_pose = Matrix2x3::new(1.0, 0.0, -arm.y, 0.0, 1.0, arm.x);
    let of_views = Matrix2::identity() * (own.variance_m2 + other.variance_m2);
    let apart = by_pose * covariance * by_pose.transpose() + of_views;
    let information = apart.try_inverse()?;
    let away = own.seen - expected;
    let gain = covariance * by_pose.transpose() * information;
    let kept = Matrix3::identity() - gain * by_pose;
    let covariance = kept * covariance * kept.transpose() + gain * of_views * gain.transpose();
    let chi2 = away.dot(&(information * away));
    let by_chance = WRONG_SHARE / ((1.0 - WRONG_SHARE) * SITE_M2);
    let log_odds = -(by_chance * TAU * apart.determinant().sqrt()).ln() - 0.5 * chi2;
    log_odds.is_finite().then_some(Said {
        log_odds,
        chi2,
        variance_m2: apart.trace(),
        from_other: moved(from_other, gain * away),
        covariance,
    })
}

#[cfg(test)]
mod tests {
    use meetpoint_geometry::Point2;
    use nalgebra::Vector3;
    use proptest::prelude::*;

    use super::*;

    fn view(x_m: f64, y_m: f64, variance_m2: f64) -> LandmarkView {
        let seen = Point2::new(x_m, y_m);
        LandmarkView { submap: 0, name: 0, seen, variance_m2, n_sightings: 1 }
    }

    proptest! {
        /// The definition: the information of both added, the derivative by differences.
        #[test]
        fn says_what_least_squares_do(
            (x, y, turn) in (-9.0..9.0_f64, -9.0..9.0_f64, -3.0..3.0_f64),
            (own_x, own_y) in (-5.0..5.0_f64, -5.0..5.0_f64),
            (other_x, other_y) in (-5.0..5.0_f64, -5.0..5.0_f64),
            (own_m2, other_m2) in (0.01..1.0_f64, 0.01..1.0_f64),
        ) {
            let (own, other) = (view(own_x, own_y, own_m2), view(other_x, other_y, other_m2));
            let (from_other, covariance) = (
                Pose::new(x, y, turn),
                Matrix3::new(4.0, 0.5, 0.1, 0.5, 2.0, -0.2, 0.1, -0.2, 0.3),
            );
            let found = said(&own, &other, from_other, &covariance).expect("finite");
            let seen = |step: Vector3<f64>| {
                let pose = Pose::new(x + step.x, y + step.y, turn + step.z);
                (pose * other.seen).coords
            };
            let slope = |axis: usize| {
                let mut step = Vector3::zeros();
                step[axis] = 1e-6;
                (seen(step) - seen(-step)) / 2e-6
            };
            let by_pose = Matrix2x3::from_columns(&[slope(0), slope(1), slope(2)]);
            let of_views = Matrix2::identity() / (own_m2 + other_m2);
            let before = covariance.try_inverse().expect("positive definite");
            let after = before + by_pose.transpose() * of_views * by_pose;
            let expected = after.try_inverse().expect("positive definite");
            prop_assert!((found.covariance - expected).amax() < 1e-6, "{found:?} {expected}");
            let away = own.seen.coords - seen(Vector3::zeros());
            let step = expected * by_pose.transpose() * of_views * away;
            let moved = Pose::new(x + step.x, y + step.y, turn + step.z);
            let off = moved.step_to(found.from_other);
            prop_assert!(off.distance_m() + off.theta_rad.abs() < 1e-5, "{found:?} {moved:?}");
            // Both costs at the minimum are what the difference costs.
            let left = away - by_pose * step;
            let cost = step.dot(&(before * step)) + left.dot(&(of_views * left));
            prop_assert!((found.chi2 - cost).abs() < 1e-5 * (1.0 + cost), "{found:?} {cost}");
        }
    }

    #[test]
    fn the_surer_the_graph_the_more_may_speak_against_a_name() {
        let (own, other) = (view(0.0, 0.0, 0.1), view(0.0, 0.0, 0.1));
        let log_odds = |n_std: f64, std_m: f64| {
            let covariance = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 1e-6)) * std_m * std_m;
            let off_m = n_std * (std_m * std_m + 0.2).sqrt();
            said(&own, &other, Pose::new(off_m, 0.0, 0.0), &covariance).expect("finite").log_odds
        };
        assert!(LOG_ODDS_MIN < log_odds(3.5, 0.3), "{}", log_odds(3.5, 0.3));
        assert!(LOG_ODDS_MIN < log_odds(1.0, 8.0), "{}", log_odds(1.0, 8.0));
        assert!(log_odds(3.5, 8.0) < LOG_ODDS_MIN, "{}", log_odds(3.5, 8.0));
    }
}
