//! Expectation maximisation (TBF98 section 4): where the robot was, given the map, and the map,
//! given where the robot was, in turn, until the likelihood of the data stands still.
//!
//! Time of an iteration: steps times cells of a belief times entries of a motion's kernel.

use std::num::NonZero;

use meetpoint_geometry::Pose;

use crate::belief::Belief;
use crate::calibration::Calibration;
use crate::e_step::{self, Model, Posterior};
use crate::landmark::{Kinds, Landmark};
use crate::landmark_map::LandmarkMap;
use crate::level::Level;
use crate::m_step::{Before, Counts, MapParams};
use crate::motion_model::MotionParams;
use crate::no_landmark::View;
use crate::path::{self, Path};
use crate::perception::{Perception, PerceptionParams};
use crate::pose_grid::{PoseCell, PoseGrid};
use crate::start::StartBelief;
use crate::travel::Travel;
use crate::{backward, forward};

/// Tunables of [`Em`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmParams {
    /// Poses and places, at the end.
    pub grid: PoseGrid,
    /// Iterations on a coarser grid beforehand.
    pub n_coarse_iterations: u32,
    /// How much farther apart that grid's nodes and headings are.
    pub coarse_factor: u32,
    /// How wrong odometry may be.
    pub motion: MotionParams,
    /// Its steady errors, which are corrected beforehand.
    pub calibration: Calibration,
    /// How wrong sightings may be.
    pub perception: PerceptionParams,
    /// How sightings make a map.
    pub map: MapParams,
    /// Where the travel begins.
    pub start: StartBelief,
    /// Poses less probable than this share of the most probable one are dropped; .001 in the paper.
    pub selection_share: f32,
    /// Stop when the log-likelihood changes by less than this share.
    pub change_max: f64,
    /// Stop after this many iterations even so.
    pub n_iterations_max: u32,
    /// Threads that may be used; results do not depend on it.
    pub n_threads: NonZero<usize>,
}

impl EmParams {
    /// A button pressed upon landmarks, a robot on carpet, a start at the frame's origin, one
    /// thread. Four iterations on a grid twice as coarse find the places, a dozen finer ones at
    /// most contract them; a thousandth is the paper's share of selection.
    pub fn button(grid: PoseGrid) -> Self {
        Self {
            grid,
            n_coarse_iterations: 4,
            coarse_factor: 2,
            motion: MotionParams::CARPET,
            calibration: Calibration::NONE,
            perception: PerceptionParams::BUTTON,
            map: MapParams::CONTRACTING,
            start: StartBelief::At(Pose::IDENTITY),
            selection_share: 1e-3,
            change_max: 1e-3,
            n_iterations_max: 16,
            n_threads: NonZero::<usize>::MIN,
        }
    }
}

/// What the first E-step knows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start<'a> {
    /// The controls alone (section 4.1.3).
    Controls,
    /// A map, right or wrong. Iterations by (21) would blur it: parameters should ask for none.
    Map(&'a [Landmark]),
}

/// What an iteration found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figures {
    /// Which iteration it was, from 1.
    pub iteration: u32,
    /// `ln P(d|m)` of the map before the iteration; `None` if there was none.
    pub log_likelihood: Option<f64>,
    /// By how much that is above the iteration before on the same grid.
    pub change: Option<f64>,
    /// Cells of all beliefs together.
    pub n_cells: usize,
    /// Cells times entries of motion tables, over all steps: what time is proportional to.
    pub n_products: usize,
    /// Bytes taken at most: motion tables, beliefs, maps.
    pub n_bytes: usize,
}

/// Expectation maximisation under way.
#[derive(Debug)]
pub struct Em<'a> {
    pub(crate) travel: &'a Travel,
    pub(crate) params: EmParams,
    pub(crate) level: Level,
    pub(crate) kinds: Kinds,
    pub(crate) map: Option<LandmarkMap>,
    pub(crate) figures: Option<Figures>,
}

impl<'a> Em<'a> {
    /// Before the first iteration. The way to a travel's first step is not looked at.
    pub fn new(travel: &'a Travel, params: EmParams, start: Start<'_>) -> Self {
        let known = match start {
            Start::Controls => &[],
            Start::Map(landmarks) => landmarks,
        };
        let kinds = Kinds::new(travel, known);
        let level = Level::new(travel, &params, &kinds, grid_of(&params, 1));
        let map = match start {
            Start::Controls => None,
            Start::Map(known) => {
                Some(LandmarkMap::from_landmarks(level.grid, kinds.clone(), known))
            }
        };
        Self { travel, params, level, kinds, map, figures: None }
    }

    /// Iterations done.
    pub fn n_iterations(&self) -> u32 {
        self.figures.map_or(0, |figures| figures.iteration)
    }

    /// What the last iteration found.
    pub fn figures(&self) -> Option<&Figures> {
        self.figures.as_ref()
    }

    /// The current map; `None` before the first iteration from the controls alone.
    pub fn map(&self) -> Option<&LandmarkMap> {
        self.map.as_ref()
    }

