//! Tunables of the relaxation of laser sessions.

use crate::params::MappingParams;

/// Tunables of [`LaserRelaxation`](crate::LaserRelaxation).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaserRelaxationParams {
    /// Those of live mapping: how scans are drawn, and what a likelihood field is.
    pub mapping: MappingParams,
    /// Edge of the cells of submaps and of the maps that are measured, in metres.
    pub resolution_m: f64,
}

impl LaserRelaxationParams {
    /// For 2-D lasers on wheeled robots in buildings.
    pub const INDOOR: Self = Self { mapping: MappingParams::INDOOR, resolution_m: 0.05 };
}
