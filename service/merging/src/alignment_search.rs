//! The search for where the newcomer lies in the site, a slice at a time.
//!
//! Pieces of the newcomer are searched for all over the site, at any heading, by branch and bound; each
//! place where one fits says where the whole newcomer may lie. These places are refined by all walls,
//! those that come to the same are joined, and each is judged by what the walls of both maps say of it,
//! and against the others. Landmarks with names that both maps have say where it may lie too, and which
//! place it is. Time O(pieces * headings * area of the site), and O(places * walls).

use std::f64::consts::{FRAC_PI_2, PI};
use std::num::NonZero;
use std::sync::Arc;

use meetpoint_geometry::{Point2, Pose};
use meetpoint_tracking::{Candidate, side_by_side};

use crate::alignment::{Alignment, Alignments, SearchFigures, Verdict};
use crate::alignment_params::AlignmentParams;
use crate::evidence::{Evidence, middle};
use crate::merge_rules::MergeRules;
use crate::named_landmarks::places_by_names;
use crate::overlap::overlap;
use crate::part::Part;
use crate::patches::{Patch, patches};
use crate::reason::Reason;
use crate::refinement::{Refined, refined};
use crate::rivals::{margin, named_margin, nameless_margin};
use crate::slides::least_margin;
use crate::verdict::{Rival, Standing, judged};

/// A search under way. The same parts give the same bits, on any number of threads.
#[derive(Debug)]
pub struct AlignmentSearch {
    site: Arc<Part>,
    newcomer: Arc<Part>,
    params: AlignmentParams,
    rules: MergeRules,
    patches: Vec<Patch>,
    /// Where the newcomer lies if a patch lies where it fits.
    peaks: Vec<Pose>,
    places: Vec<Place>,
    figures: SearchFigures,
    work: Work,
}

/// What is being done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Work {
    /// The patch that is searched for next, and the last of this round.
    Patches(usize, usize),
    /// The peak that is refined next.
    Peaks(usize),
    /// The place that is judged next.
    Places(usize),
    Done,
}

/// A place of the whole newcomer.
#[derive(Clone, Debug)]
struct Place {
    refined: Refined,
    evidence: Evidence,
    /// Of the newcomer's walls in the overlap, in its frame.
    middle: Point2<f64>,
    log_odds: f64,
}

/// How far a search is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlignmentProgress {
    /// Share of the work that is done, in 0..=1, as far as one knows.
    pub share: f64,
}

/// Of how many quarter turns walls that run alike leave open.
const N_QUARTERS: u32 = 4;
/// Share of the walls that must run along two directions for these to say anything.
const DIRECTED_SHARE_MIN: f64 = 0.4;
/// Patches, those that are held best, that are searched for at all headings whatever walls say.
const N_ANYHOW: usize = 2;
/// The same if nothing was found at the headings that walls say.
const N_AGAIN: usize = 8;
/// Patches that a thread takes in a slice: some 10 milliseconds each.
const N_PATCHES_A_THREAD: usize = 1;
/// Peaks that a thread refines in a slice: a millisecond each.
const N_PEAKS_A_THREAD: usize = 16;
/// Places that a thread judges in a slice: some milliseconds each.
const N_PLACES_A_THREAD: usize = 4;
/// Walls that a peak is refined by, at most, before it is known whether it is worth more.
const N_WALLS_QUICK: usize = 500;
/// The same for a place.
const N_WALLS_FULL: usize = 4000;

impl AlignmentSearch {
    /// Begins a search for the newcomer in the site.
    pub fn new(
        site: Arc<Part>,
        newcomer: Arc<Part>,
        params: AlignmentParams,
        rules: MergeRules,
    ) -> Self {
        let is_enough = few_walls(&site, &newcomer, rules.walls_min_m).is_none();
        let patches = if is_enough { patches(&newcomer, &params) } else { Vec::new() };
        let peaks = if is_enough { places_by_names(&site, &newcomer) } else { Vec::new() };
        let n_patches = patches.len();
        let by_wall_directions = is_directed(&site) && is_directed(&newcomer);
        Self {
            site,
            newcomer,
            params,
            rules,
            patches,
            peaks,
            places: Vec::new(),
            figures: SearchFigures { n_patches, by_wall_directions, ..SearchFigures::default() },
            work: Work::Patches(0, n_patches),
        }
    }

    /// Lets the slices that follow be shared among so many threads. What they find does not depend on it.
    pub fn use_threads(&mut self, n_threads: NonZero<usize>) {
        self.params.n_threads = n_threads;
    }

    /// Does a slice of the work, some tens of milliseconds, and says how far it is; `None` when all is
    /// done.
    pub fn advance(&mut self) -> Option<AlignmentProgress> {
        self.work = match self.work {
            Work::Patches(next, end) => self.search_some(next, end),
            Work::Peaks(next) => self.refine_some(next),
            Work::Places(next) => self.judge_some(next),
            Work::Done => Work::Done,
        };
        let of = |next: usize, all: usize| next as f64 / all.max(1) as f64;
        let share = match self.work {
            Work::Patches(next, end) => 0.6 * of(next, end),
            Work::Peaks(next) => 0.6 + 0.2 * of(next, self.peaks.len()),
            Work::Places(next) => 0.8 + 0.2 * of(next, self.places.len()),
            Work::Done => return None,
        };
        // Of the first of two searches, the second of which is rarely needed.
        let is_first = self.figures.by_wall_directions;
        Some(AlignmentProgress { share: if is_first { 0.5 * share } else { 0.5 + 0.5 * share } })
    }

