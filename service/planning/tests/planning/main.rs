//! Planning against its definitions.

mod consistency;
mod exact;
mod exploration;
mod exploration_values;
mod floors;
mod footprint;
mod inside;
mod nearest;
mod reachable;
mod search;
mod shape;
mod smooth;
mod squares;
mod topological;
mod triplets;
mod value_iteration;
mod visibility;
