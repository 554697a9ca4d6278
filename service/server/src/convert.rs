//! Conversions between messages, domain types and records: one file per noun.
//!
//! Messages are taken apart by pattern, so that a new field breaks the build, and the field at
//! fault is named by its path.

pub(crate) mod causal;
pub(crate) mod change;
pub(crate) mod closure;
pub(crate) mod cost;
pub(crate) mod distinctive_place;
pub(crate) mod door;
pub(crate) mod exploration;
pub(crate) mod geojson;
pub(crate) mod graph;
pub(crate) mod grey_png;
pub(crate) mod grid;
pub(crate) mod hypothesis;
pub(crate) mod hypothesis_decision;
pub(crate) mod hypothesis_graph;
pub(crate) mod import;
pub(crate) mod job;
pub(crate) mod landmark;
pub(crate) mod map;
pub(crate) mod mapping_parameters;
pub(crate) mod merge;
pub(crate) mod merge_decision;
pub(crate) mod observation;
pub(crate) mod outline;
pub(crate) mod place;
pub(crate) mod place_graph_picture;
pub(crate) mod place_map;
pub(crate) mod place_picture;
pub(crate) mod place_visit;
pub(crate) mod plan;
pub(crate) mod pose;
pub(crate) mod qualitative;
pub(crate) mod qualitative_decision;
pub(crate) mod relaxation;
pub(crate) mod sensor;
pub(crate) mod session;
mod sheet;
pub(crate) mod slug;
pub(crate) mod table_picture;
pub(crate) mod trajectory;
pub(crate) mod tum;
pub(crate) mod value_picture;
pub(crate) mod way_picture;
