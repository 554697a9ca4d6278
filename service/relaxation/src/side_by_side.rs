//! The same work for every one of several numbers, shared among threads. What comes back does not
//! depend on how many there are: every number is worked on alone, and results stand in order.

use std::num::NonZero;

/// Below this many units of work a thread costs more than it brings: starting one takes some
/// 20 microseconds, a unit (a multiplication and an addition) about half a nanosecond.
const N_UNITS_ALONE: usize = 60_000;

/// `work(0), work(1) ... work(n - 1)` on at most `n_threads` threads. `n_units` is about how many
/// steps all of it takes.
pub(crate) fn side_by_side<T: Send>(
    n: u32,
    n_threads: NonZero<usize>,
    n_units: usize,
    work: impl Fn(u32) -> T + Sync,
) -> Vec<T> {
    let n_threads = u32::try_from(n_threads.get()).unwrap_or(u32::MAX).min(n);
    if n_threads <= 1 || n_units < N_UNITS_ALONE {
        return (0..n).map(work).collect();
    }
    // Neighbours cost alike, so threads take turns.
    let share = |first: u32| (first..n).step_by(n_threads as usize).map(&work).collect::<Vec<T>>();
    let mut shares = std::thread::scope(|scope| {
        let share = &share;
        let others: Vec<_> =
            (1..n_threads).map(|first| scope.spawn(move || share(first))).collect();
        let mut shares = vec![share(0).into_iter()];
        for other in others {
            match other.join() {
                Ok(results) => shares.push(results.into_iter()),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        }
        shares
    });
    let n_shares = shares.len();
    (0..n as usize).filter_map(|i| shares[i % n_shares].next()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_is_kept() {
        for n_threads in 1..5 {
            let n_threads = NonZero::new(n_threads).expect("not zero");
            let results = side_by_side(11, n_threads, usize::MAX, |i| i * i);
            let expected: Vec<u32> = (0..11).map(|i| i * i).collect();
            assert_eq!(results, expected, "{n_threads} threads");
        }
    }
}
