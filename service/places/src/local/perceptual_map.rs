//! Local perceptual maps: bounded grids in frames of their own.
//!
//! HSSH 2004, sections I-C and III-A: the map of "a simple local region", of which it is known which
//! positions are free within its bounds, and nothing of what lies beyond.

use std::collections::VecDeque;

use meetpoint_geometry::{Cell, GridInfo, Point2, Pose};
use meetpoint_occupancy::Raster;
use meetpoint_topology::FreeSpace;

use crate::local::medial_axis::{beside, cell_of};
use crate::local::params::LocalParams;
use crate::local::parsed_map::{LocalPlace, place_at};

/// A bounded grid around a place. Its frame is parallel to that of the map it was made from.
#[derive(Clone, Debug)]
pub struct LocalPerceptualMap {
    /// Its cells, in its own frame.
    pub raster: Raster,
    /// Where its frame lies in the map it was made from: a shift by whole cells.
    pub map_from_local: Pose,
}

impl LocalPerceptualMap {
    /// What of a grid can be reached from `point` without going farther than `radius_m` from it, and
    /// the walls beside; the cell of `point` is (0, 0). `None` unless that is free. Time O(cells of the
    /// square).
    pub fn cut(raster: &Raster, point: Point2<f64>, radius_m: f64) -> Option<Self> {
        let frame = raster.info.frame;
        let middle = frame.cell_at(point);
        let is_free = |cell: Cell| {
            let index = raster.info.index_of(cell)?;
            let log_odds_max = FreeSpace::PROBABILITY_MAX / (1.0 - FreeSpace::PROBABILITY_MAX);
            Some(f64::from(raster.log_odds[index]) < log_odds_max.ln())
        };
        if is_free(middle) != Some(true) || !radius_m.is_finite() {
            return None;
        }
        let info = square(raster.info, middle, radius_m)?;
        let mut local = Raster { info, log_odds: vec![f32::NAN; info.n_cells()] };
        let mut queue = VecDeque::from([middle]);
        let mut is_seen = vec![false; info.n_cells()];
        while let Some(cell) = queue.pop_front() {
            let (Some(to), Some(from)) = (info.index_of(cell), raster.info.index_of(cell)) else {
                continue;
            };
            if is_seen[to] || radius_m < (frame.center_of(cell) - frame.center_of(middle)).norm() {
                continue;
            }
            is_seen[to] = true;
            local.log_odds[to] = raster.log_odds[from];
            if is_free(cell) == Some(true) {
                queue.extend(beside(cell));
                // No way leads over a corner, but walls do.
                queue
                    .extend(corners(cell).into_iter().filter(|&cell| is_free(cell) == Some(false)));
            }
        }
        local.info.first = Cell {
            x: info.first.x.saturating_sub(middle.x),
            y: info.first.y.saturating_sub(middle.y),
        };
        let corner = frame.corner_of(middle);
        Some(Self { raster: local, map_from_local: Pose::new(corner.x, corner.y, 0.0) })
    }

    /// The place at a point of this map's frame, with its star, or what lies on a path there; `None`
    /// if there is neither, or the point is on the way to it.
    pub fn place_at(&self, point: Point2<f64>, params: &LocalParams) -> Option<LocalPlace> {
        place_at(&self.raster, point, params)
    }
}

/// The four cells at the corners of one.
fn corners(cell: Cell) -> [Cell; 4] {
    let [right, above, left, below] = beside(cell);
    [[right, above], [left, above], [left, below], [right, below]]
        .map(|[x, y]| Cell { x: x.x, y: y.y })
}

/// The cells within a radius of one, of those there are.
fn square(info: GridInfo, middle: Cell, radius_m: f64) -> Option<GridInfo> {
    #[expect(clippy::cast_possible_truncation, reason = "saturates, and is clipped below")]
    let reach = (radius_m / info.frame.resolution_m()).ceil() as i32;
    let last = cell_of(info, info.n_cells().checked_sub(1)?);
    let span = |middle: i32, first: i32, last: i32| {
        let from = middle.saturating_sub(reach).max(first);
        let to = middle.saturating_add(reach).min(last);
        (from, to.saturating_add(1).saturating_sub(from).unsigned_abs())
    };
    let (x, width) = span(middle.x, info.first.x, last.x);
    let (y, height) = span(middle.y, info.first.y, last.y);
    Some(GridInfo { first: Cell { x, y }, width, height, ..info })
}
