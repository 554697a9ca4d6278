//! The searches of a job: which part in which, slice by slice.

use std::num::NonZero;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

use meetpoint_merging::{
    AlignmentParams, AlignmentProgress, AlignmentSearch, Alignments, MergeRules, Part, Verdict,
};

use super::super::running::Stopped;
use super::super::workbench::Next;
use super::constellations::LandmarksFound;
use super::parts::Parts;
use super::{Merging, SHARE_WALLS};
use crate::jobs::relax::REPORT_EVERY;

/// What was found of the newcomers.
#[derive(Debug, Default)]
pub(super) struct Searched {
    /// Of each newcomer, where it lies in the map; `None` if either has drawn nothing.
    pub(super) in_site: Vec<Option<Alignments>>,
    /// Where a newcomer lies in an older one: their numbers, the older first.
    pub(super) in_others: Vec<([usize; 2], Alignments)>,
    /// What landmarks say of each newcomer; `None` of those that saw walls, or nothing.
    pub(super) by_landmarks: Vec<Option<LandmarksFound>>,
}

impl Searched {
    /// True if a newcomer lies in the map beyond doubt.
    fn is_found(&self, newcomer: usize) -> bool {
        let found = self.in_site.get(newcomer).and_then(Option::as_ref);
        found.is_some_and(|found| found.verdict == Verdict::Merged)
    }
}

impl Merging<'_> {
    /// Looks for all newcomers: in the map; those that are not found there in one another; and those that
    /// are, in one another too, to see whether they say the same.
    pub(super) async fn search(&self, parts: &Parts) -> Result<Searched, Stopped> {
        let n = parts.newcomers.len();
        // At most: which pairs are needed is known when the map was searched.
        let n_searches = n + n * n.saturating_sub(1) / 2;
        let mut searched = Searched::default();
        for (index, newcomer) in parts.newcomers.iter().enumerate() {
            let found = match (&parts.site, &newcomer.part) {
                (Some(site), Some(part)) => {
                    let share = index as f64 / n_searches as f64;
                    let found = self.found([site, part], [share, 1.0 / n_searches as f64]);
                    Some(found.await?)
                }
                _ => None,
            };
            searched.in_site.push(found);
        }
        let mut n_done = n;
        for younger in 0..n {
            for older in 0..younger {
                n_done += 1;
                if searched.is_found(older) != searched.is_found(younger) {
                    continue;
                }
                let pair = [older, younger].map(|index| parts.newcomers[index].part.as_ref());
                let [Some(still), Some(part)] = pair else { continue };
                let shares = [(n_done - 1) as f64 / n_searches as f64, 1.0 / n_searches as f64];
                let found = self.found([still, part], shares).await?;
                searched.in_others.push(([older, younger], found));
            }
        }
        Ok(searched)
    }

    /// Where the second part lies in the first, while the job goes through a share of the search:
    /// where it begins, and how much it is.
    async fn found(
        &self,
        [still, part]: [&Arc<Part>; 2],
        [begin, extent]: [f64; 2],
    ) -> Result<Alignments, Stopped> {
        let (still, part) = (still.clone(), part.clone());
        let rules = self.service.settings.merging.rules();
        let mut pieces = self.bench.pieces(move |teller| {
            search([still, part], rules, teller.n_threads(), |progress| {
                teller.tell(progress).map_continue(|()| teller.n_threads())
            })
        })?;
        let mut reported = Instant::now();
        loop {
            let AlignmentProgress { share } = match pieces.next().await? {
                Next::Piece(progress) => progress,
                Next::Done(found) => return found.ok_or(Stopped::Left),
            };
            if REPORT_EVERY <= reported.elapsed() {
                let progress = SHARE_WALLS * (begin + extent * share).clamp(0.0, 1.0);
                self.running.progress(progress, None).await?;
                reported = Instant::now();
            }
        }
    }
}

/// Searches slice by slice on `n_threads` threads and tells how far it is; is told in return how many the
/// next slice may have, or to stop, which gives `None`.
fn search(
    [still, newcomer]: [Arc<Part>; 2],
    rules: MergeRules,
    n_threads: NonZero<usize>,
    mut tell: impl FnMut(AlignmentProgress) -> ControlFlow<(), NonZero<usize>>,
) -> Option<Alignments> {
    let mut search = AlignmentSearch::new(still, newcomer, AlignmentParams::INDOOR, rules);
    search.use_threads(n_threads);
    while let Some(progress) = search.advance() {
        match tell(progress) {
            ControlFlow::Continue(n_threads) => search.use_threads(n_threads),
            ControlFlow::Break(()) => return None,
        }
    }
    Some(search.into_alignments())
}
