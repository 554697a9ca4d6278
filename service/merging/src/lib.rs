//! Where one robot's map lies in another's, and whether to believe it.
//!
//! Two maps that were made apart, each in a frame of its own, are [`Part`]s. [`AlignmentSearch`] looks
//! for where the *newcomer* lies in the *site*, judges each place by all that both maps say, and ends in
//! a [`Verdict`] with its reasons: [`Alignments`]. [`placed`] makes one placement of any number of parts
//! of alignments two by two. [`preview`] draws one map over the other.
//!
//! These names and fields are what the service is built on; they are kept stable.

mod alignment;
mod alignment_params;
mod alignment_search;
mod evidence;
mod ground;
mod looked;
mod merge_rules;
mod named_landmarks;
mod nameless_landmarks;
mod nearest_walls;
mod overlap;
mod part;
mod patches;
mod placement;
mod preview;
mod reason;
mod refinement;
mod rivals;
mod search_field;
mod slides;
mod verdict;
mod walls;

pub use alignment::{Alignment, Alignments, SearchFigures, Verdict};
pub use alignment_params::AlignmentParams;
pub use alignment_search::{AlignmentProgress, AlignmentSearch};
pub use looked::Look;
pub use merge_rules::MergeRules;
pub use named_landmarks::NamedLandmark;
pub use nameless_landmarks::NamelessLandmark;
pub use part::Part;
pub use placement::{PairAlignment, PairFate, Placement, placed};
pub use preview::preview;
pub use reason::Reason;
