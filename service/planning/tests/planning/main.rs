//! Planning against its definitions.

mod consistency;
mod exact;
mod floors;
mod topological;
mod triplets;
