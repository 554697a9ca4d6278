//! Paths by look-up: plan tables over the regions of a map.

mod cost;
mod footprint;
mod gate_costs;
mod gates;
mod hierarchy;
mod inside;
mod meeting;
mod pair_bounds;
mod plans;
mod region_table;
mod route;
mod space;
mod walk;
mod wave;

pub use cost::{Cost, DIAGONAL, STRAIGHT, UNREACHABLE, WEIGHT_ONE, length_cells};
pub use footprint::enterable;
pub use inside::Scratch;
pub use plans::{ArcCost, Plans, Size};
pub use route::{GateIndex, Route, RouteStep};
pub use space::{InvalidSpace, Space};
pub use walk::GridPath;
