//! What was computed of sessions lately, so that the next question costs what came since.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use meetpoint_storage::SessionId;

/// What questions about one session share, one after the other.
pub(crate) type Shared<T> = Arc<tokio::sync::Mutex<T>>;

/// A cache over the journal.
pub(crate) struct SessionCache<T> {
    /// Newest last.
    kept: Mutex<VecDeque<(SessionId, Shared<T>)>>,
    n_kept_max: usize,
}

impl<T> SessionCache<T> {
    /// Empty; so many sessions will be kept.
    pub(crate) fn new(n_kept_max: usize) -> Self {
        Self { kept: Mutex::default(), n_kept_max }
    }

    /// What is kept of a session, or `new` if nothing is.
    ///
    /// # Errors
    /// Those of `new`.
    pub(crate) fn of<E>(
        &self,
        session: SessionId,
        new: impl FnOnce() -> Result<T, E>,
    ) -> Result<Shared<T>, E> {
        let mut kept = self.kept();
        let place = kept.iter().position(|(other, _)| *other == session);
        let shared = match place.and_then(|place| kept.remove(place)) {
            Some((_, shared)) => shared,
            None => Arc::new(tokio::sync::Mutex::new(new()?)),
        };
        kept.push_back((session, shared.clone()));
        while self.n_kept_max < kept.len() {
            kept.pop_front();
        }
        Ok(shared)
    }

    /// Forgets a session, which is read again when it is asked for.
    pub(crate) fn forget(&self, session: SessionId) {
        self.kept().retain(|(other, _)| *other != session);
    }

    /// A panic while the lock was held cannot leave the table half changed.
    fn kept(&self) -> MutexGuard<'_, VecDeque<(SessionId, Shared<T>)>> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use uuid::Uuid;

    use super::*;

    #[tokio::test]
    async fn the_newest_are_kept() {
        let cache = SessionCache::new(2);
        let [a, b, c] = [1, 2, 3].map(|id| SessionId(Uuid::from_u128(id)));
        let kept = async |session, value: u32| {
            let Ok::<_, Infallible>(shared) = cache.of(session, || Ok(value));
            *shared.lock().await
        };
        for (session, value) in [(a, 1), (b, 2), (a, 10), (c, 3)] {
            kept(session, value).await;
        }
        assert_eq!(kept(a, 100).await, 1, "asked for in between");
        assert_eq!(kept(b, 20).await, 20, "the oldest was given up");
        cache.forget(a);
        assert_eq!(kept(a, 5).await, 5, "forgotten");
        cache.of(c, || Err("none")).expect_err("there is none to be kept");
    }
}
