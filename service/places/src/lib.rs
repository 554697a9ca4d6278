//! Every topological map that fits what a robot has seen, which of them is simplest, and where to
//! go to find out.

mod assumptions;
mod difference;
mod drawing;
mod map_tree;
mod observation;
mod place_map;
mod rehearsal;
mod star;
mod travel;
mod world;

pub use assumptions::Assumptions;
pub use difference::{Difference, Sighting, first_difference, sightings};
pub use drawing::InvalidDrawing;
pub use map_tree::{Hypothesis, HypothesisId, MapTree, MapTreeParams, Refused};
pub use observation::{Observation, View};
pub use place_map::{Gateway, Place, PlaceId, PlaceMap};
pub use rehearsal::{Decision, Rehearsal, next_decision, rehearsal};
pub use star::{ControlLaw, InvalidStar, Opening, Star};
pub use travel::{InvalidTravel, Step, Travel};
pub use world::{InvalidRoute, World};
