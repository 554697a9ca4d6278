//! Where one map of landmarks lies in another that was made apart, when landmarks look alike: which
//! placements there are, and what speaks for each.
//!
//! ```text
//! ln P(both maps | T) - ln P(both maps | no overlap)
//!   =  sum over matches (i, j)   ln N(z(i) - T z(j); 0, C(i) + R C(j) R') - ln density
//!    + sum over the unmatched    ln (1 - exists noticed)
//!    + density · area that both looked at
//! ```
//!
//! which is exact for landmarks strewn independently (a Poisson process) and noticed independently
//! by either robot; it is integrated over the placement `T` by Laplace's method with an even prior
//! over all placements, so that a few landmarks that agree by chance prove nothing. A
//! building is not strewn, it repeats itself: where either map fits itself at another place
//! ([`crate::alignment_repeats`]), a third place that nobody has seen may be meant, and a placement has
//! to agree better than that.
//!
//! Candidates: every two landmarks of the one as far apart as two of the other vote for the placement
//! that follows ([`crate::alignment_votes`]); those with most votes are fitted and judged.

use meetpoint_geometry::Pose;
use nalgebra::Matrix3;

use crate::alignment_fit::{Fitted, Judge};
use crate::alignment_repeats::log_evidence_of_repeats;
use crate::alignment_votes::candidates;
use crate::constellation::Constellation;
use crate::travel::Travel;

/// Tunables of [`aligned`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlignmentParams {
    /// By how much a landmark's place may be wrong besides what its map says, in metres: maps bend.
    pub place_std_m: f64,
    /// Landmarks farther from one another than this many standard deviations are not the same.
    pub deviations_max: f64,
    /// Chance that the type of a landmark was mistaken.
    pub mistaken_share: f64,
    /// Chance that a landmark's name was read wrong, or the landmark moved.
    pub renamed_share: f64,
    /// Candidates that are fitted.
    pub n_candidates_max: usize,
    /// Alignments that are told.
    pub n_told_max: usize,
    /// Two placements that put the newcomer's landmarks nearer than this are the same, in metres...
    pub apart_m: f64,
    /// ...unless they are turned by more than this, in radians.
    pub apart_rad: f64,
    /// Chance that a building which repeats itself does so once more where nobody has been.
    pub repeats_share: f64,
    /// Matches without which nothing is told of landmarks that look alike.
    pub n_matched_min: usize,
}

impl AlignmentParams {
    /// Landmarks seen by a camera. Maps of one robot are a tenth of a metre off where cameras are; two
    /// places a metre apart are two. A hundred candidates cost milliseconds; chance agreements
    /// have fewer votes than the true one by far.
    pub const CAMERA: Self = Self {
        place_std_m: 0.1,
        deviations_max: 3.5,
        mistaken_share: 0.02,
        renamed_share: 0.01,
        n_candidates_max: 100,
        n_told_max: 10,
        apart_m: 0.5,
        apart_rad: 0.2,
        repeats_share: 0.3,
        n_matched_min: 3,
    };

    /// Landmarks marked by a person with a button, half a metre off.
    pub const BUTTON: Self =
        Self { place_std_m: 0.4, apart_m: 2.0, apart_rad: 0.3, ..Self::CAMERA };

    /// Those for travels with these detectors: of a camera, unless all of them are buttons.
    pub fn of_travels<'a>(travels: impl IntoIterator<Item = &'a Travel>) -> Self {
        let is_button = travels.into_iter().all(|travel| travel.detector.is_button());
        if is_button { Self::BUTTON } else { Self::CAMERA }
    }
}

/// One placement of a newcomer's landmarks in a site's.
#[derive(Clone, Debug, PartialEq)]
pub struct LandmarkAlignment {
    /// The newcomer's frame in the site's.
    pub site_from_other: Pose,
    /// Of x, y (metres) and heading (radians) of that.
    pub covariance: Matrix3<f64>,
    /// Logarithm of the odds against the two maps having nothing in common, each of which is as
    /// probable beforehand.
    pub log_evidence: f64,
    /// Logarithm of the odds against all else: other placements, no overlap, and a place that looks the
    /// same and that nobody has seen.
    pub log_odds: f64,
    /// Landmarks of both that are one.
    pub n_matched: usize,
    /// Landmarks of either that the other should have seen by more than an even chance, and did not.
    pub n_contradicted: usize,
    /// Area that both looked at, in square metres.
    pub overlap_m2: f64,
    /// Indices in the site and in the newcomer, the site's in order.
    pub matches: Vec<(usize, usize)>,
}

