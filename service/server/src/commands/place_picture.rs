//! Places drawn over their grid: gateways red, ways from the core through those that a path passes
//! blue, to the others green; walls dark, what was never observed grey.

use meetpoint_occupancy::Raster;
use meetpoint_proto::v1;

use super::canvas::{Canvas, Colour};

const CORE: Colour = [25, 50, 120];
const GATEWAY: Colour = [214, 39, 40];
const PASSES: Colour = [31, 80, 220];
const ENDS: Colour = [60, 160, 120];
/// Radius of a place, in pixels.
const CORE_RADIUS: i64 = 5;

/// The picture as a PNG, top row first.
pub(super) fn png(raster: &Raster, places: &[v1::Place]) -> anyhow::Result<Vec<u8>> {
    let mut canvas = Canvas::new(raster);
    canvas.draw_occupancy(raster);
    for place in places {
        let core = canvas.pixel(place.core);
        for gateway in &place.gateways {
            let ends = [gateway.left, gateway.right].map(|end| canvas.pixel(end));
            let middle = [0, 1].map(|axis| i64::midpoint(ends[0][axis], ends[1][axis]));
            let way = if gateway.continues_to.is_some() { PASSES } else { ENDS };
            canvas.line([core, middle], way, 0);
            canvas.line(ends, GATEWAY, 1);
        }
    }
    for place in places {
        canvas.dot(canvas.pixel(place.core), CORE, CORE_RADIUS);
    }
    canvas.encoded()
}