    /// Searches for the next patches, up to the last.
    fn search_some(&mut self, next: usize, last: usize) -> Work {
        let n_threads = self.params.n_threads;
        let end = (next + N_PATCHES_A_THREAD * n_threads.get()).min(last);
        let found = side_by_side(next..end, n_threads, |patch| self.peaks_of(patch));
        self.peaks.extend(found.into_iter().flatten());
        if end < last {
            return Work::Patches(end, last);
        }
        self.figures.n_peaks += self.peaks.len();
        Work::Peaks(0)
    }

    /// Where the newcomer lies by the places of a patch.
    fn peaks_of(&self, index: usize) -> Vec<Pose> {
        let patch = &self.patches[index];
        let AlignmentParams { step_rad, mut peaks, .. } = self.params;
        let mut found: Vec<Candidate> = Vec::new();
        for (heading_rad, half_rad) in self.headings(index) {
            let window = (heading_rad, half_rad, step_rad);
            found.extend(self.site.search.peaks(&patch.points, window, &peaks));
            let best = found.iter().map(|peak| peak.score).fold(0.0, f64::max);
            peaks.score_min = peaks.score_min.max(peaks.rival_share * best);
        }
        found.sort_by(|a, b| b.score.total_cmp(&a.score));
        found.truncate(peaks.n_max);
        let good = found.iter().take_while(|peak| peaks.score_min < peak.score);
        good.map(|peak| peak.pose * patch.map_from_patch.inverse()).collect()
    }

    /// The middles and half widths of the headings at which a patch is searched for. The patches that
    /// are held best are searched for at all of them, in case that walls run otherwise in the overlap.
    fn headings(&self, patch: usize) -> Vec<(f64, f64)> {
        if !self.figures.by_wall_directions || patch < N_ANYHOW {
            return vec![(0.0, PI)];
        }
        let turn_rad = self.site.direction.0 - self.newcomer.direction.0;
        let quarter = |n: u32| turn_rad + f64::from(n) * FRAC_PI_2;
        (0..N_QUARTERS).map(|n| (quarter(n), self.params.half_rad)).collect()
    }

    /// Refines the next peaks a little, each about its own patch's end of the newcomer.
    fn refine_some(&mut self, next: usize) -> Work {
        let n_threads = self.params.n_threads;
        let end = (next + N_PEAKS_A_THREAD * n_threads.get()).min(self.peaks.len());
        let some = &self.peaks[next..end];
        let found = side_by_side(some, n_threads, |&peak| self.place(peak, N_WALLS_QUICK));
        self.places.extend(found);
        if end < self.peaks.len() {
            return Work::Peaks(end);
        }
        self.places = self.apart(self.params.n_places_max);
        self.figures.n_places = self.places.len();
        Work::Places(0)
    }

    /// Judges the next places in full.
    fn judge_some(&mut self, next: usize) -> Work {
        let n_threads = self.params.n_threads;
        let end = (next + N_PLACES_A_THREAD * n_threads.get()).min(self.places.len());
        let some = &self.places[next..end];
        let found = side_by_side(some, n_threads, |place| {
            self.place(place.refined.site_from_newcomer, N_WALLS_FULL)
        });
        self.places.splice(next..end, found);
        if end < self.places.len() {
            return Work::Places(end);
        }
        self.places = self.apart(self.params.n_places_max);
        let best = self.places.first().map_or(f64::NEG_INFINITY, |best| best.log_odds);
        if self.figures.by_wall_directions && best < self.rules.log_odds_proposed_min {
            // Walls may have led astray: once more, at all headings.
            self.figures.by_wall_directions = false;
            self.peaks.clear();
            let n_patches = self.patches.len();
            return Work::Patches(N_ANYHOW.min(n_patches), N_AGAIN.min(n_patches));
        }
        Work::Done
    }

    /// A pose refined and judged.
    fn place(&self, pose: Pose, n_walls_max: usize) -> Place {
        let parts = (&*self.site, &*self.newcomer);
        let before = Evidence::new(parts, pose, n_walls_max);
        let about = middle(parts.1, &before.newcomer);
        let refined = refined(parts, pose, about, n_walls_max);
        let evidence = Evidence::new(parts, refined.site_from_newcomer, n_walls_max);
        let log_odds = evidence.log_odds();
        Place { refined, middle: middle(parts.1, &evidence.newcomer), log_odds, evidence }
    }

