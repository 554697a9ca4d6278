//! `P(o | xi, m)`: how probable it is to see what was seen (TBF98 section 2.2), for a map that is
//! itself a probability, which the paper leaves open.
//!
//! Every node c of the map holds a landmark of type l with probability `m_l(c)`, independently. One
//! within the perceptual radius is seen with probability p (the chance not to miss it), as type t
//! with probability `P(t|l)`, at an offset with a normal error `g`; besides, false sightings come
//! with a density k. Then, seen from xi, sightings z of types t have the likelihood
//!
//! ```text
//! P(o | xi, m) = product over c in view of (1 - p m(c))
//!              * product over z of [ k + sum over c of g(z | c, xi) odds_t(c) ]
//! odds_t(c)    = p sum over l of P(t|l) m_l(c) / (1 - p m(c)),    m = sum over l of m_l
//! ```
//!
//! which is exact for one sighting, and for several as long as these are not of one landmark. The
//! first product is the no-landmark observation of all places where nothing was seen
//! (`no_landmark.rs`); the division takes out of it the place where something was. Where `m` is 0
//! or 1 this is what a map of known landmarks gives.

use crate::kernel::Kernel;
use crate::landmark::{Kinds, LandmarkKind};
use crate::layer::Layer;
use crate::pose_grid::PoseGrid;
use crate::spread::{Spread, normal};
use crate::stencil::{Combine, Stencil};
use crate::travel::Sighting;
use crate::window::Window;

/// How wrong perception may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PerceptionParams {
    /// Standard deviation of a landmark's place in either direction, however near, in metres.
    pub position_std_m: f64,
    /// Standard deviation of a distance, as a share of it.
    pub range_std_share: f64,
    /// Standard deviation of a direction, in radians.
    pub bearing_std_rad: f64,
    /// Chance that a landmark within the perceptual radius is not seen, in (0, 1).
    pub missed: f64,
    /// False sightings to be expected for every square metre, above 0. What is seen where a map
    /// has no landmark is a false sighting or a landmark that it does not know.
    pub false_per_m2: f64,
    /// Chance that a kind of landmark is taken for another, in [0, 1).
    pub mistaken: f64,
    /// How far around a button that is pressed upon a landmark no other is expected, in metres;
    /// a detector's own range serves where it has one.
    pub radius_m: f64,
}

impl PerceptionParams {
    /// A person who presses a button at intersections, corners and dead ends (TBF98 section 6),
    /// within half a metre of the same place, nine times in ten. The paper's radius of 10 m is
    /// "somewhat ad hoc" and often more than landmarks are apart; 8 m are less often.
    pub const BUTTON: Self = Self {
        position_std_m: 0.5,
        range_std_share: 0.1,
        bearing_std_rad: 0.1,
        missed: 0.1,
        false_per_m2: 0.002,
        mistaken: 0.01,
        radius_m: 8.0,
    };

    /// The chance that a landmark in view is seen, p above.
    pub(crate) fn seen(&self) -> f32 {
        single(1.0 - self.missed.clamp(MISSED_MIN, 1.0))
    }

    /// `P(t|l)` with `n` kinds.
    pub(crate) fn taken_for(&self, seen: usize, is: usize, n: usize) -> f32 {
        match (n, seen == is) {
            (1, _) => 1.0,
            (_, true) => single(1.0 - self.mistaken),
            (_, false) => single(self.mistaken / (n - 1) as f64),
        }
    }
}

/// Nothing is seen for certain: the odds above would be infinite.
const MISSED_MIN: f64 = 1e-3;

/// Probabilities are kept in single precision.
#[expect(clippy::cast_possible_truncation, reason = "as the name says")]
pub(crate) fn single(value: f64) -> f32 {
    value as f32
}

/// One sighting: where the landmark may be, seen from every heading.
#[derive(Clone, Debug)]
pub(crate) struct Seen {
    /// Which kind it looked like.
    pub(crate) kind: usize,
    pub(crate) kernel: Kernel,
}

impl Seen {
    /// `None` if the sighting is not finite or of a kind that is not among these.
    pub(crate) fn new(
        grid: &PoseGrid,
        sighting: &Sighting,
        kinds: &Kinds,
        params: &PerceptionParams,
    ) -> Option<Self> {
        let kind = kinds.index_of(LandmarkKind::of(sighting))?;
        if !(sighting.range_m.is_finite() && sighting.bearing_rad.is_finite()) {
            return None;
        }
        let base = params.position_std_m.powi(2) - grid.node_variance_m2();
        let further = (params.range_std_share * sighting.range_m).powi(2);
        let aside = (params.bearing_std_rad * sighting.range_m).powi(2);
        let (sin, cos) = sighting.bearing_rad.sin_cos();
        let spacing_m = grid.resolution_m() / 2.0;
        let mut spreads = Vec::new();
        for &(further_m, of_range) in &normal(base + further, spacing_m) {
            for &(aside_m, of_bearing) in &normal(base + aside, spacing_m) {
                let range_m = sighting.range_m + further_m;
                spreads.push(Spread {
                    x_m: cos * range_m - sin * aside_m,
                    y_m: sin * range_m + cos * aside_m,
                    turn_rad: 0.0,
                    weight: of_range * of_bearing,
                });
            }
        }
        Some(Self { kind, kernel: Kernel::new(grid, &spreads, 0.0) })
    }

