//! The search for closures: submap by submap along the way, and again until nothing new is found.
//!
//! For each submap those are candidates that the graph has near it, give or take how uncertain it says
//! that is. What is ambiguous ([`overlaid`]) stays in the ledger with its alternatives, and is judged
//! again when other closures have made the graph surer: the alternatives of a whole way are decided by
//! what all of it says, not each by its score. A closure across great uncertainty is not believed alone:
//! another, of another submap, must say the same. What stays open along a line only, as in a bare
//! corridor, is believed in the end for what it says across that line. What a submap saw of named
//! landmarks is told to the graph before: then closures are looked for where these have it.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use meetpoint_geometry::Pose;
use nalgebra::{Matrix3, Vector3};

use crate::closures::closure::{Closure, ClosureKey, Refusal, Verdict};
use crate::closures::evidence::Evidence;
use crate::closures::joined::Joined;
use crate::closures::known_closures::{known, submaps_of};
use crate::closures::ledger::{ledger, residual};
use crate::closures::overlay::{Found, Guess, overlaid, position_std_m};
use crate::closures::submap_charts::SubmapCharts;
use crate::closures::submap_graph::{GivenUp, SubmapGraph, SubmapPair};
use crate::graph::pose_graph::Edge;
use crate::graph::uncertainty::{composed, inverted};
use crate::landmarks::landmark_search::LandmarkSearch;
use crate::relaxation_params::ClosureParams;
use crate::side_by_side::side_by_side;

/// A search under way.
#[derive(Debug)]
pub(crate) struct ClosureSearch {
    pub(crate) graph: SubmapGraph,
    landmarks: LandmarkSearch,
    /// Whether the graph knows of landmarks that its poses do not yet heed.
    is_stale: bool,
    found: BTreeMap<SubmapPair, Found>,
    /// Those among them that an earlier relaxation judged, as it did.
    known: BTreeMap<SubmapPair, Closure>,
    refused: BTreeSet<SubmapPair>,
    /// What was guessed when a pair was last matched, and its deviation.
    tried: BTreeMap<SubmapPair, (Pose, f64)>,
    charts: SubmapCharts,
    /// Where the submap before the next one may lie, as far as it was not laid there.
    guesses: VecDeque<Guess>,
    /// Closures of that submap that were accepted.
    n_accepted: usize,
    next: usize,
    n_passes: u32,
    n_accepted_in_pass: usize,
}

/// Candidates that a thread looks at in a slice: up to some 10 milliseconds each.
const N_A_THREAD: usize = 3;
/// A guess is another if it or its deviation changed by this share of the deviation.
const SAME_SHARE: f64 = 0.3;
/// Two closures of which it is less sure than this how they relate say nothing of one another, in metres.
const SAID_STD_M: f64 = 1.0;

impl ClosureSearch {
    /// Cuts the chains into submaps. `refused` are never accepted; what an earlier relaxation judged is
    /// not looked for again between submaps that are known.
    pub(crate) fn new(
        evidence: Evidence<'_>,
        refused: &[ClosureKey],
        known_closures: &[Closure],
    ) -> Self {
        let graph = SubmapGraph::new(evidence);
        let pairs = refused.iter().filter_map(|key| submaps_of(key, &graph.submaps, evidence));
        let refused = pairs.map(|(from, to)| (from.min(to), from.max(to))).collect();
        let mut search = Self {
            landmarks: LandmarkSearch::new(&graph.submaps, evidence),
            is_stale: false,
            graph,
            found: BTreeMap::new(),
            known: BTreeMap::new(),
            refused,
            tried: BTreeMap::new(),
            charts: SubmapCharts::default(),
            guesses: VecDeque::new(),
            n_accepted: 0,
            next: 0,
            n_passes: 0,
            n_accepted_in_pass: 0,
        };
        for closure in known_closures {
            search.take_known(closure, evidence);
        }
        search
    }

    /// Believes a closure as an earlier relaxation did, unless it was switched off since.
    fn take_known(&mut self, closure: &Closure, evidence: Evidence<'_>) {
        let Some((pair, mut found)) = known(closure, &self.graph.submaps, evidence) else { return };
        if self.found.contains_key(&pair) {
            return;
        }
        let off = Verdict::Refused(Refusal::SwitchedOff);
        if self.refused.contains(&pair) {
            found.verdict = off;
        } else if found.verdict == off {
            found.verdict = Verdict::Refused(Refusal::Unsupported);
        }
        let is_accepted = found.verdict == Verdict::Accepted;
        self.found.insert(pair, found);
        self.known.insert(pair, closure.clone());
        if is_accepted {
            self.accept(pair, evidence.params.closures.chi2_turn);
            self.n_accepted += 1;
        }
    }

