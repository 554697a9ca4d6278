//! Why a verdict is what it is, in words and numbers.

use std::fmt;

/// One reason of a [`Verdict`](crate::Verdict). Displayed as a clause: lowercase, value and limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reason {
    /// Nothing speaks against merging.
    Clear {
        /// Logarithm of the odds against no overlap.
        log_odds: f64,
        /// Area that both maps have seen, in square metres.
        overlap_m2: f64,
    },
    /// A map shows too few walls to be found again.
    FewWalls {
        /// Whether it is the newcomer's or the site's.
        is_newcomer: bool,
        /// Length of its walls, in metres.
        walls_m: f64,
        /// What is needed, in metres.
        walls_min_m: f64,
    },
    /// No place of the newcomer in the site is likelier than chance.
    NothingFits {
        /// Logarithm of the odds of the best place against no overlap; `None` if there was none.
        log_odds: Option<f64>,
        /// What a proposal needs.
        log_odds_min: f64,
    },
    /// The best place is not likely enough against no overlap at all.
    WeakEvidence {
        /// Logarithm of the odds against no overlap.
        log_odds: f64,
        /// What merging needs.
        log_odds_min: f64,
    },
    /// The maps have too little in common.
    SmallOverlap {
        /// Area that both have seen, in square metres.
        overlap_m2: f64,
        /// What merging needs, in square metres.
        overlap_min_m2: f64,
    },
    /// Too few of the walls agree.
    WallsDisagree {
        /// Share that does.
        agreement: f64,
        /// What merging needs.
        agreement_min: f64,
    },
    /// One map shows walls where the other saw through.
    Contradicted {
        /// Share of the walls.
        contradiction: f64,
        /// What merging allows.
        contradiction_max: f64,
    },
    /// Another place is nearly as likely.
    Rival {
        /// Logarithm of the odds against it.
        margin: f64,
        /// What merging needs.
        margin_min: f64,
        /// How far the newcomer would lie from where the best place has it, at the overlap, in metres.
        apart_m: f64,
        /// How far it would be turned, in radians.
        apart_rad: f64,
    },
    /// Only landmarks without names say that it is not another place.
    NamelessDecide {
        /// Logarithm of the odds against the other place that they say...
        margin: f64,
        /// ...and all else says, which is not enough.
        margin_without: f64,
    },
    /// Of landmarks without names, most are where the other map has looked for them and has none.
    NamelessElsewhere {
        /// So many of both maps...
        n_alone: usize,
        /// ...and so many lie together.
        n_agreeing: usize,
    },
    /// Landmarks with names lie elsewhere than the other map has them.
    NamedElsewhere {
        /// So many of those that both maps have...
        n_elsewhere: usize,
        /// ...of so many.
        n_common: usize,
    },
    /// The walls let the newcomer slide: along a corridor, say.
    Slides {
        /// Logarithm of the odds against having slid.
        margin: f64,
        /// What merging needs.
        margin_min: f64,
        /// How far, in metres.
        slide_m: f64,
    },
    /// Where the newcomer lies is not known well enough.
    Unsure {
        /// Standard deviation at the overlap, in metres.
        std_m: f64,
        /// What merging allows, in metres.
        std_max_m: f64,
    },
    /// Alignments of other maps, taken together, say otherwise.
    Inconsistent {
        /// How far a way around through the others ends from where it began, in metres.
        error_m: f64,
        /// The same in radians.
        error_rad: f64,
    },
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Clear { log_odds, overlap_m2 } => {
                write!(f, "log odds {log_odds:.1} over {overlap_m2:.0} m2 and nothing against it")
            }
            Self::FewWalls { is_newcomer, walls_m, walls_min_m } => {
                let who = if is_newcomer { "newcomer" } else { "site" };
                write!(f, "the {who} shows {walls_m:.1} m of walls, needed are {walls_min_m:.1} m")
            }
            Self::NothingFits { log_odds: Some(log_odds), log_odds_min } => {
                write!(f, "the best place has log odds {log_odds:.1}, needed are {log_odds_min:.1}")
            }
            Self::NothingFits { log_odds: None, .. } => write!(f, "no place fits at all"),
            Self::WeakEvidence { log_odds, log_odds_min } => {
                write!(f, "log odds {log_odds:.1} against no overlap, needed are {log_odds_min:.1}")
            }
            Self::SmallOverlap { overlap_m2, overlap_min_m2 } => {
                write!(f, "{overlap_m2:.1} m2 overlap, needed are {overlap_min_m2:.1} m2")
            }
            Self::WallsDisagree { agreement, agreement_min } => {
                let (share, min) = (100.0 * agreement, 100.0 * agreement_min);
                write!(f, "{share:.0} % of the walls agree, needed are {min:.0} %")
            }
            Self::Contradicted { contradiction, contradiction_max } => {
                let (share, max) = (100.0 * contradiction, 100.0 * contradiction_max);
                write!(f, "{share:.0} % of the walls lie in free space, allowed are {max:.0} %")
            }
            Self::Rival { margin, margin_min, apart_m, apart_rad } => {
                let turn_deg = apart_rad.to_degrees();
                write!(
                    f,
                    "log odds {margin:.1} against a place {apart_m:.1} m and {turn_deg:.0} degrees away, needed are {margin_min:.1}"
                )
            }
            Self::Slides { margin, margin_min, slide_m } => {
                write!(
                    f,
                    "log odds {margin:.1} against having slid by {slide_m:.1} m, needed are {margin_min:.1}"
                )
            }
            Self::NamelessDecide { margin, margin_without } => {
                write!(
                    f,
                    "log odds {margin:.1} against another place by landmarks without names, {margin_without:.1} by all else"
                )
            }
            Self::NamelessElsewhere { n_alone, n_agreeing } => {
                write!(
                    f,
                    "{n_alone} landmarks without names are in one map and not in the other, {n_agreeing} in both"
                )
            }
            Self::NamedElsewhere { n_elsewhere, n_common } => {
                write!(f, "{n_elsewhere} of {n_common} landmarks with names lie elsewhere")
            }
            Self::Unsure { std_m, std_max_m } => {
                write!(f, "the place is known to {std_m:.2} m, needed are {std_max_m:.2} m")
            }
            Self::Inconsistent { error_m, error_rad } => {
                let error_deg = error_rad.to_degrees();
                write!(
                    f,
                    "a way around by other maps ends {error_m:.2} m and {error_deg:.1} degrees off"
                )
            }
        }
    }
}
