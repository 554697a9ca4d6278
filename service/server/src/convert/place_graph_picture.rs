//! A graph of distinctive places as a drawing: places as numbered dots where dead reckoning has them, home
//! green, that of the robot red; edges between them, directions that nobody explored as short lines.

use meetpoint_geometry::{Point2, Vector2};
use meetpoint_places::qualitative::Explorer;
use meetpoint_places::{Gateway, PlaceId};

use super::sheet::{Colour, Sheet};
use crate::error::Error;

const EDGE: Colour = [120, 120, 120];
const UNEXPLORED: Colour = [240, 140, 30];
const PLACE: Colour = [31, 80, 180];
const HOME: Colour = [30, 130, 60];
const ROBOT: Colour = [200, 30, 40];
const NUMBER: Colour = [255, 255, 255];

/// An edge leaves a place along its direction for so many metres: one that bends looks bent.
const LEAVE_M: f64 = 0.8;
/// Share of the distance between two places, at most, that it does so.
const LEAVE_SHARE: f64 = 0.3;
/// Length of a direction that nobody explored, in metres.
const STUB_M: f64 = 1.2;
/// Radius of a place, in pixels.
const RADIUS: i64 = 12;

/// The drawing as a PNG.
///
/// # Errors
/// [`Error::Internal`] if it cannot be written.
pub(crate) fn png(explorer: &Explorer) -> Result<Vec<u8>, Error> {
    let graph = explorer.graph();
    let ids = || graph.map().places().map(|(id, _)| id);
    let at = |id: PlaceId| graph.place(id).map_or_else(Point2::origin, |known| known.seen.position);
    let towards = |from: Gateway| {
        let known = graph.place(from.place);
        let heading_rad = known
            .and_then(|known| known.seen.directions.get(usize::from(from.index)))
            .map_or(0.0, |direction| direction.heading_rad);
        Vector2::new(heading_rad.cos(), heading_rad.sin())
    };
    let mut sheet = Sheet::new(ids().map(at));
    sheet.rule();
    for edge in graph.edges() {
        let far_m = (at(edge.ends[0].place) - at(edge.ends[1].place)).norm();
        let leave_m = LEAVE_M.min(LEAVE_SHARE * far_m);
        let left = edge.ends.map(|end| at(end.place) + leave_m * towards(end));
        for (end, left) in edge.ends.iter().zip(left) {
            sheet.line(at(end.place), left, EDGE, 1);
        }
        sheet.line(left[0], left[1], EDGE, 1);
    }
    for gateway in graph.agenda() {
        let from = at(gateway.place);
        sheet.line(from, from + STUB_M * towards(gateway), UNEXPLORED, 1);
    }
    let robots = explorer.last_place().map(|came_by| came_by.place);
    for id in ids() {
        let is_home = graph.place(id).is_some_and(|known| known.seen.is_home);
        let paint = if Some(id) == robots {
            ROBOT
        } else if is_home {
            HOME
        } else {
            PLACE
        };
        sheet.dot(at(id), paint, RADIUS);
        sheet.number(at(id), id.0, NUMBER);
    }
    sheet.encoded()
}
