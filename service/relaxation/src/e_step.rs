//! What an E-step works on, and what comes out of it (TBF98 section 4.1, equation (13)).

use std::num::NonZero;

use crate::belief::Belief;
use crate::carry::Carry;
use crate::motion_model::MotionModel;
use crate::perception::{Observation, Perception};
use crate::pose_grid::PoseGrid;
use crate::stencil::Combine;

/// All that is known of a travel apart from the map.
pub(crate) struct Model<'a> {
    pub(crate) grid: &'a PoseGrid,
    /// By step, the way to the next; one less than steps.
    pub(crate) motions: &'a [MotionModel],
    pub(crate) observations: &'a [Observation],
    /// Poses below this share of the most probable one are dropped.
    pub(crate) share: f32,
    pub(crate) n_threads: NonZero<usize>,
}

impl Model<'_> {
    /// The way from a step to the next.
    pub(crate) fn carry(&self, step: usize, combine: Combine) -> Carry<'_> {
        let kernel = self.motions[step].kernel();
        Carry { grid: self.grid, kernel, combine, n_threads: self.n_threads }
    }
}

/// A belief for every step, and how probable what was observed is.
#[derive(Clone, Debug)]
pub struct Posterior {
    /// `alpha beta`, normalised, by step.
    pub beliefs: Vec<Belief>,
    /// `ln P(d|m)`: every sighting counts per square metre. Without a map, 0.
    pub log_likelihood: f64,
    /// Cells of all alphas.
    pub n_cells: usize,
    /// Cells times entries of their motion's kernel, over all steps: what time is proportional to.
    pub n_products: usize,
    /// Bytes that alphas and betas took at most.
    pub n_bytes: usize,
}

/// Probabilities of all poses at all steps, given a map, or given the controls alone.
pub(crate) fn posterior(
    model: &Model<'_>,
    start: &Belief,
    perception: Option<&Perception>,
) -> Posterior {
    let forward = crate::forward::forward(model, start, perception);
    let n_cells = forward.alphas.iter().map(Belief::n_cells).sum();
    let carried = forward.alphas.iter().zip(model.motions);
    let n_products = carried.map(|(alpha, way)| alpha.n_cells() * way.kernel().n_entries()).sum();
    let n_bytes = 2 * forward.alphas.iter().map(Belief::n_bytes).sum::<usize>()
        + forward.likelihoods.iter().map(Belief::n_bytes).sum::<usize>();
    let log_likelihood = forward.log_likelihood;
    // Without a map nothing is learnt backward: beta is uniform.
    let beliefs = match perception {
        None => forward.alphas,
        Some(_) => crate::backward::beliefs(model, forward),
    };
    Posterior { beliefs, log_likelihood, n_cells, n_products, n_bytes }
}
