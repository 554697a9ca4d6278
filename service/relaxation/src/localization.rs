//! Where a robot is in a known map when nothing is known of where it started: alpha with a uniform
//! alpha(0) (TBF98 section 8, Fig. 18), one step at a time, while it drives.
//!
//! The forward pass is that of expectation maximisation ([`crate::forward`]), with the same grid, tables and
//! stencils. What differs is what becomes of improbable poses: they are not dropped but pooled, and
//! the pool's probability is taken to be even over the grid,
//!
//! ```text
//! predicted(xi') = sum over kept xi of P(xi' | u, xi) alpha(xi)  +  pool / poses
//! ```
//!
//! so that nothing is ever excluded: a robot that sees what the map does not know, that starts where
//! nobody was or that is carried away comes out of the pool as soon as the map explains what it sees. What
//! leaves the grid goes into the pool as well. Time of a step: cells of the grid times entries of a
//! sighting's kernel, and kept cells times entries of the motion's.

use std::num::NonZero;

use meetpoint_geometry::Point2;

use crate::belief::{Belief, above};
use crate::calibration::Calibration;
use crate::carry::{Carry, Direction};
use crate::landmark::{Kinds, Landmark};
use crate::landmark_map::LandmarkMap;
use crate::layer::Layer;
use crate::level::SHARE_OF_SELECTION;
use crate::motion_model::{MotionModel, MotionParams};
use crate::no_landmark::View;
use crate::perception::{Observation, Perception, PerceptionParams, Seen, single};
use crate::pose_grid::{Area, InvalidGrid, PoseGrid};
use crate::side_by_side::side_by_side;
use crate::stencil::Combine;
use crate::travel::{Detector, Step};
use crate::whereabouts::{Whereabouts, peaks};

/// Tunables of [`Localization`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalizationParams {
    /// Distance of neighbouring positions, in metres.
    pub resolution_m: f64,
    /// Number of headings; four divides it.
    pub n_headings: u32,
    /// How far beyond the outermost landmarks the robot may be, in metres.
    pub margin_m: f64,
    /// How wrong odometry may be.
    pub motion: MotionParams,
    /// Its steady errors, if they are known.
    pub calibration: Calibration,
    /// How wrong sightings may be. What is seen where the map has nothing counts as false.
    pub perception: PerceptionParams,
    /// Poses less probable than this share of the most probable one are pooled; .001 in the paper, where
    /// they are dropped.
    pub selection_share: f32,
    /// So are poses that are less probable than this many times the mean of all: the pool tells as
    /// much of them.
    pub mean_share: f64,
    /// Chance that between two steps somebody carried the robot to anywhere, in [0, 1]: so much of what is
    /// believed goes into the pool with each.
    pub carried_away: f64,
    /// Threads that may be used; results do not depend on it.
    pub n_threads: NonZero<usize>,
}

impl LocalizationParams {
    /// A button pressed upon landmarks, on the paper's grid. A map has one landmark in some hundred
    /// square metres and knows nine in ten of them, so that a sighting that it does not explain is met
    /// in a thousand square metres; a robot may have started a corridor away from all. Somebody carries it
    /// elsewhere about once in a hundred steps.
    pub const BUTTON: Self = Self {
        resolution_m: 1.0,
        n_headings: 72,
        margin_m: 15.0,
        motion: MotionParams::CARPET,
        calibration: Calibration::NONE,
        perception: PerceptionParams { false_per_m2: 0.001, ..PerceptionParams::BUTTON },
        selection_share: 1e-3,
        mean_share: 1.0,
        carried_away: 0.01,
        n_threads: NonZero::<usize>::MIN,
    };

    /// Landmarks that a camera measures from some metres away in a hall: a finer grid, since these are
    /// sharper; most of what is in view is missed.
    pub const CAMERA: Self = Self {
        resolution_m: 0.25,
        n_headings: 72,
        margin_m: 3.0,
        perception: PerceptionParams {
            position_std_m: 0.2,
            range_std_share: 0.06,
            bearing_std_rad: 0.05,
            missed: 0.7,
            false_per_m2: 0.02,
            mistaken: 0.02,
            radius_m: 0.0,
        },
        ..Self::BUTTON
    };

