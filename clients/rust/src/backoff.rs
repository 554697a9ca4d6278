//! How long to wait before the next attempt: exponential with full jitter.
//!
//! ```text
//! delay_n = uniform(0, min(delay_max, delay_first * factor^n))
//! ```
//!
//! M. Brooker, "Exponential Backoff and Jitter", AWS Architecture Blog (2015): full jitter spreads
//! a fleet that lost the service at one moment over the whole interval.

use std::time::Duration;

use rand::{Rng, RngExt};

/// Tunables of [`Backoff`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BackoffParams {
    /// The longest first delay.
    pub delay_first: Duration,
    /// Growth from one attempt to the next; at least 1.
    pub factor: f64,
    /// No delay is longer, but for a wish of the service.
    pub delay_max: Duration,
}

impl BackoffParams {
    /// For robots: a service that restarts is found within seconds, and one that is away for hours
    /// sees each robot once in half a minute on average.
    pub const ROBOT: Self = Self {
        delay_first: Duration::from_secs(1),
        factor: 2.0,
        delay_max: Duration::from_mins(1),
    };
}

/// Counts attempts and says how long to wait before each.
#[derive(Clone, Debug)]
pub struct Backoff {
    params: BackoffParams,
    n_failures: u32,
}

impl Backoff {
    /// No failure yet.
    pub fn new(params: BackoffParams) -> Self {
        Self { params, n_failures: 0 }
    }

    /// The delay before the next attempt, never below what the service asked for.
    pub fn next_delay(&mut self, wish: Option<Duration>) -> Duration {
        self.draw(wish, &mut rand::rng())
    }

    fn draw(&mut self, wish: Option<Duration>, rng: &mut impl Rng) -> Duration {
        let limit = self.limit();
        self.n_failures = self.n_failures.saturating_add(1);
        let delay = limit.mul_f64(rng.random_range(0.0..=1.0));
        delay.max(wish.unwrap_or_default())
    }

    /// Something worked: the next failure waits shortly again.
    pub fn reset(&mut self) {
        self.n_failures = 0;
    }

    fn limit(&self) -> Duration {
        let exponent = i32::try_from(self.n_failures).unwrap_or(i32::MAX);
        let seconds = self.params.delay_first.as_secs_f64() * self.params.factor.powi(exponent);
        Duration::from_secs_f64(seconds.min(self.params.delay_max.as_secs_f64()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{SeedableRng, rngs::StdRng};

    #[test]
    fn grows_to_the_limit_and_stays_within_it() {
        let mut rng = StdRng::seed_from_u64(1);
        for _ in 0..100 {
            let mut backoff = Backoff::new(BackoffParams::ROBOT);
            for limit_s in [1, 2, 4, 8, 16, 32, 60, 60] {
                let delay = backoff.draw(None, &mut rng);
                assert!(delay <= Duration::from_secs(limit_s), "{delay:?} of {limit_s} s");
            }
        }
    }

    #[test]
    fn stays_finite_for_ever() {
        let mut backoff = Backoff { params: BackoffParams::ROBOT, n_failures: u32::MAX };
        let delay = backoff.draw(None, &mut StdRng::seed_from_u64(2));
        assert!(delay <= Duration::from_mins(1), "{delay:?}");
    }

    #[test]
    fn the_wish_of_the_service_is_a_lower_limit() {
        let mut backoff = Backoff::new(BackoffParams::ROBOT);
        let wish = Duration::from_secs(90);
        let delay = backoff.draw(Some(wish), &mut StdRng::seed_from_u64(3));
        assert_eq!(delay, wish, "longer than any delay of ours");
        backoff.reset();
        assert_eq!(backoff.limit(), Duration::from_secs(1), "short again");
    }
}
