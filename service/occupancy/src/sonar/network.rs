//! The network that reads four neighbouring sonars together.
//!
//! ```text
//! a = tanh(A x + a0)    b = tanh(B a + b0)    Prob(occupied | scan) = 1 / (1 + e^-(c·b + c0))
//! ```
//!
//! S. Thrun, "Learning metric-topological maps for indoor mobile robot navigation", Artificial
//! Intelligence 99 (1998), section 2.1 and Fig. 2; x are the place's angle and distance and the four
//! echoes. The paper prints no sizes. The network is trained on places of which a certain share is
//! occupied; the evidence of a scan is its log-odds without those of that share, so that a place of
//! which nothing is heard says nothing.

use super::ring::SonarView;

/// Numbers that a place is described by.
pub(super) const N_INPUTS: usize = 6;
/// Units of the first hidden layer: twice as many in both lower the cross-entropy of held-out places by
/// about a percent (`meetpoint train`).
pub(super) const N_FIRST: usize = 16;
/// Units of the second.
pub(super) const N_SECOND: usize = 8;
/// Places are taken to be no farther than this, in metres.
const DISTANCE_MAX_M: f32 = 5.0;
/// Length that distances are measured in, in metres: they lie within ±1.5 then.
const LENGTH_M: f32 = 2.0;
/// Length that an echo's distance from the place is measured in, in metres: a wall's thickness and what
/// the cone blurs it by.
const BEYOND_M: f32 = 0.3;
/// Echoes farther from the place than so many of these are all alike.
const BEYOND_MAX: f32 = 3.0;

/// First line of written weights.
const HEADING: &str = "meetpoint sonar network 1";

/// Weights of a trained network.
#[derive(Clone, Debug, PartialEq)]
pub struct Network {
    /// Unit by unit, input by input: `first[input][unit]`.
    pub(super) first: [[f32; N_FIRST]; N_INPUTS],
    pub(super) first_bias: [f32; N_FIRST],
    pub(super) second: [[f32; N_SECOND]; N_FIRST],
    pub(super) second_bias: [f32; N_SECOND],
    pub(super) output: [f32; N_SECOND],
    pub(super) output_bias: f32,
    /// Log-odds of the share of places that were occupied where it was trained.
    pub(super) prior_log_odds: f32,
}

/// What the units say of a place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Activation {
    pub(super) inputs: [f32; N_INPUTS],
    pub(super) first: [f32; N_FIRST],
    pub(super) second: [f32; N_SECOND],
    pub(super) log_odds: f32,
}

/// Why a text is not a network.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum InvalidNetwork {
    /// The first line names no known format.
    #[error("a network begins with the line `{HEADING}`")]
    Heading,
    /// A number is missing, surplus, or none.
    #[error("{0} finite numbers; needed are {needed}", needed = Network::N_WEIGHTS + 1)]
    Count(usize),
}

impl Network {
    /// Weights of all layers together.
    pub const N_WEIGHTS: usize =
        N_INPUTS * N_FIRST + N_FIRST + N_FIRST * N_SECOND + N_SECOND + N_SECOND + 1;

    /// A network whose weights are all 0: it says of every place that it is as likely occupied as not.
    pub const BLANK: Self = Self {
        first: [[0.0; N_FIRST]; N_INPUTS],
        first_bias: [0.0; N_FIRST],
        second: [[0.0; N_SECOND]; N_FIRST],
        second_bias: [0.0; N_SECOND],
        output: [0.0; N_SECOND],
        output_bias: 0.0,
        prior_log_odds: 0.0,
    };

    /// The network that comes with the service: trained on simulated rings of 16 and 24 sonars.
    ///
    /// # Panics
    /// Never: its weights are part of the crate and tested.
    pub fn shipped() -> Self {
        Self::from_text(include_str!("../../weights/sonar.txt"))
            .expect("the crate's own weights are valid")
    }

    /// Weights trained on ways besides, which draw a better map from true poses, heeded by `SonarModel::BY_WAYS`.
    /// `meetpoint train --way-places 80000` makes such weights, though not these to the bit: when they were trained
    /// readings that are too close counted as half of the least range, which `SonarRing` takes for the least range.
    ///
    /// # Panics
    /// Never: its weights are part of the crate and tested.
    pub fn by_ways() -> Self {
        Self::from_text(include_str!("../../weights/sonar_ways.txt"))
            .expect("the crate's own weights are valid")
    }

    /// Log-odds of a place's being occupied, given what is heard of it and the share of occupied places
    /// where the network was trained.
    pub fn log_odds(&self, view: &SonarView) -> f32 {
        self.activation(inputs(view)).log_odds
    }

    /// What a scan adds to the log-odds of a place: 0 if it says nothing of it.
    pub fn evidence(&self, view: &SonarView) -> f32 {
        self.log_odds(view) - self.prior_log_odds
    }

    /// Log-odds of the share of places that were occupied where the network was trained.
    pub fn prior_log_odds(&self) -> f32 {
        self.prior_log_odds
    }

