//! The search for closures: submap by submap along the way, and again until nothing new is found.
//!
//! For each submap those are candidates that the graph has near it, give or take how uncertain it says
//! that is ([`covariances_from`]). Laid over a candidate anywhere in that window, a submap may fit at
//! several places. Each is a hypothesis with a likelihood,
//!
//! ```text
//! log L = score / score_std - m2 / 2
//! ```
//!
//! where m2 is the square of its distance from what the graph says, in units of its covariance; the best
//! is taken only if it is likelier than any other by `odds_min`. What is ambiguous stays in the ledger
//! with its alternatives and is judged again when other closures have made the graph surer: the
//! alternatives of a whole way are decided by what all of it says, not each by its score. A closure
//! across great uncertainty is not believed alone: another must say the same.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use meetpoint_geometry::{GridFrame, Point2, Pose};
use nalgebra::{Matrix3, Vector3};

use crate::chain::Chain;
use crate::closure::{Closure, ClosureKey, Refusal, Verdict};
use crate::key_scan::KeyScan;
use crate::laser_travel::LaserTravel;
use crate::normal_equations::NormalEquations;
use crate::peaks::peaks_in_window;
use crate::pose_graph::{Edge, optimise};
use crate::relaxation_params::LaserRelaxationParams;
use crate::scan_pair::PairParams;
use crate::search::Window;
use crate::submap::{Submap, SubmapChart, spread_points, submaps};
use crate::submap_match::{Placed, SubmapFit, fit};
use crate::uncertainty::{Link, composed, covariances_from, inverted};

/// What all of a search reads.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Evidence<'a> {
    pub(crate) travel: &'a LaserTravel,
    pub(crate) keys: &'a [KeyScan],
    pub(crate) chain: &'a Chain,
    pub(crate) params: &'a LaserRelaxationParams,
    pub(crate) frame: GridFrame,
}

/// A search under way.
#[derive(Debug)]
pub(crate) struct ClosureSearch {
    pub(crate) submaps: Vec<Submap>,
    /// Of the submaps' anchors.
    pub(crate) poses: Vec<Pose>,
    /// For each submap the edges of the chain and of accepted closures, both ways.
    links: Vec<Vec<Link>>,
    /// Those of the chain, then those of accepted closures.
    edges: Vec<Edge>,
    /// By the two submaps.
    pub(crate) found: BTreeMap<(usize, usize), Found>,
    refused: BTreeSet<ClosureKey>,
    /// What was guessed when a pair was last matched.
    tried: BTreeMap<(usize, usize), (Pose, f64)>,
    charts: VecDeque<(usize, SubmapChart)>,
    next: usize,
    n_passes: u32,
    n_accepted_in_pass: usize,
}

/// A closure of the ledger.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    pub(crate) from_to: Pose,
    pub(crate) covariance: Matrix3<f64>,
    pub(crate) score: f64,
    pub(crate) alternatives: Vec<(Pose, f64)>,
    pub(crate) verdict: Verdict,
}

/// A submap that another may lie near.
#[derive(Clone, Copy, Debug)]
struct Guess {
    from: usize,
    from_to: Pose,
    covariance: Matrix3<f64>,
    distance_m: f64,
}

impl ClosureSearch {
    /// Cuts the chain into submaps. `refused` are never accepted.
    pub(crate) fn new(evidence: Evidence<'_>, refused: &[ClosureKey]) -> Self {
        let Evidence { keys, chain, params, .. } = evidence;
        let submaps = submaps(keys, &params.submaps);
        let poses: Vec<Pose> = submaps.iter().map(|submap| chain.poses[submap.anchor]).collect();
        let mut search = Self {
            links: vec![Vec::new(); submaps.len()],
            edges: Vec::new(),
            found: BTreeMap::new(),
            refused: refused.iter().copied().collect(),
            tried: BTreeMap::new(),
            charts: VecDeque::new(),
            next: 0,
            n_passes: 0,
            n_accepted_in_pass: 0,
            submaps,
            poses,
        };
        for to in 1..search.submaps.len() {
            let anchors = (search.submaps[to - 1].anchor, search.submaps[to].anchor);
            let covariance = along(chain, anchors);
            search.join(
                (to - 1, to),
                search.poses[to - 1].step_to(search.poses[to]),
                &covariance,
                f64::INFINITY,
            );
        }
        search
    }

