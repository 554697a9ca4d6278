//! Errors as RFC 9457 problem documents.
//!
//! `type` is `/problems/` and the code in kebab case. It names the problem and stays the same for
//! ever; there is no page behind it. Programs switch on `code`, which gRPC's `ErrorInfo` holds too.

use std::collections::BTreeMap;

use axum::body::Body;
use axum::extract::Request;
use axum::http::{HeaderValue, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use serde_json::Value;
use utoipa::ToSchema;

use super::request_id;
use crate::error::{Code, Error, status};

/// The media type of problem documents.
pub(super) const PROBLEM_JSON: &str = "application/problem+json";

/// Why a request got no answer: the service's errors, and what only HTTP knows.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Refusal {
    /// The operation's own error.
    #[error(transparent)]
    Service(#[from] Error),
    /// Nothing is served under that path.
    #[error("nothing is at `{0}`")]
    RouteNotFound(String),
    /// The path is served, but not by that method.
    #[error("`{0}` is not a method of this path")]
    MethodNotAllowed(String),
    /// The body cannot be parsed.
    #[error("the body is not JSON: {0}")]
    MalformedBody(String),
    /// The body cannot be taken apart.
    #[error("the body is not the form that is wanted: {0}")]
    MalformedForm(String),
    /// The query's fields are not what they must be.
    #[error("query: {0}")]
    InvalidQuery(String),
    /// A part of the path is not what it must be.
    #[error("path: {0}")]
    InvalidPath(String),
    /// The body is declared as something else than what is taken.
    #[error("the body's content type is `{stated}`, `{taken}` is taken")]
    UnsupportedMediaType {
        /// What the request says.
        stated: String,
        /// What it must say.
        taken: &'static str,
    },
    /// The body is larger than is taken.
    #[error("the body has more than {limit_bytes} bytes, which is the limit")]
    BodyTooLarge {
        /// `limits.request_bytes_max`.
        limit_bytes: usize,
    },
    /// The connection broke while the body was read.
    #[error("the body ended early")]
    BodyEndedEarly,
    /// The first request with this key is not answered yet.
    #[error("the first request with this Idempotency-Key is still under way")]
    KeyInUse,
    /// A check of readiness failed.
    #[error("{check}: {problem}")]
    NotReady {
        /// Which.
        check: &'static str,
        /// What was found.
        problem: String,
    },
    /// What a layer below answered by a bare status.
    #[error("{}", .0.canonical_reason().unwrap_or("refused").to_lowercase())]
    Bare(StatusCode),
}

impl Refusal {
    /// Status and stable code. Statuses that gRPC has a twin of come from the one table.
    fn row(&self) -> (StatusCode, &'static str) {
        match self {
            Self::Service(error) => (status(error.code()).0, error.reason()),
            Self::RouteNotFound(_) => (status(Code::NotFound).0, "ROUTE_NOT_FOUND"),
            Self::MethodNotAllowed(_) => (StatusCode::METHOD_NOT_ALLOWED, "METHOD_NOT_ALLOWED"),
            Self::MalformedBody(_) | Self::MalformedForm(_) => {
                (status(Code::Invalid).0, "MALFORMED_BODY")
            }
            Self::InvalidQuery(_) => (status(Code::Invalid).0, "INVALID_QUERY"),
            Self::InvalidPath(_) => (status(Code::Invalid).0, "INVALID_PATH"),
            Self::UnsupportedMediaType { .. } => {
                (StatusCode::UNSUPPORTED_MEDIA_TYPE, "UNSUPPORTED_MEDIA_TYPE")
            }
            Self::BodyTooLarge { .. } => (status(Code::TooLarge).0, "MESSAGE_TOO_LARGE"),
            Self::BodyEndedEarly => (status(Code::Invalid).0, "BODY_ENDED_EARLY"),
            Self::KeyInUse => (status(Code::AlreadyExists).0, "IDEMPOTENCY_KEY_IN_USE"),
            Self::NotReady { .. } => (status(Code::Busy).0, "NOT_READY"),
            Self::Bare(StatusCode::INTERNAL_SERVER_ERROR) => {
                (StatusCode::INTERNAL_SERVER_ERROR, "INTERNAL")
            }
            Self::Bare(status) => (*status, "HTTP_ERROR"),
        }
    }

    fn retry_after_s(&self) -> Option<u64> {
        match self {
            Self::Service(error) => error.retry_after().map(|delay| delay.as_secs().max(1)),
            Self::KeyInUse | Self::NotReady { .. } => Some(1),
            _ => None,
        }
    }

    /// Facts for programs. Numbers become numbers; a field's path stays text.
    fn members(&self) -> BTreeMap<String, Value> {
        let facts = match self {
            Self::Service(error) => error.metadata(),
            Self::BodyTooLarge { limit_bytes } => vec![("limit_bytes", limit_bytes.to_string())],
            Self::NotReady { check, .. } => vec![("check", (*check).to_owned())],
            _ => Vec::new(),
        };
        let value = |text: String| match text.parse::<u64>() {
            Ok(number) => serde_json::json!(super::integer::Unsigned64(number)),
            Err(_) => Value::from(text),
        };
        facts.into_iter().map(|(name, text)| (name.to_owned(), value(text))).collect()
    }
}

/// What went wrong, after RFC 9457.
#[derive(Clone, Debug, Serialize, ToSchema)]
#[schema(example = json!({
    "type": "/problems/map-not-found",
    "title": "Map not found",
    "status": 404,
    "detail": "no map `intel`",
    "instance": "/v1/maps/intel",
    "code": "MAP_NOT_FOUND",
    "request_id": "0199d3a6-6ac5-7c4e-9d51-2d9a3f1f3c11"
}))]
pub(crate) struct Problem {
    /// Names the kind of problem: `/problems/` and the code in kebab case. No page is behind it.
    #[serde(rename = "type")]
    kind: String,
    /// The kind of problem in words, the same for every occurrence.
    title: String,
    /// The HTTP status, repeated.
    status: u16,
    /// This occurrence, for people: the value at fault and the limit.
    detail: String,
    /// The path that was asked for.
    #[serde(skip_serializing_if = "String::is_empty")]
    instance: String,
    /// Stable, for programs.
    code: &'static str,
    /// The `x-request-id` of the answer, to be found in the service's log.
    #[serde(skip_serializing_if = "String::is_empty")]
    request_id: String,
    /// Facts for programs: `field`, `expected_number`, `newest_epoch`, `number`, `limit_bytes`,
    /// `limit_cells` or `check`, where the code has them.
    #[serde(flatten)]
    #[schema(additional_properties, value_type = Object)]
    members: BTreeMap<String, Value>,
}

