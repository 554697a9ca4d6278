//! How far a relaxation is.

use crate::closures::closure::Verdict;
use crate::laser_outcome::{LaserProgress, LaserStage};
use crate::laser_relaxation::{LaserRelaxation, Work};

impl LaserRelaxation {
    /// What is done next; `None` when all is done. Shares are of the time that stages take.
    pub(super) fn progress(&self) -> Option<LaserProgress> {
        let of = |part: usize, all: usize| part as f64 / all.max(1) as f64;
        let (stage, share) = match &self.work {
            Work::Before(_, steps) => (LaserStage::Before, 0.15 * of(steps.len(), self.keys.len())),
            Work::ChainSweeps(..) => (LaserStage::Chain, 0.15),
            Work::Closures(search) => {
                (LaserStage::Closures, 0.2 + 0.3 * search.share(&self.params.closures))
            }
            Work::Sweeps(_, n) => (
                LaserStage::Sweeps,
                0.5 + 0.25 * of(*n as usize, self.params.n_sweeps_max as usize),
            ),
            Work::MapMatching(_) => (LaserStage::MapMatching, 0.75),
            Work::Placing(_) => {
                (LaserStage::Placing, 0.8 + 0.15 * of(self.n_placed, self.travels.all.scans.len()))
            }
            Work::After(_) => (LaserStage::After, 0.95),
            Work::Done => return None,
        };
        let search = match &self.work {
            Work::Closures(search) => Some(search),
            _ => self.search.as_ref(),
        };
        let (n_accepted, n_refused) = search.map_or_else(
            || {
                let n = self.closures.iter().filter(|c| c.verdict == Verdict::Accepted).count();
                (n, self.closures.len() - n)
            },
            |search| search.counts(),
        );
        Some(LaserProgress { share, stage, n_accepted, n_refused })
    }
}
