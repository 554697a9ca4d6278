//! How sure a mean is: percentile bootstrap.
//!
//! B. Efron, "Bootstrap methods: another look at the jackknife", Annals of Statistics 7 (1979): the mean
//! of samples drawn from the values with replacement spreads as the mean itself would, were it all
//! measured again. Relations of one log share poses, so that the interval is narrower than it should be:
//! it tells how much hangs on single relations, and nothing of other logs.

use meetpoint_sim::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

/// Samples drawn: two digits of the percentiles.
const N_SAMPLES: usize = 1000;
/// Share of samples beyond either end.
const TAIL: f64 = 0.025;

/// Both ends.
pub(super) type Interval = [f64; 2];

/// The interval that the mean of values lies in with 95 %; zeros of no values. The same seed gives the
/// same bits.
pub(super) fn interval(values: &[f64], seed: u64) -> Interval {
    if values.is_empty() {
        return [0.0; 2];
    }
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut means: Vec<f64> = (0..N_SAMPLES)
        .map(|_| {
            let drawn = (0..values.len()).map(|_| values[rng.random_range(0..values.len())]);
            drawn.sum::<f64>() / values.len() as f64
        })
        .collect();
    means.sort_by(f64::total_cmp);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 1000")]
    let n_tail = (TAIL * N_SAMPLES as f64) as usize;
    [means[n_tail], means[N_SAMPLES - 1 - n_tail]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holds_the_mean_and_narrows_with_the_root_of_the_number() {
        let values = |n: u32| (0..n).map(|index| f64::from(index % 10)).collect::<Vec<f64>>();
        let [low, high] = interval(&values(100), 7);
        assert!(low < 4.5 && 4.5 < high, "{low} {high}");
        // Standard deviation 2.87, of the mean of 100 of them 0.287.
        assert!((high - low - 2.0 * 1.96 * 0.287).abs() < 0.15, "{low} {high}");
        let [nearer_low, nearer_high] = interval(&values(10_000), 7);
        assert!(nearer_high - nearer_low < 0.2 * (high - low), "a tenth");
        assert_eq!(
            interval(&values(100), 7).map(f64::to_bits),
            [low, high].map(f64::to_bits),
            "same"
        );
        assert_eq!(interval(&[], 7).map(f64::to_bits), [0; 2], "of nothing");
    }
}
