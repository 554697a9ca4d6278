//! `/v1/maps/{map}/hypotheses/{hypothesis}/places/{place}`: what was seen of a place of a travel.

use axum::extract::State;
use axum::http::{HeaderName, HeaderValue, header};
use axum::response::{IntoResponse, Response};
use meetpoint_proto::v1;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::Rest;
use super::geometry::{Point, Pose};
use super::hypotheses::{TreeQuery, named, tree};
use super::hypothesis_tree::HypothesisTree;
use super::openapi::ReadProblems;
use super::places::Place;
use super::problem::Refusal;
use super::reply::{filled, ok};
use super::request::{Path, Query};
use crate::error::Error;

/// Names a place of a map of places.
#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub(crate) struct PlaceMapPath {
    /// Id of the map.
    #[param(example = "intel")]
    map: String,
    /// Id of the hypothesis, or `simplest` for the first.
    #[param(example = "simplest")]
    hypothesis: String,
    /// Number of the place.
    #[param(example = 3)]
    place: u32,
}

/// How what was seen of a place is answered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum PlaceMapFormat {
    #[default]
    Json,
    /// Grey, one pixel a cell, the highest row first; resolution and origin are in the headers.
    Png,
}

/// How a place is asked for.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct PlaceMapQuery {
    /// Id of the session; absent or empty for the one that was opened last of those that told of visits.
    #[serde(default)]
    session: String,
    /// No two ways cross but at places: no bridges, no stairs.
    #[serde(default)]
    planar: bool,
    /// Ways may come back to a place that they pass: corridors in a circle.
    #[serde(default)]
    circles: bool,
    /// Maps whose places cannot lie in one frame as odometry says (`moved` of visits) are left out.
    #[serde(default)]
    metrical: bool,
    /// Which visit to it, by its number; absent for the first that has scans.
    visit: Option<u32>,
    /// JSON if absent.
    #[serde(default)]
    #[param(inline)]
    format: PlaceMapFormat,
}

/// A distinctive state: at a place, facing along one of its paths in one direction.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct DistinctiveState {
    /// From 1, clockwise.
    number: u32,
    /// Which path of the place, from 1.
    path: u32,
    /// Which direction of it: downstream (+) or upstream.
    plus: bool,
    /// Whether the path ends at the place in this direction.
    ends: bool,
    /// States that a right turn may lead to, as one meets them.
    right: Vec<u32>,
    /// States that a left turn may lead to, as one meets them.
    left: Vec<u32>,
    /// The state that faces the other way on the same path.
    around: u32,
}

impl From<v1::DistinctiveState> for DistinctiveState {
    fn from(wire: v1::DistinctiveState) -> Self {
        let v1::DistinctiveState { number, path, plus, ends, right, left, around } = wire;
        Self { number, path, plus, ends, right, left, around }
    }
}

/// A local perceptual map with what is read off it. Its frame is its own: the origin is where the robot was at the
/// visit, to half a cell, and the robot's first pose of those that were drawn looks along x.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct PlaceMap {
    tree: HypothesisTree,
    /// Id of the hypothesis.
    hypothesis: String,
    /// Number of the place.
    place: u32,
    /// All visits to it, by their numbers.
    visits: Vec<u32>,
    /// The visit that this is of.
    visit: u32,
    /// Edge of a cell, in metres.
    resolution_m: f64,
    /// The lower left corner of the lower left cell.
    origin: Point,
    /// Cells along x.
    width: u32,
    /// Cells along y.
    height: u32,
    /// Scans that were drawn.
    scans: u32,
    /// Whether the journal was not read far enough to draw all within 6 m of the visit.
    cut_short: bool,
    /// Where the robot was at the visit.
    robot: Pose,
    /// What is found there, in this frame; absent where `not_a_place` says why. Where its gateways lead is a matter of
    /// the hypothesis.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    star: Option<Place>,
    /// For people; absent where there is a star.
    #[serde(skip_serializing_if = "String::is_empty")]
    not_a_place: String,
    /// The gateway of it by which the robot came in; absent of a robot that was set down there.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    came_in_by: Option<u32>,
    /// The star as read from that gateway; absent without.
    #[serde(skip_serializing_if = "String::is_empty")]
    #[schema(example = "abab")]
    star_found: String,
    /// The star that was told at the visit, or found by steps.
    #[schema(example = "abab")]
    star_told: String,
    /// The large-scale star: distinctive states, clockwise.
    states: Vec<DistinctiveState>,
}

