//! What is merged without a person.

/// The rules by which an alignment becomes [`Merged`](crate::Verdict::Merged) or
/// [`Proposed`](crate::Verdict::Proposed). Merging wrongly is worse than not merging: where a rule is not
/// met, a person is asked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MergeRules {
    /// Walls that a map must show before anything is said, in metres.
    pub walls_min_m: f64,
    /// Walls that both maps must show before one that fits nowhere is said not to overlap, in metres:
    /// with fewer, not even all of them agreeing would be enough to merge by.
    pub walls_no_overlap_min_m: f64,
    /// Logarithm of the odds against no overlap that merging needs.
    pub log_odds_min: f64,
    /// The same for a proposal: below it, there is no overlap.
    pub log_odds_proposed_min: f64,
    /// Logarithm of the odds against any other place, and against having slid, that merging needs; with
    /// less the place is ambiguous.
    pub margin_min: f64,
    /// The margin over any other place must also be this share of the log odds: in a row of offices alike,
    /// the evidence that all places share grows with the row, and what the ends of the row say against
    /// some of them grows with it, and is worth nothing.
    pub margin_share_min: f64,
    /// ...unless names say it: with so much of the margin theirs...
    pub named_margin_min: f64,
    /// ...and so many of them lying where the other map has them. One may be another landmark of that name.
    pub named_min: usize,
    /// Landmarks without names say which of two places alike it is with so much of the margin theirs...
    pub nameless_margin_min: f64,
    /// ...and so many of them lying where the other map has one of their type...
    pub nameless_min: usize,
    /// ...and then it is merged; else a person is asked: what looks alike may look so elsewhere too.
    pub accepts_nameless: bool,
    /// Area that both maps must have seen, in square metres.
    pub overlap_min_m2: f64,
    /// Share of the walls in the overlap that must agree.
    pub agreement_min: f64,
    /// Share of the walls in the overlap that may lie where the other map is free: doors that opened or
    /// closed, chairs and people.
    pub contradiction_max: f64,
    /// The same for a proposal: more is no overlap.
    pub contradiction_proposed_max: f64,
    /// Standard deviation of the place at the overlap, in metres.
    pub std_max_m: f64,
}

impl MergeRules {
    /// For 2-D lasers in buildings.
    pub const INDOOR: Self = Self {
        walls_min_m: 10.0,
        walls_no_overlap_min_m: 60.0,
        log_odds_min: 45.0,
        log_odds_proposed_min: 8.0,
        margin_min: 6.0,
        margin_share_min: 0.1,
        named_margin_min: 12.0,
        named_min: 2,
        nameless_margin_min: 12.0,
        nameless_min: 3,
        accepts_nameless: false,
        overlap_min_m2: 15.0,
        agreement_min: 0.6,
        contradiction_max: 0.15,
        contradiction_proposed_max: 0.3,
        std_max_m: 0.2,
    };
}