    /// Looks at the next candidates. False when the search is over.
    pub(crate) fn advance(&mut self, evidence: Evidence<'_>) -> bool {
        if !self.guesses.is_empty() {
            let n = N_A_THREAD * evidence.params.n_threads.get();
            let some = self.guesses.drain(..n.min(self.guesses.len())).collect();
            self.consider(some, evidence);
            return true;
        }
        if 0 < self.n_accepted {
            self.n_accepted_in_pass += self.n_accepted;
            self.n_accepted = 0;
            self.optimise(evidence);
        }
        while self.next < self.graph.submaps.len() && self.is_known(self.next, evidence) {
            self.next += 1;
            if self.sees_landmarks(self.next - 1, evidence) {
                return true;
            }
        }
        if self.next == self.graph.submaps.len() {
            self.n_passes += 1;
            if self.is_stale {
                self.optimise(evidence);
            }
            let n_passes_max = evidence.params.closures.n_passes_max;
            if self.n_accepted_in_pass == 0 || n_passes_max <= self.n_passes {
                self.settle(evidence);
                return false;
            }
            (self.next, self.n_accepted_in_pass) = (0, 0);
        }
        self.sees_landmarks(self.next, evidence);
        self.guesses = self.guesses_of(self.next, evidence).into();
        self.next += 1;
        true
    }

    fn optimise(&mut self, evidence: Evidence<'_>) {
        self.graph.optimise(&evidence.params.graph);
        self.is_stale = false;
    }

    /// Tells the graph what a submap saw of landmarks. False if there was nothing to look at.
    fn sees_landmarks(&mut self, submap: usize, evidence: Evidence<'_>) -> bool {
        let judged = self.landmarks.judge(submap, &mut self.graph);
        self.is_stale |= 0 < judged.n_joined;
        if judged.is_news {
            self.n_accepted_in_pass += 1;
            self.optimise(evidence);
        }
        0 < judged.n_asked
    }

    /// Of each travel, the sightings of landmarks that the graph rests on, and those that were seen again
    /// but not where they were.
    pub(crate) fn n_sightings(&self, n_travels: usize) -> Vec<(usize, usize)> {
        self.landmarks.counts(&self.graph, n_travels)
    }

    /// True if an earlier relaxation has placed all of a submap.
    fn is_known(&self, submap: usize, evidence: Evidence<'_>) -> bool {
        self.graph.submaps[submap].keys.clone().all(|key| evidence.keys[key].is_known)
    }

    /// Share of the search that is done, as far as one knows.
    pub(crate) fn share(&self, params: &ClosureParams) -> f64 {
        let pass = self.next as f64 / self.graph.submaps.len().max(1) as f64;
        ((f64::from(self.n_passes) + pass) / f64::from(params.n_passes_max.max(1))).min(1.0)
    }

    /// Closures accepted and refused so far.
    pub(crate) fn counts(&self) -> (usize, usize) {
        let n = self.found.values().filter(|found| found.verdict == Verdict::Accepted).count();
        (n, self.found.len() - n)
    }

