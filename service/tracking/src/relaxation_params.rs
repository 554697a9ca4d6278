//! Tunables of the relaxation of laser sessions.

use std::f64::consts::PI;
use std::num::NonZero;

use crate::closures::submap::SubmapParams;
use crate::graph::pose_graph::PoseGraphParams;
use crate::matching::peaks::PeakParams;
use crate::params::MappingParams;
use crate::scans::chain::OdometryParams;
use crate::scans::key_scan::KeyScanParams;
use crate::scans::neighbours::NeighbourParams;
use crate::scans::scan_pair::PairParams;

/// Tunables of [`LaserRelaxation`](crate::LaserRelaxation).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaserRelaxationParams {
    /// Those of live mapping: how scans are drawn, and what a likelihood field is.
    pub mapping: MappingParams,
    /// Edge of the cells of submaps and of the maps that are measured, in metres.
    pub resolution_m: f64,
    /// Which scans the pose graph is made of.
    pub key_scans: KeyScanParams,
    /// How odometry errs.
    pub odometry: OdometryParams,
    /// Standard deviation of a facet's place as another scan has it, in metres.
    pub facet_std_m: f64,
    /// How the way is cut.
    pub submaps: SubmapParams,
    /// When two submaps are believed to be one place.
    pub closures: ClosureParams,
    /// Which key scans of other passes are matched.
    pub neighbours: NeighbourParams,
    /// Sweeps over the chain alone.
    pub n_chain_sweeps: u32,
    /// The first sweeps over all pairs, which look wider.
    pub n_wide_sweeps: u32,
    /// Sweeps over all pairs, at most.
    pub n_sweeps_max: u32,
    /// Rounds in which each key scan is matched with the map of all.
    pub n_map_rounds: u32,
    /// How the pose graph of submaps is solved.
    pub graph: PoseGraphParams,
    /// How that of key scans is solved in each sweep: the next one goes on from there.
    pub sweep_graph: PoseGraphParams,
    /// Threads that share the work of a slice. What is found does not depend on it.
    pub n_threads: NonZero<usize>,
}

/// When two submaps are believed to be one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosureParams {
    /// Way between two submaps, in metres, below which the chain says enough.
    pub way_min_m: f64,
    /// Submaps are laid over one another if their anchors may lie this near, in metres.
    pub reach_m: f64,
    /// Submaps that one is laid over in a pass, at most.
    pub n_candidates_max: usize,
    /// Half the window in standard deviations.
    pub n_std: f64,
    /// No half window is smaller, in metres...
    pub half_min_m: f64,
    /// ...or larger.
    pub half_max_m: f64,
    /// The same for headings, in radians.
    pub half_min_rad: f64,
    /// The same for headings, in radians.
    pub half_max_rad: f64,
    /// Step of the headings, in radians.
    pub step_rad: f64,
    /// Hits that are matched: one a square of this edge, in metres...
    pub point_edge_m: f64,
    /// ...no farther than this, in metres...
    pub point_range_m: f64,
    /// ...not more than this...
    pub n_points_max: usize,
    /// ...and not fewer.
    pub n_points_min: usize,
    /// Mean of the field over the hits that a match has at least, in 0..=1.
    pub score_min: f64,
    /// Deviation of the score of a right match from one view to the next.
    pub score_std: f64,
    /// Logarithm of the odds against any other place of the window.
    pub log_odds_min: f64,
    /// Two places are two if they are as far apart as this, in metres...
    pub apart_m: f64,
    /// ...or as this, in radians.
    pub apart_rad: f64,
    /// Scans of a submap that are asked whether they agree.
    pub n_scans_max: usize,
    /// Share of them that must.
    pub agreeing_share_min: f64,
    /// Share of the hits that may lie where others saw through.
    pub contradicted_share_max: f64,
    /// Where the graph is less sure than this, in metres, a closure is not believed alone.
    pub alone_std_m: f64,
    /// Two closures say the same if the square of the difference, in units of its covariance, is at
    /// most this.
    pub support_chi2_max: f64,
    /// Square of its residual at which a closure is half doubted.
    pub chi2_turn: f64,
    /// A closure with a larger square is refused in the end.
    pub inconsistent_chi2_min: f64,
    /// Deviations that the graph has at least, in metres...
    pub graph_std_m: f64,
    /// ...and radians: what its bound may have left out.
    pub graph_std_rad: f64,
    /// Deviations that a match has at least, in metres...
    pub match_std_m: f64,
    /// ...and radians: how far a submap is from rigid.
    pub match_std_rad: f64,
    /// A rival has at least this share of the best score.
    pub rival_share: f64,
    /// Rivals that are kept, at most.
    pub n_peaks_max: usize,
    /// Passes over all submaps, at most.
    pub n_passes_max: u32,
}

