//! How good the map is that a network's answers add up to, on ways that it was not trained on.

use super::network::Network;
use super::way_training::{HeardPlace, WayTrainingParams, sum};

/// Log-odds of 0.7: what is beyond, or below their negative, is decided.
const DECIDED: f32 = 0.8473;

/// What became of places after all that was heard of them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WayExamination {
    /// Places that somebody could see.
    pub n_seen: usize,
    /// Of these, decided ones: said to be occupied with less than 0.3 or more than 0.7.
    pub n_decided: usize,
    /// Of these, rightly decided ones.
    pub n_right: usize,
    /// Decided places that somebody could see and that are occupied.
    pub n_walls: usize,
    /// Of these, rightly decided ones.
    pub n_walls_right: usize,
    /// Places that nobody could see, of which something was heard all the same.
    pub n_hidden: usize,
    /// Of these, decided ones: the fewer, the better.
    pub n_hidden_decided: usize,
}

impl WayExamination {
    /// Of a network on these places.
    pub fn new(network: &Network, places: &[HeardPlace], params: &WayTrainingParams) -> Self {
        let mut found = Self::default();
        for place in places {
            let said = sum(network, &place.views, params);
            let is_decided = DECIDED < said.abs();
            if !place.is_seen() {
                found.n_hidden += 1;
                found.n_hidden_decided += usize::from(is_decided);
                continue;
            }
            let is_right = is_decided && (0.0 < said) == place.is_occupied;
            found.n_seen += 1;
            found.n_decided += usize::from(is_decided);
            found.n_right += usize::from(is_right);
            found.n_walls += usize::from(is_decided && place.is_occupied);
            found.n_walls_right += usize::from(is_right && place.is_occupied);
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::super::ring::SonarView;
    use super::super::way_training::HeardView;
    use super::*;

    #[test]
    fn who_says_nothing_decides_nothing() {
        let view = SonarView { share: 0.5, distance_m: 1.0, echoes_m: [1.0; 4] };
        let place = |is_in_sight, is_occupied| HeardPlace {
            views: vec![HeardView { view, is_in_sight }; 3],
            is_occupied,
        };
        let places = [place(true, true), place(true, false), place(false, false)];
        let found = WayExamination::new(&Network::BLANK, &places, &WayTrainingParams::STANDARD);
        let expected = WayExamination { n_seen: 2, n_hidden: 1, ..WayExamination::default() };
        assert_eq!(found, expected, "two could be seen");
    }
}
