//! A map of places in the words of a graph: places as regions, edges as arcs.

use std::collections::BTreeMap;

use meetpoint_geometry::Point2;
use meetpoint_places::{ConsistentFrame, EdgeRecords, Gateway, Hypothesis, Leg, PlaceId};
use meetpoint_proto::v1;

/// The graph, without the names of map and hypothesis. An edge whose length was not measured is as long as
/// it is from place to place.
pub(crate) fn to_wire(of: &Hypothesis, frame: &ConsistentFrame, edges: &EdgeRecords) -> v1::Graph {
    let region = |(number, &at): (u64, &Point2<f64>)| v1::Region {
        id: number,
        center: Some(point(at)),
        ..v1::Region::default()
    };
    let arc = |(number, (from, to)): (u64, (Gateway, Gateway))| {
        let [a, b] = [from, to].map(|gateway| frame.places[gateway.place.0 as usize]);
        let length_m = length_m(from, to, Some(frame), edges);
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
        arcs: ways(of).map(arc).collect(),
        ..v1::Graph::default()
    }
}

/// Every edge once, by its ends, with the number of its arc.
fn ways(of: &Hypothesis) -> impl Iterator<Item = (u64, (Gateway, Gateway))> {
    let ways = of.map.gateways().filter_map(|from| Some((from, of.map.leads_to(from)?)));
    // Each edge is met at both of its gateways.
    (1..).zip(ways.filter(|(from, to)| from < to))
}

/// The way of one who goes along these legs, from place to place: a path on the graph of the same map. In metres
/// as edges were measured; where the map has a frame, an edge that was not is as long as it is from place to
/// place. `None` if an edge has no length.
pub(crate) fn path(
    of: &Hypothesis,
    (from, legs): (PlaceId, &[Leg]),
    frame: Option<&ConsistentFrame>,
    edges: &EdgeRecords,
) -> Option<v1::PlannedPath> {
    let numbers: BTreeMap<Gateway, u64> =
        ways(of).flat_map(|(number, (a, b))| [(a, number), (b, number)]).collect();
    let step = |leg: &Leg| v1::RouteStep {
        region: u64::from(leg.to.place.0) + 1,
        arc: numbers.get(&leg.from).copied().unwrap_or(0),
    };
    let first = v1::RouteStep { region: u64::from(from.0) + 1, arc: 0 };
    let lengths_m: Option<Vec<f64>> =
        legs.iter().map(|leg| length_m(leg.from, leg.to, frame, edges)).collect();
    let length_m: f64 = lengths_m?.iter().sum();
    let places = std::iter::once(from).chain(legs.iter().map(|leg| leg.to.place));
    let points = frame.map(|frame| places.map(|place| point(frame.places[place.0 as usize])));
    Some(v1::PlannedPath {
        route: std::iter::once(first).chain(legs.iter().map(step)).collect(),
        grid_length_m: length_m,
        path_length_m: length_m,
        points: points.map_or_else(Vec::new, Iterator::collect),
        cost_m: length_m,
        ..v1::PlannedPath::default()
    })
}

/// How long an edge is, in metres, as the graph has it; `None` where nothing was measured.
pub(crate) fn length_m(
    from: Gateway,
    to: Gateway,
    frame: Option<&ConsistentFrame>,
    edges: &EdgeRecords,
) -> Option<f64> {
    let measured_m = edges.leaving(from).and_then(|edge| edge.length_m);
    measured_m.or_else(|| {
        let [a, b] = [from, to].map(|end| end.place.0 as usize);
        frame.map(|frame| (frame.places[b] - frame.places[a]).norm())
    })
}

fn point(at: Point2<f64>) -> v1::Point {
    v1::Point { x_m: at.x, y_m: at.y }
}
