//! Health and metrics.

use std::time::Duration;

use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use utoipa::ToSchema;

use super::Rest;
use super::openapi::NotReadyProblem;
use super::problem::Refusal;
use super::reply::ok;
use crate::telemetry;

/// Prometheus' text format.
const PROMETHEUS_TEXT: &str = "text/plain; version=0.0.4; charset=utf-8";
/// A store that takes longer for a trivial question serves nobody.
const STORE_ANSWERS_WITHIN: Duration = Duration::from_secs(1);

/// All is well.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Health {
    /// Always `ok`.
    #[schema(example = "ok")]
    status: &'static str,
}

const WELL: Health = Health { status: "ok" };

/// Answers while the process is up.
#[utoipa::path(
    get,
    path = "/healthz",
    tag = "operation",
    responses((status = 200, description = "The process is up.", body = Health))
)]
pub(super) async fn healthz() -> Response {
    ok(&WELL)
}

/// Says whether requests can be served.
///
/// Three checks: `stopping` (the service is not going down), `journal` (the last batches that came
/// could be kept) and `store` (a trivial question is answered within a second). The problem document's `check` names the one that failed.
#[utoipa::path(
    get,
    path = "/readyz",
    tag = "operation",
    responses(
        (status = 200, description = "Requests can be served.", body = Health),
        NotReadyProblem,
    )
)]
pub(super) async fn readyz(State(rest): State<Rest>) -> Result<Response, Refusal> {
    let not_ready = |check, problem: &str| Refusal::NotReady { check, problem: problem.to_owned() };
    if rest.service.stop.is_cancelled() {
        return Err(not_ready("stopping", "the service is going down"));
    }
    if let Some(problem) = rest.service.journal.failure() {
        return Err(not_ready("journal", &problem));
    }
    let question = rest.service.store.maps(None, 1);
    match tokio::time::timeout(STORE_ANSWERS_WITHIN, question).await {
        Ok(Ok(_)) => Ok(ok(&WELL)),
        Ok(Err(error)) => {
            let error = crate::error::Error::from(error);
            error.log();
            Err(not_ready("store", &error.to_string()))
        }
        Err(_) => {
            let problem = format!("no answer within {} s", STORE_ANSWERS_WITHIN.as_secs());
            Err(not_ready("store", &problem))
        }
    }
}

/// All metrics in Prometheus' text format.
#[utoipa::path(
    get,
    path = "/metrics",
    tag = "operation",
    responses((status = 200, description = "The metrics.", content_type = "text/plain", body = String))
)]
pub(super) async fn metrics() -> Response {
    ([(header::CONTENT_TYPE, PROMETHEUS_TEXT)], telemetry::render_metrics()).into_response()
}
