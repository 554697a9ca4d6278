//! From free cells to regions, step by step as the paper goes in section 3.1.
//!
//! S. Thrun, "Learning metric-topological maps for indoor mobile robot navigation", Artificial
//! Intelligence 99 (1998).

use std::f64::consts::PI;

use crate::clearance::{Clearance, clearance};
use crate::constriction::{ConstrictionParams, constrictions};
use crate::critical::{CriticalParams, CriticalPoint, minima, points_at};
use crate::critical_line::{CriticalLine, critical_lines};
use crate::free::FreeSpace;
use crate::graph::Region;
use crate::meet_points::MeetPointParams;
use crate::regions::{Partition, partition};
use crate::voronoi::{Making, Voronoi, VoronoiParams};

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
    /// Of the points where lines of the diagram meet, turn or end.
    pub meet_points: MeetPointParams,
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
            area_min_m2: Region::SPECK_AREA_MAX_M2,
        },
        meet_points: MeetPointParams::INDOOR,
    };
}

/// What is found on the way from free cells to regions.
#[derive(Clone, Debug, PartialEq)]
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
    /// What it was found from, and on the way.
    pub(crate) trace: Trace,
}

/// What is kept so that a change of the space costs no more than it must.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Trace {
    pub(crate) params: TopologyParams,
    pub(crate) space: FreeSpace,
    /// The space without islands.
    pub(crate) open: FreeSpace,
    pub(crate) making: Making,
    /// Cells of the diagram where the clearance is a local minimum.
    pub(crate) minima: Vec<usize>,
    /// One a critical point.
    pub(crate) lines: Vec<CriticalLine>,
    /// Regions between all of those.
    pub(crate) fine: Partition,
}

/// Cuts free space into regions. Time O(cells log cells), space O(cells).
pub fn segmentation(space: &FreeSpace, params: &TopologyParams) -> Segmentation {
    let open = space.without_islands(params.island_extent_max_m);
    let clearance = clearance(&open);
    let (making, voronoi) = Making::new(&open, &clearance, &params.voronoi);
    let minima = minima(&voronoi, &clearance, &params.critical, voronoi.cells().iter().copied());
    let points = points_at(&minima, &clearance, &params.critical);
    let lines = critical_lines(&open, &clearance, &points, params.constriction.depth_m);
    let fine = partition(space, lines.iter().flat_map(|line| &line.crossings));
    let trace = Trace { params: *params, space: space.clone(), open, making, minima, lines, fine };
    trace.segmentation(clearance, voronoi, points)
}

impl Trace {
    /// The last step: which lines are doors.
    pub(crate) fn segmentation(
        self,
        clearance: Clearance,
        voronoi: Voronoi,
        points: Vec<CriticalPoint>,
    ) -> Segmentation {
        let (lines, partition) =
            constrictions(&self.fine, self.lines.clone(), &clearance, &self.params.constriction);
        Segmentation { clearance, voronoi, points, lines, partition, trace: self }
    }
}
