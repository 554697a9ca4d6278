//! A path drawn over its map: regions faint, critical lines thin, those of the route red, the path
//! blue from a green start to a red goal, alternatives orange.

use meetpoint_occupancy::Raster;
use meetpoint_proto::v1;

use super::canvas::{CRITICAL_LINE, Canvas, Colour};

const OTHER_LINE: Colour = [170, 170, 170];
const PATH: Colour = [31, 80, 180];
const ALTERNATIVE: Colour = [240, 140, 30];
const START: Colour = [30, 150, 60];
const GOAL: Colour = [200, 30, 40];
/// How faint regions are.
const WHITE: f64 = 0.55;
/// Radius of start and goal, in pixels.
const END_RADIUS: i64 = 7;

/// The picture as a PNG, top row first. `ends` are start and goal as asked for.
pub(super) fn png(
    raster: &Raster,
    graph: &v1::Graph,
    reply: &v1::PlanPathResponse,
    ends: [v1::Point; 2],
) -> anyhow::Result<Vec<u8>> {
    let mut canvas = Canvas::new(raster);
    canvas.draw_cells(raster, graph);
    canvas.fade(WHITE);
    let route = reply.path.iter().flat_map(|path| &path.route);
    let crossed: Vec<u64> = route.map(|step| step.arc).collect();
    for arc in &graph.arcs {
        let line = [arc.line_from, arc.line_to].map(|end| canvas.pixel(end));
        if crossed.contains(&arc.id) {
            canvas.line(line, CRITICAL_LINE, 1);
        } else {
            canvas.line(line, OTHER_LINE, 0);
        }
    }
    for path in &reply.alternatives {
        draw(&mut canvas, path, ALTERNATIVE);
    }
    if let Some(path) = &reply.path {
        draw(&mut canvas, path, PATH);
    }
    for (end, paint) in ends.into_iter().zip([START, GOAL]) {
        canvas.dot(canvas.pixel(Some(end)), paint, END_RADIUS);
    }
    canvas.encoded()
}

fn draw(canvas: &mut Canvas, path: &v1::PlannedPath, paint: Colour) {
    for ends in path.points.windows(2) {
        let line = [ends[0], ends[1]].map(|end| canvas.pixel(Some(end)));
        canvas.line(line, paint, 1);
    }
}