    /// The kernel at a heading, ready to look up, or mirrored to write into a map.
    pub(crate) fn stencils(&self, grid: &PoseGrid, heading: u32, mirrored: bool) -> Vec<Stencil> {
        let (n_quarters, slabs) = self.kernel.slabs(grid, heading);
        slabs.iter().map(|slab| Stencil::new(&slab.table, n_quarters, mirrored)).collect()
    }
}

/// What a map says about sightings and their absence, made once for every map.
#[derive(Debug)]
pub(crate) struct Perception {
    /// `odds_t`, by kind seen.
    pub(crate) odds: Vec<Layer>,
    odds_max: Vec<f32>,
    /// `P(nothing in view)`, by heading, or one for all.
    nothing: Vec<Layer>,
    density: f32,
    false_per_m2: f32,
}

impl Perception {
    pub(crate) fn new(
        grid: &PoseGrid,
        odds: Vec<Layer>,
        nothing: Vec<Layer>,
        params: &PerceptionParams,
    ) -> Self {
        let max = |layer: &Layer| layer.weights().iter().fold(0.0_f32, |max, &odds| max.max(odds));
        Self {
            odds_max: odds.iter().map(max).collect(),
            odds,
            nothing,
            density: single(1.0 / grid.node_area_m2()),
            false_per_m2: single(params.false_per_m2.max(1e-9)),
        }
    }

    /// `k + sum over c of g(z | c, xi) odds_t(c)` for one sighting from one heading, per square
    /// metre, where `shape` has cells.
    pub(crate) fn density(
        &self,
        grid: &PoseGrid,
        seen: &Seen,
        heading: u32,
        shape: &Layer,
    ) -> Layer {
        let mut sum = shape.same_shape();
        let mut scratch = Vec::new();
        for stencil in seen.stencils(grid, heading, false) {
            stencil.draw(&self.odds[seen.kind], &mut sum, Combine::Sum, &mut scratch);
        }
        let window = sum.window();
        for y in window.y..window.top() {
            for density in sum.row_mut(y).1 {
                *density = *density * self.density + self.false_per_m2;
            }
        }
        sum
    }

    /// No density above is larger than this, so that products of many stay within bounds.
    pub(crate) fn density_max(&self, seen: &Seen) -> f64 {
        let sum = f64::from(self.odds_max[seen.kind]) * f64::from(self.density);
        sum * f64::from(seen.kernel.weight_max()) + f64::from(self.false_per_m2)
    }

    /// `P(o | xi, m)` for one heading where `shape` has cells, as a share of the product of
    /// [`Self::density_max`].
    pub(crate) fn likelihood(
        &self,
        grid: &PoseGrid,
        observation: &Observation,
        heading: u32,
        shape: &Layer,
    ) -> Vec<f64> {
        let window = shape.window();
        let mut product = vec![1.0; window.n_cells()];
        if observation.something_in_view {
            let nothing = &self.nothing[heading as usize % self.nothing.len()];
            multiply(&mut product, window, nothing, 1.0);
        }
        for seen in &observation.seen {
            let density = self.density(grid, seen, heading, shape);
            multiply(&mut product, window, &density, 1.0 / self.density_max(seen));
        }
        product
    }
}

/// What was observed at one step.
#[derive(Clone, Debug)]
pub(crate) struct Observation {
    pub(crate) seen: Vec<Seen>,
    /// Whether what was not seen says something, too.
    pub(crate) something_in_view: bool,
}

impl Observation {
    /// The logarithm of what [`Perception::likelihood`] was divided by.
    pub(crate) fn log_scale(&self, perception: &Perception) -> f64 {
        self.seen.iter().map(|seen| perception.density_max(seen).ln()).sum()
    }
}

fn multiply(product: &mut [f64], window: Window, factors: &Layer, scale: f64) {
    let common = window.intersection(factors.window());
    for y in common.y..common.top() {
        let (x, row) = factors.row(y);
        for (x, &factor) in (x..common.right()).zip(row) {
            if let Some(index) = window.index_of(x, y) {
                product[index] *= f64::from(factor) * scale;
            }
        }
    }
}
