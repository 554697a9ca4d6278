//! What is to be done with the best place.

use crate::alignment::{Alignment, Verdict};
use crate::merge_rules::MergeRules;
use crate::reason::Reason;

/// The best place and what stands beside it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Standing<'a> {
    pub(crate) best: &'a Alignment,
    /// The other places.
    pub(crate) rivals: &'a [Rival],
    /// Logarithm of the odds against having slid, and how far in metres.
    pub(crate) slide: (f64, f64),
    /// Standard deviation at the overlap, in metres.
    pub(crate) std_m: f64,
    /// What names say of the logarithm of the odds.
    pub(crate) named_log_odds: f64,
}

/// Another place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rival {
    /// How far it lies from the best: metres and radians at the overlap.
    pub(crate) apart: (f64, f64),
    /// Logarithm of the odds of the best place against it.
    pub(crate) margin: f64,
    /// Of this, what names say...
    pub(crate) named: f64,
    /// ...and what landmarks without names say.
    pub(crate) nameless: f64,
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
    let lacking = standing.rivals.iter().filter_map(|rival| {
        let is_told = nameless_decide(rival, standing, rules);
        let lacking = lacking(rival, standing, rules).filter(|_| !is_told);
        let lacking = lacking_in_all(rival, standing, rules).or(lacking);
        lacking.map(|lacking| (lacking, rival.apart))
    });
    let rival = lacking.min_by(|a, b| a.0.0.total_cmp(&b.0.0));
    let rival = rival.map(|((margin, margin_min), (apart_m, apart_rad))| Reason::Rival {
        margin,
        margin_min,
        apart_m,
        apart_rad,
    });
    let margin_min = rules.margin_min;
    let (margin, slide_m) = standing.slide;
    let slides = (margin < margin_min).then_some(Reason::Slides { margin, margin_min, slide_m });
    rival.into_iter().chain(slides).collect()
}

/// Whether landmarks without names say enough against another place.
fn nameless_decide(rival: &Rival, standing: &Standing<'_>, rules: &MergeRules) -> bool {
    rules.nameless_margin_min <= rival.nameless
        && rules.nameless_min <= standing.best.n_nameless_agreeing
}

/// The margin by all that is said and what is needed, if it is not enough.
fn lacking_in_all(
    rival: &Rival,
    standing: &Standing<'_>,
    rules: &MergeRules,
) -> Option<(f64, f64)> {
    let margin_min = rules.margin_min.max(by_walls_min(standing, rules));
    (rival.margin < rules.margin_min).then_some((rival.margin, margin_min))
}

/// The same without landmarks that have no names: of what is left, or of what walls say, unless names decide.
fn lacking(rival: &Rival, standing: &Standing<'_>, rules: &MergeRules) -> Option<(f64, f64)> {
    let (margin, by_walls_min) = (rival.margin - rival.nameless, by_walls_min(standing, rules));
    if margin < rules.margin_min {
        return Some((margin, rules.margin_min.max(by_walls_min)));
    }
    let is_named =
        rules.named_margin_min <= rival.named && rules.named_min <= standing.best.n_named_agreeing;
    let by_walls = margin - rival.named;
    (!is_named && by_walls < by_walls_min).then_some((by_walls, by_walls_min))
}

/// What walls are to say of the margin.
fn by_walls_min(standing: &Standing<'_>, rules: &MergeRules) -> f64 {
    rules.margin_share_min * (standing.best.log_odds - standing.named_log_odds)
}

/// What landmarks without names say, and all else does, of the place that all else tells least from the best,
/// if they are needed.
fn told_by_nameless(standing: &Standing<'_>, rules: &MergeRules) -> Option<(f64, f64)> {
    let needed = standing.rivals.iter().filter(|rival| lacking(rival, standing, rules).is_some());
    let told = needed.map(|rival| (rival.nameless, rival.margin - rival.nameless));
    told.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Why a person should look.
fn weaknesses(standing: &Standing<'_>, rules: &MergeRules) -> Vec<Reason> {
    let Alignment { log_odds, overlap_m2, agreement, n_named, n_named_agreeing, .. } =
        *standing.best;
    let (n_alone, n_agreeing) = (standing.best.n_nameless_alone, standing.best.n_nameless_agreeing);
    let decide = told_by_nameless(standing, rules).filter(|_| !rules.accepts_nameless);
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
        // Each that lies together is in both maps.
        (rules.nameless_min <= n_alone && 2 * n_agreeing < n_alone)
            .then_some(Reason::NamelessElsewhere { n_alone, n_agreeing }),
        decide.map(|(margin, margin_without)| Reason::NamelessDecide { margin, margin_without }),
        (std_max_m < std_m).then_some(Reason::Unsure { std_m, std_max_m }),
    ]
    .into_iter()
    .flatten()
    .collect()
}
