//! The whole relaxation of a travel, timed piece by piece.

use std::num::NonZero;
use std::time::{Duration, Instant};

use meetpoint_relaxation::{Outcome, Relaxation, RelaxationParams, Stage, Travel};

/// A relaxation that is over.
pub(super) struct Relaxed {
    /// What it found; `None` if nothing fits.
    pub(super) outcome: Option<Outcome>,
    /// What it took.
    pub(super) stages: Vec<Timed>,
    /// Most bytes that tables, beliefs and maps of an iteration took.
    pub(super) n_bytes: usize,
}

/// A stage of it.
pub(super) struct Timed {
    pub(super) stage: Stage,
    pub(super) n_pieces: u32,
    pub(super) took: Duration,
    pub(super) longest: Duration,
}

impl Relaxed {
    /// Relaxes a travel to the end.
    pub(super) fn of(travel: &Travel, n_threads: NonZero<usize>) -> Self {
        Self::watched(travel, n_threads, |_, _| {})
    }

    /// Relaxes a travel to the end, while somebody looks at it after every piece but the last of a
    /// stage.
    pub(super) fn watched(
        travel: &Travel,
        n_threads: NonZero<usize>,
        mut watch: impl FnMut(Stage, &Relaxation<'_>),
    ) -> Self {
        let params = RelaxationParams { n_threads, ..RelaxationParams::of(travel) };
        let mut relaxed = Self { outcome: None, stages: Vec::new(), n_bytes: 0 };
        let mut begun = Instant::now();
        let mut relaxation = Relaxation::new(travel, params);
        loop {
            let progress = relaxation.advance();
            relaxed.note(progress.stage, begun.elapsed());
            watch(progress.stage, &relaxation);
            begun = Instant::now();
            let figures = relaxation.em().and_then(|em| em.figures());
            let n_bytes = figures.map_or(0, |figures| figures.n_bytes);
            relaxed.n_bytes = relaxed.n_bytes.max(n_bytes);
            if progress.is_done {
                relaxed.outcome = relaxation.outcome().cloned();
                return relaxed;
            }
        }
    }

    /// From begin to end.
    pub(super) fn took(&self) -> Duration {
        self.stages.iter().map(|timed| timed.took).sum()
    }

    fn note(&mut self, stage: Stage, piece: Duration) {
        match self.stages.last_mut().filter(|timed| timed.stage == stage) {
            Some(timed) => {
                timed.n_pieces += 1;
                timed.took += piece;
                timed.longest = timed.longest.max(piece);
            }
            None => self.stages.push(Timed { stage, n_pieces: 1, took: piece, longest: piece }),
        }
    }
}
