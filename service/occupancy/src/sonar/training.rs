//! Training of the network by back-propagation.
//!
//! Minimised is the mean cross-entropy over examples (view, occupied or not),
//!
//! ```text
//! E = - mean of ( t log p + (1 - t) log (1 - p) )
//! ```
//!
//! so that the network's answer is a probability (T. Mitchell, "Machine Learning" (1997), p. 167, as the
//! 1998 paper says), by gradient descent over small lots of examples with the step adapted for each
//! weight: D. Kingma and J. Ba, "Adam: a method for stochastic optimization", ICLR (2015), Algorithm 1.
//! Time O(epochs * examples * weights).

use rand::seq::SliceRandom;
use rand::{Rng, RngExt};

use super::network::{Activation, N_FIRST, N_INPUTS, N_SECOND, Network, inputs};
use super::ring::SonarView;

/// A place of which is known whether it is occupied.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Example {
    /// What was heard of it.
    pub view: SonarView,
    /// Whether it is occupied.
    pub is_occupied: bool,
}

/// How a network is trained.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrainingParams {
    /// Times that every example is shown.
    pub n_epochs: u32,
    /// Examples that a step is made of.
    pub n_lot: usize,
    /// Size of the first step; the last is a hundredth of it.
    pub rate: f32,
}

impl TrainingParams {
    /// Enough that two and a half times as many epochs lower the cross-entropy by half a percent.
    pub const STANDARD: Self = Self { n_epochs: 12, n_lot: 64, rate: 0.01 };
}

/// How much of the mean of gradients, and of their squares, is kept from step to step (the authors').
const KEPT: (f32, f32) = (0.9, 0.999);
/// Keeps the step finite where the gradient is 0 (the authors').
const EPSILON: f32 = 1e-8;
/// The last step as a share of the first.
const RATE_LAST: f32 = 0.01;

/// Steps down the gradient, each weight's by what its gradients were so far.
pub(super) struct Adam {
    mean: Vec<f32>,
    square: Vec<f32>,
    kept: (f32, f32),
    rate: f32,
    n_done: usize,
    n_steps: usize,
}

impl Adam {
    /// For so many steps in all.
    pub(super) fn new(params: &TrainingParams, n_steps: usize) -> Self {
        let mean = vec![0.0_f32; Network::N_WEIGHTS];
        Self { square: mean.clone(), mean, kept: (1.0, 1.0), rate: params.rate, n_done: 0, n_steps }
    }

    /// Moves the weights of a network against a gradient in the shape of a network.
    pub(super) fn step(&mut self, network: &mut Network, gradient: &Network) {
        self.kept = (self.kept.0 * KEPT.0, self.kept.1 * KEPT.1);
        let done = self.n_done as f32 / self.n_steps.max(1) as f32;
        let rate = self.rate * RATE_LAST.powf(done);
        let moments = self.mean.iter_mut().zip(&mut self.square);
        let all = network.weights_mut().zip(gradient.weights()).zip(moments);
        for ((weight, slope), (mean, square)) in all {
            *mean = KEPT.0 * *mean + (1.0 - KEPT.0) * slope;
            *square = KEPT.1 * *square + (1.0 - KEPT.1) * slope * slope;
            let (mean, square) = (*mean / (1.0 - self.kept.0), *square / (1.0 - self.kept.1));
            *weight -= rate * mean / (square.sqrt() + EPSILON);
        }
        self.n_done += 1;
    }
}

/// A network trained on these examples from random weights.
pub fn trained(examples: &[Example], params: &TrainingParams, rng: &mut impl Rng) -> Network {
    let mut network = random(rng);
    network.prior_log_odds = prior_log_odds(examples);
    network.output_bias = network.prior_log_odds;
    let mut order: Vec<usize> = (0..examples.len()).collect();
    let n_lots = examples.len().div_ceil(params.n_lot.max(1)) * params.n_epochs as usize;
    let mut adam = Adam::new(params, n_lots);
    for _ in 0..params.n_epochs {
        order.shuffle(rng);
        for lot in order.chunks(params.n_lot.max(1)) {
            let gradient = gradient(&network, lot.iter().map(|&index| &examples[index]));
            adam.step(&mut network, &gradient);
        }
    }
    network
}

/// Mean cross-entropy of what a model says of examples, in nats; the model gives log-odds.
pub fn cross_entropy(examples: &[Example], log_odds: impl Fn(&SonarView) -> f32) -> f64 {
    let loss = |example: &Example| {
        let log_odds = f64::from(log_odds(&example.view));
        let against = if example.is_occupied { -log_odds } else { log_odds };
        // log(1 + e^x) without overflow.
        against.max(0.0) + (-against.abs()).exp().ln_1p()
    };
    examples.iter().map(loss).sum::<f64>() / examples.len().max(1) as f64
}

