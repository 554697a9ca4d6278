//! One expectation maximisation over several travels whose relative start is unknown (TBF98 section 8):
//! alpha(0) is a Dirac distribution for the first robot and uniform for every other, and the map is
//! one.
//!
//! ```text
//! E-step   alpha beta of each travel by itself, given the map      (13)
//! M-step   counts of all travels added up, then as for one travel  (19)
//! ```
//!
//! Travels are independent given the map, so that the likelihood of all is the product of theirs and
//! never falls for the same reason as that of one. As in the paper the first E-step knows a map, that
//! of the first robot: without one a robot that may be anywhere would smear it.

use crate::belief::Belief;
use crate::calibration::Calibration;
use crate::e_step::{self, Model, Posterior};
use crate::em::{EmParams, Figures};
use crate::forward;
use crate::landmark::{Kinds, Landmark};
use crate::landmark_map::LandmarkMap;
use crate::level::Level;
use crate::m_step::{Before, Counts};
use crate::no_landmark::View;
use crate::path::{self, Path};
use crate::perception::Perception;
use crate::start::StartBelief;
use crate::travel::Travel;

/// One robot's travel among several.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointTravel<'a> {
    /// What it measured.
    pub travel: &'a Travel,
    /// Where it begins: the first robot's at its start, another's within the map and its surroundings.
    pub start: StartBelief,
    /// Steady errors of its odometry, which are corrected beforehand.
    pub calibration: Calibration,
}

/// Expectation maximisation over several travels under way.
#[derive(Debug)]
pub struct JointEm<'a> {
    runs: Vec<Run<'a>>,
    params: EmParams,
    kinds: Kinds,
    map: LandmarkMap,
    figures: Option<Figures>,
}

/// One of the travels with its tables.
#[derive(Debug)]
struct Run<'a> {
    travel: &'a Travel,
    start: StartBelief,
    level: Level,
}

impl<'a> JointEm<'a> {
    /// Before the first iteration. Of `params`, start and calibration are the travels' own, and there
    /// are no coarse iterations.
    pub fn new(travels: &[JointTravel<'a>], params: EmParams, map: &[Landmark]) -> Self {
        let kinds = travels.iter().flat_map(|it| Kinds::new(it.travel, map).as_slice().to_vec());
        let known = map.iter().map(|landmark| landmark.kind);
        let kinds = Kinds::from_kinds(kinds.chain(known).collect());
        let run = |it: &JointTravel<'a>| {
            let own = EmParams { calibration: it.calibration, ..params };
            let level = Level::new(it.travel, &own, &kinds, params.grid);
            Run { travel: it.travel, start: it.start, level }
        };
        let runs = travels.iter().map(run).collect();
        let map = LandmarkMap::from_landmarks(params.grid, kinds.clone(), map);
        Self { runs, params, kinds, map, figures: None }
    }

    /// The current map.
    pub fn map(&self) -> &LandmarkMap {
        &self.map
    }

    /// What the last iteration found, over all travels.
    pub fn figures(&self) -> Option<&Figures> {
        self.figures.as_ref()
    }

    /// One E-step of each travel, and one M-step over all.
    pub fn iterate(&mut self) -> Figures {
        let iteration = self.figures.map_or(0, |figures| figures.iteration) + 1;
        let counts_given_map = self.params.map.n_even_iterations < iteration;
        let mut all: Option<Counts> = None;
        let (mut log_likelihood, mut n_cells, mut n_products, mut n_bytes) = (0.0, 0, 0, 0);
        for run in &self.runs {
            let perception = self.perception(run);
            let posterior = self.posterior_of(run, &perception);
            let before = Before { map: &self.map, perception: &perception };
            let before = counts_given_map.then_some(&before);
            let (n_kinds, view) = (self.kinds.n(), self.view(run));
            let counts = Counts::of(&self.model(run), n_kinds, &posterior.beliefs, before, &view);
            all = Some(match all {
                None => counts,
                Some(sum) => sum.with(&counts),
            });
            log_likelihood += posterior.log_likelihood;
            n_cells += posterior.n_cells;
            n_products += posterior.n_products;
            n_bytes += run.level.n_bytes() + posterior.n_bytes;
        }
        let first = self.runs.first().map(|run| self.perception(run));
        if let Some((counts, perception)) = all.zip(first) {
            let before = Before { map: &self.map, perception: &perception };
            let before = counts_given_map.then_some(&before);
            let params = (&self.params.map, &self.params.perception);
            self.map = counts.map(&self.params.grid, &self.kinds, before, params);
        }
        let earlier = self.figures.and_then(|figures| figures.log_likelihood);
        let figures = Figures {
            iteration,
            log_likelihood: Some(log_likelihood),
            change: earlier.map(|earlier| log_likelihood - earlier),
            n_cells,
            n_products,
            n_bytes: n_bytes + 2 * self.map.n_bytes(),
        };
        self.figures = Some(figures);
        figures
    }

    /// Whether more iterations are not worth it: the likelihood stands still, or there were many.
    pub fn has_converged(&self) -> bool {
        let Some(figures) = self.figures else { return self.params.n_iterations_max == 0 };
        let still = figures.change.zip(figures.log_likelihood).is_some_and(|(change, value)| {
            change.abs() <= self.params.change_max * value.abs().max(1.0)
        });
        still || self.params.n_iterations_max <= figures.iteration
    }

    /// Where each robot was at every step, given the current map, and how probable its data are.
    pub fn posteriors(&self) -> Vec<Posterior> {
        let of = |run: &Run<'_>| self.posterior_of(run, &self.perception(run));
        self.runs.iter().map(of).collect()
    }

    /// Alphas of all steps of one of the travels, given the current map (Fig. 18); none for a travel
    /// that there is not.
    pub fn alphas(&self, index: usize) -> Vec<Belief> {
        let Some(run) = self.runs.get(index) else { return Vec::new() };
        let start = run.start.on(&self.params.grid);
        forward::forward(&self.model(run), &start, Some(&self.perception(run))).alphas
    }

    /// The most likely path of each robot, given the current map; `None` for one that left the grid.
    pub fn paths(&self) -> Vec<Option<Path>> {
        let path = |run: &Run<'_>| {
            let perception = self.perception(run);
            let beliefs = self.posterior_of(run, &perception).beliefs;
            let (model, start) = (self.model(run), run.start.on(&self.params.grid));
            let cells = path::most_likely(&model, &start, Some(&perception), &beliefs)?;
            Some(path::around(&self.params.grid, &cells, &beliefs))
        };
        self.runs.iter().map(path).collect()
    }

    fn posterior_of(&self, run: &Run<'_>, perception: &Perception) -> Posterior {
        let start = run.start.on(&self.params.grid);
        e_step::posterior(&self.model(run), &start, Some(perception))
    }

    fn perception(&self, run: &Run<'_>) -> Perception {
        self.map.perception(&self.params.perception, &self.view(run), self.params.n_threads)
    }

    fn view(&self, run: &Run<'_>) -> View {
        View::new(&run.travel.detector, self.params.perception.radius_m)
    }

    fn model<'b>(&'b self, run: &'b Run<'_>) -> Model<'b> {
        Model {
            grid: &self.params.grid,
            motions: &run.level.motions,
            observations: &run.level.observations,
            share: self.params.selection_share,
            n_threads: self.params.n_threads,
        }
    }
}
