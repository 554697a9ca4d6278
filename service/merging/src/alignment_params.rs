//! Tunables of the search for alignments.

use std::f64::consts::PI;
use std::num::NonZero;

use meetpoint_tracking::{FieldParams, PeakParams};

/// Tunables of [`AlignmentSearch`](crate::AlignmentSearch). One set for all buildings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlignmentParams {
    /// Radius of the pieces of the newcomer that are searched for, in metres: a room with what is
    /// around it.
    pub patch_radius_m: f64,
    /// Middles of pieces lie about this far apart, in metres.
    pub patch_spacing_m: f64,
    /// Pieces that are searched for, at most.
    pub n_patches_max: usize,
    /// Walls of a piece that are matched: one a square of this edge, in metres...
    pub point_edge_m: f64,
    /// ...not more than this...
    pub n_points_max: usize,
    /// ...and not fewer.
    pub n_points_min: usize,
    /// Step of the headings, in radians: half of it moves a wall at 6 m by as much as half a cell of
    /// the search.
    pub step_rad: f64,
    /// Headings that are searched about one that the directions of walls say, to each side, in radians.
    pub half_rad: f64,
    /// The field that pieces are matched with.
    pub field: FieldParams,
    /// Which places of a piece are kept.
    pub peaks: PeakParams,
    /// Different places of the whole newcomer that are judged in full, at most.
    pub n_places_max: usize,
    /// Two places are two if the overlap lies as far apart as this, in metres...
    pub apart_m: f64,
    /// ...or is turned by this, in radians.
    pub apart_rad: f64,
    /// Alignments that are told, at most.
    pub n_told_max: usize,
    /// Threads that share a slice of work. What is found does not depend on it.
    pub n_threads: NonZero<usize>,
}

impl AlignmentParams {
    /// For maps of buildings by 2-D lasers.
    pub const INDOOR: Self = Self {
        patch_radius_m: 6.0,
        patch_spacing_m: 4.0,
        n_patches_max: 24,
        point_edge_m: 0.4,
        n_points_max: 80,
        n_points_min: 30,
        step_rad: 2.5 * PI / 180.0,
        half_rad: 5.0 * PI / 180.0,
        field: FieldParams { hit_std_m: 0.2, occupied_log_odds_min: 0.0 },
        peaks: PeakParams {
            score_min: 0.45,
            rival_share: 0.75,
            apart_m: 0.5,
            apart_rad: 10.0 * PI / 180.0,
            n_max: 12,
        },
        n_places_max: 24,
        apart_m: 1.0,
        apart_rad: 10.0 * PI / 180.0,
        n_told_max: 8,
        n_threads: NonZero::<usize>::MIN,
    };
}
