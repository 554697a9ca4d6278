//! Tunables of the relaxation of laser sessions.

use std::f64::consts::PI;

use crate::key_scan::KeyScanParams;
use crate::params::MappingParams;

/// Tunables of [`LaserRelaxation`](crate::LaserRelaxation).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaserRelaxationParams {
    /// Those of live mapping: how scans are drawn, and what a likelihood field is.
    pub mapping: MappingParams,
    /// Edge of the cells of submaps and of the maps that are measured, in metres.
    pub resolution_m: f64,
    /// Which scans the pose graph is made of.
    pub key_scans: KeyScanParams,
}

impl LaserRelaxationParams {
    /// For 2-D lasers on wheeled robots in buildings.
    pub const INDOOR: Self = Self {
        mapping: MappingParams::INDOOR,
        resolution_m: 0.05,
        key_scans: KeyScanParams { distance_m: 0.3, turn_rad: 12.0 * PI / 180.0, range_max_m: 40.0 },
    };
}