    fn join(
        &mut self,
        (from, to): (usize, usize),
        from_to: Pose,
        covariance: &Matrix3<f64>,
        chi2_turn: f64,
    ) {
        let Some(information) = covariance.try_inverse() else { return };
        self.links[from].push((to, *covariance));
        self.links[to].push((from, inverted(from_to, covariance)));
        self.edges.push(Edge { from, to, from_to, information, chi2_turn });
    }

    /// Looks at the next submap. False when the search is over.
    pub(crate) fn advance(&mut self, evidence: Evidence<'_>) -> bool {
        if self.next == self.submaps.len() {
            self.n_passes += 1;
            let again = 0 < self.n_accepted_in_pass
                && self.n_passes < evidence.params.closures.n_passes_max;
            if !again {
                self.settle(evidence);
                return false;
            }
            (self.next, self.n_accepted_in_pass) = (0, 0);
        }
        let to = self.next;
        self.next += 1;
        let guesses = self.guesses(to, evidence);
        let mut n_accepted = 0;
        for guess in guesses {
            n_accepted += usize::from(self.consider(guess, to, evidence));
        }
        if 0 < n_accepted {
            self.n_accepted_in_pass += n_accepted;
            self.optimise(evidence);
        }
        true
    }

    /// Share of the search that is done, as far as one knows.
    pub(crate) fn share(&self, n_passes_max: u32) -> f64 {
        let passes = f64::from(self.n_passes) + self.next as f64 / self.submaps.len().max(1) as f64;
        passes / f64::from(n_passes_max.max(1))
    }

    fn is_accepted(&self, pair: (usize, usize)) -> bool {
        self.found.get(&pair).is_some_and(|found| found.verdict == Verdict::Accepted)
    }

    /// The submaps that may lie near one, of each pass the nearest.
    fn guesses(&self, to: usize, evidence: Evidence<'_>) -> Vec<Guess> {
        let Evidence { keys, params, .. } = evidence;
        let closures = &params.closures;
        let driven_m = |submap: usize| keys[self.submaps[submap].anchor].driven_m;
        let covariances = covariances_from(to, &self.poses, &self.links);
        let guess = |from: usize| {
            let to_from = self.poses[to].step_to(self.poses[from]);
            let covariance = inverted(to_from, &covariances[from]?) + closures.floor();
            let std_m = position_std_m(&covariance);
            let from_to = to_from.inverse();
            let distance_m = from_to.distance_m();
            let reach_m = closures.reach_m + (closures.n_std * std_m).min(closures.half_max_m);
            let far = closures.way_min_m <= (driven_m(to) - driven_m(from)).abs();
            (far && distance_m <= reach_m).then_some(Guess {
                from,
                from_to,
                covariance,
                distance_m,
            })
        };
        let all: Vec<Option<Guess>> = (0..to).map(guess).collect();
        let distance = |from: Option<usize>| {
            let guess = from.and_then(|from| all.get(from).copied().flatten());
            guess.map_or(f64::INFINITY, |guess| guess.distance_m)
        };
        let nearest = |guess: &Guess| {
            guess.distance_m < distance(guess.from.checked_sub(1))
                && guess.distance_m <= distance(Some(guess.from + 1))
        };
        let mut nearest: Vec<Guess> = all.iter().copied().flatten().filter(nearest).collect();
        nearest.sort_by(|a, b| a.distance_m.total_cmp(&b.distance_m));
        nearest.truncate(closures.n_candidates_max);
        nearest.retain(|guess| !self.is_accepted((guess.from, to)));
        nearest
    }

    /// Matches a submap with one that it may lie near. True if a closure was accepted.
    fn consider(&mut self, guess: Guess, to: usize, evidence: Evidence<'_>) -> bool {
        let pair = (guess.from, to);
        if self.was_tried(pair, guess) {
            return false;
        }
        let Some(mut found) = self.matched(guess, to, evidence) else { return false };
        let mut accepted = vec![];
        if found.verdict == Verdict::Accepted {
            let alone = position_std_m(&guess.covariance) <= evidence.params.closures.alone_std_m;
            let support = self.supporters(pair, &found, evidence.params.closures.support_chi2_max);
            if self.refused.contains(&self.key(pair, evidence)) {
                found.verdict = Verdict::Refused(Refusal::SwitchedOff);
            } else if alone || !support.is_empty() {
                accepted = support;
                accepted.push(pair);
            } else {
                found.verdict = Verdict::Refused(Refusal::Unsupported);
            }
        }
        self.found.insert(pair, found);
        for &pair in &accepted {
            self.accept(pair, evidence);
        }
        !accepted.is_empty()
    }