impl TryFrom<v1::GetPlaceMapResponse> for PlaceMap {
    type Error = Error;

    fn try_from(wire: v1::GetPlaceMapResponse) -> Result<Self, Error> {
        let v1::GetPlaceMapResponse {
            tree,
            hypothesis,
            place,
            visits,
            visit,
            grid,
            png: _,
            scans,
            cut_short,
            robot,
            star,
            not_a_place,
            came_in_by,
            star_found,
            star_told,
            states,
        } = wire;
        let v1::Grid { resolution_m, origin, width, height, .. } = filled(grid, "grid")?;
        Ok(Self {
            tree: filled(tree, "tree")?.into(),
            hypothesis,
            place,
            visits,
            visit,
            resolution_m,
            origin: filled(origin, "origin")?.into(),
            width,
            height,
            scans,
            cut_short,
            robot: filled(robot, "robot")?.into(),
            star: star.map(Place::from),
            not_a_place,
            came_in_by,
            star_found,
            star_told,
            states: states.into_iter().map(DistinctiveState::from).collect(),
        })
    }
}

/// What was seen of a place of a travel, on one visit.
///
/// A bounded map that the robot drew around it, by its laser and odometry alone, with gateways, path fragments and
/// stars. `PLACE_NOT_SCANNED` where no laser scan with odometry was taken around that visit.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/hypotheses/{hypothesis}/places/{place}",
    tag = "hypotheses",
    params(PlaceMapPath, PlaceMapQuery),
    responses(
        (status = 200, description = "The place.",
            content((PlaceMap = "application/json"), (Vec<u8> = "image/png")),
            headers(
                ("Meetpoint-Resolution-M" = f64, description = "Of a picture: edge of a cell, in metres."),
                ("Meetpoint-Origin-X-M" = f64, description = "Of a picture: its lower left corner in the place's own frame, metres."),
                ("Meetpoint-Origin-Y-M" = f64, description = "Of a picture: its lower left corner in the place's own frame, metres."),
            )),
        ReadProblems,
    )
)]
pub(super) async fn get_place_map(
    State(rest): State<Rest>,
    Path(path): Path<PlaceMapPath>,
    Query(query): Query<PlaceMapQuery>,
) -> Result<Response, Refusal> {
    let PlaceMapPath { map, hypothesis, place } = path;
    let PlaceMapQuery { session, planar, circles, metrical, visit, format } = query;
    let tree = Some(tree(map, TreeQuery { session, planar, circles, metrical }));
    let picture = format == PlaceMapFormat::Png;
    let hypothesis = named(hypothesis);
    let request = v1::GetPlaceMapRequest { tree, hypothesis, place, visit, picture };
    let told = rest.service.get_place_map(request).await?;
    if !picture {
        return Ok(ok(&PlaceMap::try_from(told)?));
    }
    let v1::Grid { resolution_m, origin, .. } = filled(told.grid, "grid")?;
    let v1::Point { x_m, y_m } = filled(origin, "origin")?;
    let mut response = ([(header::CONTENT_TYPE, "image/png")], told.png).into_response();
    for (name, value_m) in [
        ("meetpoint-resolution-m", resolution_m),
        ("meetpoint-origin-x-m", x_m),
        ("meetpoint-origin-y-m", y_m),
    ] {
        let value = HeaderValue::try_from(value_m.to_string()).map_err(Error::internal)?;
        response.headers_mut().insert(HeaderName::from_static(name), value);
    }
    Ok(response)
}
