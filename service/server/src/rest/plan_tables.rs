//! `/v1/maps/{map}/plan-tables`.

use axum::body::Body;
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use meetpoint_proto::v1;
use serde::Deserialize;
use utoipa::IntoParams;

use super::Rest;
use super::maps::MapPath;
use super::openapi::ReadProblems;
use super::problem::Refusal;
use super::request::{Path, Query};

/// Whose tables.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct TablesQuery {
    /// Name of a profile; absent for `default`.
    profile: Option<String>,
    /// Number of a version; absent for the published one.
    map_version: Option<u64>,
}

/// The plan tables of one profile, so that a robot can go on without the network.
///
/// The file's format is told in `clients/rust/src/plan_tables.rs`. Waits until the tables are made;
/// `PLAN_TABLES_NOT_READY` if that takes too long.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/plan-tables",
    tag = "plans",
    params(MapPath, TablesQuery),
    responses(
        (status = 200, description = "The file.", content_type = "application/octet-stream", body = Vec<u8>),
        ReadProblems,
    )
)]
pub(super) async fn plan_tables(
    State(rest): State<Rest>,
    Path(path): Path<MapPath>,
    Query(query): Query<TablesQuery>,
) -> Result<Response, Refusal> {
    let TablesQuery { profile, map_version } = query;
    let kind = profile.map(v1::robot_choice::Kind::Profile);
    let request = v1::DownloadPlanTablesRequest {
        map: path.map,
        robot: kind.map(|kind| v1::RobotChoice { kind: Some(kind) }),
        map_version: map_version.unwrap_or(0),
    };
    let pieces = rest.service.plan_tables(request).await?;
    let pieces = pieces.into_iter().map(Ok::<_, std::convert::Infallible>);
    let body = Body::from_stream(tokio_stream::iter(pieces));
    Ok(([(header::CONTENT_TYPE, "application/octet-stream")], body).into_response())
}
