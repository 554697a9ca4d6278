//! The next motion of a robot that stands anywhere.

use meetpoint_geometry::Point2;

use super::ends::{Located, Nowhere, locate};
use super::field::{Field, metres};
use super::paths::{Wanted, best};

/// Which way to go.
#[derive(Clone, Debug)]
pub(crate) struct Motion {
    pub(crate) position: Result<Located, Nowhere>,
    pub(crate) goal: Result<Located, Nowhere>,
    /// `None` if there is no way.
    pub(crate) step: Option<Step>,
    pub(crate) by_tables: bool,
}

/// A step towards the goal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Step {
    /// `None` in the goal's cell.
    pub(crate) heading_rad: Option<f64>,
    pub(crate) distance_left_m: f64,
    /// Id.
    pub(crate) region: u64,
    /// Id; 0 if no arc is crossed.
    pub(crate) next_arc: u64,
    /// Where the step leads, in metres.
    pub(crate) next: Point2<f64>,
}

/// The next motion from a point to another.
pub(crate) fn next_motion(
    field: &Field,
    position: Point2<f64>,
    goal: Point2<f64>,
    tolerance_m: f64,
) -> Motion {
    let plans = field.plans().map(AsRef::as_ref);
    let by_tables = plans.is_some();
    let [from, to] = [position, goal].map(|point| locate(field, point, tolerance_m));
    let step = |from: Located, to: Located| {
        let ends = [from.cell, to.cell];
        let (found, next) = field.with_searches(|searches| match plans {
            Some(plans) => {
                let found = best(field, Some(plans), searches, ends, Wanted::Route)?;
                let next = plans.next_cell(from.cell, to.cell, &mut searches.tables);
                Some((found, next))
            }
            None => {
                let found = best(field, None, searches, ends, Wanted::Cells)?;
                let next = found.cells.get(1).map(|&cell| cell as usize);
                Some((found, next))
            }
        })?;
        let here = field.center(from.cell);
        let next = match next {
            // Onto a cell first, if the robot is on none.
            _ if 0.0 < from.moved_m => from.point,
            Some(cell) => field.center(cell),
            None => here,
        };
        let origin = if 0.0 < from.moved_m { position } else { here };
        let along = next - origin;
        Some(Step {
            heading_rad: (next != origin).then(|| along.y.atan2(along.x)),
            distance_left_m: metres(found.cost, field.ground.side_m()),
            region: field.ground.region_id_at(from.cell),
            next_arc: found
                .route
                .get(1)
                .and_then(|(_, arc)| *arc)
                .map_or(0, |arc| field.ground.arc_id(arc)),
            next,
        })
    };
    let found = match (from, to) {
        (Ok(from), Ok(to)) => step(from, to),
        _ => None,
    };
    Motion { position: from, goal: to, step: found, by_tables }
}
