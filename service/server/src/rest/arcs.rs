//! `/v1/maps/{map}/arcs/{arc}`: closed, opened, priced.

use axum::extract::State;
use axum::response::Response;
use meetpoint_proto::v1;
use serde::Deserialize;
use utoipa::{IntoParams, ToSchema};

use super::Rest;
use super::costs::{Cost, CostsChanged, Origin, changed};
use super::openapi::ChangeProblems;
use super::problem::Refusal;
use super::reply::{filled, ok};
use super::request::{JsonBody, Path};

/// Names an arc.
#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub(crate) struct ArcPath {
    /// Id of the map.
    #[param(example = "intel")]
    map: String,
    /// Id of the arc, as the graph and routes name it.
    #[param(example = 17)]
    arc: u64,
}

/// Why, and who says so.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Said {
    /// For people, up to 200 characters.
    #[serde(default)]
    reason: String,
    /// For people, up to 200 characters.
    #[serde(default)]
    author: String,
    #[serde(default)]
    origin: Origin,
}

/// A toll, why, and who says so.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct NewToll {
    /// Metres of free travel, above 0 up to 10 000.
    toll_m: f64,
    /// For people, up to 200 characters.
    #[serde(default)]
    reason: String,
    /// For people, up to 200 characters.
    #[serde(default)]
    author: String,
    #[serde(default)]
    origin: Origin,
}

/// Closes an arc: no plan crosses it.
///
/// Closing a closed one changes nothing.
#[utoipa::path(
    post,
    path = "/v1/maps/{map}/arcs/{arc}/close",
    tag = "costs",
    params(ArcPath),
    request_body = Said,
    responses((status = 200, description = "What is in force.", body = Cost), ChangeProblems)
)]
pub(super) async fn close_arc(
    State(rest): State<Rest>,
    Path(path): Path<ArcPath>,
    body: JsonBody<Said>,
) -> Result<Response, Refusal> {
    let (ArcPath { map, arc }, Said { reason, author, origin }) = (path, body.value);
    let request = v1::CloseArcRequest { map, arc, reason, author, origin: origin.into() };
    let v1::CloseArcResponse { cost, cost_revision: _ } = rest.service.close_arc(request).await?;
    Ok(ok(&Cost::from(filled(cost, "cost")?)))
}

/// Takes closure and toll of an arc back.
///
/// Opening an open one changes nothing.
#[utoipa::path(
    post,
    path = "/v1/maps/{map}/arcs/{arc}/open",
    tag = "costs",
    params(ArcPath),
    request_body = Said,
    responses((status = 200, description = "It is open.", body = CostsChanged), ChangeProblems)
)]
pub(super) async fn open_arc(
    State(rest): State<Rest>,
    Path(path): Path<ArcPath>,
    body: JsonBody<Said>,
) -> Result<Response, Refusal> {
    let (ArcPath { map, arc }, Said { reason, author, origin }) = (path, body.value);
    let of = map.clone();
    let request = v1::OpenArcRequest { map, arc, reason, author, origin: origin.into() };
    let v1::OpenArcResponse { cost_revision } = rest.service.open_arc(request).await?;
    Ok(ok(&changed(of, cost_revision)))
}

/// Makes crossing an arc as dear as so many metres more; opens it if it was closed.
#[utoipa::path(
    post,
    path = "/v1/maps/{map}/arcs/{arc}/toll",
    tag = "costs",
    params(ArcPath),
    request_body = NewToll,
    responses((status = 200, description = "What is in force.", body = Cost), ChangeProblems)
)]
pub(super) async fn set_arc_toll(
    State(rest): State<Rest>,
    Path(path): Path<ArcPath>,
    body: JsonBody<NewToll>,
) -> Result<Response, Refusal> {
    let (ArcPath { map, arc }, NewToll { toll_m, reason, author, origin }) = (path, body.value);
    let origin = origin.into();
    let request = v1::SetArcTollRequest { map, arc, toll_m, reason, author, origin };
    let v1::SetArcTollResponse { cost, cost_revision: _ } =
        rest.service.set_arc_toll(request).await?;
    Ok(ok(&Cost::from(filled(cost, "cost")?)))
}
