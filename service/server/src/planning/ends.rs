//! Where a point that is asked about lies: in a cell that the robot can be at, or why not.

use meetpoint_geometry::Point2;
use meetpoint_planning::nearest_enterable;

use super::field::Field;

/// A place that the robot can be at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Located {
    /// Index of the cell.
    pub(crate) cell: usize,
    /// The point asked for, or the centre of the cell if that had to be moved.
    pub(crate) point: Point2<f64>,
    /// How far it was moved, in metres.
    pub(crate) moved_m: f64,
}

/// Why the robot cannot be at a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Nowhere {
    /// An obstacle, or one nearer than the robot's radius.
    Occupied,
    /// Never observed.
    Unknown,
    /// Outside of all that was observed.
    Outside,
}

/// Where the robot is taken to be that says it is at `point`; moved by at most `tolerance_m`.
pub(crate) fn locate(
    field: &Field,
    point: Point2<f64>,
    tolerance_m: f64,
) -> Result<Located, Nowhere> {
    if let Some(found) = nearest_enterable(&field.space, point, tolerance_m) {
        let meetpoint_planning::Nearest { cell, point, moved_m } = found;
        return Ok(Located { cell, point, moved_m });
    }
    let info = field.info();
    match info.index_of(info.frame.cell_at(point)) {
        None => Err(Nowhere::Outside),
        Some(cell) if is_rim(cell, info.width as usize, info.height as usize) => {
            Err(Nowhere::Outside)
        }
        Some(cell) if field.ground.is_unknown(cell) => Err(Nowhere::Unknown),
        Some(_) => Err(Nowhere::Occupied),
    }
}

/// The rim around what was observed belongs to the cells, but not to the map.
fn is_rim(cell: usize, width: usize, height: usize) -> bool {
    let (x, y) = (cell % width, cell / width);
    x == 0 || y == 0 || x + 1 == width || y + 1 == height
}
