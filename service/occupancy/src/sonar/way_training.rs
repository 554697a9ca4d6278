//! Training of the network by the map that its answers add up to.
//!
//! Eq. (1) takes readings to be independent given the place. Those of a robot that drives by are not: what one of
//! them gets wrong of a place before a wall, the next gets wrong as well, and their sum is sure of it. So what is
//! minimised here is the cross-entropy of the sum, over places and all that was heard of them on a way,
//!
//! ```text
//! l = sum over readings t of e(view_t)     each step bounded as the map's cells are
//! E = - mean of w ( t log p + (1 - t) log (1 - p) )     p = 1 / (1 + e^-l)
//! ```
//!
//! by back-propagation through the sum: the slope of E by every `e(view_t)` since the sum was last at its bound
//! is `w (p - t)`. Readings that say little alone are then as weak as they have to be together. S. Thrun, "Learning
//! metric-topological maps for indoor mobile robot navigation", Artificial Intelligence 99 (1998), sections 2.1
//! and 2.2, trains on single readings. Time O(epochs * readings * weights).

use rand::seq::SliceRandom;
use rand::{Rng, RngExt};

use super::interpretation::SonarModel;
use super::network::{Activation, Network, inputs};
use super::ring::SonarView;
use super::training::{Adam, TrainingParams, add_slopes};
use crate::beam::BeamModel;

/// What one firing heard of a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeardView {
    /// What was heard.
    pub view: SonarView,
    /// Whether nothing stands between robot and place.
    pub is_in_sight: bool,
}

/// A place of which is known whether it is occupied, and all that was heard of it on a way.
#[derive(Clone, Debug, PartialEq)]
pub struct HeardPlace {
    /// What was heard, in order of time.
    pub views: Vec<HeardView>,
    /// Whether it is occupied.
    pub is_occupied: bool,
}

impl HeardPlace {
    /// Whether somebody could see it.
    pub(super) fn is_seen(&self) -> bool {
        self.views.iter().any(|heard| heard.is_in_sight)
    }
}

/// How sums are made and judged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WayTrainingParams {
    /// Epochs, lots and steps.
    pub training: TrainingParams,
    /// What of a reading reaches the map.
    pub model: SonarModel,
    /// No sum leaves ±this, as log-odds: the map's bound.
    pub log_odds_bound: f32,
    /// A place of which nothing is heard is taken to be occupied with this probability: occupied places count
    /// for so much more than free ones, which are many times as many.
    pub prior: f32,
    /// What places that nobody could see count for, beside 1 for free ones that somebody could.
    pub hidden_weight: f32,
}

impl WayTrainingParams {
    /// Free places are many times as many as occupied ones: with a prior of 0.2 more of them are found free and
    /// fewer walls are found.
    pub const STANDARD: Self = Self {
        training: TrainingParams { n_epochs: 12, n_lot: 32, rate: 0.005 },
        model: SonarModel::BY_WAYS,
        log_odds_bound: BeamModel::INDOOR.log_odds_bound,
        prior: 0.4,
        hidden_weight: 0.5,
    };
}

/// A network whose answers add up to a better map: that one, trained on.
pub fn trained_on_ways(
    network: &Network,
    places: &[HeardPlace],
    params: &WayTrainingParams,
    rng: &mut impl Rng,
) -> Network {
    let mut network = network.clone();
    let TrainingParams { n_epochs, n_lot, .. } = params.training;
    let n_lot = n_lot.max(1);
    let weights = weights(places, params);
    let mut order: Vec<usize> = (0..places.len()).collect();
    let mut adam = Adam::new(&params.training, places.len().div_ceil(n_lot) * n_epochs as usize);
    let mut scratch = Vec::new();
    for _ in 0..n_epochs {
        order.shuffle(rng);
        for lot in order.chunks(n_lot) {
            let mut slopes = Network::BLANK;
            for &index in lot {
                let place = &places[index];
                let heard = (part(&place.views, rng), place.is_occupied);
                let weights = weights.map(|weight| weight / lot.len() as f32);
                add_way(&network, heard, (weights, params), &mut scratch, &mut slopes);
            }
            adam.step(&mut network, &slopes);
        }
    }
    network
}

/// All that was heard half of the time; else a part of the way, of one reading as often as of two to three,
/// of four to seven, and so on: a map has to be right long before the end.
fn part<'a>(views: &'a [HeardView], rng: &mut impl Rng) -> &'a [HeardView] {
    let n = views.len();
    if n < 2 || rng.random() {
        return views;
    }
    let n_doublings = rng.random_range(0..=n.ilog2());
    let least = 1_usize << n_doublings;
    let length = rng.random_range(least..(2 * least).min(n + 1));
    let first = rng.random_range(0..=n - length);
    &views[first..first + length]
}