    /// The submaps that one may lie near, of each pass the nearest.
    fn guesses_of(&self, to: usize, evidence: Evidence<'_>) -> Vec<Guess> {
        let params = &evidence.params.closures;
        let submaps = &self.graph.submaps;
        let anchor = |submap: usize| &evidence.keys[submaps[submap].anchor];
        let covariances = self.graph.covariances_from(to);
        let guess = |other: usize| {
            let to_other = self.graph.poses[to].step_to(self.graph.poses[other]);
            let covariance = covariances[other]?;
            let guess = if other < to {
                let covariance = inverted(to_other, &covariance) + floor(params);
                Guess { from: other, to, from_to: to_other.inverse(), covariance }
            } else {
                let covariance = covariance + floor(params);
                Guess { from: to, to: other, from_to: to_other, covariance }
            };
            let open_m = (params.n_std * guess.position_std_m()).min(params.half_max_m);
            let near = to_other.distance_m() <= params.reach_m + open_m;
            let way_m = anchor(guess.to).way_since_m(anchor(guess.from));
            (near && params.way_min_m <= way_m).then_some(guess)
        };
        // Later ones look back on this one themselves, unless they are known.
        let is_asked = |other: usize| other < to || (to < other && self.is_known(other, evidence));
        let all: Vec<Option<Guess>> =
            (0..submaps.len()).map(|other| guess(other).filter(|_| is_asked(other))).collect();
        let distance_m = |of: usize, other: Option<usize>| {
            let is_own = |other: &usize| {
                submaps.get(*other).is_some_and(|other| other.travel == submaps[of].travel)
            };
            let guess = other.filter(is_own).and_then(|other| all[other]);
            guess.map_or(f64::INFINITY, |guess| guess.from_to.distance_m())
        };
        let is_nearest = |guess: &Guess| {
            let (here_m, of) = (guess.from_to.distance_m(), guess.from + guess.to - to);
            here_m < distance_m(of, of.checked_sub(1)) && here_m <= distance_m(of, Some(of + 1))
        };
        let mut nearest: Vec<Guess> = all.iter().copied().flatten().filter(is_nearest).collect();
        nearest.sort_by(|a, b| a.from_to.distance_m().total_cmp(&b.from_to.distance_m()));
        nearest.truncate(params.n_candidates_max);
        nearest
    }

    /// Matches a submap with some that it may lie near.
    fn consider(&mut self, guesses: Vec<Guess>, evidence: Evidence<'_>) {
        let mut open = Vec::new();
        for guess in guesses {
            if !self.is_accepted((guess.from, guess.to)) && !self.was_tried(&guess) {
                open.push((guess, self.charts.take(guess.from)));
            }
        }
        let submaps = &self.graph.submaps;
        let matched = side_by_side(open, evidence.params.n_threads, |(guess, mut chart)| {
            let found = overlaid(&guess, submaps, &mut chart, evidence);
            (guess, chart, found)
        });
        for (guess, chart, found) in matched {
            if let Some(chart) = chart {
                self.charts.keep(guess.from, chart);
            }
            if let Some(found) = found
                && !self.is_accepted((guess.from, guess.to))
            {
                self.n_accepted += usize::from(self.judge(&guess, found, evidence));
            }
        }
    }

    fn is_accepted(&self, pair: SubmapPair) -> bool {
        self.found.get(&pair).is_some_and(|found| found.verdict == Verdict::Accepted)
    }

    /// Notes what was found, and believes it if there is nothing against it. True if a closure was
    /// accepted.
    fn judge(&mut self, guess: &Guess, mut found: Found, evidence: Evidence<'_>) -> bool {
        let params = &evidence.params.closures;
        let pair = (guess.from, guess.to);
        let mut accepted = Vec::new();
        if found.verdict == Verdict::Accepted {
            let is_sure = guess.position_std_m() <= params.alone_std_m;
            let support = self.supporters(pair, &found, params.support_chi2_max);
            if self.refused.contains(&pair) {
                found.verdict = Verdict::Refused(Refusal::SwitchedOff);
            } else if is_sure || !support.is_empty() {
                accepted = support;
                accepted.push(pair);
            } else {
                found.verdict = Verdict::Refused(Refusal::Unsupported);
            }
        }
        self.known.remove(&pair);
        self.found.insert(pair, found);
        for pair in &accepted {
            self.accept(*pair, params.chi2_turn);
        }
        !accepted.is_empty()
    }

    /// True if a pair was matched before and as much was known; notes what is known now.
    fn was_tried(&mut self, guess: &Guess) -> bool {
        let (pair, std_m) = ((guess.from, guess.to), guess.position_std_m());
        let same = self.tried.get(&pair).is_some_and(|&(before, std_before_m)| {
            before.step_to(guess.from_to).distance_m() < SAME_SHARE * std_m
                && std_before_m * (1.0 - SAME_SHARE) < std_m
        });
        if !same {
            self.tried.insert(pair, (guess.from_to, std_m));
        }
        same
    }

    fn accept(&mut self, pair: SubmapPair, chi2_turn: f64) {
        if let Some(found) = self.found.get_mut(&pair) {
            found.verdict = Verdict::Accepted;
            self.graph.add_closure(pair, (found.from_to, &found.covariance), chi2_turn);
        }
    }