    pub(super) fn activation(&self, inputs: [f32; N_INPUTS]) -> Activation {
        let mut first = self.first_bias;
        for (weights, input) in self.first.iter().zip(inputs) {
            for (sum, weight) in first.iter_mut().zip(weights) {
                *sum += weight * input;
            }
        }
        let first = first.map(tanh);
        let mut second = self.second_bias;
        for (weights, input) in self.second.iter().zip(first) {
            for (sum, weight) in second.iter_mut().zip(weights) {
                *sum += weight * input;
            }
        }
        let second = second.map(tanh);
        let pairs = self.output.iter().zip(second);
        let log_odds = pairs.fold(self.output_bias, |sum, (weight, input)| sum + weight * input);
        Activation { inputs, first, second, log_odds }
    }

    /// The weights as text, a line a number, that [`Network::from_text`] reads bit for bit.
    pub fn to_text(&self) -> String {
        let weights = self.weights().chain([self.prior_log_odds]);
        let lines = weights.map(|weight| weight.to_string());
        std::iter::once(HEADING.to_owned()).chain(lines).collect::<Vec<_>>().join("\n") + "\n"
    }

    /// The network of a text.
    ///
    /// # Errors
    /// [`InvalidNetwork`] if it is not what [`Network::to_text`] writes.
    pub fn from_text(text: &str) -> Result<Self, InvalidNetwork> {
        let mut lines = text.lines();
        if lines.next() != Some(HEADING) {
            return Err(InvalidNetwork::Heading);
        }
        let numbers: Vec<f32> = lines
            .map_while(|line| line.trim().parse::<f32>().ok().filter(|number| number.is_finite()))
            .collect();
        let n_lines = text.lines().count() - 1;
        if numbers.len() != n_lines || n_lines != Self::N_WEIGHTS + 1 {
            return Err(InvalidNetwork::Count(numbers.len()));
        }
        let mut network = Self::BLANK;
        for (weight, number) in network.weights_mut().zip(&numbers) {
            *weight = *number;
        }
        network.prior_log_odds = numbers[Self::N_WEIGHTS];
        Ok(network)
    }

    /// All weights, layer by layer.
    pub(super) fn weights(&self) -> impl Iterator<Item = f32> + '_ {
        let Self { first, first_bias, second, second_bias, output, output_bias, .. } = self;
        let layers = first.as_flattened().iter().chain(first_bias).chain(second.as_flattened());
        layers.chain(second_bias).chain(output).chain([output_bias]).copied()
    }

    /// The same to be changed, in the same order.
    pub(super) fn weights_mut(&mut self) -> impl Iterator<Item = &mut f32> {
        let Self { first, first_bias, second, second_bias, output, output_bias, .. } = self;
        let layers = first.as_flattened_mut().iter_mut().chain(first_bias);
        let layers = layers.chain(second.as_flattened_mut()).chain(second_bias);
        layers.chain(output).chain([output_bias])
    }
}

/// A place in the network's numbers: its angle, its distance, and how much farther than it the echoes come
/// from. The paper gives the echoes as they are; seen from the place, the same weights serve all
/// distances.
pub(super) fn inputs(view: &SonarView) -> [f32; N_INPUTS] {
    let beyond =
        |echo_m: f32| ((echo_m - view.distance_m) / BEYOND_M).clamp(-BEYOND_MAX, BEYOND_MAX);
    let [first, second, third, fourth] = view.echoes_m.map(beyond);
    let distance = view.distance_m.clamp(0.0, DISTANCE_MAX_M) / LENGTH_M - 1.0;
    [2.0 * view.share - 1.0, distance, first, second, third, fourth]
}

/// The hyperbolic tangent to within 3e-4, the same on every machine: only sums, products and a
/// quotient. J. Lambert's continued fraction, cut off after the seventh term.
pub(super) fn tanh(x: f32) -> f32 {
    let x = x.clamp(-4.97, 4.97);
    let x2 = x * x;
    let above = x * (135_135.0 + x2 * (17_325.0 + x2 * (378.0 + x2)));
    let below = 135_135.0 + x2 * (62_370.0 + x2 * (3_150.0 + x2 * 28.0));
    (above / below).clamp(-1.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tanh_is_near_its_definition() {
        for step in -1000_i16..=1000 {
            let x = f32::from(step) * 0.01;
            assert!((tanh(x) - x.tanh()).abs() < 3e-4, "tanh({x})");
        }
    }

    #[test]
    fn texts_keep_every_bit() {
        let mut network = Network::BLANK;
        let mut number = 0.1_f32;
        for weight in network.weights_mut() {
            number = (number * 1.7 + 0.3) % 3.0 - 1.5;
            *weight = number / 3.0;
        }
        network.prior_log_odds = -1.2;
        assert_eq!(network.weights().count(), Network::N_WEIGHTS, "all of them");
        assert_eq!(Network::from_text(&network.to_text()), Ok(network), "there and back");
    }

    #[test]
    fn the_weights_of_the_crate_are_valid() {
        assert_ne!(Network::shipped(), Network::by_ways(), "trained differently");
    }

    #[test]
    fn says_what_is_no_network() {
        assert_eq!(Network::from_text("hello\n1"), Err(InvalidNetwork::Heading), "no heading");
        let short = format!("{HEADING}\n1\n2\n");
        assert_eq!(Network::from_text(&short), Err(InvalidNetwork::Count(2)), "too few");
        let none = Network::BLANK.to_text().replacen("0\n", "nan\n", 1);
        assert!(Network::from_text(&none).is_err(), "no number");
    }
}
