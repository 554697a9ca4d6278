//! Closures: places that the robot came back to, found between submaps and judged.

pub(crate) mod closure;
pub(crate) mod closure_search;
pub(crate) mod evidence;
pub(crate) mod joined;
pub(crate) mod known_closures;
pub(crate) mod ledger;
pub(crate) mod overlay;
pub(crate) mod slide;
pub(crate) mod submap;
pub(crate) mod submap_charts;
pub(crate) mod submap_graph;
pub(crate) mod submap_match;
