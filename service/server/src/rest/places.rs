//! `/v1/maps/{map}/places`.

use axum::extract::State;
use axum::response::Response;
use meetpoint_proto::v1;
use serde::Serialize;
use utoipa::ToSchema;

use super::Rest;
use super::geometry::Point;
use super::integer::Unsigned64;
use super::maps::MapPath;
use super::openapi::GridProblems;
use super::page::VersionPage;
use super::problem::Refusal;
use super::reply::ok;
use super::request::{Path, Query, version_number};

/// How one travels away from a place.
#[derive(Clone, Copy, Debug, Serialize, ToSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub(crate) enum TravelLaw {
    /// Not told by the service of that version.
    Unspecified,
    /// In the middle between the walls.
    Midline,
    /// Along the wall on the left.
    LeftWall,
    /// Along the wall on the right.
    RightWall,
    /// Straight on, where no wall is near.
    BlindStep,
    /// Not at all: a wall is in the way.
    DeadEnd,
    /// Not at all: no law applies, though nothing is in the way.
    None,
}

impl From<v1::TravelLaw> for TravelLaw {
    fn from(wire: v1::TravelLaw) -> Self {
        match wire {
            v1::TravelLaw::Unspecified => Self::Unspecified,
            v1::TravelLaw::Midline => Self::Midline,
            v1::TravelLaw::LeftWall => Self::LeftWall,
            v1::TravelLaw::RightWall => Self::RightWall,
            v1::TravelLaw::BlindStep => Self::BlindStep,
            v1::TravelLaw::DeadEnd => Self::DeadEnd,
            v1::TravelLaw::None => Self::None,
        }
    }
}

/// A constriction on a way out of a place.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct PlaceGateway {
    /// The nearest wall on the left of one who leaves, in the map's frame.
    left: Point,
    /// The nearest wall on the right of one who leaves, in the map's frame.
    right: Point,
    /// The direction outward, in radians.
    heading_rad: f64,
    /// From the one wall to the other, in metres.
    width_m: f64,
    law: TravelLaw,
    /// The gateway of this place where a path that comes in here leaves it again; absent if it ends here.
    #[serde(skip_serializing_if = "Option::is_none")]
    continues_to: Option<u32>,
    /// The place where one comes who leaves here; absent where nobody knows.
    #[serde(skip_serializing_if = "Option::is_none")]
    to_place: Option<u32>,
    /// The gateway of that place where one comes in; absent with it.
    #[serde(skip_serializing_if = "Option::is_none")]
    to_gateway: Option<u32>,
}

impl From<v1::PlaceGateway> for PlaceGateway {
    fn from(wire: v1::PlaceGateway) -> Self {
        let law = wire.law().into();
        let v1::PlaceGateway {
            left,
            right,
            heading_rad,
            width_m,
            law: _,
            continues_to,
            to_place,
            to_gateway,
        } = wire;
        Self {
            left: left.unwrap_or_default().into(),
            right: right.unwrap_or_default().into(),
            heading_rad,
            width_m,
            law,
            continues_to,
            to_place,
            to_gateway: to_place.map(|_| to_gateway),
        }
    }
}

/// A path fragment of a place, in one of its directions.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct PathFragment {
    /// Counted from 1, clockwise.
    number: u32,
    /// Whether it is the direction in which the fragment comes first in the star.
    plus: bool,
    /// The gateway by which one leaves in this direction; absent if the fragment ends at the place.
    #[serde(skip_serializing_if = "Option::is_none")]
    outward: Option<u32>,
    /// The gateway by which one comes in; absent if the fragment begins at the place.
    #[serde(skip_serializing_if = "Option::is_none")]
    inward: Option<u32>,
    law: TravelLaw,
}

impl From<v1::PathFragment> for PathFragment {
    fn from(wire: v1::PathFragment) -> Self {
        let law = wire.law().into();
        let v1::PathFragment { number, plus, outward, inward, law: _ } = wire;
        Self { number, plus, outward, inward, law }
    }
}

/// A place of a grid.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Place {
    /// From 0, the widest first. In another version the same number may be another place.
    number: u32,
    /// Its point farthest from the walls, in the map's frame.
    core: Point,
    /// How far that is from them, in metres.
    clearance_m: f64,
    /// Local topology, read from the first gateway: one letter a gateway, clockwise, the same for two that a path
    /// passes through; `<`, `>` or `^` behind those that are left along the left wall, the right wall, or straight on
    /// where no wall is near.
    #[schema(example = "aba")]
    star: String,
    /// Clockwise, from north (y) on.
    gateways: Vec<PlaceGateway>,
    /// The small-scale star: every path fragment in both of its directions, clockwise.
    fragments: Vec<PathFragment>,
}

impl From<v1::Place> for Place {
    fn from(wire: v1::Place) -> Self {
        let v1::Place { number, core, clearance_m, star, gateways, fragments } = wire;
        Self {
            number,
            core: core.unwrap_or_default().into(),
            clearance_m,
            star,
            gateways: gateways.into_iter().map(PlaceGateway::from).collect(),
            fragments: fragments.into_iter().map(PathFragment::from).collect(),
        }
    }
}

/// A page of places.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct PlaceList {
    /// The widest first.
    places: Vec<Place>,
    /// Empty on the last page.
    next_page_token: String,
    /// The version that was asked about.
    map_version: Unsigned64,
    /// Places on all pages.
    place_count: u32,
    /// Ways from a gateway to another.
    edges: u32,
    /// Paths: those that are not known to be one count as several.
    paths: u32,
}

impl From<v1::ListPlacesResponse> for PlaceList {
    fn from(wire: v1::ListPlacesResponse) -> Self {
        let v1::ListPlacesResponse {
            places,
            next_page_token,
            map_version,
            place_count,
            edges,
            paths,
        } = wire;
        Self {
            places: places.into_iter().map(Place::from).collect(),
            next_page_token,
            map_version: Unsigned64(map_version),
            place_count,
            edges,
            paths,
        }
    }
}

/// The places of a version's grid, and how paths join them.
///
/// Places are where lines of the medial axis of what is free meet or end, with the gateways around; where a single path
/// passes and nothing else, such as the corner of a corridor, there is none. `GRID_TOO_LARGE` if the grid is.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/places",
    tag = "grids",
    params(MapPath, VersionPage),
    responses(
        (status = 200, description = "A page of places.", body = PlaceList),
        GridProblems,
    )
)]
pub(super) async fn list_places(
    State(rest): State<Rest>,
    Path(path): Path<MapPath>,
    Query(query): Query<VersionPage>,
) -> Result<Response, Refusal> {
    let MapPath { map } = path;
    let VersionPage { version, page_size, page_token } = query;
    let version = version.as_deref().map_or(Ok(0), version_number)?;
    let request = v1::ListPlacesRequest { map, version, page_size, page_token };
    Ok(ok(&PlaceList::from(rest.service.list_places(request).await?)))
}
