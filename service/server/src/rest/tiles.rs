//! `/v1/maps/{map}/versions/{version}/tiles/{z}/{x}/{y}.png`: what a viewer pans over.

use axum::extract::State;
use axum::http::{HeaderMap, header};
use axum::response::{IntoResponse, Response};
use meetpoint_occupancy::{MAP_TILE_LEVEL_MAX, map_tile, png};
use serde::Deserialize;
use utoipa::IntoParams;

use super::Rest;
use super::entity_tag::EntityTag;
use super::openapi::ReadProblems;
use super::problem::Refusal;
use super::request::{Path, version_number};
use crate::error::Error;

/// Names a tile.
#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub(crate) struct TilePath {
    /// Id of the map.
    #[param(example = "intel")]
    map: String,
    /// Number of the version from 1 on, or `latest` for the published one.
    #[param(example = "latest", pattern = "^(latest|[1-9][0-9]*)$")]
    version: String,
    /// Level, 0 to 8: a pixel is 2^z cells wide.
    #[param(value_type = u8, maximum = 8, example = 0)]
    z: String,
    /// Index to the right: floor(x / tile width).
    #[param(value_type = i32, example = 0)]
    x: String,
    /// Index upwards: floor(y / tile height).
    #[param(value_type = i32, example = -1)]
    y: String,
}

/// A square picture of 256 by 256 pixels.
///
/// At level 0 a pixel is a cell; each level halves the resolution, a pixel showing the most occupied
/// cell that was observed under it, so that walls stay. A tile is `256 * 2^z * resolution_m` metres
/// wide; its indices are the coordinates of its lower-left corner in the map's frame divided by that
/// width, y up. Greys as in the grid's PNG. Where nothing was observed, however far away, all pixels are
/// 205: that is an answer and no error. Levels above 8 are refused.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/versions/{version}/tiles/{z}/{x}/{y}",
    tag = "grids",
    params(TilePath),
    responses(
        (status = 200, description = "The picture.", content_type = "image/png",
            headers(("ETag" = String, description = "Strong."))),
        (status = 304, description = "The client has it: `If-None-Match` names the tag."),
        ReadProblems,
    )
)]
pub(super) async fn get_tile(
    State(rest): State<Rest>,
    Path(path): Path<TilePath>,
    headers: HeaderMap,
) -> Result<Response, Refusal> {
    let TilePath { map, version, z, x, y } = path;
    let row = y.strip_suffix(".png").ok_or_else(|| Error::field("y", "does not end in `.png`"))?;
    let (level, column, row) = (level(&z)?, index("x", &x)?, index("y", row)?);
    let asked = version_number(&version)?;
    let version = rest.service.version_record(&map, asked).await?;
    let tag = EntityTag::of(
        &[
            "tile",
            &map,
            &version.number.to_string(),
            &version.create_time_ns.to_string(),
            &format!("{level}/{column}/{row}"),
        ],
        asked != 0,
    );
    if let Some(response) = tag.not_modified(&headers) {
        return Ok(response);
    }
    let grid = rest.service.version_grid(&map, version.number).await?.grid;
    let drawn = tokio::task::spawn_blocking(move || {
        map_tile(&grid, level, column, row).map(|raster| png(&raster))
    });
    let bytes = drawn.await.map_err(Error::internal)?;
    let bytes =
        bytes.map_err(|error| Error::internal(format!("a stored resolution: {error:?}")))?;
    Ok(tag.on(([(header::CONTENT_TYPE, "image/png")], bytes).into_response()))
}

fn level(text: &str) -> Result<u8, Error> {
    text.parse().ok().filter(|&level| level <= MAP_TILE_LEVEL_MAX).ok_or_else(|| {
        let shown: String = text.chars().take(20).collect();
        Error::field("z", format!("`{shown}` is not a level from 0 to {MAP_TILE_LEVEL_MAX}"))
    })
}

fn index(field: &str, text: &str) -> Result<i32, Error> {
    text.parse().map_err(|_| {
        let shown: String = text.chars().take(20).collect();
        Error::field(field, format!("`{shown}` is not a whole number of 32 bits"))
    })
}
