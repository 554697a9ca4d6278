//! Every topological map that fits what a robot has seen, which of them is simplest, and where to
//! go to find out.

mod assumptions;
mod map_tree;
mod observation;
mod place_map;
mod star;
mod travel;

pub use assumptions::Assumptions;
pub use map_tree::{Hypothesis, HypothesisId, MapTree, MapTreeParams, Refused};
pub use observation::{Observation, View};
pub use place_map::{Gateway, Place, PlaceId, PlaceMap};
pub use star::{ControlLaw, InvalidStar, Opening, Star};
pub use travel::{InvalidTravel, Step, Travel};