    /// The grid that is being worked on.
    pub fn grid(&self) -> &PoseGrid {
        &self.level.grid
    }

    /// One E-step and one M-step.
    pub fn iterate(&mut self) -> Figures {
        let iteration = self.n_iterations() + 1;
        let grid = grid_of(&self.params, iteration);
        let same_grid = grid == self.level.grid;
        if !same_grid {
            self.level = Level::new(self.travel, &self.params, &self.kinds, grid);
            self.map = self.map.take().map(|map| map.on(grid));
        }
        let perception = self.perception();
        let posterior = self.e_step(perception.as_ref());
        let before = self.map.as_ref().zip(perception.as_ref());
        let before = before.filter(|_| iteration > self.params.map.n_even_iterations);
        let before = before.map(|(map, perception)| Before { map, perception });
        let (beliefs, view) = (&posterior.beliefs, self.view());
        let counts = Counts::of(&self.model(), self.kinds.n(), beliefs, before.as_ref(), &view);
        let map_params = (&self.params.map, &self.params.perception);
        let map = counts.map(&self.level.grid, &self.kinds, before.as_ref(), map_params);
        let log_likelihood = perception.is_some().then_some(posterior.log_likelihood);
        let earlier = self.figures.and_then(|figures| figures.log_likelihood).filter(|_| same_grid);
        let figures = Figures {
            iteration,
            log_likelihood,
            change: log_likelihood.zip(earlier).map(|(now, earlier)| now - earlier),
            n_cells: posterior.n_cells,
            n_products: posterior.n_products,
            n_bytes: posterior.n_bytes + self.level.n_bytes() + 2 * map.n_bytes(),
        };
        self.map = Some(map);
        self.figures = Some(figures);
        figures
    }

    /// Whether more iterations are not worth it: the likelihood stands still, or there were many.
    pub fn has_converged(&self) -> bool {
        let Some(figures) = self.figures else { return self.params.n_iterations_max == 0 };
        let still = figures.change.zip(figures.log_likelihood).is_some_and(|(change, value)| {
            change.abs() <= self.params.change_max * value.abs().max(1.0)
        });
        let fine = figures.iteration > self.params.n_coarse_iterations;
        // Where counts by (20) are to come, a standstill by (21) is not the end: two of them must
        // have been compared.
        let (n_even, n_max) = (self.params.map.n_even_iterations, self.params.n_iterations_max);
        let settled = n_even >= n_max || figures.iteration > n_even.saturating_add(1);
        fine && settled && still || figures.iteration >= n_max
    }

    /// Where the robot was at every step, given the current map, and how probable the data are.
    pub fn posterior(&self) -> Posterior {
        self.e_step(self.perception().as_ref())
    }

    /// Alphas of all steps, given the current map.
    pub fn alphas(&self) -> Vec<Belief> {
        let start = self.params.start.on(&self.level.grid);
        forward::forward(&self.model(), &start, self.perception().as_ref()).alphas
    }

    /// The beta of a step, given the current map, wherever it is: slow, for pictures (Figs. 3, 14).
    /// Uniform without a map and for steps that there are not.
    pub fn beta(&self, step: usize) -> Belief {
        match self.perception() {
            Some(perception) => backward::beta(&self.model(), &perception, step),
            None => Belief::uniform(&self.level.grid, |_| true),
        }
    }

    /// The most likely path, given the current map; `None` if the robot left the grid.
    pub fn path(&self) -> Option<Path> {
        let (cells, posterior) = self.traced()?;
        Some(path::around(&self.level.grid, &cells, &posterior))
    }

    /// The cells of the most likely path.
    pub fn most_likely_cells(&self) -> Option<Vec<PoseCell>> {
        self.traced().map(|(cells, _)| cells)
    }

    fn traced(&self) -> Option<(Vec<PoseCell>, Vec<Belief>)> {
        let perception = self.perception();
        let beliefs = self.e_step(perception.as_ref()).beliefs;
        let start = self.params.start.on(&self.level.grid);
        let cells = path::most_likely(&self.model(), &start, perception.as_ref(), &beliefs)?;
        Some((cells, beliefs))
    }

    fn e_step(&self, perception: Option<&Perception>) -> Posterior {
        let start = self.params.start.on(&self.level.grid);
        e_step::posterior(&self.model(), &start, perception)
    }

    fn perception(&self) -> Option<Perception> {
        let map = self.map.as_ref()?;
        Some(map.perception(&self.params.perception, &self.view(), self.params.n_threads))
    }

    fn view(&self) -> View {
        View::new(&self.travel.detector, self.params.perception.radius_m)
    }

    fn model(&self) -> Model<'_> {
        Model {
            grid: &self.level.grid,
            motions: &self.level.motions,
            observations: &self.level.observations,
            share: self.params.selection_share,
            n_threads: self.params.n_threads,
        }
    }
}

/// The grid of an iteration.
pub(crate) fn grid_of(params: &EmParams, iteration: u32) -> PoseGrid {
    if iteration <= params.n_coarse_iterations {
        params.grid.coarser(params.coarse_factor)
    } else {
        params.grid
    }
}