/// Log-odds of the share of occupied examples, as if one more of each kind had been seen.
fn prior_log_odds(examples: &[Example]) -> f32 {
    let n_occupied = examples.iter().filter(|example| example.is_occupied).count();
    ((n_occupied + 1) as f32 / (examples.len() - n_occupied + 1) as f32).ln()
}

/// Weights that let every unit answer to its inputs (variance 1 / inputs).
fn random(rng: &mut impl Rng) -> Network {
    let mut network = Network::BLANK;
    let mut draw = |weights: &mut [f32], n_inputs: usize| {
        let half = (3.0 / n_inputs as f32).sqrt();
        for weight in weights {
            *weight = rng.random_range(-half..half);
        }
    };
    draw(network.first.as_flattened_mut(), N_INPUTS);
    draw(&mut network.first_bias, N_INPUTS);
    draw(network.second.as_flattened_mut(), N_FIRST);
    draw(&mut network.output, N_SECOND);
    network
}

/// Derivative of the mean cross-entropy of examples by each weight, in the shape of a network.
fn gradient<'a>(
    network: &Network,
    examples: impl ExactSizeIterator<Item = &'a Example>,
) -> Network {
    let share = 1.0 / examples.len().max(1) as f32;
    let mut sum = Network::BLANK;
    for example in examples {
        let activation = network.activation(inputs(&example.view));
        let probability = 1.0 / (1.0 + (-activation.log_odds).exp());
        let target = if example.is_occupied { 1.0 } else { 0.0 };
        add_slopes(network, &activation, share * (probability - target), &mut sum);
    }
    sum
}

/// Back-propagates the derivative by the log-odds, `slope`, to all weights.
pub(super) fn add_slopes(
    network: &Network,
    activation: &Activation,
    slope: f32,
    sum: &mut Network,
) {
    let Activation { inputs, first, second, log_odds: _ } = activation;
    sum.output_bias += slope;
    let mut by_second = [0.0_f32; N_SECOND];
    for unit in 0..N_SECOND {
        sum.output[unit] += slope * second[unit];
        by_second[unit] = slope * network.output[unit] * (1.0 - second[unit] * second[unit]);
        sum.second_bias[unit] += by_second[unit];
    }
    let mut by_first = [0.0_f32; N_FIRST];
    for unit in 0..N_FIRST {
        let weights = &network.second[unit];
        let back: f32 = weights.iter().zip(by_second).map(|(weight, by)| weight * by).sum();
        by_first[unit] = back * (1.0 - first[unit] * first[unit]);
        sum.first_bias[unit] += by_first[unit];
        for (slope, by) in sum.second[unit].iter_mut().zip(by_second) {
            *slope += first[unit] * by;
        }
    }
    for (slopes, input) in sum.first.iter_mut().zip(inputs) {
        for (slope, by) in slopes.iter_mut().zip(by_first) {
            *slope += input * by;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    /// Places before and behind a wall that all four hear at the same distance.
    fn wall(n: usize, rng: &mut ChaCha8Rng) -> Vec<Example> {
        let example = |_| {
            let wall_m = rng.random_range(0.5..3.0_f32);
            let distance_m = rng.random_range(0.2..3.5_f32);
            let view =
                SonarView { share: rng.random_range(0.0..1.0), distance_m, echoes_m: [wall_m; 4] };
            Example { view, is_occupied: wall_m < distance_m }
        };
        (0..n).map(example).collect()
    }

    #[test]
    fn slopes_are_those_of_the_cross_entropy() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let examples = wall(5, &mut rng);
        let network = random(&mut rng);
        let slopes: Vec<f32> = gradient(&network, examples.iter()).weights().collect();
        for (index, slope) in slopes.into_iter().enumerate() {
            let at = |step: f32| {
                let mut moved = network.clone();
                let weight = moved.weights_mut().nth(index).expect("a weight");
                *weight += step;
                cross_entropy(&examples, |view| moved.log_odds(view))
            };
            let expected = (at(0.01) - at(-0.01)) / 0.02;
            assert!((f64::from(slope) - expected).abs() < 2e-3, "{index}: {slope}, {expected}");
        }
    }

    #[test]
    fn learns_what_lies_behind_a_wall() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let examples = wall(4000, &mut rng);
        let network = trained(&examples, &TrainingParams::STANDARD, &mut rng);
        let held_out = wall(1000, &mut rng);
        let constant = cross_entropy(&held_out, |_| network.prior_log_odds);
        let found = cross_entropy(&held_out, |view| network.log_odds(view));
        assert!(found < 0.2 * constant, "{found} nats, by the prior alone {constant}");
    }

    #[test]
    fn nothing_to_learn_from_says_nothing() {
        let network = trained(&[], &TrainingParams::STANDARD, &mut ChaCha8Rng::seed_from_u64(1));
        assert!(network.weights().all(f32::is_finite), "no weight is lost");
        assert_eq!(network.prior_log_odds, 0.0, "as likely as not");
    }
}