    /// True if a pair was matched before and as much was known; notes what is known now.
    fn was_tried(&mut self, pair: (usize, usize), guess: Guess) -> bool {
        let std_m = position_std_m(&guess.covariance);
        let same = self.tried.get(&pair).is_some_and(|&(before, std_before_m)| {
            before.step_to(guess.from_to).distance_m() < SAME_SHARE * std_m
                && std_before_m * (1.0 - SAME_SHARE) < std_m
        });
        if !same {
            self.tried.insert(pair, (guess.from_to, std_m));
        }
        same
    }

    fn accept(&mut self, pair: (usize, usize), evidence: Evidence<'_>) {
        let Some(found) = self.found.get_mut(&pair) else { return };
        let is_new =
            !self.edges.iter().any(|edge| (edge.from, edge.to) == pair && pair.0 + 1 != pair.1);
        found.verdict = Verdict::Accepted;
        let (from_to, covariance) = (found.from_to, found.covariance);
        if is_new {
            self.join(pair, from_to, &covariance, evidence.params.closures.chi2_turn);
        }
    }

    /// Which stamps a pair of submaps joins.
    fn key(&self, (from, to): (usize, usize), evidence: Evidence<'_>) -> ClosureKey {
        let stamp_ns = |submap: usize| {
            let key = &evidence.keys[self.submaps[submap].anchor];
            evidence.travel.scans[key.scan].stamp_ns
        };
        ClosureKey { from_ns: stamp_ns(from), to_ns: stamp_ns(to) }
    }