/// What free, occupied and hidden places count for.
fn weights(places: &[HeardPlace], params: &WayTrainingParams) -> [f32; 3] {
    let n_seen = places.iter().filter(|place| place.is_seen()).count();
    let is_wall = |place: &&HeardPlace| place.is_occupied && place.is_seen();
    let n_occupied = places.iter().filter(is_wall).count();
    let share = (n_occupied + 1) as f32 / (n_seen + 2) as f32;
    let odds = params.prior / (1.0 - params.prior) * (1.0 - share) / share;
    [1.0, odds, params.hidden_weight]
}

/// What the map says of a place after all that was heard of it, as log-odds.
pub(super) fn sum(network: &Network, views: &[HeardView], params: &WayTrainingParams) -> f32 {
    let said = views.iter().map(|heard| params.model.heeded(network.evidence(&heard.view)));
    let bound = params.log_odds_bound;
    said.fold(0.0, |log_odds, said| (log_odds + said).clamp(-bound, bound))
}

/// Adds the slopes of one place's cross-entropy, of which a free, an occupied and a hidden one weigh so much.
fn add_way(
    network: &Network,
    (views, is_occupied): (&[HeardView], bool),
    (weights, params): ([f32; 3], &WayTrainingParams),
    scratch: &mut Vec<Activation>,
    slopes: &mut Network,
) {
    scratch.clear();
    scratch.extend(views.iter().map(|heard| network.activation(inputs(&heard.view))));
    let (bound, most) = (params.log_odds_bound, params.model.evidence_max);
    let mut log_odds = 0.0_f32;
    let mut first = 0;
    for (index, activation) in scratch.iter().enumerate() {
        log_odds += params.model.heeded(activation.log_odds - network.prior_log_odds);
        if bound < log_odds.abs() {
            log_odds = log_odds.clamp(-bound, bound);
            first = index + 1;
        }
    }
    let probability = 1.0 / (1.0 + (-log_odds).exp());
    let [free, occupied, hidden] = weights;
    let (target, weight) = match (views.iter().any(|heard| heard.is_in_sight), is_occupied) {
        (false, _) => (0.5, hidden),
        (true, true) => (1.0, occupied),
        (true, false) => (0.0, free),
    };
    let slope = weight * (probability - target);
    for activation in &scratch[first..] {
        let said = activation.log_odds - network.prior_log_odds;
        // A reading at its own limit only goes back.
        if said.abs() <= most || 0.0 < slope * said {
            add_slopes(network, activation, slope, slopes);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::training::{Example, trained};
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    /// Places before a wall at 2 m that every reading hears 0.3 m too near, all of one way alike.
    fn places(n: usize, rng: &mut ChaCha8Rng) -> Vec<HeardPlace> {
        let place = |_| {
            let distance_m = rng.random_range(1.0..2.2_f32);
            let heard_m = 2.0 - rng.random_range(0.0..0.3_f32);
            let view = SonarView { share: 0.5, distance_m, echoes_m: [heard_m; 4] };
            let n_views = rng.random_range(1..60);
            let views = vec![HeardView { view, is_in_sight: true }; n_views];
            HeardPlace { views, is_occupied: 2.0 < distance_m }
        };
        (0..n).map(place).collect()
    }

    fn off(network: &Network, places: &[HeardPlace]) -> f32 {
        let params = &WayTrainingParams::STANDARD;
        let off = places.iter().map(|place| {
            let said = sum(network, &place.views, params);
            let against = if place.is_occupied { -said } else { said };
            against.exp().ln_1p()
        });
        off.sum::<f32>() / places.len() as f32
    }

    #[test]
    fn what_repeats_itself_is_believed_less() {
        let mut rng = ChaCha8Rng::seed_from_u64(9);
        let shown = places(3000, &mut rng);
        let singly: Vec<Example> = shown
            .iter()
            .map(|place| Example { view: place.views[0].view, is_occupied: place.is_occupied })
            .collect();
        let before = trained(&singly, &TrainingParams::STANDARD, &mut rng);
        let after = trained_on_ways(&before, &shown, &WayTrainingParams::STANDARD, &mut rng);
        let held_out = places(1000, &mut rng);
        let (before, after) = (off(&before, &held_out), off(&after, &held_out));
        assert!(after < 0.7 * before, "{after} nats of sums, {before} before");
    }

    #[test]
    fn nothing_heard_changes_nothing() {
        let network = Network::shipped();
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let again = trained_on_ways(&network, &[], &WayTrainingParams::STANDARD, &mut rng);
        assert_eq!(again, network, "no place, no step");
    }
}
