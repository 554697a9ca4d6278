//! `/v1/maps`.

use axum::extract::State;
use axum::http::StatusCode;
use axum::response::Response;
use meetpoint_proto::v1;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::Rest;
use super::idempotency::{Creation, IdempotencyKey, Reply, once};
use super::integer::{Signed64, Unsigned64};
use super::openapi::{CreationProblems, ListProblems, ReadProblems};
use super::page::Page;
use super::problem::Refusal;
use super::reply::{filled, ok};
use super::request::{JsonBody, Path, Query};

const CREATION: Creation =
    Creation { route: "POST /v1/maps", collection: Some("/v1/maps"), id: "/id" };

/// One level of a site with one fixed frame: metres, radians, counter-clockwise (REP 103 and 105).
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Map {
    /// Chosen by people: 1 to 63 of a-z, 0-9, `-`, `_`, beginning with a letter or digit.
    #[schema(example = "intel")]
    id: String,
    /// For people. May be empty.
    #[schema(example = "Intel Research Lab, Seattle")]
    display_name: String,
    /// Edge of a cell, in metres.
    #[schema(example = 0.05)]
    resolution_m: f64,
    /// The version that queries are answered from; absent before the first.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    published_version: Option<Unsigned64>,
    /// The newest version; absent before the first.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    latest_version: Option<Unsigned64>,
    /// False while the pointer was moved back by a person.
    publishes_automatically: bool,
    /// Counts what operators and evidence changed on top of a version.
    cost_revision: Unsigned64,
    /// When it was made, by the service's clock, nanoseconds since 1970.
    create_time_ns: Signed64,
}

impl From<v1::Map> for Map {
    fn from(wire: v1::Map) -> Self {
        let v1::Map {
            id,
            display_name,
            resolution_m,
            published_version,
            latest_version,
            publishes_automatically,
            cost_revision,
            create_time_ns,
        } = wire;
        Self {
            id,
            display_name,
            resolution_m,
            published_version: Unsigned64::above_zero(published_version),
            latest_version: Unsigned64::above_zero(latest_version),
            publishes_automatically,
            cost_revision: Unsigned64(cost_revision),
            create_time_ns: Signed64(create_time_ns),
        }
    }
}

/// A map to be made.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct NewMap {
    /// 1 to 63 of a-z, 0-9, `-`, `_`, beginning with a letter or digit. Never used again for another.
    #[schema(pattern = "^[a-z0-9][a-z0-9_-]{0,62}$", example = "intel")]
    id: String,
    /// For people: up to 200 characters.
    #[serde(default)]
    #[schema(max_length = 200, example = "Intel Research Lab, Seattle")]
    display_name: String,
    /// Edge of a cell in metres, 0.01 to 0.5; 0 or absent for the default of 0.05.
    #[serde(default)]
    #[schema(minimum = 0.0, maximum = 0.5, example = 0.05)]
    resolution_m: f64,
}

impl From<NewMap> for v1::CreateMapRequest {
    fn from(map: NewMap) -> Self {
        let NewMap { id, display_name, resolution_m } = map;
        Self { map: Some(v1::Map { id, display_name, resolution_m, ..v1::Map::default() }) }
    }
}

/// A page of maps.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct MapList {
    maps: Vec<Map>,
    /// Empty on the last page.
    next_page_token: String,
}

/// Names a map.
#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub(crate) struct MapPath {
    /// Id of the map.
    #[param(example = "intel")]
    pub(crate) map: String,
}

/// Makes an empty map.
#[utoipa::path(
    post,
    path = "/v1/maps",
    tag = "maps",
    params(IdempotencyKey),
    request_body = NewMap,
    responses(
        (status = 201, description = "The new map.", body = Map,
            headers(("Location" = String, description = "Where it is found."))),
        CreationProblems,
    )
)]
pub(super) async fn create_map(
    State(rest): State<Rest>,
    key: IdempotencyKey,
    body: JsonBody<NewMap>,
) -> Result<Response, Refusal> {
    let service = rest.service.clone();
    once(&rest, &CREATION, key, body.fingerprint, async move {
        let v1::CreateMapResponse { map } = service.create_map(body.value.into()).await?;
        Ok(Reply::new(StatusCode::CREATED, &Map::from(filled(map, "map")?))?)
    })
    .await
}

/// All maps, by id.
#[utoipa::path(
    get,
    path = "/v1/maps",
    tag = "maps",
    params(Page),
    responses((status = 200, description = "A page of maps.", body = MapList), ListProblems)
)]
pub(super) async fn list_maps(
    State(rest): State<Rest>,
    Query(page): Query<Page>,
) -> Result<Response, Refusal> {
    let Page { page_size, page_token } = page;
    let request = v1::ListMapsRequest { page_size, page_token };
    let v1::ListMapsResponse { maps, next_page_token } = rest.service.list_maps(request).await?;
    Ok(ok(&MapList { maps: maps.into_iter().map(Map::from).collect(), next_page_token }))
}

/// One map.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}",
    tag = "maps",
    params(MapPath),
    responses((status = 200, description = "The map.", body = Map), ReadProblems)
)]
pub(super) async fn get_map(
    State(rest): State<Rest>,
    Path(path): Path<MapPath>,
) -> Result<Response, Refusal> {
    let request = v1::GetMapRequest { map: path.map };
    let v1::GetMapResponse { map } = rest.service.get_map(request).await?;
    Ok(ok(&Map::from(filled(map, "map")?)))
}
