//! Planning against its definitions.

mod consistency;
mod exact;
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
