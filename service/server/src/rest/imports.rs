//! `/v1/maps/{map}/imports`: maps that were made elsewhere.

use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use meetpoint_proto::v1;
use serde::Serialize;
use utoipa::ToSchema;

use super::Rest;
use super::geometry::Point;
use super::integer::Unsigned64;
use super::maps::{Map, MapPath};
use super::openapi::CreationProblems;
use super::problem::Refusal;
use super::reply::filled;
use super::request::{Path, whole_body};
use crate::error::Error;
use crate::operations::imports::in_time;

/// Bytes of a form beside its files: boundaries and headers.
const FORM_BYTES: usize = 65536;

/// The files of a `map_server` map.
#[derive(ToSchema)]
#[expect(dead_code, reason = "describes a form for the OpenAPI document")]
pub(crate) struct MapServerFiles {
    /// Text of the YAML file, up to 64 KiB. `image` in it is not followed.
    #[schema(
        example = "image: map.pgm\nresolution: 0.05\norigin: [-10.0, -10.0, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )]
    yaml: String,
    /// The image's file: PNG or PGM.
    #[schema(value_type = String, format = Binary, content_media_type = "application/octet-stream")]
    image: Vec<u8>,
}

/// What came of an import.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct MapImport {
    map: Map,
    /// The version that the import became; absent if it is not made yet, which takes a while on a
    /// busy service: it will be the first whose `journal_position` reaches the one below.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    map_version: Option<Unsigned64>,
    /// The import's place in the journal.
    journal_position: Unsigned64,
    /// True if the same files were imported before.
    already_imported: bool,
    cells: ImportedCells,
    /// For people: what was changed, and what in the files is probably not meant.
    warnings: Vec<String>,
}

/// Where an imported map came to lie.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct ImportedCells {
    /// Lower-left corner of the lower-left cell, in the map's frame.
    origin: Point,
    /// Cells along x.
    width: u32,
    /// Cells along y.
    height: u32,
    free: Unsigned64,
    occupied: Unsigned64,
    unknown: Unsigned64,
    /// How far the map was moved onto the lattice of cells, in metres: half a cell at most.
    shift_x_m: f64,
    /// How far the map was moved onto the lattice of cells, in metres: half a cell at most.
    shift_y_m: f64,
    /// By how much it was turned about its origin, in radians, counter-clockwise.
    turn_rad: f64,
}

impl From<v1::ImportedCells> for ImportedCells {
    fn from(wire: v1::ImportedCells) -> Self {
        let v1::ImportedCells {
            origin,
            width,
            height,
            free,
            occupied,
            unknown,
            shift_x_m,
            shift_y_m,
            turn_rad,
        } = wire;
        Self {
            // Always set by the conversion from maps.
            origin: origin.unwrap_or_default().into(),
            width,
            height,
            free: Unsigned64(free),
            occupied: Unsigned64(occupied),
            unknown: Unsigned64(unknown),
            shift_x_m,
            shift_y_m,
            turn_rad,
        }
    }
}

impl MapImport {
    /// # Errors
    /// [`Error::Internal`] if a part is missing.
    pub(crate) fn new(wire: v1::ImportMapResponse) -> Result<Self, Error> {
        let v1::ImportMapResponse {
            map,
            map_version,
            journal_position,
            already_imported,
            cells,
            warnings,
        } = wire;
        Ok(Self {
            map: filled(map, "map")?.into(),
            map_version: Unsigned64::above_zero(map_version),
            journal_position: Unsigned64(journal_position),
            already_imported,
            cells: filled(cells, "cells")?.into(),
            warnings,
        })
    }
}

