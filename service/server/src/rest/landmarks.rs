//! `/v1/maps/{map}/landmarks`: as JSON by pages, and as GeoJSON.

use axum::extract::State;
use axum::http::{HeaderName, HeaderValue};
use axum::response::Response;
use meetpoint_proto::v1;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::Rest;
use super::geometry::Point;
use super::integer::Unsigned64;
use super::maps::MapPath;
use super::openapi::ReadProblems;
use super::problem::Refusal;
use super::reply::{ok, ok_long};
use super::request::{Path, Query, version_number};
use crate::convert::geojson::landmarks_geojson;

/// What told a landmark apart from its surroundings.
#[derive(Clone, Copy, Debug, Serialize, ToSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub(crate) enum LandmarkSource {
    /// Not told by the service of that version.
    Unspecified,
    /// A detector of the robot's.
    Detector,
    /// The service, in the grid about the robot: a junction, a corner, a dead end.
    Grid,
}

impl From<v1::LandmarkSource> for LandmarkSource {
    fn from(wire: v1::LandmarkSource) -> Self {
        match wire {
            v1::LandmarkSource::Unspecified => Self::Unspecified,
            v1::LandmarkSource::Detector => Self::Detector,
            v1::LandmarkSource::Grid => Self::Grid,
        }
    }
}

/// A place that robots told apart from others.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Landmark {
    /// A UUID. Where the landmark has an identity it stays the same from job to job of the session;
    /// otherwise each job gives a new one.
    #[schema(example = "0199d3a6-6ac5-8c4e-9d51-2d9a3f1f3c11")]
    id: String,
    /// As the sightings name it; empty where all look alike. `meet_point` where the
    /// service found them in the grid.
    r#type: String,
    /// What it is called, where sightings told and the job was to believe them; else absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    identity: Option<String>,
    /// In the map's frame.
    #[serde(flatten)]
    position: Point,
    covariance: Covariance,
    /// How often it was seen.
    sightings: u32,
    /// How probable it is that it is one landmark and not two.
    #[schema(minimum = 0, maximum = 1, example = 0.99)]
    confidence: f64,
    /// Id of the session that saw it.
    session: String,
    source: LandmarkSource,
}

/// How far off a position may be: the covariance of x and y in the map's frame, in square metres.
#[derive(Clone, Copy, Debug, Serialize, ToSchema)]
pub(crate) struct Covariance {
    xx_m2: f64,
    xy_m2: f64,
    yy_m2: f64,
}

impl From<v1::Covariance> for Covariance {
    fn from(wire: v1::Covariance) -> Self {
        let v1::Covariance { xx_m2, xy_m2, yy_m2 } = wire;
        Self { xx_m2, xy_m2, yy_m2 }
    }
}

impl From<v1::Landmark> for Landmark {
    fn from(wire: v1::Landmark) -> Self {
        let v1::Landmark {
            id,
            landmark_type,
            identity,
            position,
            covariance,
            sightings,
            confidence,
            session,
            source,
        } = wire;
        Self {
            id,
            r#type: landmark_type,
            identity,
            position: position.unwrap_or_default().into(),
            covariance: covariance.unwrap_or_default().into(),
            sightings,
            confidence,
            session,
            source: v1::LandmarkSource::try_from(source).unwrap_or_default().into(),
        }
    }
}

/// A page of landmarks.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct LandmarkList {
    landmarks: Vec<Landmark>,
    /// Empty on the last page.
    next_page_token: String,
    /// The version that was asked for.
    map_version: Unsigned64,
}

/// What landmarks are given as.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum LandmarkFormat {
    /// A page.
    #[default]
    Json,
    /// All of them as a feature collection of points in metres of the map's frame.
    Geojson,
}

/// Which landmarks are asked for.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct LandmarksQuery {
    /// `json` (the default) gives a page, `geojson` gives all.
    #[serde(default)]
    #[param(inline)]
    format: LandmarkFormat,
    /// Number of a version from 1 on; absent or `latest` for the published one.
    #[param(pattern = "^(latest|[1-9][0-9]*)$", example = "latest")]
    version: Option<String>,
    /// Rows wanted: 0 or absent for the default of 100; cut at 1000.
    #[serde(default)]
    #[param(minimum = 0, maximum = 4_294_967_295_u32, example = 100)]
    page_size: u32,
    /// The previous reply's `next_page_token`; absent or empty for the first page.
    #[serde(default)]
    #[param(example = "")]
    page_token: String,
}

/// The landmarks of a version.
///
/// None before a relax job has found any.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/landmarks",
    tag = "landmarks",
    params(MapPath, LandmarksQuery),
    responses(
        (status = 200, description = "Landmarks. GeoJSON is described by its RFC.",
            body = LandmarkList,
            headers(
                ("Meetpoint-Map-Version" = u64, description = "The version that was asked for."),
            )),
        ReadProblems,
    )
)]
pub(super) async fn list_landmarks(
    State(rest): State<Rest>,
    Path(path): Path<MapPath>,
    Query(query): Query<LandmarksQuery>,
) -> Result<Response, Refusal> {
    let MapPath { map } = path;
    let LandmarksQuery { format, version, page_size, page_token } = query;
    let version = version.as_deref().map_or(Ok(0), version_number)?;
    let (map_version, mut response) = match format {
        LandmarkFormat::Json => {
            let request = v1::ListLandmarksRequest { map, version, page_size, page_token };
            let v1::ListLandmarksResponse { landmarks, next_page_token, map_version } =
                rest.service.list_landmarks(request).await?;
            let landmarks = landmarks.into_iter().map(Landmark::from).collect();
            let map_version = Unsigned64(map_version);
            (map_version.0, ok(&LandmarkList { landmarks, next_page_token, map_version }))
        }
        LandmarkFormat::Geojson => {
            let number = rest.service.version_record(&map, version).await?.number;
            let landmarks = rest.service.all_landmarks(&map, number).await?;
            (number, ok_long(landmarks_geojson(&map, number, &landmarks)).await?)
        }
    };
    let name = HeaderName::from_static("meetpoint-map-version");
    response.headers_mut().insert(name, HeaderValue::from(map_version));
    Ok(response)
}
