//! A map made ready for branch and bound.

use meetpoint_geometry::{Cell, GridInfo, Pose};
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

impl SearchField {
    /// Of a map's walls. Places reach half a piece of `reach_m` beyond the map.
    pub(crate) fn new(ground: &Ground, walls: &[Wall], reach_m: f64, params: &FieldParams) -> Self {
        let (info, frame) = (ground.info, ground.info.frame);
        let half = |n: u32| i32::try_from(n / 2).unwrap_or(0);
        let middle = (half(info.width), half(info.height));
        let shifted = GridInfo { first: Cell { x: -middle.0, y: -middle.1 }, ..info };
        let mut log_odds = vec![f32::NAN; info.n_cells()];
        for index in walls.iter().filter_map(|wall| info.index_of(frame.cell_at(wall.at))) {
            log_odds[index] = WALL;
        }
        let grid = Grid::from_raster(&Raster { info: shifted, log_odds });
        let field = Field::new(&grid, params);
        let half = half(info.width.max(info.height)) + 1;
        #[expect(clippy::cast_possible_truncation, reason = "some hundred cells")]
        let margin = (reach_m / ground.edge_m()).ceil() as i32;
        let pyramid = Pyramid::new(&field, half + margin);
        let corner =
            frame.corner_of(Cell { x: info.first.x + middle.0, y: info.first.y + middle.1 });
        let map_from_middle = Pose::new(corner.x, corner.y, 0.0);
        Self { field, pyramid, map_from_middle, half_m: f64::from(half) * ground.edge_m() }
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
