//! What cells cost beyond their length: clearance, occupancy, zones.
//!
//! ```text
//! weight(c) = 16 · near(c) · doubt(c) · zone(c), rounded, at most 255
//! near(c)   = 1 + (f_n - 1) max(0, 1 - clearance(c) / d)     dearer near obstacles
//! doubt(c)  = 1 + (f_d - 1) min(1, p(c) / 0.5)               dearer where "occupied" is likelier
//! zone(c)   = largest factor of the zones that hold c's centre, 1 outside
//! ```
//!
//! S. Thrun, Artificial Intelligence 99 (1998), section 2.5, has a cell cost its probability of
//! "occupied" alone; here that is added to the length, so that paths through free space stay
//! shortest. Time O(cells).

use crate::cost::WEIGHT_ONE;

/// How much dearer cells are than their length, by what is known of each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WeightParams {
    /// A cell whose centre is nearer to an obstacle is dearer, in metres (d); 0 for none.
    pub clearance_distance_m: f64,
    /// Times as dear right beside an obstacle, at least 1 (`f_n`).
    pub clearance_factor: f64,
    /// Times as dear at even odds of "occupied", at least 1 (`f_d`).
    pub occupancy_factor: f64,
}

impl WeightParams {
    /// Cells cost their length.
    pub const LENGTH_ONLY: Self =
        Self { clearance_distance_m: 0.0, clearance_factor: 1.0, occupancy_factor: 1.0 };

    /// Whether all cells cost their length, zones apart.
    pub fn is_length_only(&self) -> bool {
        let is_near_free = self.clearance_distance_m <= 0.0 || self.clearance_factor <= 1.0;
        is_near_free && self.occupancy_factor <= 1.0
    }

    /// Weight of a cell of that clearance in metres, probability of "occupied" and zone factor, in
    /// parts of [`WEIGHT_ONE`]. What is no number counts as 0, and a zone as 1.
    pub fn weight(&self, clearance_m: f64, probability: f64, zone_factor: f64) -> u8 {
        let near = match self.clearance_distance_m {
            distance_m if 0.0 < distance_m => (1.0 - clearance_m.max(0.0) / distance_m).max(0.0),
            _ => 0.0,
        };
        let doubt = (probability.max(0.0) / PROBABILITY_EVEN).min(1.0);
        let factor = share(self.clearance_factor, near)
            * share(self.occupancy_factor, doubt)
            * zone_factor.max(1.0);
        rounded(factor)
    }
}

/// Even odds: cells of more are not free.
const PROBABILITY_EVEN: f64 = 0.5;

/// 1 for a share of 0, `factor` for a share of 1.
fn share(factor: f64, share: f64) -> f64 {
    1.0 + (factor.max(1.0) - 1.0) * share
}

/// A factor in parts of [`WEIGHT_ONE`].
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to a byte")]
fn rounded(factor: f64) -> u8 {
    (factor * f64::from(WEIGHT_ONE)).round().clamp(f64::from(WEIGHT_ONE), 255.0) as u8
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const CAREFUL: WeightParams =
        WeightParams { clearance_distance_m: 1.0, clearance_factor: 4.0, occupancy_factor: 2.0 };

    #[test]
    fn as_the_formula_says() {
        assert_eq!(CAREFUL.weight(2.0, 0.0, 1.0), 16, "far from everything");
        assert_eq!(CAREFUL.weight(0.0, 0.0, 1.0), 64, "beside an obstacle");
        assert_eq!(CAREFUL.weight(0.5, 0.0, 1.0), 40, "half-way");
        assert_eq!(CAREFUL.weight(2.0, 0.5, 1.0), 32, "as likely occupied as free");
        assert_eq!(CAREFUL.weight(2.0, 0.25, 3.0), 72, "in a zone too");
        assert_eq!(CAREFUL.weight(0.0, 0.5, 8.0), 255, "no more than a byte");
        assert_eq!(CAREFUL.weight(f64::NAN, f64::NAN, f64::NAN), 64, "no numbers");
        assert_eq!(WeightParams::LENGTH_ONLY.weight(0.0, 0.5, 1.0), WEIGHT_ONE, "its length");
        assert!(WeightParams::LENGTH_ONLY.is_length_only(), "and no more");
        assert!(!CAREFUL.is_length_only(), "dearer near obstacles");
    }

    proptest! {
        #[test]
        fn never_cheaper_than_length_and_dearer_towards_trouble(
            distance in 0.0..5.0, near in 0.0..9.0, doubt in 0.0..9.0, zone in 0.0..9.0,
            clearance in 0.0..6.0, p in 0.0..1.0, more in 0.0..3.0,
        ) {
            let params = WeightParams {
                clearance_distance_m: distance,
                clearance_factor: near,
                occupancy_factor: doubt,
            };
            let weight = params.weight(clearance, p, zone);
            prop_assert!(WEIGHT_ONE <= weight, "{weight}");
            prop_assert!(params.weight(clearance + more, p, zone) <= weight, "farther off");
            prop_assert!(weight <= params.weight(clearance, p + more, zone), "likelier occupied");
            prop_assert!(weight <= params.weight(clearance, p, zone + more), "a dearer zone");
        }
    }
}