    /// What laying one submap over another says, without regard to other closures; `None` if it fits
    /// nowhere.
    fn matched(&mut self, guess: Guess, to: usize, evidence: Evidence<'_>) -> Option<Found> {
        let Evidence { params, .. } = evidence;
        let closures = &params.closures;
        let there = self.placed(to..to + 1, self.submaps[to].anchor, evidence);
        let points = spread_points(
            there.iter().copied(),
            Pose::IDENTITY,
            (closures.point_edge_m, closures.point_range_m),
            closures.n_points_max,
        );
        if points.len() < closures.n_points_min {
            return None;
        }
        let std_m = position_std_m(&guess.covariance);
        let window = Window {
            center: guess.from_to,
            half_m: (closures.n_std * std_m).clamp(closures.half_min_m, closures.half_max_m),
            half_rad: (closures.n_std * guess.covariance[(2, 2)].sqrt())
                .clamp(closures.half_min_rad, closures.half_max_rad),
            step_rad: closures.step_rad,
        };
        let half_m = closures.point_range_m + guess.distance_m + window.half_m;
        #[expect(clippy::cast_possible_truncation, reason = "clamped")]
        let half = (half_m / params.resolution_m).clamp(0.0, N_CELLS_HALF_MAX) as i32;
        let chart = self.chart(guess.from, evidence);
        chart.reach(half);
        let peaks =
            peaks_in_window((&chart.field, &chart.pyramid), &points, &window, &closures.peaks());
        let likelihood = |pose: Pose, score: f64| {
            let away = Edge {
                from: 0,
                to: 1,
                from_to: guess.from_to,
                information: guess.covariance.try_inverse().unwrap_or_else(Matrix3::zeros),
                chi2_turn: f64::INFINITY,
            };
            score / closures.score_std - 0.5 * away.chi2(Pose::IDENTITY, pose)
        };
        let mut judged: Vec<(f64, Pose, f64)> = peaks
            .iter()
            .map(|peak| (likelihood(peak.pose, peak.score), peak.pose, peak.score))
            .collect();
        judged.sort_by(|a, b| b.0.total_cmp(&a.0));
        let &(best, pose, score) = judged.first()?;
        let lead = judged.get(1).map_or(f64::INFINITY, |&(next, _, _)| best - next);
        let contradicted = contradicted_share(chart, &points, pose);
        let near = guess.from.saturating_sub(1)..(guess.from + 2).min(self.submaps.len());
        let here = self.placed(near, self.submaps[guess.from].anchor, evidence);
        let stride = there.len().div_ceil(closures.n_scans_max).max(1);
        let some: Vec<Placed<'_>> = there.iter().copied().step_by(stride).collect();
        let wide = PairParams { gate_m: 0.2, turn_m: 0.1, ..params.pairs() };
        let SubmapFit { from_to, .. } = fit(&here, &some, pose, &wide);
        let fit = fit(&here, &some, from_to, &params.pairs());
        let away = pose.step_to(fit.from_to);
        let covariance = (fit.information + Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 1.0)))
            .try_inverse()?
            + closures.match_floor();
        let chart = self.chart(guess.from, evidence);
        let (n_agreeing, n_asked) = agreeing(chart, &there, fit.from_to);
        let few = n_asked < N_ASKED_MIN
            || (n_agreeing as f64) < closures.agreeing_share_min * n_asked as f64;
        let verdict = if lead < closures.log_odds_min {
            Verdict::Refused(Refusal::Ambiguous)
        } else if few
            || closures.apart_m < away.distance_m()
            || closures.apart_rad < away.theta_rad.abs()
        {
            Verdict::Refused(Refusal::FewScansAgree)
        } else if closures.contradicted_share_max < contradicted {
            Verdict::Refused(Refusal::Contradicted)
        } else {
            Verdict::Accepted
        };
        let alternatives =
            judged.iter().skip(1).filter(|other| best - other.0 < 2.0 * closures.log_odds_min);
        Some(Found {
            from_to: fit.from_to,
            covariance,
            score,
            alternatives: alternatives.map(|&(_, pose, score)| (pose, score)).collect(),
            verdict,
        })
    }

    /// Closures that wait for support and say the same as one that is new.
    fn supporters(
        &self,
        (from, to): (usize, usize),
        found: &Found,
        chi2_max: f64,
    ) -> Vec<(usize, usize)> {
        let (by_from, by_to) = (
            covariances_from(from, &self.poses, &self.links),
            covariances_from(to, &self.poses, &self.links),
        );
        let waits = |other: &Found| other.verdict == Verdict::Refused(Refusal::Unsupported);
        let supports = |(&(a, b), other): (&(usize, usize), &Found)| -> Option<(usize, usize)> {
            if !waits(other) || b == to {
                return None;
            }
            let (there, back) =
                (self.poses[from].step_to(self.poses[a]), self.poses[b].step_to(self.poses[to]));
            let by_back = inverted(back.inverse(), by_to[b].as_ref()?);
            let by_other =
                composed((there, by_from[a].as_ref()?), (other.from_to, &other.covariance));
            let covariance =
                composed((there * other.from_to, &by_other), (back, &by_back)) + found.covariance;
            let edge = Edge {
                from: 0,
                to: 1,
                from_to: there * other.from_to * back,
                information: covariance.try_inverse()?,
                chi2_turn: f64::INFINITY,
            };
            (edge.chi2(Pose::IDENTITY, found.from_to) <= chi2_max).then_some((a, b))
        };
        self.found.iter().filter_map(supports).collect()
    }

    /// Key scans of some submaps by the chain, seen from one of them.
    fn placed<'a>(
        &self,
        submaps: std::ops::Range<usize>,
        anchor: usize,
        evidence: Evidence<'a>,
    ) -> Vec<Placed<'a>> {
        let Evidence { keys, chain, .. } = evidence;
        let indices = submaps.flat_map(|submap| self.submaps[submap].keys.clone());
        indices
            .map(|index| (&keys[index], chain.poses[anchor].step_to(chain.poses[index])))
            .collect()
    }

    /// The chart of a submap and its neighbours.
    fn chart(&mut self, submap: usize, evidence: Evidence<'_>) -> &mut SubmapChart {
        let Evidence { travel, keys, chain, params, frame } = evidence;
        if let Some(place) = self.charts.iter().position(|(of, _)| *of == submap) {
            if let Some(chart) = self.charts.remove(place) {
                self.charts.push_back(chart);
            }
        } else {
            let near = submap.saturating_sub(1)..(submap + 2).min(self.submaps.len());
            let indices: Vec<usize> =
                near.flat_map(|near| self.submaps[near].keys.clone()).collect();
            let stride = indices.len().div_ceil(N_CHART_SCANS_MAX).max(1);
            let scans = indices
                .into_iter()
                .step_by(stride)
                .map(|index| (keys[index].scan, chain.poses[index]));
            let origin = chain.poses[self.submaps[submap].anchor];
            let drawing = (&params.mapping.beam_model, &params.mapping.field);
            let chart = SubmapChart::new(travel, scans, origin, frame, drawing);
            if self.charts.len() == N_CHARTS_MAX {
                self.charts.pop_front();
            }
            self.charts.push_back((submap, chart));
        }
        let last = self.charts.len() - 1;
        &mut self.charts[last].1
    }

    fn optimise(&mut self, evidence: Evidence<'_>) {
        let mut equations = NormalEquations::new(self.poses.len(), &self.edges);
        optimise(&mut self.poses, &self.edges, &mut equations, &evidence.params.graph);
    }

    /// Refuses what the other closures contradict, the worst first.
    fn settle(&mut self, evidence: Evidence<'_>) {
        self.charts.clear();
        let chi2_max = evidence.params.closures.inconsistent_chi2_min;
        loop {
            let chi2 = |edge: &Edge| edge.chi2(self.poses[edge.from], self.poses[edge.to]);
            let closures =
                self.edges.iter().enumerate().filter(|(_, edge)| edge.chi2_turn.is_finite());
            let worst = closures
                .map(|(index, edge)| (chi2(edge), index))
                .max_by(|a, b| a.0.total_cmp(&b.0));
            let Some((chi2, index)) = worst.filter(|(chi2, _)| chi2_max < *chi2) else { return };
            let _ = chi2;
            let edge = self.edges.remove(index);
            if let Some(found) = self.found.get_mut(&(edge.from, edge.to)) {
                found.verdict = Verdict::Refused(Refusal::Inconsistent);
            }
            self.optimise(evidence);
        }
    }

    /// The edges of accepted closures between the key scans that are the submaps' anchors.
    pub(crate) fn anchor_edges(&self) -> impl Iterator<Item = Edge> {
        let closures = self.edges.iter().filter(|edge| edge.chi2_turn.is_finite());
        let anchor = |submap: usize| self.submaps[submap].anchor;
        closures.map(move |edge| Edge { from: anchor(edge.from), to: anchor(edge.to), ..*edge })
    }

    /// Which submap each key scan belongs to.
    pub(crate) fn submap_of(&self) -> Vec<usize> {
        let keys = self.submaps.iter().enumerate();
        keys.flat_map(|(index, submap)| submap.keys.clone().map(move |_| index)).collect()
    }

    /// The submaps that accepted closures join, and their neighbours along the way; but none that was
    /// refused.
    pub(crate) fn joined(&self) -> BTreeSet<(usize, usize)> {
        let mut joined = BTreeSet::new();
        for edge in self.edges.iter().filter(|edge| edge.chi2_turn.is_finite()) {
            for from in edge.from.saturating_sub(1)..=edge.from + 1 {
                joined.extend((edge.to.saturating_sub(1)..=edge.to + 1).map(|to| (from, to)));
            }
        }
        let off = |pair: &(usize, usize)| {
            let verdict = self.found.get(pair).map(|found| found.verdict);
            verdict == Some(Verdict::Refused(Refusal::SwitchedOff))
        };
        joined.retain(|pair| !off(pair));
        joined
    }

    /// Poses of the key scans: those of the chain, bent so that the anchors are where they were found.
    pub(crate) fn key_poses(&self, chain: &Chain) -> Vec<Pose> {
        let at = |submap: usize, key: usize| {
            let anchor = self.submaps[submap].anchor;
            self.poses[submap] * chain.poses[anchor].step_to(chain.poses[key])
        };
        let n = self.submaps.len();
        let pose = |key: usize| {
            let after = self.submaps.partition_point(|submap| submap.anchor <= key);
            let (before, after) = (after.saturating_sub(1), after.min(n - 1));
            let (first, last) = (self.submaps[before].anchor, self.submaps[after].anchor);
            if before == after || key <= first {
                return at(before, key);
            }
            let share = (key - first) as f64 / (last - first) as f64;
            at(before, key).interpolate(at(after, key), share)
        };
        (0..chain.poses.len()).map(pose).collect()
    }

    /// Closures accepted and refused so far.
    pub(crate) fn counts(&self) -> (usize, usize) {
        let n = self.found.values().filter(|found| found.verdict == Verdict::Accepted).count();
        (n, self.found.len() - n)
    }

    /// The ledger, with residuals by the poses of key scans.
    pub(crate) fn ledger(&self, evidence: Evidence<'_>, key_poses: &[Pose]) -> Vec<Closure> {
        let closure = |(&pair, found): (&(usize, usize), &Found)| {
            let pose = |submap: usize| key_poses[self.submaps[submap].anchor];
            let edge = Edge {
                from: 0,
                to: 1,
                from_to: found.from_to,
                information: found.covariance.try_inverse().unwrap_or_else(Matrix3::zeros),
                chi2_turn: f64::INFINITY,
            };
            let error = edge.error(pose(pair.0), pose(pair.1));
            Closure {
                key: self.key(pair, evidence),
                from_to: found.from_to,
                covariance: std::array::from_fn(|row| {
                    std::array::from_fn(|column| found.covariance[(row, column)])
                }),
                score: found.score,
                alternatives: found.alternatives.clone(),
                residual_m: error.x.hypot(error.y),
                residual_rad: error.z.abs(),
                chi2: edge.chi2(pose(pair.0), pose(pair.1)),
                verdict: found.verdict,
            }
        };
        let mut closures: Vec<Closure> = self.found.iter().map(closure).collect();
        closures.sort_by_key(|closure| closure.key);
        closures
    }
}

