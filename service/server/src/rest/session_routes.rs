//! `/v1/sessions`.

use axum::extract::State;
use axum::http::StatusCode;
use axum::response::Response;
use meetpoint_proto::v1;
use serde::Deserialize;
use utoipa::{IntoParams, ToSchema};

use super::Rest;
use super::idempotency::{Creation, IdempotencyKey, Reply, once};
use super::integer::Unsigned64;
use super::openapi::{ChangeProblems, CreationProblems, ListProblems, ReadProblems};
use super::problem::Refusal;
use super::reply::{filled, ok};
use super::request::{JsonBody, Path, Query};
use super::sessions::{IngestLimits, NewSession, OpenedSession, Session, SessionList};

const CREATION: Creation =
    Creation { route: "POST /v1/sessions", collection: Some("/v1/sessions"), id: "/session/id" };

/// Names a session.
#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub(crate) struct SessionPath {
    /// Id of the session.
    #[param(format = "uuid", example = "0199d3a6-6ac5-7c4e-9d51-2d9a3f1f3c11")]
    pub(super) session: String,
}

/// Which sessions are asked for.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct SessionsQuery {
    /// Only this map's; absent or empty for all.
    #[serde(default)]
    map: String,
    /// Only this robot's; absent or empty for all.
    #[serde(default)]
    robot: String,
    /// Rows wanted: 0 or absent for the default of 100; cut at 1000.
    #[serde(default)]
    #[param(minimum = 0, maximum = 4_294_967_295_u32, example = 100)]
    page_size: u32,
    /// The previous reply's `next_page_token`; absent or empty for the first page.
    #[serde(default)]
    #[param(example = "")]
    page_token: String,
}

/// What closing asks for.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Closing {
    /// The session's own epoch.
    epoch: Unsigned64,
}

/// Opens a session, or finds the one that was opened before with the same robot and client key.
#[utoipa::path(
    post,
    path = "/v1/sessions",
    tag = "sessions",
    params(IdempotencyKey),
    request_body = NewSession,
    responses(
        (status = 201, description = "The new session.", body = OpenedSession,
            headers(("Location" = String, description = "Where it is found."))),
        (status = 200, description = "The session, which was there before.", body = OpenedSession,
            headers(("Location" = String, description = "Where it is found."))),
        CreationProblems,
    )
)]
pub(super) async fn open_session(
    State(rest): State<Rest>,
    key: IdempotencyKey,
    body: JsonBody<NewSession>,
) -> Result<Response, Refusal> {
    let service = rest.service.clone();
    once(&rest, &CREATION, key, body.fingerprint, async move {
        let reply = service.open_session(body.value.into_wire()?).await?;
        let v1::OpenSessionResponse { session, resumed, limits } = reply;
        let opened = OpenedSession {
            session: Session::from(filled(session, "session")?),
            resumed,
            limits: IngestLimits::from(filled(limits, "limits")?),
        };
        let status = if resumed { StatusCode::OK } else { StatusCode::CREATED };
        Ok(Reply::new(status, &opened)?)
    })
    .await
}

/// Sessions, oldest first.
#[utoipa::path(
    get,
    path = "/v1/sessions",
    tag = "sessions",
    params(SessionsQuery),
    responses((status = 200, description = "A page of sessions.", body = SessionList), ListProblems)
)]
pub(super) async fn list_sessions(
    State(rest): State<Rest>,
    Query(query): Query<SessionsQuery>,
) -> Result<Response, Refusal> {
    let SessionsQuery { map, robot, page_size, page_token } = query;
    let request = v1::ListSessionsRequest { map, robot, page_size, page_token };
    let reply = rest.service.list_sessions(request).await?;
    let v1::ListSessionsResponse { sessions, next_page_token } = reply;
    let sessions = sessions.into_iter().map(Session::from).collect();
    Ok(ok(&SessionList { sessions, next_page_token }))
}

/// One session.
#[utoipa::path(
    get,
    path = "/v1/sessions/{session}",
    tag = "sessions",
    params(SessionPath),
    responses((status = 200, description = "The session.", body = Session), ReadProblems)
)]
pub(super) async fn get_session(
    State(rest): State<Rest>,
    Path(path): Path<SessionPath>,
) -> Result<Response, Refusal> {
    let request = v1::GetSessionRequest { session: path.session };
    let v1::GetSessionResponse { session } = rest.service.get_session(request).await?;
    Ok(ok(&Session::from(filled(session, "session")?)))
}

/// Says that nothing more will come.
///
/// What was sent is mapped to the end and published. Closing a closed session is fine.
#[utoipa::path(
    post,
    path = "/v1/sessions/{session}/close",
    tag = "sessions",
    params(SessionPath),
    request_body = Closing,
    responses((status = 200, description = "The session.", body = Session), ChangeProblems)
)]
pub(super) async fn close_session(
    State(rest): State<Rest>,
    Path(path): Path<SessionPath>,
    body: JsonBody<Closing>,
) -> Result<Response, Refusal> {
    let Closing { epoch } = body.value;
    let request = v1::CloseSessionRequest { session: path.session, epoch: epoch.0 };
    let v1::CloseSessionResponse { session } = rest.service.close_session(request).await?;
    Ok(ok(&Session::from(filled(session, "session")?)))
}
