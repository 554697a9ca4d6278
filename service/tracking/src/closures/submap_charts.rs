//! Charts of submaps, the latest used kept: neighbouring submaps are laid over the same ones.

use std::collections::VecDeque;

use crate::closures::evidence::Evidence;
use crate::closures::submap::{Submap, SubmapChart};

/// Charts that are kept: some megabytes each.
const N_CHARTS_MAX: usize = 24;
/// Scans that a chart is drawn from, at most: walls that as many saw are certain.
const N_CHART_SCANS_MAX: usize = 30;

/// The charts at hand.
#[derive(Debug, Default)]
pub(crate) struct SubmapCharts {
    /// By submap, the latest used last.
    kept: VecDeque<(usize, SubmapChart)>,
}

impl SubmapCharts {
    /// Takes the chart of a submap, if it is at hand.
    pub(crate) fn take(&mut self, submap: usize) -> Option<SubmapChart> {
        let place = self.kept.iter().position(|(of, _)| *of == submap)?;
        self.kept.remove(place).map(|(_, chart)| chart)
    }

    /// Keeps the chart of a submap, as long as no others are kept instead.
    pub(crate) fn keep(&mut self, submap: usize, chart: SubmapChart) {
        if self.kept.len() == N_CHARTS_MAX {
            self.kept.pop_front();
        }
        self.kept.push_back((submap, chart));
    }
}

/// The chart of a submap and its two neighbours, in the frame of its anchor.
pub(crate) fn drawn(submap: usize, submaps: &[Submap], evidence: Evidence<'_>) -> SubmapChart {
    let keys: Vec<usize> =
        around(submap, submaps).flat_map(|near| submaps[near].keys.clone()).collect();
    let stride = keys.len().div_ceil(N_CHART_SCANS_MAX).max(1);
    let anchor = submaps[submap].anchor;
    let scans = keys.into_iter().step_by(stride);
    let scans = scans.map(|key| (evidence.keys[key].scan, evidence.seen(key, anchor)));
    let mapping = &evidence.params.mapping;
    SubmapChart::new(
        &evidence.travels.all,
        scans,
        evidence.frame,
        (&mapping.beam_model, &mapping.field),
    )
}

/// A submap and its two neighbours along the way, as far as its travel goes.
pub(crate) fn around(submap: usize, submaps: &[Submap]) -> std::ops::Range<usize> {
    let is_own = |other: usize| submaps[other].travel == submaps[submap].travel;
    let before = submap.checked_sub(1).filter(|&before| is_own(before));
    let after = Some(submap + 1).filter(|&after| after < submaps.len() && is_own(after));
    before.unwrap_or(submap)..after.unwrap_or(submap) + 1
}
