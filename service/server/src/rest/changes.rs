//! `/v1/maps/{map}/changes`.

use axum::extract::State;
use axum::response::Response;
use meetpoint_proto::v1;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::Rest;
use super::geometry::{BoundingBox, Point, bbox};
use super::integer::Unsigned64;
use super::maps::MapPath;
use super::openapi::GridProblems;
use super::problem::Refusal;
use super::reply::ok;
use super::request::{Path, Query, version_number};

/// What became of cells.
#[derive(Clone, Copy, Debug, Serialize, ToSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub(crate) enum ChangeKind {
    /// Not told by the service of that version.
    Unspecified,
    /// Free before, occupied now.
    Appeared,
    /// Occupied before, free now.
    Vanished,
}

impl From<v1::ChangeKind> for ChangeKind {
    fn from(wire: v1::ChangeKind) -> Self {
        match wire {
            v1::ChangeKind::Unspecified => Self::Unspecified,
            v1::ChangeKind::Appeared => Self::Appeared,
            v1::ChangeKind::Vanished => Self::Vanished,
        }
    }
}

/// Cells that touch, by edges or corners, and of which the same became.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Change {
    kind: ChangeKind,
    /// Around them, in the map's frame.
    bounding_box: BoundingBox,
    /// How many they are.
    cells: Unsigned64,
    /// The middle of one of them.
    position: Point,
}

impl From<v1::Change> for Change {
    fn from(wire: v1::Change) -> Self {
        let v1::Change { kind, bounding_box, cells, position } = wire;
        Self {
            kind: v1::ChangeKind::try_from(kind).unwrap_or_default().into(),
            bounding_box: bounding_box.unwrap_or_default().into(),
            cells: Unsigned64(cells),
            position: position.unwrap_or_default().into(),
        }
    }
}

/// A page of changes.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct ChangeList {
    /// Those of most cells first.
    changes: Vec<Change>,
    /// Empty on the last page.
    next_page_token: String,
    /// The version that was compared with.
    since: Unsigned64,
    /// The version that was asked about.
    map_version: Unsigned64,
    /// Cells of all changes on all pages that are occupied now.
    cells_appeared: Unsigned64,
    /// Cells of all changes on all pages that are free now.
    cells_vanished: Unsigned64,
}

/// Which changes are asked for.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct ChangesQuery {
    /// Number of the version that is compared with, from 1 on.
    #[param(minimum = 1, example = 1)]
    since: u64,
    /// Number of the version that is asked about, from 1 on; absent or `latest` for the published one.
    #[param(pattern = "^(latest|[1-9][0-9]*)$", example = "latest")]
    version: Option<String>,
    /// Corners of a rectangle in metres in the map's frame: `min_x,min_y,max_x,max_y`. Only tiles (of 64 by
    /// 64 cells) that it touches are compared. Absent: the whole map.
    #[param(example = "-5.0,-5.0,5.0,5.0")]
    bbox: Option<String>,
    /// Only changes of at least so many cells.
    #[serde(default)]
    #[param(minimum = 0, maximum = 4_294_967_295_u32, example = 4)]
    cells_min: u32,
    /// Rows wanted: 0 or absent for the default of 100; cut at 1000.
    #[serde(default)]
    #[param(minimum = 0, maximum = 4_294_967_295_u32, example = 100)]
    page_size: u32,
    /// The previous reply's `next_page_token`; absent or empty for the first page.
    #[serde(default)]
    #[param(example = "")]
    page_token: String,
}

/// What changed between two versions of a map.
///
/// Cells that were decided to be free (less likely occupied than 0.3) and are decided to be occupied (more
/// likely than 0.7), or the other way around. What was never observed before, or is undecided in either, is
/// none of them. `GRID_TOO_LARGE` if too many tiles differ: ask for less by `bbox`.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/changes",
    tag = "grids",
    params(MapPath, ChangesQuery),
    responses(
        (status = 200, description = "A page of changes.", body = ChangeList),
        GridProblems,
    )
)]
pub(super) async fn list_changes(
    State(rest): State<Rest>,
    Path(path): Path<MapPath>,
    Query(query): Query<ChangesQuery>,
) -> Result<Response, Refusal> {
    let MapPath { map } = path;
    let ChangesQuery { since, version, bbox: corners, cells_min, page_size, page_token } = query;
    let version = version.as_deref().map_or(Ok(0), version_number)?;
    let bounding_box = corners.as_deref().map(bbox).transpose()?;
    let request = v1::ListChangesRequest {
        map,
        since,
        version,
        bounding_box,
        cells_min,
        page_size,
        page_token,
    };
    Ok(ok(&ChangeList::from(rest.service.list_changes(request).await?)))
}

impl From<v1::ListChangesResponse> for ChangeList {
    fn from(wire: v1::ListChangesResponse) -> Self {
        let v1::ListChangesResponse {
            changes,
            next_page_token,
            since,
            map_version,
            cells_appeared,
            cells_vanished,
        } = wire;
        Self {
            changes: changes.into_iter().map(Change::from).collect(),
            next_page_token,
            since: Unsigned64(since),
            map_version: Unsigned64(map_version),
            cells_appeared: Unsigned64(cells_appeared),
            cells_vanished: Unsigned64(cells_vanished),
        }
    }
}
