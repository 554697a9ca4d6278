//! `/v1/maps/{map}/regions/{region}`: a region, or what became of it.

use axum::extract::State;
use axum::response::Response;
use meetpoint_proto::v1;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::Rest;
use super::geometry::Point;
use super::integer::Unsigned64;
use super::openapi::ReadProblems;
use super::problem::Refusal;
use super::reply::{filled, ok};
use super::request::{Path, Query, version_number};

/// Free space between critical lines.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Region {
    /// From 1 on. Stays the same from version to version as long as half of the place does, and is
    /// never used again for another. Of joined regions that of the largest.
    id: Unsigned64,
    area_m2: f64,
    /// The middle of the cell farthest from the walls, in the map's frame.
    center: Point,
    /// How far that is, in metres.
    clearance_m: f64,
    /// True of a few free cells between obstacles that no robot gets to: speckle, a shaft.
    is_speck: bool,
    /// The regions that were joined, by id; absent if none were.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    members: Vec<Unsigned64>,
    /// The outer edge, counter-clockwise, then the holes, clockwise, along cell edges, in the map's
    /// frame, first points not repeated. Absent unless asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    outline: Vec<Vec<Point>>,
}

/// A region that is no more.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct EndedRegion {
    region: Unsigned64,
    /// The first version without it.
    map_version: Unsigned64,
    /// Regions of that version that hold a part of it, the largest part first; empty if nothing of
    /// it is free.
    heirs: Vec<Heir>,
}

/// A region that holds a part of an ended one.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Heir {
    region: Unsigned64,
    /// Of that part.
    area_m2: f64,
}

/// A region, or what became of it: one of the two is there.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct RegionState {
    /// Id of the map.
    map: String,
    map_version: Unsigned64,
    cost_revision: Unsigned64,
    /// With its outline.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    region: Option<Region>,
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    ended: Option<EndedRegion>,
}

impl From<v1::Region> for Region {
    fn from(wire: v1::Region) -> Self {
        let v1::Region { id, area_m2, center, clearance_m, is_speck, members, outline } = wire;
        let ring = |ring: v1::Ring| ring.points.into_iter().map(Point::from).collect();
        Self {
            id: Unsigned64(id),
            area_m2,
            // Always set by the conversion from topologies, as are the points of arcs.
            center: center.unwrap_or_default().into(),
            clearance_m,
            is_speck,
            members: members.into_iter().map(Unsigned64).collect(),
            outline: outline.into_iter().map(ring).collect(),
        }
    }
}

impl From<v1::EndedRegion> for EndedRegion {
    fn from(wire: v1::EndedRegion) -> Self {
        let v1::EndedRegion { region, map_version, heirs } = wire;
        let heir = |v1::Heir { region, area_m2 }| Heir { region: Unsigned64(region), area_m2 };
        Self {
            region: Unsigned64(region),
            map_version: Unsigned64(map_version),
            heirs: heirs.into_iter().map(heir).collect(),
        }
    }
}

/// Names a region of a map.
#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub(crate) struct RegionPath {
    /// Id of the map.
    #[param(example = "intel")]
    map: String,
    /// Id of the region.
    #[param(example = 7)]
    region: u64,
}

/// Which version is meant.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct VersionQuery {
    /// Number of a version from 1 on; absent or `latest` for the published one.
    #[param(pattern = "^(latest|[1-9][0-9]*)$", example = "latest")]
    version: Option<String>,
}

/// One region of a version, or what became of it.
///
/// `REGION_NOT_FOUND` if neither that version nor one before it had it.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/regions/{region}",
    tag = "graphs",
    params(RegionPath, VersionQuery),
    responses(
        (status = 200, description = "The region, or its end.", body = RegionState),
        ReadProblems,
    )
)]
pub(super) async fn get_region(
    State(rest): State<Rest>,
    Path(path): Path<RegionPath>,
    Query(query): Query<VersionQuery>,
) -> Result<Response, Refusal> {
    use v1::get_region_response::State as Wire;
    let RegionPath { map, region } = path;
    let version = query.version.as_deref().map_or(Ok(0), version_number)?;
    let request = v1::GetRegionRequest { map, region, version };
    let reply = rest.service.get_region(request).await?;
    let v1::GetRegionResponse { map, map_version, cost_revision, state } = reply;
    let (region, ended) = match filled(state, "state")? {
        Wire::Region(region) => (Some(region.into()), None),
        Wire::Ended(ended) => (None, Some(ended.into())),
    };
    Ok(ok(&RegionState {
        map,
        map_version: Unsigned64(map_version),
        cost_revision: Unsigned64(cost_revision),
        region,
        ended,
    }))
}