/// Makes a version of a map from the image and the YAML of a `map_server` map.
///
/// The map is made too, if there is none of its id. Answers when the version is made. The same files
/// again are found and change nothing, so no Idempotency-Key is needed. `MAP_NOT_EMPTY` if robots have
/// observed the map, or other files were imported. With curl:
/// `curl -F yaml=@map.yaml -F image=@map.pgm http://127.0.0.1:7373/v1/maps/hall/imports`
#[utoipa::path(
    post,
    path = "/v1/maps/{map}/imports",
    tag = "maps",
    params(MapPath),
    request_body(content = MapServerFiles, content_type = "multipart/form-data"),
    responses(
        (status = 201, description = "It was imported.", body = MapImport,
            headers(("Location" = String, description = "The version that it became."))),
        (status = 200, description = "It was imported before.", body = MapImport),
        CreationProblems,
    )
)]
pub(super) async fn import_map(
    State(rest): State<Rest>,
    Path(path): Path<MapPath>,
    request: Request,
) -> Result<Response, Refusal> {
    let MapPath { map } = path;
    let slot = rest.service.import_slot().await?;
    let limit_bytes = rest.service.settings.limits.import_bytes_max;
    let boundary = boundary(&request)?;
    let body = whole_body(request.into_body(), limit_bytes.saturating_add(FORM_BYTES));
    let body = in_time(body).await.map_err(|refusal| match refusal {
        Refusal::BodyTooLarge { .. } => Refusal::BodyTooLarge { limit_bytes },
        other => other,
    })?;
    // Off the async threads: a form may have 64 MB.
    let handle = tokio::runtime::Handle::current();
    let taken = tokio::task::spawn_blocking(move || handle.block_on(files(body, boundary)));
    let files = taken.await.map_err(Error::internal)??;
    let reply = MapImport::new(rest.service.import_map(slot, &map, files).await?)?;
    let status = if reply.already_imported { StatusCode::OK } else { StatusCode::CREATED };
    let location = reply.map_version.as_ref().map(|Unsigned64(number)| {
        HeaderValue::try_from(format!("/v1/maps/{map}/versions/{number}"))
    });
    let mut response = (status, axum::Json(reply)).into_response();
    if let Some(Ok(location)) = location {
        response.headers_mut().insert(header::LOCATION, location);
    }
    Ok(response)
}

/// What separates the parts of the form.
fn boundary(request: &Request<Body>) -> Result<String, Refusal> {
    let stated = request.headers().get(header::CONTENT_TYPE);
    let stated = stated.map_or("none", |value| value.to_str().unwrap_or("?"));
    multer::parse_boundary(stated).map_err(|_| Refusal::UnsupportedMediaType {
        stated: stated.chars().take(100).collect(),
        taken: "multipart/form-data",
    })
}

/// The two files of a form.
async fn files(body: Vec<u8>, boundary: String) -> Result<v1::MapServerFiles, Refusal> {
    let malformed = |error: multer::Error| Refusal::MalformedForm(error.to_string());
    let whole = tokio_stream::once(Ok::<_, std::convert::Infallible>(body));
    let mut form = multer::Multipart::new(whole, boundary);
    let (mut yaml, mut image) = (None, None);
    while let Some(part) = form.next_field().await.map_err(malformed)? {
        let name = part.name().unwrap_or_default().to_owned();
        let bytes = part.bytes().await.map_err(malformed)?.to_vec();
        let slot = match name.as_str() {
            "yaml" => &mut yaml,
            "image" => &mut image,
            other => {
                let shown: String = other.chars().take(40).collect();
                return Err(Refusal::MalformedForm(format!("a part `{shown}` is not taken")));
            }
        };
        if slot.replace(bytes).is_some() {
            return Err(Error::field(name, "given twice").into());
        }
    }
    let given = |part: Option<Vec<u8>>, name| part.ok_or_else(|| Error::field(name, "missing"));
    let yaml = String::from_utf8(given(yaml, "yaml")?)
        .map_err(|_| Error::field("yaml", "not text in UTF-8"))?;
    Ok(v1::MapServerFiles { yaml, image: given(image, "image")? })
}
