//! Where a job computes: a thread of its own, which makes room for robots and queries.

use std::num::NonZero;
use std::ops::ControlFlow;
use std::sync::mpsc;
use std::thread::available_parallelism;
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
    /// Threads that work may be shared among while nobody else is there.
    n_threads: NonZero<usize>,
}

impl Workbench {
    /// Starts the thread. While anybody sends or asks, the job takes the given share of one core;
    /// `is_shared` if its work may be shared among threads while nobody does.
    ///
    /// # Errors
    /// [`Error::Internal`] if the system has none left.
    pub(super) fn new(service: &Service, cpu_share: f64, is_shared: bool) -> Result<Self, Error> {
        let (slices, waiting) = mpsc::channel::<Slice>();
        let work = move || {
            for slice in waiting {
                slice();
            }
        };
        std::thread::Builder::new().name("job".to_owned()).spawn(work).map_err(Error::internal)?;
        let n_threads = NonZero::new(service.settings.jobs.n_threads)
            .or_else(|| available_parallelism().ok())
            .filter(|_| is_shared);
        Ok(Self {
            slices,
            activity: service.activity.clone(),
            cpu_share,
            n_threads: n_threads.unwrap_or(NonZero::<usize>::MIN),
        })
    }

    /// Computes a slice of work, then rests as long as the share of the processor asks for.
    ///
    /// # Errors
    /// [`Error::Internal`] if the work panicked.
    pub(super) async fn slice<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, Error> {
        let slice = move || {
            let begun = Instant::now();
            let result = work();
            (result, begun.elapsed())
        };
        let (result, spent) = self.begin(slice)?.await.map_err(|_| panicked())?;
        self.rest(rest(spent, self.cpu_share)).await;
        Ok(result)
    }

    /// Begins work that tells of each of its pieces, and waits after each until it is to go on.
    ///
    /// # Errors
    /// [`Error::Internal`] if the thread has ended.
    pub(super) fn pieces<T: Send + 'static, R: Send + 'static>(
        &self,
        work: impl FnOnce(&mut Teller<T>) -> R + Send + 'static,
    ) -> Result<Pieces<'_, T, R>, Error> {
        let (tell, told) = tokio::sync::mpsc::channel(1);
        let (go, go_on) = mpsc::channel();
        let (activity, n_threads) = (self.activity.clone(), self.n_threads);
        let result = self.begin(move || {
            work(&mut Teller { tell, go_on, begun: Instant::now(), activity, n_threads })
        })?;
        Ok(Pieces { bench: self, told, go, result, spent: None })
    }

    /// Hands work to the thread.
    fn begin<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<oneshot::Receiver<T>, Error> {
        let (done, result) = oneshot::channel();
        let slice = move || {
            // Whoever gave the job up does not need it.
            let _ = done.send(work());
        };
        self.slices.send(Box::new(slice)).map_err(|_| Error::internal("a job's thread ended"))?;
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

fn panicked() -> Error {
    Error::internal("a job's work panicked")
}

/// By which work in pieces tells of them.
pub(super) struct Teller<T> {
    tell: tokio::sync::mpsc::Sender<(T, Duration)>,
    go_on: mpsc::Receiver<()>,
    begun: Instant,
    activity: Activity,
    n_threads: NonZero<usize>,
}

impl<T> Teller<T> {
    /// Threads that the next piece may be shared among.
    pub(super) fn n_threads(&self) -> NonZero<usize> {
        if self.activity.is_busy() { NonZero::<usize>::MIN } else { self.n_threads }
    }

    /// Tells of a piece that is done, and waits. Breaks if nobody wants more.
    pub(super) fn tell(&mut self, piece: T) -> ControlFlow<()> {
        let told = self.tell.blocking_send((piece, self.begun.elapsed()));
        if told.is_err() || self.go_on.recv().is_err() {
            return ControlFlow::Break(());
        }
        self.begun = Instant::now();
        ControlFlow::Continue(())
    }
}

/// Work in pieces, under way. It ends when this is dropped.
pub(super) struct Pieces<'a, T, R> {
    bench: &'a Workbench,
    told: tokio::sync::mpsc::Receiver<(T, Duration)>,
    go: mpsc::Sender<()>,
    result: oneshot::Receiver<R>,
    /// What the piece that was told of last took: there is a rest after it.
    spent: Option<Duration>,
}

/// What comes next of work in pieces.
pub(super) enum Next<T, R> {
    /// A piece is done.
    Piece(T),
    /// All is done.
    Done(R),
}

impl<T, R> Pieces<'_, T, R> {
    /// Rests after the piece before, lets the work go on, and waits for what comes next.
    ///
    /// # Errors
    /// [`Error::Internal`] if the work panicked.
    pub(super) async fn next(&mut self) -> Result<Next<T, R>, Error> {
        if let Some(spent) = self.spent.take() {
            self.bench.rest(rest(spent, self.bench.cpu_share)).await;
            // Work that has ended meanwhile tells so below.
            let _ = self.go.send(());
        }
        match self.told.recv().await {
            Some((piece, spent)) => {
                self.spent = Some(spent);
                Ok(Next::Piece(piece))
            }
            None => Ok(Next::Done((&mut self.result).await.map_err(|_| panicked())?)),
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
