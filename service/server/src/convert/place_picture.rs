//! A map of places as a drawing: places as numbered dots, edges between them, ways that nobody has
//! gone as short lines, the robot's place red.

use meetpoint_geometry::{Point2, Vector2};
use meetpoint_places::{Gateway, Hypothesis, layout};

use super::sheet::{Colour, Sheet};
use crate::error::Error;

const EDGE: Colour = [120, 120, 120];
const UNEXPLORED: Colour = [240, 140, 30];
const PLACE: Colour = [31, 80, 180];
const ROBOT: Colour = [200, 30, 40];
const NUMBER: Colour = [255, 255, 255];

/// A way on the sheet: as if it were so many metres.
const WAY_M: f64 = 2.0;
/// Length of a way that nobody has gone, likewise.
const STUB_M: f64 = 0.7;
/// Angle between two of these at one place, radians.
const STUB_STEP_RAD: f64 = 0.6;
/// Radius of a place, in pixels.
const RADIUS: i64 = 14;

/// The drawing as a PNG.
///
/// # Errors
/// [`Error::Internal`] if it cannot be written.
pub(crate) fn png(of: &Hypothesis) -> Result<Vec<u8>, Error> {
    let places: Vec<Point2<f64>> =
        layout(&of.map).into_iter().map(|[x, y]| Point2::new(WAY_M * x, WAY_M * y)).collect();
    let mut sheet = Sheet::new(places.iter().copied());
    for from in of.map.gateways() {
        let Some(to) = of.map.leads_to(from) else { continue };
        let [from, to] = [from, to].map(|gateway| places[gateway.place.0 as usize]);
        sheet.line(from, to, EDGE, 1);
    }
    for (id, known) in of.map.places() {
        let gateways = (0..known.star.n_gateways()).map(|index| Gateway { place: id, index });
        let leads_to: Vec<Option<Gateway>> =
            gateways.map(|gateway| of.map.leads_to(gateway)).collect();
        let at = places[id.0 as usize];
        let neighbours = leads_to.iter().flatten().map(|to| places[to.place.0 as usize] - at);
        let away = -neighbours.sum::<Vector2<f64>>();
        let away_rad = away.y.atan2(away.x);
        let n_unexplored = leads_to.iter().filter(|to| to.is_none()).count();
        for stub in 0..n_unexplored {
            let off = stub as f64 - 0.5 * (n_unexplored as f64 - 1.0);
            let (sin, cos) = (away_rad + off * STUB_STEP_RAD).sin_cos();
            sheet.line(at, at + STUB_M * Vector2::new(cos, sin), UNEXPLORED, 1);
        }
    }
    for ((id, _), &at) in of.map.places().zip(&places) {
        sheet.dot(at, if id == of.at.place { ROBOT } else { PLACE }, RADIUS);
        sheet.number(at, id.0, NUMBER);
    }
    sheet.encoded()
}
