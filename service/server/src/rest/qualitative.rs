//! `/v1/sessions/{session}/qualitative`: robots that explore as they are told, step by step.

use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use meetpoint_proto::v1;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::Rest;
use super::openapi::{ChangeProblems, QualitativeProblems};
use super::problem::Refusal;
use super::qualitative_reply::{QualitativeDetail, QualitativeExploration, QualitativeStep};
use super::reply::{filled, ok, ok_long};
use super::request::{JsonBody, Path, Query};
use super::session_routes::SessionPath;
use super::travels::TravelSelection;

/// How an exploration is answered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum QualitativeFormat {
    #[default]
    Json,
    /// A drawing of the graph: places as numbered dots where dead reckoning has them, home green, that of the
    /// robot red; edges as lines, unexplored directions as short ones.
    Png,
}

/// How an exploration is asked for.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct QualitativeQuery {
    /// JSON if absent.
    #[serde(default)]
    #[param(inline)]
    format: QualitativeFormat,
}

/// How an exploration is to begin.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct QualitativeBeginning {
    /// A ring of sonars or a laser of the session that looks all around. Absent: its first ring, or its
    /// first laser.
    #[serde(default)]
    sensor: String,
    /// Whether the angle of its odometry is a compass's.
    #[serde(default)]
    compass: bool,
    /// Which of several directions comes first.
    #[serde(default)]
    selection: TravelSelection,
    /// Width of the building's corridors, in metres, from 1.2 to 3; absent for 2. It is measured on the way.
    #[schema(example = 2.0)]
    corridor_width_m: Option<f64>,
    /// A rehearsal leads so many edges away at most, up to 8; absent for 1 with a compass and 2 without.
    rehearsal_edges_max: Option<u32>,
    /// For people, up to 200 characters.
    #[serde(default)]
    reason: String,
    /// For people, up to 200 characters.
    #[serde(default)]
    author: String,
}

/// Which of several directions is to come first.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct DirectionSelection {
    selection: TravelSelection,
    /// For people, up to 200 characters.
    #[serde(default)]
    reason: String,
    /// For people, up to 200 characters.
    #[serde(default)]
    author: String,
}

/// Which place is home.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct HomeMark {
    /// Absent for the one where the robot is or was last.
    place: Option<u32>,
    /// Takes back that it is home.
    #[serde(default)]
    undo: bool,
    /// For people, up to 200 characters.
    #[serde(default)]
    reason: String,
    /// For people, up to 200 characters.
    #[serde(default)]
    author: String,
}

/// What was marked.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct MarkedHome {
    exploration: QualitativeExploration,
    /// The place that is meant.
    place: u32,
}

/// The next step of a robot that is driven by the service, from its newest firing.
///
/// To be asked after every firing. While a step is under way what is left of it is told. `NOTHING_FIRED` before the
/// first firing with odometry, `NOT_ALL_AROUND` where nothing of the session looks all around.
#[utoipa::path(
    get,
    path = "/v1/sessions/{session}/next-step",
    tag = "qualitative",
    params(SessionPath),
    responses((status = 200, description = "The step.", body = QualitativeStep), QualitativeProblems)
)]
pub(super) async fn get_next_step(
    State(rest): State<Rest>,
    Path(path): Path<SessionPath>,
) -> Result<Response, Refusal> {
    let request = v1::GetNextStepRequest { session: path.session };
    let v1::GetNextStepResponse { step } = rest.service.get_next_step(request).await?;
    Ok(ok(&QualitativeStep::from(filled(step, "step")?)))
}

