//! How much likelier one place is than another.
//!
//! ```text
//! margin = sum over walls that both places let speak of (l - l')
//!        + UNSEEN (sum over walls that only the one lets speak of l
//!                - sum over walls that only the other does of l')
//! ```
//!
//! as the mean over the walls of both maps. That a wall lies where the other map has not seen is no
//! evidence against a place: in a row of offices alike, places differ most by how many of them lie on one
//! another, and the truth need not be where most do. So what only one place lets speak counts little.

use crate::evidence::{Evidence, Testimony};

/// Share that a wall counts which only one of two places lets speak: what is explained nowhere else is
/// some evidence, because most of a building is unlike the rest.
const UNSEEN: f64 = 0.2;

/// Logarithm of the odds of one place against another, by all walls and landmarks.
pub(crate) fn margin(place: &Evidence, rival: &Evidence) -> f64 {
    let by_walls = 0.5 * (lead(&place.newcomer, &rival.newcomer) + lead(&place.site, &rival.site));
    by_walls + named_margin(place, rival) + nameless_margin(place, rival)
}

/// The share of it that names say.
pub(crate) fn named_margin(place: &Evidence, rival: &Evidence) -> f64 {
    place.named.log_odds - rival.named.log_odds
}

/// The share of it that landmarks without names say: which of two places alike it is.
pub(crate) fn nameless_margin(place: &Evidence, rival: &Evidence) -> f64 {
    place.nameless.log_odds - rival.nameless.log_odds
}

fn lead(place: &Testimony, rival: &Testimony) -> f64 {
    let said = place.log_odds.iter().zip(&rival.log_odds);
    said.map(|(&a, &b)| match (a.is_nan(), b.is_nan()) {
        (false, false) => f64::from(a) - f64::from(b),
        (false, true) => UNSEEN * f64::from(a),
        (true, false) => -UNSEEN * f64::from(b),
        (true, true) => 0.0,
    })
    .sum()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// What a wall says, or that it says nothing.
    fn said() -> impl Strategy<Value = f32> {
        prop_oneof![3 => -1.0_f32..1.0, 1 => Just(f32::NAN)]
    }

    fn testimony(log_odds: Vec<f32>) -> Testimony {
        Testimony { n_known: 0, agreeing: 0.0, n_contradicting: 0, log_odds }
    }

    proptest! {
        /// Odds of one place against another are those of the other against the one, turned round; and
        /// where both let all walls speak, the difference of their log odds.
        #[test]
        fn margins_turn_round(pairs in prop::collection::vec((said(), said()), 0..40)) {
            let (a, b): (Vec<f32>, Vec<f32>) = pairs.into_iter().unzip();
            let both_speak = a.iter().chain(&b).all(|said| !said.is_nan());
            let (a, b) = (testimony(a), testimony(b));
            prop_assert!((lead(&a, &b) + lead(&b, &a)).abs() < 1e-9);
            if both_speak {
                prop_assert!((lead(&a, &b) - (a.sum() - b.sum())).abs() < 1e-9);
            }
        }
    }
}
