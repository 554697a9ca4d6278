//! What is answered.

use axum::Json;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;

use super::problem::Refusal;
use crate::error::Error;

/// A part of a reply that its operation always fills in.
///
/// # Errors
/// [`Error::Internal`] if it did not.
pub(super) fn filled<T>(part: Option<T>, name: &str) -> Result<T, Error> {
    part.ok_or_else(|| Error::internal(format!("a reply without `{name}`")))
}

/// 200 and JSON.
pub(super) fn ok(body: &impl Serialize) -> Response {
    (StatusCode::OK, Json(body)).into_response()
}

/// 200 and JSON that may be long: written off the async threads.
///
/// # Errors
/// [`Error::Internal`] if it cannot be written.
pub(super) async fn ok_long(body: impl Serialize + Send + 'static) -> Result<Response, Refusal> {
    let written = tokio::task::spawn_blocking(move || serde_json::to_vec(&body)).await;
    let bytes = written.map_err(Error::internal)?.map_err(Error::internal)?;
    Ok(([(header::CONTENT_TYPE, "application/json")], bytes).into_response())
}
