//! Percentiles of times that were measured.

use std::time::Duration;

/// The smallest value that at least the share `p` of the ascending values does not exceed; zero if
/// there are none.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a place in a list, cut to its length"
)]
pub(super) fn percentile(ascending: &[Duration], p: f64) -> Duration {
    let place = (p * ascending.len() as f64).ceil() as usize;
    let index = place.min(ascending.len()).saturating_sub(1);
    ascending.get(index).copied().unwrap_or_default()
}

/// A time in milliseconds.
pub(super) fn milliseconds(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_values_that_were_measured() {
        let values: Vec<Duration> = (1..=200).map(Duration::from_millis).collect();
        assert_eq!(percentile(&values, 0.5), Duration::from_millis(100), "half");
        assert_eq!(percentile(&values, 0.99), Duration::from_millis(198), "all but two");
        assert_eq!(percentile(&values, 1.0), Duration::from_millis(200), "the longest");
        assert_eq!(percentile(&[], 0.5), Duration::ZERO, "of nothing");
    }
}