    /// Those for a detector.
    pub fn of_detector(detector: &Detector) -> Self {
        if detector.is_button() { Self::BUTTON } else { Self::CAMERA }
    }
}

/// Localisation under way.
#[derive(Debug)]
pub struct Localization {
    detector: Detector,
    params: LocalizationParams,
    grid: PoseGrid,
    kinds: Kinds,
    perception: Perception,
    /// What is kept by itself; `None` before the first step.
    alpha: Option<Belief>,
    pool: f64,
    log_evidence: f64,
}

impl Localization {
    /// The grid of a map and its surroundings, for [`Localization::on`].
    ///
    /// # Errors
    /// [`InvalidGrid`] if the map is not finite, or too large for any grid, or the parameters ask for
    /// none.
    pub fn grid_of(
        landmarks: &[Landmark],
        params: &LocalizationParams,
    ) -> Result<PoseGrid, InvalidGrid> {
        let along = |axis: usize| {
            let places = landmarks.iter().map(|landmark| landmark.position[axis]);
            let min = places.clone().fold(f64::INFINITY, f64::min);
            let max = places.fold(f64::NEG_INFINITY, f64::max);
            if min <= max { (min - params.margin_m, max + params.margin_m) } else { (0.0, 0.0) }
        };
        let is_finite = |landmark: &Landmark| landmark.position.iter().all(|at| at.is_finite());
        if !landmarks.iter().all(is_finite) {
            return Err(InvalidGrid::Area);
        }
        let ((left, right), (bottom, top)) = (along(0), along(1));
        let area = Area { min: Point2::new(left, bottom), max: Point2::new(right, top) };
        PoseGrid::new(area, params.resolution_m, params.n_headings)
    }

    /// Before the first step, on a map and its surroundings.
    ///
    /// # Errors
    /// Those of [`Localization::grid_of`].
    pub fn new(
        landmarks: &[Landmark],
        detector: Detector,
        params: LocalizationParams,
    ) -> Result<Self, InvalidGrid> {
        let grid = Self::grid_of(landmarks, &params)?;
        Ok(Self::on(grid, landmarks, detector, params))
    }

    /// The same on a grid that is given.
    pub fn on(
        grid: PoseGrid,
        landmarks: &[Landmark],
        detector: Detector,
        params: LocalizationParams,
    ) -> Self {
        let kinds = landmarks.iter().map(|landmark| landmark.kind).collect();
        let kinds = Kinds::from_kinds(kinds);
        let map = LandmarkMap::from_landmarks(grid, kinds.clone(), landmarks);
        let view = View::new(&detector, params.perception.radius_m);
        let perception = map.perception(&params.perception, &view, params.n_threads);
        Self {
            detector,
            params,
            grid,
            kinds,
            perception,
            alpha: None,
            pool: 1.0,
            log_evidence: 0.0,
        }
    }

    /// Takes in the way to the next step and what is seen there. The way to the first does not count.
    pub fn advance(&mut self, step: &Step) -> Whereabouts {
        let carried = self.carried(step);
        let seen = step
            .sightings
            .iter()
            .map(|sighting| Seen::new(&self.grid, sighting, &self.kinds, &self.params.perception));
        let seen: Vec<Option<Seen>> = seen.collect();
        // What the map knows no like of is not on it, wherever the robot is.
        let n_strange = seen.iter().filter(|seen| seen.is_none()).count();
        self.log_evidence += n_strange as f64 * self.params.perception.false_per_m2.ln();
        let seen: Vec<Seen> = seen.into_iter().flatten().collect();
        let something_in_view = 0.0 < self.detector.range_max_m || !seen.is_empty();
        if something_in_view {
            self.weigh(&carried, &Observation { seen, something_in_view });
        } else {
            let kept = carried.selected(self.params.selection_share);
            self.pool = (1.0 - kept.sum()).clamp(0.0, 1.0);
            self.alpha = Some(kept);
        }
        self.whereabouts()
    }

    /// The poses that are kept by themselves; what is missing to one is in the pool.
    pub fn alpha(&self) -> Option<&Belief> {
        self.alpha.as_ref()
    }