/// All that is known of a session's exploration by small steps.
///
/// Where the robot is, what it has before it, distinctive places and edges, the exploration agenda, the rehearsal
/// under way. `NOTHING_FIRED` before the first firing with odometry.
#[utoipa::path(
    get,
    path = "/v1/sessions/{session}/qualitative",
    tag = "qualitative",
    params(SessionPath, QualitativeQuery),
    responses(
        (status = 200, description = "What is known, or a drawing.",
            content((QualitativeDetail = "application/json"), ("image/png"))),
        QualitativeProblems,
    )
)]
pub(super) async fn get_qualitative_exploration(
    State(rest): State<Rest>,
    Path(path): Path<SessionPath>,
    Query(query): Query<QualitativeQuery>,
) -> Result<Response, Refusal> {
    let picture = query.format == QualitativeFormat::Png;
    let request = v1::GetQualitativeExplorationRequest { session: path.session, picture };
    let told = rest.service.get_qualitative_exploration(request).await?;
    if picture {
        return Ok(([(header::CONTENT_TYPE, "image/png")], told.png).into_response());
    }
    ok_long(QualitativeDetail::from(told)).await
}

/// Begins an exploration anew from the next firing on, knowing nothing.
///
/// Without it every session explores from its first firing on by the defaults of this request.
#[utoipa::path(
    post,
    path = "/v1/sessions/{session}/qualitative/begin",
    tag = "qualitative",
    params(SessionPath),
    request_body = QualitativeBeginning,
    responses(
        (status = 200, description = "How it explores.", body = QualitativeExploration),
        ChangeProblems,
    )
)]
pub(super) async fn begin_qualitative_exploration(
    State(rest): State<Rest>,
    Path(path): Path<SessionPath>,
    body: JsonBody<QualitativeBeginning>,
) -> Result<Response, Refusal> {
    let QualitativeBeginning {
        sensor,
        compass,
        selection,
        corridor_width_m,
        rehearsal_edges_max,
        reason,
        author,
    } = body.value;
    let request = v1::BeginQualitativeExplorationRequest {
        session: path.session,
        sensor,
        compass,
        selection: v1::TravelSelection::from(selection).into(),
        corridor_width_m,
        rehearsal_edges_max,
        reason,
        author,
    };
    let begun = rest.service.begin_qualitative_exploration(request).await?;
    Ok(ok(&QualitativeExploration::from(filled(begun.exploration, "exploration")?)))
}

/// Changes which direction comes first, from the next decision of the robot on.
#[utoipa::path(
    post,
    path = "/v1/sessions/{session}/qualitative/selection",
    tag = "qualitative",
    params(SessionPath),
    request_body = DirectionSelection,
    responses(
        (status = 200, description = "How it explores.", body = QualitativeExploration),
        ChangeProblems,
    )
)]
pub(super) async fn select_directions(
    State(rest): State<Rest>,
    Path(path): Path<SessionPath>,
    body: JsonBody<DirectionSelection>,
) -> Result<Response, Refusal> {
    let DirectionSelection { selection, reason, author } = body.value;
    let selection = v1::TravelSelection::from(selection).into();
    let session = path.session;
    let request = v1::SelectDirectionsRequest { session, selection, reason, author };
    let selected = rest.service.select_directions(request).await?;
    Ok(ok(&QualitativeExploration::from(filled(selected.exploration, "exploration")?)))
}

/// Says that a place is "home", which no other place is, or takes that back.
///
/// From then on only where the robot sees the mark of home, and sends a mark with the label `home`, is it that
/// place. `PLACE_NOT_FOUND`.
#[utoipa::path(
    post,
    path = "/v1/sessions/{session}/qualitative/home",
    tag = "qualitative",
    params(SessionPath),
    request_body = HomeMark,
    responses((status = 200, description = "What was marked.", body = MarkedHome), ChangeProblems)
)]
pub(super) async fn mark_home(
    State(rest): State<Rest>,
    Path(path): Path<SessionPath>,
    body: JsonBody<HomeMark>,
) -> Result<Response, Refusal> {
    let HomeMark { place, undo, reason, author } = body.value;
    let request = v1::MarkHomeRequest { session: path.session, place, undo, reason, author };
    let v1::MarkHomeResponse { exploration, place } = rest.service.mark_home(request).await?;
    let exploration = filled(exploration, "exploration")?.into();
    Ok(ok(&MarkedHome { exploration, place }))
}
