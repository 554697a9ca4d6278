//! Trees of topological maps, against their definition and in figures.

mod figures;
