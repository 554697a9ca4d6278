//! The same work for every one of several items, shared among threads. What comes back does not depend
//! on how many there are: every item is worked on alone, and results stand in the order of the items.

use std::num::NonZero;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

/// The work done on each item, on at most `n_threads` threads, each of which takes the next item when it
/// is done with one. Starting a thread takes some 20 microseconds: items are worth it together.
pub fn side_by_side<I: Send, T: Send>(
    items: impl IntoIterator<Item = I>,
    n_threads: NonZero<usize>,
    work: impl Fn(I) -> T + Sync,
) -> Vec<T> {
    let items: Vec<I> = items.into_iter().collect();
    let n_threads = n_threads.get().min(items.len());
    if n_threads <= 1 {
        return items.into_iter().map(work).collect();
    }
    let queue = Mutex::new(items.into_iter().enumerate());
    let next = || queue.lock().unwrap_or_else(PoisonError::into_inner).next();
    let share = || {
        let mut done = Vec::new();
        while let Some((index, item)) = next() {
            done.push((index, work(item)));
        }
        done
    };
    let mut done = std::thread::scope(|scope| {
        let others: Vec<_> = (1..n_threads).map(|_| scope.spawn(share)).collect();
        let mut done = share();
        for other in others {
            match other.join() {
                Ok(results) => done.extend(results),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        }
        done
    });
    done.sort_unstable_by_key(|&(index, _)| index);
    done.into_iter().map(|(_, result)| result).collect()
}

/// The same for a range of numbers, which threads take `n_at_once` by `n_at_once`: for work so short
/// that taking turns would cost as much.
pub(crate) fn in_chunks<T: Send>(
    numbers: Range<usize>,
    n_at_once: usize,
    n_threads: NonZero<usize>,
    work: impl Fn(usize) -> T + Sync,
) -> Vec<T> {
    let n_at_once = n_at_once.max(1);
    let first = |chunk: usize| numbers.start + chunk * n_at_once;
    let results = side_by_side(0..numbers.len().div_ceil(n_at_once), n_threads, |chunk| {
        let end = first(chunk + 1).min(numbers.end);
        (first(chunk)..end).map(&work).collect::<Vec<T>>()
    });
    results.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_is_kept() {
        for n_threads in (1..5).filter_map(NonZero::new) {
            let squares = side_by_side(0..11_u32, n_threads, |i| i * i);
            let expected: Vec<u32> = (0..11).map(|i| i * i).collect();
            assert_eq!(squares, expected, "{n_threads} threads");
            let next = in_chunks(3..21, 4, n_threads, |i| i + 1);
            assert_eq!(next, (4..22).collect::<Vec<usize>>(), "{n_threads} threads");
        }
    }
}
