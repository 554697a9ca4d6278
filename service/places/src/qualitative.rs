//! The qualitative explorer NX: distinctive places found by hill-climbing, edges travelled by
//! local control strategies, and the graph of both, from range readings and a heading alone.
//!
//! B. J. Kuipers and Y.-T. Byun, "A robust, qualitative method for robot spatial learning",
//! AAAI 1988 (below: KB 1988).

mod arrival;
mod body;
mod cones;
mod control;
mod distinctiveness;
mod edge_log;
mod explorer;
mod firings;
mod guide;
mod heading_error;
mod hill_climb;
mod itinerary;
mod outlook;
mod pilot;
mod place_graph;
mod readings;
mod ring;
mod surroundings;
mod travel_edge;
mod trial;

pub use arrival::Arrival;
pub use body::{Body, Explored, explore};
pub use cones::{Cones, N_CONES};
pub use control::{Strategy, fitting, steering_rad};
pub use distinctiveness::{Distinctiveness, Goal, distinctiveness, goal};
pub use explorer::{Explorer, ExplorerParams, ExplorerState, SelectionRule, Whereabouts};
pub use guide::{Firing, Guide, GuideParams};
pub use heading_error::HeadingError;
pub use hill_climb::climb;
pub use itinerary::{Itinerary, Stop};
pub use outlook::Outlook;
pub use pilot::PilotParams;
pub use place_graph::{KnownPlace, PlaceGraph};
pub use readings::{Command, Readings};
pub use ring::Ring;
pub use surroundings::{NearObject, OpenDirection, Scale, Surroundings, surroundings};
pub use travel_edge::{Averaged, TravelEdge, Traversal};
pub use trial::Rehearsing;
