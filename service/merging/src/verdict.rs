//! What is to be done with the best place.

use crate::alignment::{Alignment, Verdict};
use crate::merge_rules::MergeRules;
use crate::reason::Reason;

/// The best place and what stands beside it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Standing<'a> {
    pub(crate) best: &'a Alignment,
    /// How far the strongest rival lies from it: metres and radians at the overlap.
    pub(crate) rival_apart: (f64, f64),
    /// Logarithm of the odds against having slid, and how far in metres.
    pub(crate) slide: (f64, f64),
    /// Standard deviation at the overlap, in metres.
    pub(crate) std_m: f64,
    /// What names say of the logarithm of the odds, and of the margin over the strongest rival.
    pub(crate) named: (f64, f64),
}

/// The verdict on the best place, and why.
pub(crate) fn judged(standing: &Standing<'_>, rules: &MergeRules) -> (Verdict, Vec<Reason>) {
    let best = standing.best;
    if best.log_odds < rules.log_odds_proposed_min
        || rules.contradiction_proposed_max < best.contradiction
    {
        return (Verdict::NoOverlap, against_overlap(best, rules));
    }
    let doubts = doubts(standing, rules);
    if !doubts.is_empty() {
        return (Verdict::Ambiguous, doubts);
    }
    let weaknesses = weaknesses(standing, rules);
    if !weaknesses.is_empty() {
        return (Verdict::Proposed, weaknesses);
    }
    let Alignment { log_odds, overlap_m2, .. } = *best;
    (Verdict::Merged, vec![Reason::Clear { log_odds, overlap_m2 }])
}

fn against_overlap(best: &Alignment, rules: &MergeRules) -> Vec<Reason> {
    let (log_odds, log_odds_min) = (best.log_odds, rules.log_odds_proposed_min);
    let fits = log_odds < log_odds_min;
    let fits = fits.then_some(Reason::NothingFits { log_odds: Some(log_odds), log_odds_min });
    fits.into_iter().chain(contradicted(best, rules.contradiction_proposed_max)).collect()
}

fn contradicted(best: &Alignment, contradiction_max: f64) -> Option<Reason> {
    let contradiction = best.contradiction;
    (contradiction_max < contradiction)
        .then_some(Reason::Contradicted { contradiction, contradiction_max })
}

/// Why it may lie elsewhere.
fn doubts(standing: &Standing<'_>, rules: &MergeRules) -> Vec<Reason> {
    let best = standing.best;
    let (apart_m, apart_rad) = standing.rival_apart;
    let rival = best.margin.and_then(|margin| lacking(margin, standing, rules));
    let rival =
        rival.map(|(margin, margin_min)| Reason::Rival { margin, margin_min, apart_m, apart_rad });
    let margin_min = rules.margin_min;
    let (margin, slide_m) = standing.slide;
    let slides = (margin < margin_min).then_some(Reason::Slides { margin, margin_min, slide_m });
    rival.into_iter().chain(slides).collect()
}

/// The margin over the strongest rival and what is needed, if it is not enough: in all, or of what walls
/// say, unless names decide.
fn lacking(margin: f64, standing: &Standing<'_>, rules: &MergeRules) -> Option<(f64, f64)> {
    let (log_odds, named_margin) = standing.named;
    let by_walls_min = rules.margin_share_min * (standing.best.log_odds - log_odds);
    if margin < rules.margin_min {
        return Some((margin, rules.margin_min.max(by_walls_min)));
    }
    let is_named =
        rules.named_margin_min <= named_margin && rules.named_min <= standing.best.n_named_agreeing;
    let by_walls = margin - named_margin;
    (!is_named && by_walls < by_walls_min).then_some((by_walls, by_walls_min))
}

/// Why a person should look.
fn weaknesses(standing: &Standing<'_>, rules: &MergeRules) -> Vec<Reason> {
    let Alignment { log_odds, overlap_m2, agreement, n_named, n_named_agreeing, .. } =
        *standing.best;
    let n_elsewhere = n_named - n_named_agreeing;
    let MergeRules { log_odds_min, overlap_min_m2, agreement_min, std_max_m, .. } = *rules;
    let std_m = standing.std_m;
    [
        (log_odds < log_odds_min).then_some(Reason::WeakEvidence { log_odds, log_odds_min }),
        (overlap_m2 < overlap_min_m2)
            .then_some(Reason::SmallOverlap { overlap_m2, overlap_min_m2 }),
        (agreement < agreement_min).then_some(Reason::WallsDisagree { agreement, agreement_min }),
        contradicted(standing.best, rules.contradiction_max),
        (n_named_agreeing < n_elsewhere)
            .then_some(Reason::NamedElsewhere { n_elsewhere, n_common: n_named }),
        (std_max_m < std_m).then_some(Reason::Unsure { std_m, std_max_m }),
    ]
    .into_iter()
    .flatten()
    .collect()
}
