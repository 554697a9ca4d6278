//! `/v1/sessions/{session}/grid`: what a session that is not placed has drawn.

use axum::extract::State;
use axum::http::HeaderMap;
use axum::response::Response;
use serde::Deserialize;
use utoipa::IntoParams;

use super::Rest;
use super::entity_tag::EntityTag;
use super::geometry::bbox;
use super::grids::{Grid, GridFormat, picture};
use super::openapi::SessionGridProblems;
use super::problem::Refusal;
use super::request::{Path, Query, version_number};
use super::session_routes::SessionPath;

/// Which grid is asked for.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct SessionGridQuery {
    /// `json` is the default. The YAML names the PGM as `{session}.pgm`: save both in one folder.
    #[serde(default)]
    #[param(inline)]
    format: GridFormat,
    /// Number of a version of the map from 1 on; absent or `latest` for the published one.
    #[param(pattern = "^(latest|[1-9][0-9]*)$", example = "latest")]
    version: Option<String>,
    /// Corners of a rectangle in metres in the session's frame: `min_x,min_y,max_x,max_y`. Every cell that
    /// it touches is given. Absent: all that was observed.
    #[param(example = "-5.0,-5.0,5.0,5.0")]
    bbox: Option<String>,
}

/// What a session of unknown start has drawn, while it is not placed in the map.
///
/// In its own frame, with those that were put into it; or in that of the session that it was put into, which
/// `frame_session` names. `SESSION_PLACED` once it lies in the map: then the map's grid has it.
#[utoipa::path(
    get,
    path = "/v1/sessions/{session}/grid",
    tag = "sessions",
    params(SessionPath, SessionGridQuery),
    responses(
        (status = 200, description = "The cells.",
            content(
                (Grid = "application/json"),
                ("image/png"),
                ("image/x-portable-graymap"),
                ("application/yaml"),
                ("application/octet-stream"),
            ),
            headers(
                ("ETag" = String, description = "Strong; weak where the answer is compressed."),
                ("Meetpoint-Map-Version" = u64, description = "The version drawn."),
                ("Meetpoint-Resolution-M" = f64, description = "Edge of a cell, in metres."),
                ("Meetpoint-Origin-X-M" = f64, description = "Lower-left corner of the lower-left cell in the session's frame, metres."),
                ("Meetpoint-Origin-Y-M" = f64, description = "Lower-left corner of the lower-left cell in the session's frame, metres."),
            )),
        (status = 304, description = "The client has it: `If-None-Match` names the tag."),
        SessionGridProblems,
    )
)]
pub(super) async fn get_session_grid(
    State(rest): State<Rest>,
    Path(path): Path<SessionPath>,
    Query(query): Query<SessionGridQuery>,
    headers: HeaderMap,
) -> Result<Response, Refusal> {
    let SessionPath { session } = path;
    let SessionGridQuery { format, version, bbox: corners } = query;
    let asked = version.as_deref().map_or(Ok(0), version_number)?;
    let bounding_box = corners.as_deref().map(bbox).transpose()?;
    let (map, frame) = rest.service.session_frame(&session).await?;
    let version = rest.service.version_record(&map.0, asked).await?;
    let tag = EntityTag::of(
        &[
            &map.0,
            &frame.0.to_string(),
            &version.number.to_string(),
            &version.create_time_ns.to_string(),
            &format!("{bounding_box:?}"),
            format.names().0,
        ],
        asked != 0,
    );
    if let Some(response) = tag.not_modified(&headers) {
        return Ok(response);
    }
    let found = rest.service.frame_grid(&map.0, version.number, Some(frame)).await?;
    let raster = rest.service.raster(&found, bounding_box).await?;
    Ok(tag.on(picture(raster, format, &session, found.drawn()).await?))
}