/// All placements that are worth telling.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LandmarkAlignments {
    /// The most probable first; none if nothing fits.
    pub ranked: Vec<LandmarkAlignment>,
    /// Whether both have seen enough that anything can be told: with fewer landmarks neither a placement
    /// nor its absence means anything.
    pub is_enough: bool,
    /// Whether either map repeats itself, so that the best of these may be a place that only looks alike.
    pub is_repeated: bool,
}

/// Where `other` lies in `site`.
pub fn aligned(
    site: &Constellation,
    other: &Constellation,
    params: &AlignmentParams,
) -> LandmarkAlignments {
    let least = params.n_matched_min;
    let is_enough = least <= site.stars.len() && least <= other.stars.len();
    let judge = Judge::new(site, other, *params);
    let fitted = placements(&judge, |_| true);
    let Some(best) = fitted.first() else {
        return LandmarkAlignments { is_enough, ..LandmarkAlignments::default() };
    };
    let repeats = log_evidence_of_repeats(&judge, best);
    // Odds against all others: no overlap is 0.
    let mut all: Vec<f64> = fitted.iter().map(|fitted| fitted.log_evidence).collect();
    all.push(0.0);
    all.extend(repeats);
    let alone = |index: usize| {
        let rest = all.iter().enumerate().filter(|(other, _)| *other != index);
        all[index] - log_sum(rest.map(|(_, &log)| log))
    };
    let ranked = fitted.iter().enumerate().take(params.n_told_max).map(|(index, fitted)| {
        let matches: Vec<_> = fitted.matches.iter().map(|it| (it.site, it.other)).collect();
        LandmarkAlignment {
            site_from_other: fitted.site_from_other,
            covariance: fitted.covariance,
            log_evidence: fitted.log_evidence,
            log_odds: alone(index),
            n_matched: matches.len(),
            n_contradicted: fitted.n_contradicted,
            overlap_m2: fitted.common_m2,
            matches,
        }
    });
    LandmarkAlignments { ranked: ranked.collect(), is_enough, is_repeated: repeats.is_some() }
}

/// Placements that are judged by all that both looked at, at most.
const N_JUDGED_MAX: usize = 30;

/// Placements that are really different, the most probable first, of those that `is_asked`.
pub(crate) fn placements(judge: &Judge<'_>, is_asked: impl Fn(Pose) -> bool) -> Vec<Fitted> {
    let candidates = candidates(judge);
    let mut fitted: Vec<Fitted> = candidates
        .into_iter()
        .filter_map(|candidate| judge.fitted(candidate))
        .filter(|fitted| is_asked(fitted.site_from_other))
        .collect();
    fitted.sort_by(|a, b| b.log_evidence.total_cmp(&a.log_evidence));
    let mut kept: Vec<Fitted> = Vec::new();
    for fitted in fitted {
        if kept.iter().all(|better| judge.are_two(better, &fitted)) {
            kept.push(fitted);
        }
        if N_JUDGED_MAX <= kept.len() {
            break;
        }
    }
    let mut judged: Vec<Fitted> =
        kept.into_iter().map(|fitted| judge.with_common(fitted)).collect();
    judged.sort_by(|a, b| b.log_evidence.total_cmp(&a.log_evidence));
    judged
}

/// Logarithm of a sum, given logarithms.
fn log_sum(logs: impl Iterator<Item = f64> + Clone) -> f64 {
    let max = logs.clone().fold(f64::NEG_INFINITY, f64::max);
    if max == f64::NEG_INFINITY {
        max
    } else {
        max + logs.map(|log| (log - max).exp()).sum::<f64>().ln()
    }
}
