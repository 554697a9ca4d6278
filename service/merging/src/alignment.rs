//! What a search for alignments found.

use meetpoint_geometry::Pose;

use crate::reason::Reason;

/// A place where the newcomer may lie in the site, and what speaks for and against it.
#[derive(Clone, Debug, PartialEq)]
pub struct Alignment {
    /// The newcomer's frame seen from the site's: takes points of the newcomer's map to the site's.
    pub site_from_newcomer: Pose,
    /// Covariance of `site_from_newcomer` in the site's frame: x, y in metres, theta in radians, row by
    /// row. Of the newcomer's origin, which may be far from the overlap.
    pub covariance: [[f64; 3]; 3],
    /// Logarithm of the odds against the two maps lying nowhere on one another, by all walls of both
    /// that lie where the other one looked, and by landmarks with names.
    pub log_odds: f64,
    /// Logarithm of the odds against the likeliest other place; `None` if no other was found.
    pub margin: Option<f64>,
    /// Area that both maps have seen, in square metres.
    pub overlap_m2: f64,
    /// The same as a share of what the map that has seen less has seen, in 0..=1.
    pub overlap_share: f64,
    /// Walls of the newcomer that lie where the site has walls, as a share of those that lie where the
    /// site has seen; or the same of the site's walls, whichever is less. In 0..=1.
    pub agreement: f64,
    /// Walls of the newcomer where the site is clearly free, as a share of those that lie where the site
    /// has seen; or the same of the site's walls, whichever is more. In 0..=1.
    pub contradiction: f64,
    /// Landmarks with names that both maps have...
    pub n_named: usize,
    /// ...and those of them that lie together.
    pub n_named_agreeing: usize,
    /// Landmarks without names of the newcomer where the site has one of their type...
    pub n_nameless_agreeing: usize,
    /// ...and those of either map where the other has looked for them and has none.
    pub n_nameless_alone: usize,
}

/// Whether the newcomer is to be put into the site.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The first alignment is beyond doubt by the [`MergeRules`](crate::MergeRules).
    Merged,
    /// The first alignment is likely, and a person should look.
    Proposed,
    /// The newcomer fits, but at several places nearly as well: the alignments are rivals.
    Ambiguous,
    /// The two maps lie nowhere on one another, as far as they are drawn.
    NoOverlap,
    /// The newcomer (or the site) has seen too little to tell.
    NotEnoughSeen,
}

/// The answer of a search.
#[derive(Clone, Debug, PartialEq)]
pub struct Alignments {
    /// Whether to merge.
    pub verdict: Verdict,
    /// Why, the most important first; each is displayed as words and numbers.
    pub reasons: Vec<Reason>,
    /// What was found, the likeliest first; the others are its rivals. Empty if nothing fits.
    pub ranked: Vec<Alignment>,
    /// How it was searched.
    pub figures: SearchFigures,
}

/// How a search went.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SearchFigures {
    /// Pieces of the newcomer that were searched for in the site.
    pub n_patches: usize,
    /// Places where one of them fits.
    pub n_peaks: usize,
    /// Different places of the whole newcomer that these come to.
    pub n_places: usize,
    /// True if the directions of walls narrowed the headings (but for the pieces that are held best,
    /// which are searched for at all of them); false if walls give none, or nothing was found that
    /// way, and all headings were searched.
    pub by_wall_directions: bool,
}
