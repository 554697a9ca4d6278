//! `/v1/maps/{map}/graph`: regions and arcs as JSON and GeoJSON.

use axum::extract::State;
use axum::http::{HeaderMap, HeaderName, HeaderValue};
use axum::response::Response;
use meetpoint_proto::v1;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::Rest;
use super::entity_tag::EntityTag;
use super::geometry::Point;
use super::integer::Unsigned64;
use super::maps::MapPath;
use super::openapi::GridProblems;
use super::problem::Refusal;
use super::regions::{EndedRegion, Region};
use super::reply::{filled, ok_long};
use super::request::{Path, Query, version_number};
use crate::convert::geojson::{geojson, pruning_name};
use crate::error::Error;

/// Regions and arcs of one version.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Graph {
    /// Id of the map.
    map: String,
    map_version: Unsigned64,
    cost_revision: Unsigned64,
    /// `none`, `pairs` or `ends`.
    pruned: &'static str,
    /// In the order of their first cells.
    regions: Vec<Region>,
    arcs: Vec<Arc>,
    /// Regions that the version before had and this one does not.
    ended: Vec<EndedRegion>,
    /// Id of the hypothesis whose places and edges these are, in a frame of their own; absent of a version.
    #[serde(skip_serializing_if = "String::is_empty")]
    hypothesis: String,
}

/// A way from one region to another, across a critical line.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Arc {
    /// From 1 on, lasting like a region's.
    id: Unsigned64,
    /// The ids of the two regions.
    regions: [Unsigned64; 2],
    /// The middle of the passage, in the map's frame.
    position: Point,
    /// The critical line: the centres of the two obstacle cells that it joins, in the map's frame.
    line: [Point; 2],
    /// Widest gap for whatever passes, in metres.
    width_m: f64,
    /// Of the line, in metres.
    length_m: f64,
}

impl From<v1::Graph> for Graph {
    fn from(wire: v1::Graph) -> Self {
        let pruned = pruning_name(wire.pruning());
        let v1::Graph {
            map,
            map_version,
            cost_revision,
            pruning: _,
            regions,
            arcs,
            ended,
            hypothesis,
        } = wire;
        Self {
            map,
            map_version: Unsigned64(map_version),
            cost_revision: Unsigned64(cost_revision),
            pruned,
            regions: regions.into_iter().map(Region::from).collect(),
            arcs: arcs.into_iter().map(Arc::from).collect(),
            ended: ended.into_iter().map(EndedRegion::from).collect(),
            hypothesis,
        }
    }
}

impl From<v1::Arc> for Arc {
    fn from(wire: v1::Arc) -> Self {
        let v1::Arc { id, region_a, region_b, position, line_from, line_to, width_m, length_m } =
            wire;
        Self {
            id: Unsigned64(id),
            regions: [Unsigned64(region_a), Unsigned64(region_b)],
            position: position.unwrap_or_default().into(),
            line: [line_from, line_to].map(|end| end.unwrap_or_default().into()),
            width_m,
            length_m,
        }
    }
}

/// What a graph is given as.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum GraphFormat {
    /// Regions and arcs.
    #[default]
    Json,
    /// A feature collection in metres of the map's frame: regions as polygons, their centres as
    /// points, arcs as lines, with all attributes.
    Geojson,
}

/// Which regions are joined with their neighbours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum GraphPruning {
    /// All regions as they are.
    #[default]
    None,
    /// Neighbours with at most two neighbours each become one, until there are none.
    Pairs,
    /// A region with a single neighbour becomes one with it.
    Ends,
}

impl From<GraphPruning> for v1::GraphPruning {
    fn from(pruning: GraphPruning) -> Self {
        match pruning {
            GraphPruning::None => Self::Unspecified,
            GraphPruning::Pairs => Self::Pairs,
            GraphPruning::Ends => Self::Ends,
        }
    }
}

