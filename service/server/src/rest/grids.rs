//! `/v1/maps/{map}/grid`: occupancy as JSON, images and arrays.

use axum::extract::State;
use axum::http::{HeaderMap, HeaderName, HeaderValue, header};
use axum::response::{IntoResponse, Response};
use meetpoint_occupancy::{Raster, npy, pgm, png, yaml};
use meetpoint_proto::v1;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::Rest;
use super::entity_tag::EntityTag;
use super::geometry::{Point, bbox};
use super::integer::Unsigned64;
use super::maps::MapPath;
use super::openapi::GridProblems;
use super::problem::Refusal;
use super::request::{Path, Query, version_number};
use crate::convert;
use crate::convert::grid::Drawn;
use crate::error::Error;

/// Occupancy probabilities of a rectangle of square cells.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Grid {
    /// Id of the map.
    map: String,
    map_version: Unsigned64,
    cost_revision: Unsigned64,
    /// Edge of a cell, in metres.
    #[schema(example = 0.05)]
    resolution_m: f64,
    /// Lower-left corner of the lower-left cell, in the map's frame or that of `frame_session`.
    origin: Point,
    /// Cells along x.
    width: u32,
    /// Cells along y.
    height: u32,
    /// One number a cell, row-major along +x, the lowest row first: 0 to 100 is the probability of
    /// being occupied in percent, 255 means never observed.
    #[schema(value_type = Vec<u8>, example = json!([255, 0, 100, 37]))]
    cells: Vec<u8>,
    /// The session in whose frame it is; absent for the map's frame.
    #[serde(skip_serializing_if = "String::is_empty")]
    #[schema(required = false)]
    frame_session: String,
}

impl From<v1::Grid> for Grid {
    fn from(wire: v1::Grid) -> Self {
        let v1::Grid {
            map,
            map_version,
            cost_revision,
            resolution_m,
            origin,
            width,
            height,
            cells,
            frame_session,
        } = wire;
        Self {
            map,
            map_version: Unsigned64(map_version),
            cost_revision: Unsigned64(cost_revision),
            resolution_m,
            // Always set by the conversion from rasters.
            origin: origin.unwrap_or_default().into(),
            width,
            height,
            cells,
            frame_session,
        }
    }
}

/// What a grid is given as.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum GridFormat {
    /// Cells in percent.
    #[default]
    Json,
    /// Shades of grey, top row first: white is free, 205 never observed.
    Png,
    /// `map_server`'s image in `trinary` mode, top row first.
    Pgm,
    /// `map_server`'s description of that image.
    Yaml,
    /// `NumPy`: probabilities as `float32`, lowest row first, NaN where never observed.
    Npy,
}

impl GridFormat {
    /// Name, which is the file's extension too, and media type.
    pub(super) fn names(self) -> (&'static str, &'static str) {
        match self {
            Self::Json => ("json", "application/json"),
            Self::Png => ("png", "image/png"),
            Self::Pgm => ("pgm", "image/x-portable-graymap"),
            Self::Yaml => ("yaml", "application/yaml"),
            Self::Npy => ("npy", "application/octet-stream"),
        }
    }
}

/// Which grid is asked for.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct GridQuery {
    /// `json` is the default. The YAML names the PGM as `{map}.pgm`: save both in one folder.
    #[serde(default)]
    #[param(inline)]
    format: GridFormat,
    /// Number of a version from 1 on; absent or `latest` for the published one.
    #[param(pattern = "^(latest|[1-9][0-9]*)$", example = "latest")]
    version: Option<String>,
    /// Corners of a rectangle in metres in the map's frame: `min_x,min_y,max_x,max_y`. Every cell that
    /// it touches is given. Absent: all that was observed.
    #[param(example = "-5.0,-5.0,5.0,5.0")]
    bbox: Option<String>,
}

