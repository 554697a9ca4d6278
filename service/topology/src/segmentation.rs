//! From free cells to regions, step by step as the paper goes in section 3.1.
//!
//! S. Thrun, "Learning metric-topological maps for indoor mobile robot navigation", Artificial
//! Intelligence 99 (1998).

use std::f64::consts::PI;

use crate::clearance::{Clearance, clearance};
use crate::constriction::{ConstrictionParams, constrictions};
use crate::critical::{CriticalParams, CriticalPoint, critical_points};
use crate::critical_line::{CriticalLine, critical_lines};
use crate::free::FreeSpace;
use crate::regions::{Partition, partition};
use crate::voronoi::{Voronoi, VoronoiParams, voronoi};

/// Tunables of [`segmentation`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TopologyParams {
    /// An obstacle that stands alone is no wall if the diagonal of its bounding box is shorter, in
    /// metres.
    pub island_extent_max_m: f64,
    /// Of the diagram.
    pub voronoi: VoronoiParams,
    /// Of its critical points.
    pub critical: CriticalParams,
    /// Of the choice among their lines.
    pub constriction: ConstrictionParams,
}

impl TopologyParams {
    /// Buildings for people, and robots of 0.3 to 1 m in them.
    ///
    /// Legs of furniture, pillars and people are within 1 m; a wall between two doors is longer. A
    /// gap under 0.5 m lets no robot through, and a room's square corner shows an angle of 90
    /// degrees, a rough wall a few: 60 lies between. Door frames are up to 0.6 m deep, and 0.3 m to
    /// either side of a minimum spans the roughness of a mapped wall. What is under 2 square metres
    /// holds nobody. The two ratios say "notably": a fifth more space on both sides.
    pub const INDOOR: Self = Self {
        island_extent_max_m: 1.0,
        voronoi: VoronoiParams { basis_angle_min_rad: PI / 3.0, basis_distance_min_m: 0.5 },
        critical: CriticalParams { epsilon_m: 0.3, opening_min_rad: 2.0 * PI / 3.0 },
        constriction: ConstrictionParams {
            widening_min: 1.2,
            opening_min: 1.2,
            depth_m: 0.6,
            area_min_m2: 2.0,
        },
    };
}

/// What is found on the way from free cells to regions.
#[derive(Clone, Debug)]
pub struct Segmentation {
    /// Distance of every cell to the walls.
    pub clearance: Clearance,
    /// Voronoi diagram of the walls.
    pub voronoi: Voronoi,
    /// All critical points of the diagram.
    pub points: Vec<CriticalPoint>,
    /// The lines that bound regions, a choice of those of `points`.
    pub lines: Vec<CriticalLine>,
    /// The regions of the free cells.
    pub partition: Partition,
}

/// Cuts free space into regions. Time O(cells log cells), space O(cells).
pub fn segmentation(space: &FreeSpace, params: &TopologyParams) -> Segmentation {
    let open = space.without_islands(params.island_extent_max_m);
    let clearance = clearance(&open);
    let voronoi = voronoi(&open, &clearance, &params.voronoi);
    let points = critical_points(&voronoi, &clearance, &params.critical);
    let all = critical_lines(&open, &clearance, &points, params.constriction.depth_m);
    let fine = partition(space, all.iter().flat_map(|line| &line.crossings));
    let (lines, partition) = constrictions(&fine, all, &clearance, &params.constriction);
    Segmentation { clearance, voronoi, points, lines, partition }
}
