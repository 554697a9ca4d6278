//! Alignments of drawn worlds, and placements of many parts.

mod alignment;
mod drawn;
mod named;
mod placement;