/// A rectangle of the grid, at most 16 777 216 cells.
///
/// The entity tag stands for version, rectangle and format. With a version's number the answer may be
/// kept for ever; the published one has to be asked for again, by `If-None-Match`.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/grid",
    tag = "grids",
    params(MapPath, GridQuery),
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
                ("Meetpoint-Cost-Revision" = u64, description = "What was changed on top of it."),
                ("Meetpoint-Resolution-M" = f64, description = "Edge of a cell, in metres."),
                ("Meetpoint-Origin-X-M" = f64, description = "Lower-left corner of the lower-left cell in the map's frame, metres."),
                ("Meetpoint-Origin-Y-M" = f64, description = "Lower-left corner of the lower-left cell in the map's frame, metres."),
            )),
        (status = 304, description = "The client has it: `If-None-Match` names the tag."),
        GridProblems,
    )
)]
pub(super) async fn get_grid(
    State(rest): State<Rest>,
    Path(path): Path<MapPath>,
    Query(query): Query<GridQuery>,
    headers: HeaderMap,
) -> Result<Response, Refusal> {
    let MapPath { map } = path;
    let GridQuery { format, version, bbox: corners } = query;
    let asked = version.as_deref().map_or(Ok(0), version_number)?;
    let bounding_box = corners.as_deref().map(bbox).transpose()?;
    let cost_revision = rest.service.map_record(&map).await?.cost_revision;
    let version = rest.service.version_record(&map, asked).await?;
    let tag = EntityTag::of(
        &[
            &map,
            &version.number.to_string(),
            &version.create_time_ns.to_string(),
            &cost_revision.to_string(),
            &format!("{bounding_box:?}"),
            format.names().0,
        ],
        asked != 0,
    );
    if let Some(response) = tag.not_modified(&headers) {
        return Ok(response);
    }
    let found = rest.service.version_grid(&map, version.number).await?;
    let raster = rest.service.raster(&found, bounding_box).await?;
    Ok(tag.on(picture(raster, format, &map, found.drawn()).await?))
}

/// A grid as it is asked for, to be saved under `name`.
pub(super) async fn picture(
    raster: Raster,
    format: GridFormat,
    name: &str,
    drawn: Drawn,
) -> Result<Response, Refusal> {
    let described = described(&raster, drawn.version, drawn.cost_revision)?;
    let disposition = disposition(name, format)?;
    let name = name.to_owned();
    let bytes = tokio::task::spawn_blocking(move || encoded(&raster, format, &name, drawn));
    let bytes = bytes.await.map_err(Error::internal)??;
    let mut response =
        ([(header::CONTENT_TYPE, format.names().1)], described, bytes).into_response();
    response.headers_mut().insert(header::CONTENT_DISPOSITION, disposition);
    Ok(response)
}

fn encoded(
    raster: &Raster,
    format: GridFormat,
    name: &str,
    drawn: Drawn,
) -> Result<Vec<u8>, Error> {
    match format {
        GridFormat::Json => {
            let grid = convert::grid::to_wire(raster, drawn);
            serde_json::to_vec(&Grid::from(grid)).map_err(Error::internal)
        }
        GridFormat::Png => Ok(png(raster)),
        GridFormat::Pgm => Ok(pgm(raster)),
        GridFormat::Yaml => Ok(yaml(raster, &format!("{name}.pgm")).into_bytes()),
        GridFormat::Npy => Ok(npy(raster)),
    }
}

/// Headers that say what an image cannot.
fn described(
    raster: &Raster,
    version: u64,
    cost_revision: u64,
) -> Result<[(HeaderName, HeaderValue); 5], Error> {
    let origin = raster.info.origin();
    let metres = |value: f64| HeaderValue::try_from(value.to_string()).map_err(Error::internal);
    Ok([
        (HeaderName::from_static("meetpoint-map-version"), HeaderValue::from(version)),
        (HeaderName::from_static("meetpoint-cost-revision"), HeaderValue::from(cost_revision)),
        (
            HeaderName::from_static("meetpoint-resolution-m"),
            metres(raster.info.frame.resolution_m())?,
        ),
        (HeaderName::from_static("meetpoint-origin-x-m"), metres(origin.x)?),
        (HeaderName::from_static("meetpoint-origin-y-m"), metres(origin.y)?),
    ])
}

/// Shown in place, saved under the name that the YAML gives.
fn disposition(map: &str, format: GridFormat) -> Result<HeaderValue, Error> {
    let extension = format.names().0;
    HeaderValue::try_from(format!("inline; filename=\"{map}.{extension}\""))
        .map_err(Error::internal)
}
