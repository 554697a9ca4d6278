//! A graph drawn over its grid: regions in colours that stay with their ids, critical lines red, the
//! graph's nodes and arcs blue, walls dark, what was never observed grey.

use meetpoint_occupancy::Raster;
use meetpoint_proto::v1;

use super::canvas::{CRITICAL_LINE, Canvas, Colour};

const GRAPH: Colour = [25, 50, 120];
/// Radius of a node, in pixels.
const NODE_RADIUS: i64 = 4;

/// The picture as a PNG, top row first.
pub(super) fn png(raster: &Raster, graph: &v1::Graph) -> anyhow::Result<Vec<u8>> {
    let mut canvas = Canvas::new(raster);
    canvas.draw_cells(raster, graph);
    for arc in &graph.arcs {
        let ends = [arc.line_from, arc.line_to].map(|end| canvas.pixel(end));
        canvas.line(ends, CRITICAL_LINE, 1);
    }
    let node = |id: u64| graph.regions.iter().find(|region| region.id == id && !region.is_speck);
    for arc in &graph.arcs {
        let way = canvas.pixel(arc.position);
        for region in [arc.region_a, arc.region_b].into_iter().filter_map(node) {
            canvas.line([canvas.pixel(region.center), way], GRAPH, 0);
        }
    }
    for region in graph.regions.iter().filter(|region| !region.is_speck) {
        canvas.dot(canvas.pixel(region.center), GRAPH, NODE_RADIUS);
    }
    canvas.encoded()
}
