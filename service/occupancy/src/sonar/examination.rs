//! How good a network is on places that it has not seen, beside two that need no training.
//!
//! ```text
//! cross-entropy        mean of -(t log p + (1 - t) log (1 - p)), in nats
//! wrong                share of places that are said to be on the other side of one half
//! calibration error    mean over places of |mean p of its tenth - share occupied of its tenth|
//! ```
//!
//! The calibration error is that of M. P. Naeini, G. F. Cooper and M. Hauskrecht, "Obtaining well
//! calibrated probabilities using Bayesian binning", AAAI (2015), with ten bins. Time O(places * weights).

use super::network::Network;
use super::training::{Example, cross_entropy};

/// Bins of probabilities, each a tenth wide.
const N_TENTHS: usize = 10;

/// A place to be judged, and what the inverse cone model says of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldOut {
    /// What was heard of it, and what is there.
    pub example: Example,
    /// Evidence of the inverse cone model, in log-odds.
    pub by_cone: f32,
}

/// How good a model is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Accuracy {
    /// Mean cross-entropy, in nats.
    pub cross_entropy_nats: f64,
    /// Share of places said to be on the other side of one half, in 0..=1.
    pub wrong_share: f64,
}

/// Places of which a network says that they are occupied with a probability of one tenth of 0..=1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tenth {
    /// How many there are.
    pub n_places: usize,
    /// How many of these are occupied.
    pub n_occupied: usize,
    /// Mean of the probabilities said; 0 if there is none.
    pub said_mean: f64,
}

/// What held-out places say of a network.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Examination {
    /// Places judged.
    pub n_places: usize,
    /// Share of them that is occupied, in 0..=1.
    pub occupied_share: f64,
    /// Says of every place what share was occupied where the network was trained.
    pub constant: Accuracy,
    /// The inverse cone model, on the same prior.
    pub inverse_cone: Accuracy,
    /// The network.
    pub network: Accuracy,
    /// By the probability that the network says: from 0.0, from 0.1, ... from 0.9 on.
    pub calibration: [Tenth; N_TENTHS],
}

impl Examination {
    /// Of a network on these places.
    pub fn new(network: &Network, places: &[HeldOut]) -> Self {
        let prior = network.prior_log_odds();
        let n_occupied = places.iter().filter(|place| place.example.is_occupied).count();
        let by_network = |place: &HeldOut| network.log_odds(&place.example.view);
        Self {
            n_places: places.len(),
            occupied_share: share(n_occupied, places.len()),
            constant: accuracy(places, |_| prior),
            inverse_cone: accuracy(places, |place| prior + place.by_cone),
            network: accuracy(places, by_network),
            calibration: calibration(places, by_network),
        }
    }

    /// How far what the network says is from how often it is so, in 0..=1, over all places.
    pub fn calibration_error(&self) -> f64 {
        let off = |tenth: &Tenth| {
            let occupied_share = share(tenth.n_occupied, tenth.n_places);
            share(tenth.n_places, self.n_places) * (tenth.said_mean - occupied_share).abs()
        };
        self.calibration.iter().map(off).sum()
    }
}

fn share(n: usize, of: usize) -> f64 {
    n as f64 / of.max(1) as f64
}

fn accuracy(places: &[HeldOut], log_odds: impl Fn(&HeldOut) -> f32) -> Accuracy {
    let (mut sum_nats, mut n_wrong) = (0.0, 0);
    for place in places {
        let said = log_odds(place);
        sum_nats += cross_entropy(std::slice::from_ref(&place.example), |_| said);
        n_wrong += usize::from((0.0 < said) != place.example.is_occupied);
    }
    Accuracy {
        cross_entropy_nats: sum_nats / places.len().max(1) as f64,
        wrong_share: share(n_wrong, places.len()),
    }
}

fn calibration(places: &[HeldOut], log_odds: impl Fn(&HeldOut) -> f32) -> [Tenth; N_TENTHS] {
    let mut tenths = [Tenth::default(); N_TENTHS];
    for place in places {
        let said = 1.0 / (1.0 + f64::from(-log_odds(place)).exp());
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a probability times ten"
        )]
        let index = ((said * N_TENTHS as f64) as usize).min(N_TENTHS - 1);
        let tenth = &mut tenths[index];
        tenth.n_places += 1;
        tenth.n_occupied += usize::from(place.example.is_occupied);
        tenth.said_mean += said;
    }
    for tenth in &mut tenths {
        tenth.said_mean /= tenth.n_places.max(1) as f64;
    }
    tenths
}

#[cfg(test)]
mod tests {
    use super::super::ring::SonarView;
    use super::*;

    fn place(is_occupied: bool, by_cone: f32) -> HeldOut {
        let view = SonarView { share: 0.5, distance_m: 1.0, echoes_m: [1.0; 4] };
        HeldOut { example: Example { view, is_occupied }, by_cone }
    }

    #[test]
    fn a_network_that_knows_nothing_is_the_constant() {
        let places = [place(true, 3.0), place(false, -3.0), place(false, -3.0), place(false, 3.0)];
        let found = Examination::new(&Network::BLANK, &places);
        assert_eq!((found.n_places, found.occupied_share), (4, 0.25), "one of four");
        assert_eq!(found.network, found.constant, "as likely as not");
        assert!((found.network.cross_entropy_nats - 2.0_f64.ln()).abs() < 1e-9, "one bit");
        assert_eq!(found.inverse_cone.wrong_share, 0.25, "the last");
        let right = (1.0 + (-3.0_f64).exp()).ln();
        let expected = (3.0 * right + 3.0 + right) / 4.0;
        let nats = found.inverse_cone.cross_entropy_nats;
        assert!((nats - expected).abs() < 1e-6, "{nats} nats, expected {expected}");
    }

    #[test]
    fn tenths_hold_what_is_said() {
        let places = [place(true, 0.0), place(false, 0.0), place(false, 0.0)];
        let found = Examination::new(&Network::BLANK, &places);
        let half = Tenth { n_places: 3, n_occupied: 1, said_mean: 0.5 };
        assert_eq!(found.calibration[5], half, "from 0.5 on");
        assert_eq!(found.calibration[4], Tenth::default(), "nothing below");
        assert!((found.calibration_error() - (0.5 - 1.0 / 3.0)).abs() < 1e-9, "off by a sixth");
        let none = Examination::new(&Network::BLANK, &[]);
        assert_eq!((none.n_places, none.calibration_error()), (0, 0.0), "nothing to judge by");
    }
}
