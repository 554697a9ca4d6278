//! `/v1/maps/{map}/nearest-free`, `reachable`.

use axum::extract::State;
use axum::response::Response;
use meetpoint_proto::v1;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::Rest;
use super::geometry::Point;
use super::integer::Unsigned64;
use super::maps::MapPath;
use super::openapi::ReadProblems;
use super::planned_path::{Basis, code_name};
use super::plans::robot;
use super::problem::Refusal;
use super::reply::ok;
use super::request::{Path, Query};

/// A point, and how far around it to look.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct NearestQuery {
    /// Metres in the map's frame.
    x_m: f64,
    /// Metres in the map's frame.
    y_m: f64,
    /// How far the point may be moved, in metres, up to 50; absent for 10.
    #[serde(default)]
    distance_max_m: f64,
    /// Name of a profile; absent for `default`.
    profile: Option<String>,
    /// Metres, 0 to 5: the profile of that radius or the next larger one, or the radius itself.
    robot_radius_m: Option<f64>,
    /// Number of a version; absent for the published one.
    map_version: Option<u64>,
}

/// The nearest point that the robot can be at.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct NearestReply {
    #[serde(flatten)]
    basis: Basis,
    /// Absent if there is none that near.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    point: Option<Point>,
    /// How far it is, in metres; 0 if the robot can be at the point itself.
    distance_m: f64,
    /// Id of its region; absent if it lies in none.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    region: Option<Unsigned64>,
}

/// The nearest point that the robot can be at.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/nearest-free",
    tag = "plans",
    params(MapPath, NearestQuery),
    responses((status = 200, description = "A point, if there is one.", body = NearestReply), ReadProblems)
)]
pub(super) async fn nearest_free(
    State(rest): State<Rest>,
    Path(path): Path<MapPath>,
    Query(query): Query<NearestQuery>,
) -> Result<Response, Refusal> {
    let NearestQuery { x_m, y_m, distance_max_m, profile, robot_radius_m, map_version } = query;
    let request = v1::GetNearestFreePointRequest {
        map: path.map,
        point: Some(v1::Point { x_m, y_m }),
        robot: robot(profile, robot_radius_m)?,
        map_version: map_version.unwrap_or(0),
        distance_max_m,
    };
    let v1::GetNearestFreePointResponse { basis, point, distance_m, region } =
        rest.service.get_nearest_free_point(request).await?;
    Ok(ok(&NearestReply {
        basis: Basis::of(basis)?,
        point: point.map(Point::from),
        distance_m,
        region: Unsigned64::above_zero(region),
    }))
}

/// A start, and how far to go.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct ReachableQuery {
    /// Metres in the map's frame.
    x_m: f64,
    /// Metres in the map's frame.
    y_m: f64,
    /// Paths that cost more are not taken, in metres; absent for no limit.
    #[serde(default)]
    length_max_m: f64,
    /// Name of a profile; absent for `default`.
    profile: Option<String>,
    /// Metres, 0 to 5: the profile of that radius or the next larger one, or the radius itself.
    robot_radius_m: Option<f64>,
    /// Number of a version; absent for the published one.
    map_version: Option<u64>,
}

/// How much can be reached.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct ReachableReply {
    /// `OK`, or why the robot cannot be at the start.
    #[schema(example = "OK")]
    code: &'static str,
    #[serde(flatten)]
    basis: Basis,
    /// Of all cells that the robot's centre gets to, in square metres.
    area_m2: f64,
    /// Regions that it gets to, by id.
    regions: Vec<ReachedRegion>,
    /// For people, what can be done about a code other than `OK`.
    #[serde(skip_serializing_if = "String::is_empty")]
    what_to_do: String,
}

/// A region, or the part of it that is reached.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct ReachedRegion {
    region: Unsigned64,
    area_m2: f64,
}

/// How much can be reached from a point.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/reachable",
    tag = "plans",
    params(MapPath, ReachableQuery),
    responses((status = 200, description = "Areas.", body = ReachableReply), ReadProblems)
)]
pub(super) async fn reachable(
    State(rest): State<Rest>,
    Path(path): Path<MapPath>,
    Query(query): Query<ReachableQuery>,
) -> Result<Response, Refusal> {
    let ReachableQuery { x_m, y_m, length_max_m, profile, robot_radius_m, map_version } = query;
    let request = v1::GetReachableAreaRequest {
        map: path.map,
        start: Some(v1::Point { x_m, y_m }),
        robot: robot(profile, robot_radius_m)?,
        map_version: map_version.unwrap_or(0),
        length_max_m,
    };
    let reply = rest.service.get_reachable_area(request).await?;
    let code = code_name(reply.code());
    let v1::GetReachableAreaResponse { code: _, basis, area_m2, regions, what_to_do } = reply;
    let region = |v1::ReachedRegion { region, area_m2 }| ReachedRegion {
        region: Unsigned64(region),
        area_m2,
    };
    Ok(ok(&ReachableReply {
        code,
        basis: Basis::of(basis)?,
        area_m2,
        regions: regions.into_iter().map(region).collect(),
        what_to_do,
    }))
}
