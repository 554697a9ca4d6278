//! Beta: where the robot is, given all that was observed afterwards (TBF98 equations (17), (18)).
//!
//! ```text
//! beta(T) = 1
//! beta(t) = eta sum over xi' of P(xi' | u(t), xi) P(o(t+1) | xi', m) beta(t+1)
//! ```
//!
//! Betas are only asked for where alpha has cells, because elsewhere the product is 0. This is an
//! economy that the paper does not name: the last betas cover the grid otherwise.

use crate::belief::Belief;
use crate::carry::Direction;
use crate::e_step::Model;
use crate::forward::{Forward, likelihood_of, ones};
use crate::layer::Layer;
use crate::perception::{Perception, single};
use crate::stencil::Combine;

/// `alpha beta`, normalised, of all steps.
pub(crate) fn beliefs(model: &Model<'_>, forward: Forward) -> Vec<Belief> {
    let Forward { mut alphas, mut likelihoods, .. } = forward;
    let mut beliefs = Vec::with_capacity(alphas.len());
    let mut beta = alphas.last().map(|alpha| Belief::new(alpha.each_layer(ones)));
    while let (Some(alpha), Some(likelihood)) = (alphas.pop(), likelihoods.pop()) {
        let Some(after) = beta.take() else { break };
        if let Some(before) = alphas.last() {
            let weighed = product(&after, &likelihood);
            let carry = model.carry(alphas.len() - 1, Combine::Sum);
            let mut carried = Belief::new(carry.backward_within(&weighed, before));
            normalise_max(&mut carried);
            beta = Some(carried);
        }
        let mut belief = product(&alpha, &after);
        let sum = belief.sum();
        if sum > 0.0 {
            belief.scale(single(1.0 / sum));
        }
        beliefs.push(belief.selected(model.share));
    }
    beliefs.reverse();
    beliefs
}

/// The beta of one step, wherever it is, for those who want to see it (TBF98 Figs. 3 and 14).
pub(crate) fn beta(model: &Model<'_>, perception: &Perception, step: usize) -> Belief {
    let mut beta = Belief::uniform(model.grid, |_| true);
    for step in (step..model.motions.len()).rev() {
        let observation = &model.observations[step + 1];
        let likelihood = likelihood_of(model.grid, &beta, observation, perception);
        let mut weighed = product(&beta, &likelihood);
        normalise_max(&mut weighed);
        let weighed = weighed.selected(model.share);
        let carry = model.carry(step, Combine::Sum);
        beta = Belief::new(carry.all(&weighed, Direction::Backward)).selected(model.share);
    }
    let sum = beta.sum();
    if sum > 0.0 {
        beta.scale(single(1.0 / sum));
    }
    beta
}

/// Products where the first has cells.
fn product(left: &Belief, right: &Belief) -> Belief {
    Belief::new(left.with_each_layer(|heading, layer| {
        let mut product = layer.same_shape();
        let (window, other) = (layer.window(), right.layer(heading));
        let common = window.intersection(other.window());
        for y in common.y..common.top() {
            let (other_x, other) = other.row(y);
            let (x, out) = product.row_mut(y);
            for ((x, &weight), out) in (x..).zip(layer.row(y).1).zip(out) {
                let place = usize::try_from(x - other_x).ok();
                *out = weight * place.and_then(|place| other.get(place)).copied().unwrap_or(0.0);
            }
        }
        Layer::new(window, product.into_weights())
    }))
}

fn normalise_max(belief: &mut Belief) {
    let max = belief.max();
    if max > 0.0 {
        belief.scale(1.0 / max);
    }
}
