//! Named landmarks: what submaps saw of them, which sightings are believed to be of one thing, and where
//! they lie in the graph.

pub(crate) mod landmark_nodes;
pub(crate) mod landmark_search;
pub(crate) mod landmark_view;
