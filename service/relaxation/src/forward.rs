//! Alpha: where the robot is, given all that was observed until then (TBF98 equations (14)-(16)).
//!
//! ```text
//! alpha(1)   = start P(o(1) | xi, m)
//! alpha(t+1) = eta P(o(t+1) | xi', m) sum over xi of P(xi' | u(t), xi) alpha(t)
//! ```
//!
//! The logarithms of the normalisers eta sum to the log-likelihood of the data. Cells below a share
//! of the largest are dropped after each step and their weight is not given to others, so that it
//! is missing from the likelihood as well, which is a lower bound.

use crate::belief::{Belief, above};
use crate::carry::Direction;
use crate::e_step::Model;
use crate::layer::Layer;
use crate::perception::{Observation, Perception, single};
use crate::pose_grid::PoseGrid;
use crate::side_by_side::side_by_side;
use crate::stencil::Combine;

/// What the likelihood of an observation counts that is impossible wherever the robot may be.
const LOG_IMPOSSIBLE: f64 = -700.0;

/// Alphas, and what backward needs.
pub(crate) struct Forward {
    pub(crate) alphas: Vec<Belief>,
    /// `P(o | xi, m)` where alphas have cells, up to a factor for each step.
    pub(crate) likelihoods: Vec<Belief>,
    pub(crate) log_likelihood: f64,
}

/// Alphas of all steps; without a map from the controls alone.
pub(crate) fn forward(
    model: &Model<'_>,
    start: &Belief,
    perception: Option<&Perception>,
) -> Forward {
    let n_steps = model.observations.len();
    let mut forward = Forward {
        alphas: Vec::with_capacity(n_steps),
        likelihoods: Vec::new(),
        log_likelihood: 0.0,
    };
    for (step, observation) in model.observations.iter().enumerate() {
        let predicted = match forward.alphas.last() {
            None => start.clone(),
            Some(alpha) => {
                Belief::new(model.carry(step - 1, Combine::Sum).all(alpha, Direction::Forward))
            }
        };
        let seen = match perception {
            None => unseen(predicted, model.share),
            Some(perception) => weighed(model, &predicted, observation, perception),
        };
        forward.log_likelihood += seen.log_evidence;
        forward.alphas.push(seen.alpha);
        forward.likelihoods.extend(seen.likelihood);
    }
    forward
}

/// An alpha, and how probable the observation was that made it.
struct Weighed {
    alpha: Belief,
    likelihood: Option<Belief>,
    log_evidence: f64,
}

/// Nothing observed: what left the grid or was dropped is all that is missing.
fn unseen(mut predicted: Belief, share: f32) -> Weighed {
    let sum = predicted.sum();
    if sum > 0.0 {
        predicted.scale(single(1.0 / sum));
    }
    Weighed { alpha: predicted.selected(share), likelihood: None, log_evidence: 0.0 }
}

fn weighed(
    model: &Model<'_>,
    predicted: &Belief,
    observation: &Observation,
    perception: &Perception,
) -> Weighed {
    let likelihoods = likelihoods(model, predicted, observation, perception);
    let (mut sum, mut likelihood_max) = (0.0, 0.0_f64);
    let mut product_max = 0.0_f64;
    for (heading, layer) in predicted.layers() {
        for (&weight, &likelihood) in layer.weights().iter().zip(&likelihoods[heading as usize]) {
            let product = f64::from(weight) * likelihood;
            sum += product;
            product_max = product_max.max(product);
            if weight > 0.0 {
                likelihood_max = likelihood_max.max(likelihood);
            }
        }
    }
    if !(sum > 0.0 && sum.is_finite()) {
        let unseen = unseen(predicted.clone(), model.share);
        let ones = Belief::new(unseen.alpha.each_layer(ones));
        return Weighed { likelihood: Some(ones), log_evidence: LOG_IMPOSSIBLE, ..unseen };
    }
    let limit = single(product_max / sum) * model.share;
    let (mut alphas, mut kept) = (Vec::new(), Vec::new());
    for (heading, likelihoods) in (0..model.grid.n_headings()).zip(&likelihoods) {
        let layer = predicted.layer(heading);
        let products = layer.weights().iter().zip(likelihoods);
        let weights = products.map(|(&weight, &value)| single(f64::from(weight) * value / sum));
        let alpha = above(&Layer::new(layer.window(), weights.collect()), limit);
        let scaled = likelihoods.iter().map(|&value| single(value / likelihood_max)).collect();
        kept.push(Layer::new(layer.window(), scaled).cut(alpha.window()));
        alphas.push(alpha);
    }
    Weighed {
        alpha: Belief::new(alphas),
        likelihood: Some(Belief::new(kept)),
        log_evidence: sum.ln() + observation.log_scale(perception),
    }
}

/// `P(o | xi, m)` by heading where `predicted` has cells.
fn likelihoods(
    model: &Model<'_>,
    predicted: &Belief,
    observation: &Observation,
    perception: &Perception,
) -> Vec<Vec<f64>> {
    let entries: usize = observation.seen.iter().map(|seen| seen.kernel.n_entries()).sum();
    let n_units = predicted.n_cells() * (entries + 1);
    side_by_side(model.grid.n_headings(), model.n_threads, n_units, |heading| {
        perception.likelihood(model.grid, observation, heading, predicted.layer(heading))
    })
}

/// One for every cell of a layer.
pub(crate) fn ones(layer: &Layer) -> Layer {
    Layer::new(layer.window(), vec![1.0; layer.weights().len()])
}

/// `P(o | xi, m)` for all poses of a belief, up to a factor: for those who ask for betas alone.
pub(crate) fn likelihood_of(
    grid: &PoseGrid,
    belief: &Belief,
    observation: &Observation,
    perception: &Perception,
) -> Belief {
    let layer = |heading| {
        let layer = belief.layer(heading);
        let values = perception.likelihood(grid, observation, heading, layer);
        Layer::new(layer.window(), values.iter().map(|&value| single(value)).collect())
    };
    Belief::new((0..grid.n_headings()).map(layer).collect())
}
