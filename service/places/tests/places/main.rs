//! Trees of topological maps, against their definition and in figures.

mod asking;
mod definition;
mod enumeration;
mod figures;
mod nested_loops;
mod shortest;
