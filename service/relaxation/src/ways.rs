//! The search over associations in both directions of time.
//!
//! A search decides first what it knows least of: what was seen when the map was still empty. Backward
//! the same sightings come last. Both find their own hypotheses, and all are judged by the evidence
//! of the whole travel forward. Where it is asked for, the travel is then searched once more, from the
//! end that the best hypothesis came to last, with that hypothesis' map to begin with.

use std::num::NonZero;

use crate::consolidation::{consolidated, renumber};
use crate::error_model::ErrorModel;
use crate::hypothesis::Hypothesis;
use crate::merging::mergers;
use crate::search::{KnownMap, Search, SearchParams};
use crate::travel::Travel;

/// Hypotheses kept after the searches.
const N_HYPOTHESES_MAX: usize = 50;
/// Hypotheses of a search after the first that are judged.
const N_JUDGED: usize = 3;

/// Rounds of taking two landmarks for one.
const N_MERGERS_MAX: u32 = 10;

/// What searches need besides the travel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Means {
    pub(crate) model: ErrorModel,
    pub(crate) params: SearchParams,
    pub(crate) n_threads: NonZero<usize>,
}

/// Hypotheses about a travel, the best first.
#[derive(Clone, Debug, Default)]
pub(crate) struct Judged(pub(crate) Vec<Hypothesis>);

impl Judged {
    /// Takes in an association, if it is new, where its evidence puts it.
    pub(crate) fn judge(&mut self, travel: &Travel, means: &Means, association: Vec<Option<u32>>) {
        if self.0.iter().any(|known| known.association == association) {
            return;
        }
        let search = Search::new(travel, &means.model, means.params).on_threads(means.n_threads);
        let mut search = search.along(association);
        while search.advance() {}
        self.0.extend(search.hypotheses().into_iter().next());
        self.0.sort_by(|a, b| b.log_evidence.total_cmp(&a.log_evidence));
        self.0.truncate(N_HYPOTHESES_MAX);
    }

    /// Takes in what becomes of the best if landmarks that are one are taken together.
    fn consolidate(&mut self, travel: &Travel, means: &Means) {
        let Some(best) = self.0.first() else { return };
        let start = (best.association.clone(), best.poses.clone(), best.calibration);
        let density_per_m2 = means.params.density_per_m2;
        if let Some((association, _)) = consolidated(travel, &means.model, start, density_per_m2) {
            self.judge(travel, means, association);
        }
    }
}

/// The searches under way.
#[derive(Clone, Debug)]
pub(crate) struct Ways {
    forward: Travel,
    backward: Travel,
    means: Means,
    search: Search,
    is_backward: bool,
    n_done: u32,
    n_mergers: u32,
    found: Judged,
    best_is_backward: bool,
}

impl Ways {
    /// Before the first step of the first search.
    pub(crate) fn new(travel: &Travel, means: Means) -> Self {
        let search = Search::new(travel, &means.model, means.params).on_threads(means.n_threads);
        Self {
            forward: travel.clone(),
            backward: travel.reversed(),
            means,
            search,
            is_backward: false,
            n_done: 0,
            n_mergers: 0,
            found: Judged::default(),
            best_is_backward: false,
        }
    }

    /// Goes a step on. False once all searches are over.
    pub(crate) fn advance(&mut self) -> bool {
        if self.means.params.n_ways <= self.n_done {
            return self.merge();
        }
        self.search.advance();
        if self.search.share() < 1.0 {
            return true;
        }
        self.take_in();
        self.n_done += 1;
        if self.means.params.n_ways <= self.n_done {
            return self.merges();
        }
        self.is_backward = !self.best_is_backward;
        let travel = if self.is_backward { &self.backward } else { &self.forward };
        let Means { model, params, n_threads } = &self.means;
        let mut search = Search::new(travel, model, *params);
        if 1 < self.n_done
            && let Some(best) = self.found.0.first()
        {
            let map = KnownMap::of(best, &self.forward, self.is_backward);
            search = Search::on_map(travel, model, *params, map);
        }
        self.search = search.on_threads(*n_threads);
        true
    }

    /// Share of the steps done, 0 to 1.
    pub(crate) fn share(&self) -> f64 {
        let n_ways = self.means.params.n_ways.max(1);
        let n_parts = f64::from(n_ways + u32::from(self.merges()));
        let under_way = if self.n_done < n_ways { self.search.share() } else { 0.0 };
        (f64::from(self.n_done) + under_way) / n_parts
    }

    /// Whether landmarks are taken for one after the searches: where they stand so near to each other
    /// that a travel is searched more than to and fro.
    fn merges(&self) -> bool {
        2 < self.means.params.n_ways
    }

    /// Logarithm of the best hypothesis' probability so far, in the search under way.
    pub(crate) fn log_evidence(&self) -> Option<f64> {
        self.search.log_evidence()
    }

    /// All that was found, the best first.
    pub(crate) fn found(&self) -> &Judged {
        &self.found
    }

    /// Judges what a search has found.
    fn take_in(&mut self) {
        let hypotheses = self.search.hypotheses();
        if self.n_done == 0 {
            self.found.0 = hypotheses;
            self.found.0.truncate(N_HYPOTHESES_MAX);
            self.found.consolidate(&self.forward, &self.means);
            return;
        }
        let best = self.best_log_evidence();
        for Hypothesis { mut association, .. } in hypotheses.into_iter().take(N_JUDGED) {
            if self.is_backward {
                association.reverse();
            }
            renumber(&mut association);
            self.found.judge(&self.forward, &self.means, association);
        }
        if best < self.best_log_evidence() {
            self.best_is_backward = self.is_backward;
            self.found.consolidate(&self.forward, &self.means);
        }
    }

    /// Takes two landmarks of the best for one if the evidence grows. False if it does not.
    fn merge(&mut self) -> bool {
        let Some(best) = self.found.0.first().cloned() else { return false };
        for association in mergers(&self.forward, &self.means.model, &best) {
            self.found.judge(&self.forward, &self.means, association);
        }
        self.n_mergers += 1;
        best.log_evidence < self.best_log_evidence() && self.n_mergers < N_MERGERS_MAX
    }

    fn best_log_evidence(&self) -> f64 {
        self.found.0.first().map_or(f64::NEG_INFINITY, |best| best.log_evidence)
    }
}