    /// Closures that wait for support and say the same as one that is new.
    fn supporters(&self, pair: SubmapPair, found: &Found, chi2_max: f64) -> Vec<SubmapPair> {
        let waits = |other: &Found| other.verdict == Verdict::Refused(Refusal::Unsupported);
        let waiting = || self.found.iter().filter(|(_, other)| waits(other));
        if waiting().next().is_none() {
            return Vec::new();
        }
        let (from, to) = pair;
        let by_from = self.graph.covariances_from(from);
        let by_to = self.graph.covariances_from(to);
        let poses = &self.graph.poses;
        // The new closure as the other has it: from, to the other's ends and back, to.
        let chi2 = |(a, b): SubmapPair, other: &Found| -> Option<f64> {
            let (there, back) = (poses[from].step_to(poses[a]), poses[b].step_to(poses[to]));
            let by_back = inverted(back.inverse(), by_to[b].as_ref()?);
            let by_there = by_from[a].as_ref()?;
            let by_other = composed((there, by_there), (other.from_to, &other.covariance));
            let covariance = composed((there * other.from_to, &by_other), (back, &by_back));
            let both = covariance + found.covariance;
            let edge = Edge {
                from,
                to,
                from_to: there * other.from_to * back,
                information: both.try_inverse().filter(|_| position_std_m(&both) <= SAID_STD_M)?,
                chi2_turn: f64::INFINITY,
            };
            Some(edge.chi2(Pose::IDENTITY, found.from_to))
        };
        waiting()
            .filter(|(other, _)| other.1 != to)
            .filter(|(other, said)| chi2(**other, said).is_some_and(|chi2| chi2 <= chi2_max))
            .map(|(other, _)| *other)
            .collect()
    }

    /// Believes of what is open along a line how it lies across, if the graph, which by now knows all
    /// else, says the same.
    fn accept_across(&mut self, evidence: Evidence<'_>) {
        let params = &evidence.params.closures;
        let mut accepted = Vec::new();
        for (&(from, to), found) in &self.found {
            let Some(covariance) = found.across() else { continue };
            let by_graph = self.graph.covariances_from(from)[to];
            let Some(by_graph) = by_graph.filter(|_| !self.refused.contains(&(from, to))) else {
                continue;
            };
            let said = (found.from_to, &(covariance + by_graph + floor(params)));
            let poses = (self.graph.poses[from], self.graph.poses[to]);
            if residual(said, (from, to), poses).1 <= params.support_chi2_max {
                accepted.push(((from, to), covariance));
            }
        }
        for (pair, covariance) in &accepted {
            if let Some(found) = self.found.get_mut(pair) {
                found.covariance = *covariance;
            }
            self.accept(*pair, params.chi2_turn);
        }
        if !accepted.is_empty() {
            self.optimise(evidence);
        }
    }

    /// Refuses what the others contradict, of closures and landmarks, the worst first.
    fn settle(&mut self, evidence: Evidence<'_>) {
        self.charts = SubmapCharts::default();
        self.accept_across(evidence);
        let chi2_max = evidence.params.closures.inconsistent_chi2_min;
        while let Some(wrong) = self.graph.remove_worst(chi2_max) {
            if let GivenUp::Closure(pair) = wrong
                && let Some(found) = self.found.get_mut(&pair)
            {
                found.verdict = Verdict::Refused(Refusal::Inconsistent);
            }
            self.graph.optimise(&evidence.params.graph);
        }
    }

    /// The submaps whose scans may be matched with one another: those that whole closures or landmarks
    /// join, and their neighbours, but none that an operator took apart. Scans that are joined along an
    /// open line would be held wherever they happen to lie along it.
    pub(crate) fn joined(&self) -> Joined {
        let off = Verdict::Refused(Refusal::SwitchedOff);
        let is_off = |(pair, found): (&SubmapPair, &Found)| (found.verdict == off).then_some(*pair);
        let is_whole = |pair: SubmapPair| self.found.get(&pair).is_some_and(Found::is_whole);
        self.graph.joined(is_whole, self.found.iter().filter_map(is_off).collect())
    }

    /// The ledger, with residuals by the poses of key scans. What these contradict is refused.
    pub(crate) fn ledger(&self, evidence: Evidence<'_>, key_poses: &[Pose]) -> Vec<Closure> {
        ledger((&self.found, &self.known), &self.graph.submaps, evidence, key_poses)
    }
}

/// What is added to the covariance that the graph bounds.
fn floor(params: &ClosureParams) -> Matrix3<f64> {
    let std = Vector3::new(params.graph_std_m, params.graph_std_m, params.graph_std_rad);
    Matrix3::from_diagonal(&std.map(|std| std * std))
}
