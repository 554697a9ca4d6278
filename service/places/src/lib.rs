//! Every topological map that fits what a robot has seen, which of them is simplest, and where to
//! go to find out.

mod assumptions;
mod boundary_regions;
mod causal;
mod consistent_frame;
mod difference;
mod drawing;
mod edge_records;
mod errand;
mod isomorphism;
mod layout;
mod local;
mod map_tree;
mod observation;
mod place_map;
pub mod qualitative;
mod rehearsal;
mod route;
mod star;
mod travel;
mod world;

pub use assumptions::Assumptions;
pub use boundary_regions::{BoundaryRegions, boundary_regions};
pub use causal::{
    Action, CausalSchema, CausalView, CausalWorld, Facing, Outcome, ToldApart, TurnSide,
    causal_world, told_apart,
};
pub use consistent_frame::{ConsistentFrame, FrameParams, consistent_frame};
pub use difference::{Difference, Sighting, first_difference, sightings};
pub use drawing::InvalidDrawing;
pub use edge_records::{EdgeRecord, EdgeRecords, TravelRecord};
pub use errand::{Errand, Selection, next_errand};
pub use isomorphism::is_isomorphic;
pub use layout::layout;
pub use local::fragments::passages;
pub use local::gateway::{GatewayCriterion, LocalGateway};
pub use local::large_scale_star::{DState, LargeScaleStar};
pub use local::params::{
    FragmentParams, GatewayParams, LawParams, LocalParams, NeighborhoodParams,
};
pub use local::parsed_map::{LocalPlace, ParsedMap, parsed_map};
pub use local::perceptual_map::LocalPerceptualMap;
pub use local::scrolling_map::ScrollingMap;
pub use local::small_scale_star::{DirectedFragment, SmallScaleStar, TravelLaw};
pub use map_tree::{Hypothesis, HypothesisId, MapTree, MapTreeParams, Refused};
pub use observation::{Observation, View};
pub use place_map::{Gateway, Pass, Place, PlaceId, PlaceMap};
pub use rehearsal::{Decision, Rehearsal, next_decision, rehearsal};
pub use route::{Leg, route};
pub use star::{ControlLaw, InvalidStar, Opening, Star};
pub use travel::{InvalidTravel, Step, Travel};
pub use world::{InvalidRoute, World};
