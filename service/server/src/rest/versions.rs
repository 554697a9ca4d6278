//! `/v1/maps/{map}/versions`.

use axum::extract::State;
use axum::response::Response;
use meetpoint_proto::v1;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::Rest;
use super::geometry::BoundingBox;
use super::integer::{Signed64, Unsigned64};
use super::maps::{Map, MapPath};
use super::openapi::{ChangeProblems, ReadProblems};
use super::page::Page;
use super::problem::Refusal;
use super::reply::{filled, ok};
use super::request::{Path, Query, version_number};

/// An immutable, complete set of what is known of a map.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct MapVersion {
    /// Id of the map.
    map: String,
    /// 1, 2, 3... within the map.
    number: Unsigned64,
    /// True for the one that queries are answered from.
    published: bool,
    /// The place in the journal up to which this version tells everything.
    journal_position: Unsigned64,
    /// Scans drawn into the grid.
    scans: Unsigned64,
    /// Extent of the observed cells; absent if nothing was observed.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    bounding_box: Option<BoundingBox>,
    /// When it was made, by the service's clock, nanoseconds since 1970.
    create_time_ns: Signed64,
    /// What made it: `tracking` or a job's kind.
    #[schema(example = "tracking")]
    origin: String,
    /// Names the weights by which sonars were read when it was made; empty if an older program made it.
    #[schema(example = "8f3a52c01b7e")]
    sonar_weights: String,
    /// Names the parameters that it was drawn by; empty for those that the service has for buildings.
    #[schema(example = "")]
    mapping_parameters: String,
}

impl From<v1::MapVersion> for MapVersion {
    fn from(wire: v1::MapVersion) -> Self {
        let v1::MapVersion {
            map,
            number,
            published,
            journal_position,
            scans,
            bounding_box,
            create_time_ns,
            origin,
            sonar_weights,
            mapping_parameters,
        } = wire;
        Self {
            map,
            number: Unsigned64(number),
            published,
            journal_position: Unsigned64(journal_position),
            scans: Unsigned64(scans),
            bounding_box: bounding_box.map(BoundingBox::from),
            create_time_ns: Signed64(create_time_ns),
            origin,
            sonar_weights,
            mapping_parameters,
        }
    }
}

/// A page of versions.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct MapVersionList {
    versions: Vec<MapVersion>,
    /// Empty on the last page.
    next_page_token: String,
}

/// Names a version of a map.
#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub(crate) struct VersionPath {
    /// Id of the map.
    #[param(example = "intel")]
    pub(crate) map: String,
    /// Number of the version from 1 on, or `latest` for the published one.
    #[param(example = "latest", pattern = "^(latest|[1-9][0-9]*)$")]
    pub(crate) version: String,
}

/// The versions of a map, newest first.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/versions",
    tag = "maps",
    params(MapPath, Page),
    responses((status = 200, description = "A page of versions.", body = MapVersionList), ReadProblems)
)]
pub(super) async fn list_map_versions(
    State(rest): State<Rest>,
    Path(path): Path<MapPath>,
    Query(page): Query<Page>,
) -> Result<Response, Refusal> {
    let Page { page_size, page_token } = page;
    let request = v1::ListMapVersionsRequest { map: path.map, page_size, page_token };
    let reply = rest.service.list_map_versions(request).await?;
    let v1::ListMapVersionsResponse { versions, next_page_token } = reply;
    let versions = versions.into_iter().map(MapVersion::from).collect();
    Ok(ok(&MapVersionList { versions, next_page_token }))
}

/// One version.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/versions/{version}",
    tag = "maps",
    params(VersionPath),
    responses((status = 200, description = "The version.", body = MapVersion), ReadProblems)
)]
pub(super) async fn get_map_version(
    State(rest): State<Rest>,
    Path(path): Path<VersionPath>,
) -> Result<Response, Refusal> {
    let number = version_number(&path.version)?;
    let request = v1::GetMapVersionRequest { map: path.map, number };
    let v1::GetMapVersionResponse { version } = rest.service.get_map_version(request).await?;
    Ok(ok(&MapVersion::from(filled(version, "version")?)))
}

/// Moves the map's pointer to a version, atomically.
///
/// While it points at an older one, new versions are made but not published; publishing the newest
/// resumes that.
#[utoipa::path(
    post,
    path = "/v1/maps/{map}/versions/{version}/publish",
    tag = "maps",
    params(VersionPath),
    responses((status = 200, description = "The map.", body = Map), ChangeProblems)
)]
pub(super) async fn publish_map_version(
    State(rest): State<Rest>,
    Path(path): Path<VersionPath>,
) -> Result<Response, Refusal> {
    let number = version_number(&path.version)?;
    let request = v1::PublishMapVersionRequest { map: path.map, number };
    let v1::PublishMapVersionResponse { map } = rest.service.publish_map_version(request).await?;
    Ok(ok(&Map::from(filled(map, "map")?)))
}
