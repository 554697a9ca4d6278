//! What is answered.

use axum::Json;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use serde::Serialize;

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
