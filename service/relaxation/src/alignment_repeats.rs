//! Patterns that repeat: doors at equal distances, identical wings, a room like twenty others.
//!
//! Where a map fits itself, moved or turned, its building repeats itself, and what looks like the same
//! place may be a third one that is in one of the maps only. Under such a repetition a share `f` of all
//! landmarks is found again, under the truth a share `p`; a placement with `m` matches and `c`
//! contradictions is therefore a repetition with
//!
//! ```text
//! ln P(repetition)  =  ln P(placement) + ln share - max(0, m ln (p / f) + c ln ((1 - p) / (1 - f)))
//! ```
//!
//! so that it has to agree better than the building agrees with itself.

use meetpoint_geometry::Pose;

use crate::alignment::placements;
use crate::alignment_fit::{Fitted, Judge, Match};
use crate::constellation::Constellation;

/// Share of the landmarks of one place that two maps agree on: each robot misses some.
const SAME_SHARE: f64 = 0.9;
/// A repetition that agrees less is taken to agree so much.
const REPEATED_SHARE_MIN: f64 = 0.05;
/// Odds from which a map repeats itself, as a logarithm: every map has some landmarks that lie by
/// chance as others do.
const REPEATED_LOG_ODDS_MIN: f64 = 4.0;
/// Landmarks that a map must find again in itself: two always fit.
const N_REPEATED_MIN: usize = 3;

/// Logarithm of the evidence for a place that only looks like the one that a placement says; `None`
/// if neither map repeats itself.
pub(crate) fn log_evidence_of_repeats(judge: &Judge<'_>, best: &Fitted) -> Option<f64> {
    let of = |map| repeated_share(judge, map);
    let share = of(judge.site).into_iter().chain(of(judge.other)).max_by(f64::total_cmp)?;
    // A building that fits itself better than two maps of one place fit tells nothing of a place.
    let share = share.clamp(REPEATED_SHARE_MIN, SAME_SHARE);
    let (m, c) = (best.matches.len() as f64, best.n_contradicted as f64);
    let agrees = m * (SAME_SHARE / share).ln() + c * ((1.0 - SAME_SHARE) / (1.0 - share)).ln();
    Some(best.log_evidence + judge.params.repeats_share.ln() - agrees.max(0.0))
}

/// The largest share of its landmarks that a map finds again in itself at another place, if that is no
/// chance.
fn repeated_share(judge: &Judge<'_>, map: &Constellation) -> Option<f64> {
    let itself = Judge::new(map, map, judge.params);
    let is_elsewhere = |placed: Pose| {
        let off_m = map.stars.iter().map(|star| (placed * star.position - star.position).norm());
        judge.params.apart_m < off_m.sum::<f64>() / map.stars.len().max(1) as f64
    };
    let share = |it: &Fitted| {
        let both = 2.0 * it.matches.len() as f64;
        both / (both + it.n_contradicted as f64)
    };
    let found = placements(&itself, is_elsewhere);
    let proven = found.iter().filter(|it| is_proven(it));
    proven.map(share).max_by(f64::total_cmp)
}

/// Whether a map fits itself by more than chance. Where it is turned by half a turn, two landmarks that
/// change places say the same twice.
fn is_proven(fitted: &Fitted) -> bool {
    let is_twice = |it: &&Match| {
        let is_reverse = |other: &Match| (other.site, other.other) == (it.other, it.site);
        it.site < it.other && fitted.matches.iter().any(is_reverse)
    };
    let twice: Vec<&Match> = fitted.matches.iter().filter(is_twice).collect();
    let told_twice: f64 = twice.iter().map(|it| it.gain).sum();
    N_REPEATED_MIN <= fitted.matches.len() - twice.len()
        && REPEATED_LOG_ODDS_MIN < fitted.log_evidence - told_twice
}
