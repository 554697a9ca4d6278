//! Local perceptual maps, and the stars of places read off grids: HSSH 2004, section III.

pub(crate) mod branch;
pub(crate) mod fragments;
pub(crate) mod gateway;
pub(crate) mod large_scale_star;
pub(crate) mod medial_axis;
pub(crate) mod neighborhood;
pub(crate) mod params;
pub(crate) mod parsed_map;
pub(crate) mod perceptual_map;
pub(crate) mod scrolling_map;
pub(crate) mod sight;
pub(crate) mod small_scale_star;
pub(crate) mod walls;