    /// Probabilities of positions, whatever the heading, with the pool spread evenly: row-major from the
    /// grid's lower-left node along +x, as in the pictures of Fig. 18.
    pub fn over_positions(&self) -> Vec<f32> {
        let n_nodes = self.grid.n_nodes();
        let kept = self.alpha.as_ref().map(|alpha| alpha.over_positions(&self.grid));
        let even = single(self.pool / n_nodes as f64);
        kept.unwrap_or_else(|| vec![0.0; n_nodes]).iter().map(|weight| weight + even).collect()
    }

    /// The grid of poses.
    pub fn grid(&self) -> &PoseGrid {
        &self.grid
    }

    /// What is known so far.
    pub fn whereabouts(&self) -> Whereabouts {
        let kept = self.alpha.as_ref();
        let (mut entropy, mut n_kept) = (0.0, 0);
        for (_, weight) in kept.iter().flat_map(|alpha| alpha.entries()) {
            let weight = f64::from(weight);
            entropy -= weight * weight.ln();
            n_kept += 1;
        }
        let n_pooled = (self.grid.n_cells() - n_kept) as f64;
        if 0.0 < self.pool && 0.0 < n_pooled {
            entropy -= self.pool * (self.pool / n_pooled).ln();
        }
        Whereabouts {
            peaks: kept.map_or_else(Vec::new, |alpha| peaks(&self.grid, alpha)),
            elsewhere: self.pool,
            entropy,
            log_evidence: self.log_evidence,
        }
    }

    /// Where the kept poses lead, and what the pool is then.
    fn carried(&mut self, step: &Step) -> Belief {
        let Some(alpha) = &self.alpha else {
            return Belief::new(vec![Layer::EMPTY; self.grid.n_headings() as usize]);
        };
        let LocalizationParams { calibration, motion, selection_share, n_threads, .. } =
            &self.params;
        let share = selection_share * SHARE_OF_SELECTION;
        let model = MotionModel::new(&self.grid, &step.motion, calibration, motion, share);
        let carry = Carry {
            grid: &self.grid,
            kernel: model.kernel(),
            combine: Combine::Sum,
            n_threads: *n_threads,
        };
        let mut carried = Belief::new(carry.all(alpha, Direction::Forward));
        carried.scale(single(1.0 - self.params.carried_away.clamp(0.0, 1.0)));
        self.pool = (1.0 - carried.sum()).clamp(0.0, 1.0);
        carried
    }

    /// Weighs every pose of the grid by what is seen.
    fn weigh(&mut self, carried: &Belief, observation: &Observation) {
        let window = self.grid.window();
        let even = self.pool / self.grid.n_cells() as f64;
        let entries: usize = observation.seen.iter().map(|seen| seen.kernel.n_entries()).sum();
        let (n, n_units) = (self.grid.n_headings(), self.grid.n_cells() * (entries + 1));
        let whole = Layer::zeros(window);
        let products = side_by_side(n, self.params.n_threads, n_units, |heading| {
            let mut predicted = Layer::zeros(window);
            predicted.add(carried.layer(heading));
            let likelihood = self.perception.likelihood(&self.grid, observation, heading, &whole);
            let both = predicted.weights().iter().zip(likelihood);
            let product = both.map(|(&weight, value)| (f64::from(weight) + even) * value);
            product.collect::<Vec<f64>>()
        });
        let sum: f64 = products.iter().flatten().sum();
        if !(0.0 < sum && sum.is_finite()) {
            // Impossible wherever the robot is: nothing is learnt.
            self.alpha = Some(carried.clone().selected(self.params.selection_share));
            return;
        }
        let max = products.iter().flatten().fold(0.0_f64, |max, &value| max.max(value));
        let mean = sum / self.grid.n_cells() as f64;
        let limit =
            (f64::from(self.params.selection_share) * max).max(self.params.mean_share * mean);
        let kept = products.iter().map(|products| {
            let weights = products.iter().map(|&value| single(value / sum)).collect();
            above(&Layer::new(window, weights), single(limit / sum))
        });
        let alpha = Belief::new(kept.collect());
        self.pool = (1.0 - alpha.sum()).clamp(0.0, 1.0);
        self.alpha = Some(alpha);
        self.log_evidence += sum.ln() + observation.log_scale(&self.perception);
    }
}