/// A guess is another if it or its deviation changed by this share of the deviation.
const SAME_SHARE: f64 = 0.3;
/// Charts are searched no farther than this from their origin, in cells.
const N_CELLS_HALF_MAX: f64 = 1000.0;
/// Scans that a chart is drawn from, at most: walls that as many saw are certain.
const N_CHART_SCANS_MAX: usize = 30;
/// Charts that are kept: some megabytes each.
const N_CHARTS_MAX: usize = 12;

/// Covariance of one key scan seen from another before it, along the chain.
fn along(chain: &Chain, (from, to): (usize, usize)) -> Matrix3<f64> {
    (from + 1..=to).fold(Matrix3::zeros(), |sum, next| {
        let there = chain.poses[from].step_to(chain.poses[next - 1]);
        let step = chain.poses[next - 1].step_to(chain.poses[next]);
        composed((there, &sum), (step, &chain.covariances[next]))
    })
}

/// Deviation along the axis in which a position is least sure, in metres.
fn position_std_m(covariance: &Matrix3<f64>) -> f64 {
    let (xx, xy, yy) = (covariance[(0, 0)], covariance[(0, 1)], covariance[(1, 1)]);
    (0.5 * (xx + yy) + (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt()).max(0.0).sqrt()
}

/// Scans of which enough lies on mapped space, how many of them agree with the walls there, the latter
/// first.
fn agreeing(chart: &SubmapChart, scans: &[Placed<'_>], pose: Pose) -> (usize, usize) {
    let (mut n_agreeing, mut n_asked) = (0, 0);
    for (key, seen) in scans {
        let place = pose * *seen;
        let (mut n_known, mut n_met) = (0_usize, 0_usize);
        for facet in key.surface.facets() {
            let at = place * facet.at.map(f64::from);
            let (value, _, _) = chart.field.interpolate(at);
            let known = WALL_VALUE_MIN <= value
                || chart.grid.log_odds(chart.grid.frame().cell_at(at)).is_some();
            n_known += usize::from(known);
            n_met += usize::from(WALL_VALUE_MIN <= value);
        }
        if N_KNOWN_MIN <= n_known && key.surface.facets().len() <= 3 * n_known {
            n_asked += 1;
            n_agreeing += usize::from(2 * n_known < 3 * n_met);
        }
    }
    (n_agreeing, n_asked)
}

/// A scan with fewer facets on mapped space is not asked.
const N_KNOWN_MIN: usize = 20;
/// Fewer scans than this confirm nothing.
const N_ASKED_MIN: usize = 3;

/// Share of the points on mapped space that lie where others saw through.
fn contradicted_share(chart: &SubmapChart, points: &[Point2<f64>], pose: Pose) -> f64 {
    let (mut n_known, mut n_free) = (0_u32, 0_u32);
    for &point in points {
        let place = pose * point;
        let (value, _, _) = chart.field.interpolate(place);
        let Some(log_odds) = chart.grid.log_odds(chart.grid.frame().cell_at(place)) else {
            continue;
        };
        n_known += 1;
        n_free += u32::from(log_odds < FREE_LOG_ODDS_MAX && value < WALL_VALUE_MIN);
    }
    f64::from(n_free) / f64::from(n_known.max(1))
}

/// A cell that three beams crossed is free.
const FREE_LOG_ODDS_MAX: f32 = -1.0;
/// A place where the field reaches this lies at a wall.
const WALL_VALUE_MIN: f64 = 0.1;