    /// The likeliest of the places, and those that lie apart from it, and so on.
    fn apart(&self, n_max: usize) -> Vec<Place> {
        let mut order: Vec<&Place> = self.places.iter().collect();
        order.sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds));
        let mut kept: Vec<&Place> = Vec::new();
        for place in order {
            if kept.len() == n_max {
                break;
            }
            let is_other = |other: &&Place| {
                let (apart_m, apart_rad) = apart(other, place);
                self.params.apart_m <= apart_m || self.params.apart_rad <= apart_rad
            };
            if kept.iter().all(is_other) {
                kept.push(place);
            }
        }
        kept.into_iter().cloned().collect()
    }

    /// What was found. Work that is left is done first.
    pub fn into_alignments(mut self) -> Alignments {
        while self.advance().is_some() {}
        if let Some(reason) = few_walls(&self.site, &self.newcomer, self.rules.walls_min_m) {
            return self.empty(Verdict::NotEnoughSeen, reason);
        }
        let Some(best) = self.places.first() else {
            let log_odds_min = self.rules.log_odds_proposed_min;
            let reason = Reason::NothingFits { log_odds: None, log_odds_min };
            return self.nowhere(vec![reason], Vec::new());
        };
        let told = &self.places[..self.places.len().min(self.params.n_told_max)];
        let ranked: Vec<Alignment> = told.iter().map(|place| self.alignment(place)).collect();
        let standing = Standing {
            best: &ranked[0],
            rivals: &self.rivals(best),
            slide: least_margin(
                (&self.site, &self.newcomer),
                &best.refined,
                (best.middle, &best.evidence),
                N_WALLS_FULL,
            ),
            std_m: best.refined.weakest().0,
            named_log_odds: best.evidence.named.log_odds,
        };
        let (verdict, reasons) = judged(&standing, &self.rules);
        if verdict == Verdict::NoOverlap {
            return self.nowhere(reasons, ranked);
        }
        Alignments { verdict, reasons, ranked, figures: self.figures }
    }

    /// The newcomer fits nowhere: there is no overlap, if both have seen enough to say so.
    fn nowhere(&self, mut reasons: Vec<Reason>, ranked: Vec<Alignment>) -> Alignments {
        let few = few_walls(&self.site, &self.newcomer, self.rules.walls_no_overlap_min_m);
        let verdict = if few.is_some() { Verdict::NotEnoughSeen } else { Verdict::NoOverlap };
        reasons.splice(0..0, few);
        Alignments { verdict, reasons, ranked, figures: self.figures }
    }

    fn empty(self, verdict: Verdict, reason: Reason) -> Alignments {
        let figures = self.figures;
        Alignments { verdict, reasons: vec![reason], ranked: Vec::new(), figures }
    }

    /// The place that a place has the least margin over.
    fn strongest_rival(&self, place: &Place) -> Option<&Place> {
        let others = self.places.iter().filter(|other| !std::ptr::eq(*other, place));
        others.min_by(|a, b| {
            margin(&place.evidence, &a.evidence).total_cmp(&margin(&place.evidence, &b.evidence))
        })
    }

    /// All other places.
    fn rivals(&self, place: &Place) -> Vec<Rival> {
        let others = self.places.iter().filter(|other| !std::ptr::eq(*other, place));
        let rival = |other: &Place| Rival {
            apart: apart(place, other),
            margin: margin(&place.evidence, &other.evidence),
            named: named_margin(&place.evidence, &other.evidence),
            nameless: nameless_margin(&place.evidence, &other.evidence),
        };
        others.map(rival).collect()
    }

    fn alignment(&self, place: &Place) -> Alignment {
        let site_from_newcomer = place.refined.site_from_newcomer;
        let (overlap_m2, overlap_share) = overlap(&self.site, &self.newcomer, site_from_newcomer);
        let rival = self.strongest_rival(place);
        Alignment {
            site_from_newcomer,
            covariance: place.refined.covariance(),
            log_odds: place.log_odds,
            margin: rival.map(|rival| margin(&place.evidence, &rival.evidence)),
            overlap_m2,
            overlap_share,
            agreement: place.evidence.agreement(),
            contradiction: place.evidence.contradiction(),
            n_named: place.evidence.named.n_common,
            n_named_agreeing: place.evidence.named.n_agreeing,
            n_nameless_agreeing: place.evidence.nameless.n_agreeing,
            n_nameless_alone: place.evidence.nameless.n_alone,
        }
    }
}

/// How far the first place's overlap lies from where the second has it: metres and radians.
fn apart(a: &Place, b: &Place) -> (f64, f64) {
    let (pose, other) = (a.refined.site_from_newcomer, b.refined.site_from_newcomer);
    let distance_m = (pose * a.middle - other * a.middle).norm();
    (distance_m, pose.step_to(other).theta_rad.abs())
}

fn is_directed(part: &Part) -> bool {
    DIRECTED_SHARE_MIN <= part.direction.1
}

/// Why a map shows too few walls, if one does.
fn few_walls(site: &Part, newcomer: &Part, walls_min_m: f64) -> Option<Reason> {
    let reason = |is_newcomer: bool, walls_m: f64| {
        (walls_m < walls_min_m).then_some(Reason::FewWalls { is_newcomer, walls_m, walls_min_m })
    };
    reason(true, newcomer.walls_m()).or_else(|| reason(false, site.walls_m()))
}
