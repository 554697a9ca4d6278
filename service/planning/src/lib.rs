//! Paths by look-up.

mod cost;
mod footprint;
mod space;

pub use cost::{Cost, DIAGONAL, STRAIGHT, UNREACHABLE, WEIGHT_ONE, length_cells};
pub use footprint::enterable;
pub use space::{InvalidSpace, Space};
