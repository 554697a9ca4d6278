//! Graphs and landmarks as GeoJSON: regions as polygons, their centres and landmarks as points, arcs
//! as lines.
//!
//! RFC 7946 knows degrees of longitude and latitude only; ours are metres in the map's frame, which
//! the collection says in members of its own, as it allows "by private agreement". Outer rings run
//! counter-clockwise, holes clockwise.

use meetpoint_proto::v1;
use serde_json::{Map, Value, json};

/// A graph with outlines as a feature collection with all attributes.
pub(crate) fn geojson(graph: &v1::Graph) -> Value {
    let v1::Graph { map, map_version, cost_revision, pruning: _, regions, arcs, ended, hypothesis } =
        graph;
    // Places are points.
    let polygons = regions.iter().filter(|_| hypothesis.is_empty()).map(polygon);
    let centers = regions.iter().map(center);
    let features: Vec<Value> = polygons.chain(centers).chain(arcs.iter().map(line)).collect();
    let ended = ended.iter().map(|v1::EndedRegion { region, map_version, heirs }| {
        let heir = |&v1::Heir { region, area_m2 }: &v1::Heir| {
            json!({ "region": region, "area_m2": area_m2 })
        };
        let heirs: Vec<Value> = heirs.iter().map(heir).collect();
        json!({ "region": region, "map_version": map_version, "heirs": heirs })
    });
    json!({
        "type": "FeatureCollection",
        "name": "graph",
        "frame": if hypothesis.is_empty() { "map" } else { "hypothesis" },
        "hypothesis": hypothesis,
        "unit": "metre",
        "map": map,
        "map_version": map_version,
        "cost_revision": cost_revision,
        "pruned": pruning_name(graph.pruning()),
        "ended": ended.collect::<Vec<Value>>(),
        "features": features,
    })
}

/// The landmarks of a version as a feature collection of points with all attributes.
pub(crate) fn landmarks_geojson(map: &str, map_version: u64, landmarks: &[v1::Landmark]) -> Value {
    json!({
        "type": "FeatureCollection",
        "name": "landmarks",
        "frame": "map",
        "unit": "metre",
        "map": map,
        "map_version": map_version,
        "features": landmarks.iter().map(landmark).collect::<Vec<Value>>(),
    })
}

fn landmark(landmark: &v1::Landmark) -> Value {
    let v1::Landmark {
        id,
        landmark_type,
        identity,
        position: at,
        covariance,
        sightings,
        confidence,
        session,
        source,
    } = landmark;
    let is_of_grid = *source == i32::from(v1::LandmarkSource::Grid);
    let v1::Covariance { xx_m2, xy_m2, yy_m2 } = covariance.unwrap_or_default();
    let properties = object([
        ("kind", json!("landmark")),
        ("type", json!(landmark_type)),
        ("identity", json!(identity)),
        ("covariance", json!({ "xx_m2": xx_m2, "xy_m2": xy_m2, "yy_m2": yy_m2 })),
        ("sightings", json!(sightings)),
        ("confidence", json!(confidence)),
        ("session", json!(session)),
        ("source", json!(if is_of_grid { "GRID" } else { "DETECTOR" })),
    ]);
    let geometry = json!({ "type": "Point", "coordinates": position(&at.unwrap_or_default()) });
    feature(&format!("landmark/{id}"), &properties, &geometry)
}

/// How a pruning is called in JSON and on the command line.
pub(crate) fn pruning_name(pruning: v1::GraphPruning) -> &'static str {
    match pruning {
        v1::GraphPruning::Unspecified => "none",
        v1::GraphPruning::Pairs => "pairs",
        v1::GraphPruning::Ends => "ends",
    }
}

fn polygon(region: &v1::Region) -> Value {
    let rings: Vec<Value> = region.outline.iter().map(ring).collect();
    let geometry = json!({ "type": "Polygon", "coordinates": rings });
    feature(&format!("region/{}", region.id), &attributes("region", region), &geometry)
}

fn center(region: &v1::Region) -> Value {
    let at = region.center.unwrap_or_default();
    let geometry = json!({ "type": "Point", "coordinates": position(&at) });
    feature(&format!("center/{}", region.id), &attributes("center", region), &geometry)
}

fn attributes(kind: &str, region: &v1::Region) -> Map<String, Value> {
    let v1::Region { id, area_m2, center: _, clearance_m, is_speck, members, outline: _ } = region;
    object([
        ("kind", json!(kind)),
        ("region", json!(id)),
        ("area_m2", json!(area_m2)),
        ("clearance_m", json!(clearance_m)),
        ("is_speck", json!(is_speck)),
        ("members", json!(members)),
    ])
}

fn line(arc: &v1::Arc) -> Value {
    let v1::Arc { id, region_a, region_b, position: at, line_from, line_to, width_m, length_m } =
        arc;
    let ends = [line_from, line_to].map(|end| position(&end.unwrap_or_default()));
    let properties = object([
        ("kind", json!("arc")),
        ("arc", json!(id)),
        ("regions", json!([region_a, region_b])),
        ("position", position(&at.unwrap_or_default())),
        ("width_m", json!(width_m)),
        ("length_m", json!(length_m)),
    ]);
    let geometry = json!({ "type": "LineString", "coordinates": ends });
    feature(&format!("arc/{id}"), &properties, &geometry)
}

fn feature(id: &str, properties: &Map<String, Value>, geometry: &Value) -> Value {
    json!({ "type": "Feature", "id": id, "properties": properties, "geometry": geometry })
}

fn object<const N: usize>(members: [(&str, Value); N]) -> Map<String, Value> {
    members.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
}

/// A ring closed as GeoJSON closes it: the first position again at the end.
fn ring(ring: &v1::Ring) -> Value {
    let first = ring.points.first();
    ring.points.iter().chain(first).map(position).collect()
}

fn position(point: &v1::Point) -> Value {
    json!([point.x_m, point.y_m])
}
