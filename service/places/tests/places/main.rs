//! Trees of topological maps, against their definition and in figures; NX in its environments.

mod asking;
mod causal;
mod definition;
mod driven;
mod enumeration;
mod figures;
mod frames;
mod local;
mod measured;
mod nested_loops;
mod nx_guided;
mod nx_measures;
mod nx_worlds;
mod regions;
mod scrolling;
mod shortest;
