//! A scan matched against the likelihood field of a map.

pub(crate) mod descent;
pub(crate) mod field;
pub(crate) mod peaks;
pub(crate) mod points;
pub(crate) mod pyramid;
pub(crate) mod search;
pub(crate) mod tile_hashing;
pub(crate) mod wide_search;
