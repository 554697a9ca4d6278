//! `/v1/sessions/{session}/whereabouts`.

use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use meetpoint_proto::v1;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::Rest;
use super::geometry::Pose;
use super::integer::Unsigned64;
use super::openapi::SessionGridProblems;
use super::problem::Refusal;
use super::reply::{filled, ok};
use super::request::{Path, Query};
use super::session_routes::SessionPath;

/// How whereabouts are told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum WhereaboutsFormat {
    /// Peaks and figures.
    #[default]
    Json,
    /// A picture of all places, black where the robot most probably is.
    Png,
}

/// Which moment is asked for.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct WhereaboutsQuery {
    /// From 0 to one below `steps`, at most 999; absent for the last. A step ends where landmarks were seen, or
    /// after 20 m without.
    #[param(minimum = 0, maximum = 999, example = 0)]
    step: Option<u32>,
    /// `json` is the default.
    #[serde(default)]
    #[param(inline)]
    format: WhereaboutsFormat,
}

/// Where a robot may be.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Whereabouts {
    /// Id of the session.
    session: String,
    /// Id of its map.
    map: String,
    /// The version whose landmarks were taken for known.
    map_version: Unsigned64,
    /// Landmarks of it that others than this session saw.
    landmarks: u32,
    /// The step that is told of.
    step: u32,
    /// How many there are.
    steps: u32,
    /// Sightings up to that step.
    sightings: u32,
    /// The most probable first, six at most; none while it may be anywhere.
    peaks: Vec<Peak>,
    /// The probability to be at none of the poses that are held by themselves.
    #[schema(minimum = 0, maximum = 1, example = 0.05)]
    elsewhere: f64,
    /// The logarithm of the number of poses that it might as well be at.
    entropy_nats: f64,
}

/// A place where a robot may be.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Peak {
    map_from_robot: Pose,
    /// The probability to be within a metre and ten degrees of it.
    #[schema(minimum = 0, maximum = 1, example = 0.8)]
    probability: f64,
    /// The same within twice as much.
    #[schema(minimum = 0, maximum = 1, example = 0.95)]
    around: f64,
}

impl From<v1::Peak> for Peak {
    fn from(wire: v1::Peak) -> Self {
        let v1::Peak { map_from_robot, probability, around } = wire;
        Self { map_from_robot: map_from_robot.unwrap_or_default().into(), probability, around }
    }
}

impl From<v1::Whereabouts> for Whereabouts {
    fn from(wire: v1::Whereabouts) -> Self {
        let v1::Whereabouts {
            session,
            map,
            map_version,
            landmarks,
            step,
            steps,
            sightings,
            peaks,
            elsewhere,
            entropy_nats,
        } = wire;
        Self {
            session,
            map,
            map_version: Unsigned64(map_version),
            landmarks,
            step,
            steps,
            sightings,
            peaks: peaks.into_iter().map(Peak::from).collect(),
            elsewhere,
            entropy_nats,
        }
    }
}

/// Where a robot is among the landmarks of its map when nothing is known of where it started.
///
/// By all that its session drove and saw up to a step, among the landmarks of the published version that others
/// saw (Thrun, Burgard and Fox 1998, section 8). `LANDMARKS_UNKNOWN` if there are none, `NOTHING_SEEN` if
/// the session has seen none, `MAP_TOO_LARGE` if they lie so far apart that more than 50 million poses would
/// have to be held.
#[utoipa::path(
    get,
    path = "/v1/sessions/{session}/whereabouts",
    tag = "sessions",
    params(SessionPath, WhereaboutsQuery),
    responses(
        (status = 200, description = "Where it may be.",
            content((Whereabouts = "application/json"), ("image/png"))),
        SessionGridProblems,
    )
)]
pub(super) async fn get_whereabouts(
    State(rest): State<Rest>,
    Path(path): Path<SessionPath>,
    Query(query): Query<WhereaboutsQuery>,
) -> Result<Response, Refusal> {
    let SessionPath { session } = path;
    let WhereaboutsQuery { step, format } = query;
    let picture = format == WhereaboutsFormat::Png;
    let request = v1::GetWhereaboutsRequest { session, step, picture };
    let v1::GetWhereaboutsResponse { whereabouts, png } =
        rest.service.get_whereabouts(request).await?;
    if picture {
        return Ok(([(header::CONTENT_TYPE, "image/png")], png).into_response());
    }
    Ok(ok(&Whereabouts::from(filled(whereabouts, "whereabouts")?)))
}
