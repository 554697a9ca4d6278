//! A map of places in the words of a graph: places as regions, edges as arcs.

use meetpoint_geometry::Point2;
use meetpoint_places::{ConsistentFrame, EdgeRecords, Gateway, Hypothesis};
use meetpoint_proto::v1;

/// The graph, without the names of map and hypothesis. An edge whose length was not measured is as long as
/// it is from place to place.
pub(crate) fn to_wire(of: &Hypothesis, frame: &ConsistentFrame, edges: &EdgeRecords) -> v1::Graph {
    let region = |(number, &at): (u64, &Point2<f64>)| v1::Region {
        id: number,
        center: Some(point(at)),
        ..v1::Region::default()
    };
    let ways = of.map.gateways().filter_map(|from| Some((from, of.map.leads_to(from)?)));
    // Each edge is met at both of its gateways.
    let ways = ways.filter(|(from, to)| from < to);
    let arc = |(number, (from, to)): (u64, (Gateway, Gateway))| {
        let [a, b] = [from, to].map(|gateway| frame.places[gateway.place.0 as usize]);
        let length_m = edges.leaving(from).and_then(|edge| edge.length_m);
        v1::Arc {
            id: number,
            region_a: u64::from(from.place.0) + 1,
            region_b: u64::from(to.place.0) + 1,
            position: Some(point(a + 0.5 * (b - a))),
            line_from: Some(point(a)),
            line_to: Some(point(b)),
            width_m: 0.0,
            length_m: length_m.unwrap_or((b - a).norm()),
        }
    };
    v1::Graph {
        regions: (1..).zip(&frame.places).map(region).collect(),
        arcs: (1..).zip(ways).map(arc).collect(),
        ..v1::Graph::default()
    }
}

fn point(at: Point2<f64>) -> v1::Point {
    v1::Point { x_m: at.x, y_m: at.y }
}
