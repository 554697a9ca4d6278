//! A map made ready for branch and bound.

use meetpoint_geometry::{Cell, GridFrame, GridInfo, Pose, Vector2};
use meetpoint_occupancy::{Grid, Raster};
use meetpoint_tracking::{
    Candidate, Field, FieldParams, PeakParams, Pyramid, Window, peaks_in_window,
};
use nalgebra::Point2;

use crate::ground::{Ground, Known};
use crate::walls::Wall;

/// The walls' field about the map's middle.
#[derive(Clone, Debug)]
pub(crate) struct SearchField {
    field: Field,
    pyramid: Pyramid,
    /// The middle seen from the map.
    map_from_middle: Pose,
    /// Half the longer side of the map, in metres.
    half_m: f64,
}

/// Log-odds that stand for a wall.
const WALL: f32 = 1.0;
/// Edge of the cells that are searched, in cells of the ground: as fine as steps of the headings are.
const CELLS: f64 = 2.0;

impl SearchField {
    /// Of a map's walls. Places reach half a piece of `reach_m` beyond the map.
    pub(crate) fn new(ground: &Ground, walls: &[Wall], reach_m: f64, params: &FieldParams) -> Self {
        let info = ground.info;
        let side_m = |n: u32| f64::from(n) * ground.edge_m();
        let half_m = Vector2::new(0.5 * side_m(info.width), 0.5 * side_m(info.height));
        let middle = info.origin() + half_m;
        let frame = GridFrame::new(CELLS * ground.edge_m()).unwrap_or(info.frame);
        let half = frame.cell_at(Point2::from(half_m));
        let first = Cell { x: -half.x - 1, y: -half.y - 1 };
        let (width, height) = (2 * half.x.unsigned_abs() + 2, 2 * half.y.unsigned_abs() + 2);
        let info = GridInfo { frame, first, width, height };
        let mut log_odds = vec![f32::NAN; info.n_cells()];
        let cells = walls.iter().map(|wall| frame.cell_at(wall.at - middle.coords));
        for index in cells.filter_map(|cell| info.index_of(cell)) {
            log_odds[index] = WALL;
        }
        let field = Field::new(&Grid::from_raster(&Raster { info, log_odds }), params);
        #[expect(clippy::cast_possible_truncation, reason = "some hundred cells")]
        let margin = (reach_m / frame.resolution_m()).ceil() as i32;
        let pyramid = Pyramid::new(&field, half.x.max(half.y) + 1 + margin);
        let map_from_middle = Pose::new(middle.x, middle.y, 0.0);
        Self { field, pyramid, map_from_middle, half_m: half_m.max() }
    }

    /// The poses about a heading where some points fit, seen from the map.
    pub(crate) fn peaks(
        &self,
        points: &[Point2<f64>],
        (heading_rad, half_rad, step_rad): (f64, f64, f64),
        params: &PeakParams,
    ) -> Vec<Candidate> {
        let center = Pose::new(0.0, 0.0, heading_rad);
        let window = Window { center, half_m: self.half_m, half_rad, step_rad };
        let mut peaks = peaks_in_window((&self.field, &self.pyramid), points, &window, params);
        for peak in &mut peaks {
            peak.pose = self.map_from_middle * peak.pose;
        }
        peaks
    }
}

/// Area of all known cells, in square metres.
pub(crate) fn known_m2(ground: &Ground) -> f64 {
    let n_known = ground.cells().iter().filter(|&&known| known != Known::Unknown).count();
    n_known as f64 * ground.edge_m() * ground.edge_m()
}
