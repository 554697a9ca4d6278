//! Submaps: what was seen along a few metres of the way, as one rigid piece.

use std::collections::BTreeMap;
use std::ops::Range;

use meetpoint_geometry::{GridFrame, Point2, Pose};
use meetpoint_occupancy::{BeamModel, Grid, ScanMarks};

use crate::matching::field::Field;
use crate::matching::pyramid::Pyramid;
use crate::params::FieldParams;
use crate::scans::key_scan::KeyScan;
use crate::scans::laser_travel::LaserTravel;

/// How long submaps are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SubmapParams {
    /// A new one begins after this way, in metres...
    pub way_m: f64,
    /// ...or after so many key scans.
    pub n_keys_max: usize,
}

/// A stretch of key scans.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Submap {
    /// The travel that they are of.
    pub(crate) travel: usize,
    /// Its key scans.
    pub(crate) keys: Range<usize>,
    /// The one in the middle, whose pose is the submap's.
    pub(crate) anchor: usize,
}

/// All key scans, cut into submaps. The last of a travel may be shorter than the others.
pub(crate) fn submaps(keys: &[KeyScan], params: &SubmapParams) -> Vec<Submap> {
    let mut found = Vec::new();
    let mut first = 0;
    for index in 0..keys.len() {
        let way_m = keys[index].way_since_m(&keys[first]);
        if params.way_m <= way_m || params.n_keys_max <= index - first {
            found.push(submap(keys, first..index));
            first = index;
        }
    }
    if first < keys.len() {
        found.push(submap(keys, first..keys.len()));
    }
    found
}

fn submap(all: &[KeyScan], keys: Range<usize>) -> Submap {
    let anchor = usize::midpoint(keys.start, keys.end - 1);
    Submap { travel: all[anchor].travel, keys, anchor }
}

/// Some key scans drawn, to be searched.
#[derive(Debug)]
pub(crate) struct SubmapChart {
    pub(crate) grid: Grid,
    pub(crate) field: Field,
    pub(crate) pyramid: Pyramid,
}

impl SubmapChart {
    /// Draws some scans of a travel, given with their poses.
    pub(crate) fn new(
        travel: &LaserTravel,
        scans: impl Iterator<Item = (usize, Pose)>,
        frame: GridFrame,
        (model, params): (&BeamModel, &FieldParams),
    ) -> Self {
        let mut grid = Grid::new(frame);
        let mut marks = ScanMarks::new();
        for (scan, pose) in scans {
            let scan = &travel.scans[scan];
            if let Some(laser) = travel.lasers.get(scan.laser) {
                let pose = pose * laser.robot_from_sensor;
                grid.insert_scan(pose, &laser.geometry, &scan.ranges_m, model, &mut marks);
            }
        }
        let field = Field::new(&grid, params);
        let pyramid = Pyramid::new(&field, 0);
        Self { grid, field, pyramid }
    }

    /// Sees to it that the pyramid reaches up to `half` cells along each axis.
    pub(crate) fn reach(&mut self, half: i32) {
        if self.pyramid.half() < half {
            self.pyramid = Pyramid::new(&self.field, half);
        }
    }
}

/// Hits of some key scans, one of each square of `edge_m` metres, at most `n_max` of them and none
/// farther than `range_max_m` from the origin.
pub(crate) fn spread_points<'a>(
    keys: impl Iterator<Item = (&'a KeyScan, Pose)>,
    (edge_m, range_max_m): (f64, f64),
    n_max: usize,
) -> Vec<Point2<f64>> {
    let mut places = BTreeMap::new();
    for (key, pose) in keys {
        for facet in key.surface.facets() {
            let point = pose * facet.at.map(f64::from);
            if point.x.hypot(point.y) <= range_max_m {
                #[expect(clippy::cast_possible_truncation, reason = "within the range")]
                let square = ((point.x / edge_m).floor() as i32, (point.y / edge_m).floor() as i32);
                places.entry(square).or_insert(point);
            }
        }
    }
    let stride = places.len().div_ceil(n_max.max(1)).max(1);
    places.into_values().step_by(stride).collect()
}