impl ClosureParams {
    /// What counts as a place of its own.
    pub(crate) fn peaks(&self) -> PeakParams {
        PeakParams {
            score_min: self.score_min,
            rival_share: self.rival_share,
            apart_m: self.apart_m,
            apart_rad: self.apart_rad,
            n_max: self.n_peaks_max,
        }
    }
}

impl LaserRelaxationParams {
    /// How scans are matched at last.
    pub(crate) fn pairs(&self) -> PairParams {
        PairParams { gate_m: 0.1, turn_m: 0.05, facet_std_m: self.facet_std_m }
    }

    /// How scans are matched at first: before the walls of several passes have met.
    pub(crate) fn wide_pairs(&self) -> PairParams {
        PairParams { gate_m: 0.25, turn_m: 0.1, facet_std_m: self.facet_std_m }
    }

    /// The same with less patience, for what is done again and again while robots drive: two passes over
    /// what is new, and as many sweeps over it as bring centimetres. What remains is left to a
    /// relaxation in full.
    #[must_use]
    pub fn in_passing(self) -> Self {
        Self {
            closures: ClosureParams { n_passes_max: 2, ..self.closures },
            n_chain_sweeps: 1,
            n_wide_sweeps: 1,
            n_sweeps_max: 2,
            n_map_rounds: 0,
            ..self
        }
    }

    /// For 2-D lasers on wheeled robots in buildings.
    pub const INDOOR: Self = Self {
        mapping: MappingParams::INDOOR,
        resolution_m: 0.05,
        key_scans: KeyScanParams {
            distance_m: 0.3,
            turn_rad: 12.0 * PI / 180.0,
            range_max_m: 40.0,
        },
        odometry: OdometryParams {
            std_m: 0.02,
            std_per_m: 0.05,
            std_rad: 0.02,
            std_per_rad: 0.1,
            chi2_turn: 9.0,
        },
        facet_std_m: 0.05,
        submaps: SubmapParams { way_m: 4.0, n_keys_max: 24 },
        closures: ClosureParams {
            way_min_m: 10.0,
            reach_m: 5.0,
            n_candidates_max: 6,
            n_std: 3.0,
            half_min_m: 0.5,
            half_max_m: 8.0,
            half_min_rad: 10.0 * PI / 180.0,
            half_max_rad: PI / 4.0,
            step_rad: PI / 180.0,
            point_edge_m: 0.1,
            point_range_m: 12.0,
            n_points_max: 250,
            n_points_min: 40,
            score_min: 0.4,
            score_std: 0.03,
            log_odds_min: 7.0,
            apart_m: 0.5,
            apart_rad: 15.0 * PI / 180.0,
            n_scans_max: 6,
            agreeing_share_min: 0.6,
            contradicted_share_max: 0.2,
            alone_std_m: 0.4,
            support_chi2_max: 16.0,
            chi2_turn: 16.0,
            inconsistent_chi2_min: 16.0,
            graph_std_m: 0.1,
            graph_std_rad: 2.0 * PI / 180.0,
            match_std_m: 0.02,
            match_std_rad: 0.3 * PI / 180.0,
            rival_share: 0.6,
            n_peaks_max: 8,
            n_passes_max: 3,
        },
        neighbours: NeighbourParams { radius_m: 3.0, n_passes_max: 6, way_max_m: 12.0 },
        n_chain_sweeps: 2,
        n_wide_sweeps: 2,
        n_sweeps_max: 10,
        n_map_rounds: 1,
        graph: PoseGraphParams { n_iterations_max: 20, fall_min: 1e-4 },
        sweep_graph: PoseGraphParams { n_iterations_max: 2, fall_min: 1e-3 },
        n_threads: NonZero::<usize>::MIN,
    };
}
