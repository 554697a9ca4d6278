//! Where a job computes: a thread of its own, which makes room for robots and queries.

use std::sync::mpsc;
use std::time::{Duration, Instant};

use tokio::sync::oneshot;

use crate::activity::Activity;
use crate::{error::Error, service::Service};

/// While a job rests, this often it looks whether anybody is still there to rest for.
const LOOK: Duration = Duration::from_millis(50);

type Slice = Box<dyn FnOnce() + Send>;

/// A job's thread. It ends when the bench is dropped and the slice under way is done.
pub(super) struct Workbench {
    slices: mpsc::Sender<Slice>,
    activity: Activity,
    cpu_share: f64,
}

impl Workbench {
    /// Starts the thread.
    ///
    /// # Errors
    /// [`Error::Internal`] if the system has none left.
    pub(super) fn new(service: &Service) -> Result<Self, Error> {
        let (slices, waiting) = mpsc::channel::<Slice>();
        let work = move || {
            for slice in waiting {
                slice();
            }
        };
        std::thread::Builder::new().name("job".to_owned()).spawn(work).map_err(Error::internal)?;
        let cpu_share = service.settings.jobs.cpu_share;
        Ok(Self { slices, activity: service.activity.clone(), cpu_share })
    }

    /// Computes a slice of work, then rests as long as the share of the processor asks for.
    ///
    /// # Errors
    /// [`Error::Internal`] if the work panicked.
    pub(super) async fn slice<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, Error> {
        let (done, result) = oneshot::channel();
        let slice = move || {
            let begun = Instant::now();
            let result = work();
            // Whoever gave the job up does not need it.
            let _ = done.send((result, begun.elapsed()));
        };
        self.slices.send(Box::new(slice)).map_err(|_| Error::internal("a job's thread ended"))?;
        let (result, spent) = result.await.map_err(|_| Error::internal("a job's work panicked"))?;
        self.rest(rest(spent, self.cpu_share)).await;
        Ok(result)
    }

    /// Rests, as long as anybody is there to rest for.
    async fn rest(&self, rest: Duration) {
        let begun = Instant::now();
        while self.activity.is_busy() && begun.elapsed() < rest {
            tokio::time::sleep(LOOK.min(rest.saturating_sub(begun.elapsed()))).await;
        }
    }
}

/// How long to rest after so much work, that the work is this share of both.
fn rest(spent: Duration, cpu_share: f64) -> Duration {
    let factor = (1.0 - cpu_share) / cpu_share;
    Duration::try_from_secs_f64(spent.as_secs_f64() * factor).unwrap_or(Duration::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rests_as_long_as_its_share_asks_for() {
        let spent = Duration::from_millis(300);
        assert_eq!(rest(spent, 1.0), Duration::ZERO, "all of it");
        assert_eq!(rest(spent, 0.5), spent, "half and half");
        assert_eq!(rest(spent, 0.25), 3 * spent, "a quarter");
    }
}
