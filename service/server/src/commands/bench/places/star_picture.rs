//! Stars drawn over plans: gateways red, ways from the core through those that a path passes blue, others green;
//! cores dark, or orange where what lies there is part of a path and no place.

use std::path::Path;

use meetpoint_geometry::{Point2, Vector2};
use meetpoint_occupancy::Raster;
use meetpoint_places::LocalPlace;
use meetpoint_proto::v1;

use crate::commands::canvas::{Canvas, Colour};

const DOOR: Colour = [255, 210, 0];
const CORE: Colour = [25, 50, 120];
const ON_PATH: Colour = [255, 140, 0];
const GATEWAY: Colour = [214, 39, 40];
const GATEWAY_ON_PATH: Colour = [255, 170, 120];
const PASSES: Colour = [31, 80, 220];
const ENDS: Colour = [60, 160, 120];
/// Radius of a place, in pixels.
const CORE_RADIUS: i64 = 6;
/// How far a gateway's direction outward is drawn, in metres.
const OUT_M: f64 = 0.4;

/// A picture of places, with the cells of doors, as a PNG file.
pub(super) fn save(
    raster: &Raster,
    doors: &[Vec<Point2<f64>>],
    places: &[LocalPlace],
    path: &Path,
) -> anyhow::Result<()> {
    let mut canvas = Canvas::new(raster);
    canvas.draw_occupancy(raster);
    for cell in doors.iter().flatten() {
        canvas.dot(pixel(&canvas, *cell), DOOR, 1);
    }
    for place in places {
        draw(&mut canvas, place);
    }
    std::fs::write(path, canvas.encoded()?)?;
    Ok(())
}

fn draw(canvas: &mut Canvas, place: &LocalPlace) {
    let is_place = place.place.is_some();
    let core = pixel(canvas, place.core);
    for gateway in &place.gateways {
        let paint = if is_place { GATEWAY } else { GATEWAY_ON_PATH };
        let (sin, cos) = gateway.heading_rad.sin_cos();
        let center = pixel(canvas, gateway.center());
        let out = pixel(canvas, gateway.center() + OUT_M * Vector2::new(cos, sin));
        let way = if gateway.continues_to.is_some() { PASSES } else { ENDS };
        canvas.line([core, center], way, 0);
        canvas.line(gateway.ends.map(|end| pixel(canvas, end)), paint, 1);
        canvas.line([center, out], paint, 0);
    }
    let (paint, radius) = if is_place { (CORE, CORE_RADIUS) } else { (ON_PATH, CORE_RADIUS / 2) };
    canvas.dot(core, paint, radius);
}

fn pixel(canvas: &Canvas, at: Point2<f64>) -> [i64; 2] {
    canvas.pixel(Some(v1::Point { x_m: at.x, y_m: at.y }))
}
