//! Which stamps a session has used: a stamp is unique within a sensor of a session.
//!
//! Memory is bounded: the newest stamps are remembered, with the batch and index that brought them.
//! A batch that is sent again therefore finds its own stamps and is judged as it was the first time.

use std::collections::{HashMap, VecDeque};

/// Stamps of one session.
#[derive(Debug)]
pub(crate) struct Stamps {
    n_max: usize,
    /// The batch, and the index in it, of the reading that used a sensor's stamp first.
    used_by: HashMap<(usize, i64), (u64, u32)>,
    order: VecDeque<(usize, i64)>,
    newest: Option<Newest>,
    /// What `newest` was before the batch that is being looked at.
    before: Option<Newest>,
}

#[derive(Clone, Copy, Debug)]
struct Newest {
    stamp_ns: i64,
    batch: u64,
}

impl Stamps {
    /// Remembers at most `n_max` stamps.
    pub(crate) fn new(n_max: usize) -> Self {
        Self { n_max, used_by: HashMap::new(), order: VecDeque::new(), newest: None, before: None }
    }

    /// The largest stamp of batches before `batch`, if any came.
    pub(crate) fn newest_before(&self, batch: u64) -> Option<i64> {
        let newest = match self.newest {
            Some(newest) if newest.batch >= batch => self.before,
            newest => newest,
        };
        newest.map(|newest| newest.stamp_ns)
    }

    /// Notes a stamp of any observation of `batch`.
    pub(crate) fn advance(&mut self, batch: u64, stamp_ns: i64) {
        match self.newest {
            Some(newest) if newest.stamp_ns >= stamp_ns => {}
            Some(newest) if newest.batch == batch => {
                self.newest = Some(Newest { stamp_ns, batch });
            }
            newest => {
                self.before = newest;
                self.newest = Some(Newest { stamp_ns, batch });
            }
        }
    }

    /// Notes the stamp of a sensor's reading at `index` of `batch`; false if an earlier reading of
    /// that sensor had it.
    pub(crate) fn take(&mut self, sensor: usize, stamp_ns: i64, batch: u64, index: u32) -> bool {
        match self.used_by.get(&(sensor, stamp_ns)) {
            Some(&first) => (batch, index) <= first,
            None => {
                self.used_by.insert((sensor, stamp_ns), (batch, index));
                self.order.push_back((sensor, stamp_ns));
                if self.order.len() > self.n_max
                    && let Some(oldest) = self.order.pop_front()
                {
                    self.used_by.remove(&oldest);
                }
                true
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_batch_sent_again_is_judged_as_before() {
        let mut stamps = Stamps::new(10);
        for _ in 0..2 {
            assert!(stamps.take(0, 100, 1, 3), "first use, and the same batch again");
            assert!(!stamps.take(0, 100, 1, 4), "the same stamp later in that batch");
        }
        assert!(!stamps.take(0, 100, 2, 0), "another batch with that stamp");
        assert!(stamps.take(1, 100, 2, 0), "another sensor");
    }

    #[test]
    fn forgets_the_oldest() {
        let mut stamps = Stamps::new(2);
        for stamp_ns in 0..3 {
            assert!(stamps.take(0, stamp_ns, 1, 0), "all new");
        }
        assert!(stamps.take(0, 0, 9, 0), "long forgotten");
        assert!(!stamps.take(0, 2, 9, 0), "still known");
    }

    #[test]
    fn the_newest_stamp_is_that_of_earlier_batches() {
        let mut stamps = Stamps::new(10);
        stamps.advance(1, 50);
        stamps.advance(2, 70);
        stamps.advance(2, 80);
        assert_eq!(stamps.newest_before(2), Some(50), "of batch 1");
        assert_eq!(stamps.newest_before(3), Some(80), "of batch 2");
    }
}
