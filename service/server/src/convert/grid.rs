//! Rectangles of grids.

use meetpoint_geometry::{Cell, GridFrame, GridInfo, Point2};
use meetpoint_occupancy::Raster;
use meetpoint_proto::v1;
use meetpoint_storage::SessionId;

use crate::error::Error;

/// The cells that a box touches.
pub(crate) fn cells_in(frame: GridFrame, wire: v1::BoundingBox) -> Result<GridInfo, Error> {
    let v1::BoundingBox { min_x_m, min_y_m, max_x_m, max_y_m } = wire;
    let ordered = min_x_m < max_x_m && min_y_m < max_y_m;
    let limit_m = super::pose::COORDINATE_MAX_M;
    let near = [min_x_m, min_y_m, max_x_m, max_y_m].iter().all(|value| value.abs() <= limit_m);
    if !(ordered && near) {
        return Err(Error::field(
            "bounding_box",
            format!(
                "({min_x_m}, {min_y_m}) to ({max_x_m}, {max_y_m}) m: minima below maxima, within {limit_m} m"
            ),
        ));
    }
    let first = frame.cell_at(Point2::new(min_x_m, min_y_m));
    // A box that ends on a cell's edge does not touch the cell beyond.
    let inner = frame.resolution_m() * 1e-6;
    let last = frame.cell_at(Point2::new(max_x_m - inner, max_y_m - inner));
    let span = |first: i32, last: i32| u32::try_from(last - first + 1).unwrap_or(1);
    Ok(GridInfo {
        frame,
        first: Cell { x: first.x, y: first.y },
        width: span(first.x, last.x),
        height: span(first.y, last.y),
    })
}

/// What a grid is of.
#[derive(Clone, Debug)]
pub(crate) struct Drawn {
    pub(crate) map: String,
    pub(crate) version: u64,
    pub(crate) cost_revision: u64,
    /// The session in whose frame it is; `None` for the map's.
    pub(crate) frame: Option<SessionId>,
}

/// A grid for the wire.
pub(crate) fn to_wire(raster: &Raster, drawn: Drawn) -> v1::Grid {
    let Drawn { map, version, cost_revision, frame } = drawn;
    let origin = raster.info.origin();
    v1::Grid {
        map,
        map_version: version,
        cost_revision,
        resolution_m: raster.info.frame.resolution_m(),
        origin: Some(v1::Point { x_m: origin.x, y_m: origin.y }),
        width: raster.info.width,
        height: raster.info.height,
        cells: raster.percent(),
        frame_session: frame.map(|frame| frame.0.to_string()).unwrap_or_default(),
    }
}