impl Problem {
    /// The document of a refusal; which request it was is filled in by [`written_out`].
    pub(super) fn of(refusal: &Refusal) -> Self {
        let (status, code) = refusal.row();
        Self {
            kind: format!("/problems/{}", code.to_lowercase().replace('_', "-")),
            title: title(code),
            status: status.as_u16(),
            detail: refusal.to_string(),
            instance: String::new(),
            code,
            request_id: String::new(),
            members: refusal.members(),
        }
    }
}

/// `MAP_NOT_FOUND` becomes `Map not found`.
fn title(code: &str) -> String {
    let words = code.to_lowercase().replace('_', " ");
    let mut letters = words.chars();
    let first = letters.next().map(|letter| letter.to_ascii_uppercase());
    first.into_iter().chain(letters).collect()
}

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        if let Self::Service(error) = &self {
            error.log();
        }
        let problem = Problem::of(&self);
        let mut response = self.row().0.into_response();
        if let Some(seconds) = self.retry_after_s() {
            response.headers_mut().insert(header::RETRY_AFTER, HeaderValue::from(seconds));
        }
        response.extensions_mut().insert(problem);
        response
    }
}

/// Layer: gives every error its document, those of the router and its layers too.
pub(super) async fn written_out(request: Request, next: Next) -> Response {
    let instance = request.uri().path().to_owned();
    let method = request.method().to_string();
    let request_id = request_id(&request);
    let mut response = next.run(request).await;
    let status = response.status();
    if !(status.is_client_error() || status.is_server_error()) {
        return response;
    }
    let stated = response.extensions_mut().remove::<Problem>();
    let problem = stated.unwrap_or_else(|| {
        Problem::of(&match status {
            StatusCode::NOT_FOUND => Refusal::RouteNotFound(instance.clone()),
            StatusCode::METHOD_NOT_ALLOWED => Refusal::MethodNotAllowed(method),
            other => Refusal::Bare(other),
        })
    });
    let problem = Problem { instance, request_id, ..problem };
    let (mut parts, _) = response.into_parts();
    parts.headers.remove(header::CONTENT_LENGTH);
    parts.headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(PROBLEM_JSON));
    // A document of strings and numbers cannot fail to be written.
    Response::from_parts(parts, Body::from(serde_json::to_vec(&problem).unwrap_or_default()))
}

/// What a handler's panic is answered with.
#[expect(clippy::needless_pass_by_value, reason = "the shape that the panic layer asks for")]
pub(super) fn of_panic(panic: Box<dyn std::any::Any + Send>) -> Response {
    let words = panic
        .downcast_ref::<&str>()
        .map(|text| (*text).to_owned())
        .or_else(|| panic.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "a panic without words".to_owned());
    Refusal::Service(Error::internal(words)).into_response()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn document(refusal: &Refusal) -> Value {
        serde_json::to_value(Problem::of(refusal)).expect("a document")
    }

    #[test]
    fn says_what_and_where() {
        let gap = document(&Error::SequenceGap { expected: 7 }.into());
        assert_eq!(gap["type"], "/problems/sequence-gap", "kebab case");
        assert_eq!(gap["title"], "Sequence gap", "in words");
        assert_eq!(gap["status"], 409, "repeated");
        assert_eq!(gap["code"], "SEQUENCE_GAP", "for programs");
        assert_eq!(gap["expected_number"], 7, "a number");
        let field = document(&Error::field("map.id", "empty").into());
        assert_eq!(field["field"], "map.id", "named");
        assert_eq!(field["detail"], "map.id: empty", "the value at fault");
    }

    #[test]
    fn causes_are_not_told() {
        let internal = Refusal::from(Error::internal("the password is hunter2"));
        assert_eq!(document(&internal)["detail"], "internal error", "nothing of the cause");
    }

    #[test]
    fn says_when_to_come_again() {
        let response = Refusal::from(Error::StorageFull).into_response();
        assert_eq!(response.headers()[header::RETRY_AFTER], "30", "seconds");
        assert_eq!(response.status(), StatusCode::INSUFFICIENT_STORAGE, "507");
    }
}
