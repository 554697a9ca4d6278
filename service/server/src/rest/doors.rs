//! `/v1/maps/{map}/doors`.

use axum::extract::State;
use axum::response::Response;
use meetpoint_proto::v1;
use serde::Serialize;
use utoipa::ToSchema;

use super::Rest;
use super::geometry::{BoundingBox, Point};
use super::integer::{Signed64, Unsigned64};
use super::maps::MapPath;
use super::openapi::ReadProblems;
use super::page::VersionPage;
use super::problem::Refusal;
use super::reply::ok;
use super::request::{Path, Query, version_number};

/// What was seen last of a door.
#[derive(Clone, Copy, Debug, Serialize, ToSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub(crate) enum DoorState {
    /// Not told by the service of that version.
    Unspecified,
    /// Most of its cells are free.
    Open,
    /// Most of its cells are occupied.
    Closed,
}

impl From<v1::DoorState> for DoorState {
    fn from(wire: v1::DoorState) -> Self {
        match wire {
            v1::DoorState::Unspecified => Self::Unspecified,
            v1::DoorState::Open => Self::Open,
            v1::DoorState::Closed => Self::Closed,
        }
    }
}

/// A place whose occupancy keeps changing: a door, or where something is put and taken away again and again.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Door {
    /// Of the cell of it that has changed for longest: the same in later versions, until the map is drawn anew.
    id: String,
    /// The middle of its cells, in the map's frame.
    position: Point,
    /// Around its cells, in the map's frame. What is next to the frame of a door is not among them.
    bounding_box: BoundingBox,
    /// How many they are.
    cells: Unsigned64,
    state: DoorState,
    /// How often it was closed or opened, as far as anybody saw, at least 3.
    changes: u32,
    /// When it last was, or rather was seen to be, by the clock of the robot that saw it: nanoseconds since 1970.
    change_time_ns: Signed64,
    /// Since when changes are counted, by such a clock: nanoseconds since 1970.
    since_time_ns: Signed64,
    /// Share of the looks since then that found it closed, 0 to 1. A look is all that was seen within two seconds.
    closed_share: f64,
    /// Variance of what looks found of its cells, 0.05 to 0.25: near 0 where nearly all find the same.
    variance: f64,
    /// Autocorrelation of what looks found that followed each other within ten seconds, 0.5 to 1: 0 for noise.
    autocorrelation: f64,
}

impl From<v1::Door> for Door {
    fn from(wire: v1::Door) -> Self {
        let state = wire.state().into();
        let v1::Door {
            id,
            position,
            bounding_box,
            cells,
            state: _,
            changes,
            change_time_ns,
            since_time_ns,
            closed_share,
            variance,
            autocorrelation,
        } = wire;
        Self {
            id,
            position: position.unwrap_or_default().into(),
            bounding_box: bounding_box.unwrap_or_default().into(),
            cells: Unsigned64(cells),
            state,
            changes,
            change_time_ns: Signed64(change_time_ns),
            since_time_ns: Signed64(since_time_ns),
            closed_share,
            variance,
            autocorrelation,
        }
    }
}

/// A page of doors.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct DoorList {
    /// Those that changed most often first.
    doors: Vec<Door>,
    /// Empty on the last page.
    next_page_token: String,
    /// The version that was asked about.
    map_version: Unsigned64,
}

impl From<v1::ListDoorsResponse> for DoorList {
    fn from(wire: v1::ListDoorsResponse) -> Self {
        let v1::ListDoorsResponse { doors, next_page_token, map_version } = wire;
        Self {
            doors: doors.into_iter().map(Door::from).collect(),
            next_page_token,
            map_version: Unsigned64(map_version),
        }
    }
}

/// The doors of a map: places whose occupancy keeps changing, free for stretches and occupied for stretches.
///
/// Not what changed once or twice (a wall that was moved, a cart that stood there), not what changes from look to
/// look (edges of walls, people who walk by). Found by the variance and the autocorrelation over time of what lasers
/// saw; sonar has no part in it.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/doors",
    tag = "grids",
    params(MapPath, VersionPage),
    responses(
        (status = 200, description = "A page of doors.", body = DoorList),
        ReadProblems,
    )
)]
pub(super) async fn list_doors(
    State(rest): State<Rest>,
    Path(path): Path<MapPath>,
    Query(query): Query<VersionPage>,
) -> Result<Response, Refusal> {
    let MapPath { map } = path;
    let VersionPage { version, page_size, page_token } = query;
    let version = version.as_deref().map_or(Ok(0), version_number)?;
    let request = v1::ListDoorsRequest { map, version, page_size, page_token };
    Ok(ok(&DoorList::from(rest.service.list_doors(request).await?)))
}