/// Which graph is asked for.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is a word of the question, and of the wire"
)]
pub(crate) struct GraphQuery {
    /// `json` is the default.
    #[serde(default)]
    #[param(inline)]
    format: GraphFormat,
    /// Number of a version from 1 on; absent or `latest` for the published one.
    #[param(pattern = "^(latest|[1-9][0-9]*)$", example = "latest")]
    version: Option<String>,
    /// `none` is the default.
    #[serde(default)]
    #[param(inline)]
    pruned: GraphPruning,
    /// Whether regions are to have outlines; in GeoJSON they always do.
    #[serde(default)]
    outlines: bool,
    /// The graph of a map of places in place of a version's: its id, or `simplest`. Its regions are places,
    /// its arcs edges, in a frame of their own. Not together with `version`; there is nothing to prune, and
    /// there are no outlines.
    #[serde(default)]
    #[param(example = "simplest")]
    hypothesis: String,
    /// With `hypothesis`: id of the session; absent or empty for the one that was opened last of those that
    /// told of visits.
    #[serde(default)]
    session: String,
    /// With `hypothesis`: no two ways cross but at places.
    #[serde(default)]
    planar: bool,
    /// With `hypothesis`: ways may come back to a place that they pass.
    #[serde(default)]
    circles: bool,
    /// With `hypothesis`: maps against which odometry speaks are left out.
    #[serde(default)]
    metrical: bool,
}

/// The topological graph of a version.
///
/// `GRAPH_NOT_MADE` of a version that an older program made, `MAP_TOO_LARGE` of one with more cells than
/// graphs are made of. Of a hypothesis `TRAVEL_NOT_MEASURED` where visits are without odometry,
/// `TRAVEL_TOO_LARGE` where there are too many places and visits to lay them out. The entity
/// tag stands for version, pruning and format; a hypothesis has none.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/graph",
    tag = "graphs",
    params(MapPath, GraphQuery),
    responses(
        (status = 200, description = "Regions and arcs. GeoJSON is described by its RFC.", body = Graph,
            headers(
                ("ETag" = String, description = "Strong; weak where the answer is compressed."),
                ("Meetpoint-Map-Version" = u64, description = "The version whose graph it is."),
                ("Meetpoint-Cost-Revision" = u64, description = "What was changed on top of it."),
            )),
        (status = 304, description = "The client has it: `If-None-Match` names the tag."),
        GridProblems,
    )
)]
pub(super) async fn get_graph(
    State(rest): State<Rest>,
    Path(path): Path<MapPath>,
    Query(query): Query<GraphQuery>,
    headers: HeaderMap,
) -> Result<Response, Refusal> {
    let MapPath { map } = path;
    let GraphQuery {
        format,
        version,
        pruned,
        outlines,
        hypothesis,
        session,
        planar,
        circles,
        metrical,
    } = query;
    let asked = version.as_deref().map_or(Ok(0), version_number)?;
    if !hypothesis.is_empty() {
        let tree = v1::TreeName { map: map.clone(), session, planar, circles, metrical };
        let request = v1::GetGraphRequest {
            map,
            version: asked,
            hypothesis,
            tree: Some(tree),
            ..Default::default()
        };
        let graph = filled(rest.service.get_graph(request).await?.graph, "graph")?;
        return drawn(graph, format).await;
    }
    let cost_revision = rest.service.map_record(&map).await?.cost_revision;
    let version = rest.service.version_record(&map, asked).await?;
    let tag = EntityTag::of(
        &[
            "graph",
            &map,
            &version.number.to_string(),
            &version.create_time_ns.to_string(),
            &cost_revision.to_string(),
            &format!("{format:?} {pruned:?} {outlines}"),
        ],
        asked != 0,
    );
    if let Some(response) = tag.not_modified(&headers) {
        return Ok(response);
    }
    let request = v1::GetGraphRequest {
        map,
        version: version.number,
        pruning: v1::GraphPruning::from(pruned).into(),
        outlines: outlines || format == GraphFormat::Geojson,
        ..Default::default()
    };
    let graph = filled(rest.service.get_graph(request).await?.graph, "graph")?;
    let cost_revision = graph.cost_revision;
    let mut response = drawn(graph, format).await?;
    for (name, number) in
        [("meetpoint-map-version", version.number), ("meetpoint-cost-revision", cost_revision)]
    {
        response.headers_mut().insert(HeaderName::from_static(name), HeaderValue::from(number));
    }
    Ok(tag.on(response))
}

async fn drawn(graph: v1::Graph, format: GraphFormat) -> Result<Response, Refusal> {
    match format {
        GraphFormat::Json => Ok(ok_long(Graph::from(graph)).await?),
        GraphFormat::Geojson => {
            let drawn = tokio::task::spawn_blocking(move || geojson(&graph)).await;
            Ok(ok_long(drawn.map_err(Error::internal)?).await?)
        }
    }
}
