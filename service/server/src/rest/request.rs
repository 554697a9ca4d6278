//! What is read of a request: JSON bodies, queries, paths, each refused with a problem document.

use axum::body::Body;
use axum::extract::{FromRequest, FromRequestParts, Request};
use axum::http::header::CONTENT_TYPE;
use axum::http::request::Parts;
use meetpoint_storage::ContentHash;
use serde::de::DeserializeOwned;
use tokio_stream::StreamExt;

use super::Rest;
use super::problem::Refusal;
use crate::error::Error;

/// Larger bodies are parsed off the async threads: at some 200 MB/s this is half a millisecond.
const INLINE_BYTES_MAX: usize = 100_000;

/// Of a body that is too large, so much is read beyond the limit and thrown away.
const THROWN_AWAY_BYTES_MAX: usize = 64 << 20;

/// A body of JSON.
pub(crate) struct JsonBody<T> {
    /// What it says.
    pub(crate) value: T,
    /// BLAKE3 of its bytes.
    pub(crate) fingerprint: ContentHash,
}

impl<T: DeserializeOwned + Send + 'static> FromRequest<Rest> for JsonBody<T> {
    type Rejection = Refusal;

    async fn from_request(request: Request, rest: &Rest) -> Result<Self, Refusal> {
        check_content_type(&request)?;
        let limit_bytes = rest.service.settings.limits.request_bytes_max;
        let bytes = whole_body(request.into_body(), limit_bytes).await?;
        if bytes.len() <= INLINE_BYTES_MAX {
            return parsed(&bytes);
        }
        tokio::task::spawn_blocking(move || parsed(&bytes)).await.map_err(Error::internal)?
    }
}

/// The body, if it is not too large. One that is gets read on for a while and thrown away, so that
/// its sender finds the refusal and not a broken pipe.
pub(super) async fn whole_body(body: Body, limit_bytes: usize) -> Result<Vec<u8>, Refusal> {
    let mut pieces = body.into_data_stream();
    let mut bytes = Vec::new();
    let mut n_bytes = 0_usize;
    while n_bytes < limit_bytes.saturating_add(THROWN_AWAY_BYTES_MAX)
        && let Some(piece) = pieces.next().await
    {
        let piece = piece.map_err(|_| Refusal::BodyEndedEarly)?;
        n_bytes = n_bytes.saturating_add(piece.len());
        if n_bytes <= limit_bytes {
            bytes.extend_from_slice(&piece);
        } else {
            bytes = Vec::new();
        }
    }
    if n_bytes <= limit_bytes { Ok(bytes) } else { Err(Refusal::BodyTooLarge { limit_bytes }) }
}

fn check_content_type(request: &Request) -> Result<(), Refusal> {
    let stated = request.headers().get(CONTENT_TYPE).map(|value| value.to_str().unwrap_or("?"));
    let stated = stated.unwrap_or("none");
    let kind = stated.split(';').next().unwrap_or("").trim().to_ascii_lowercase();
    let is_json =
        kind == "application/json" || (kind.starts_with("application/") && kind.ends_with("+json"));
    if is_json {
        return Ok(());
    }
    let stated = stated.chars().take(100).collect();
    Err(Refusal::UnsupportedMediaType { stated, taken: "application/json" })
}

fn parsed<T: DeserializeOwned>(bytes: &[u8]) -> Result<JsonBody<T>, Refusal> {
    let fingerprint = ContentHash(*blake3::hash(bytes).as_bytes());
    let mut deserializer = serde_json::Deserializer::from_slice(bytes);
    let value = serde_path_to_error::deserialize(&mut deserializer).map_err(|error| {
        let path = error.path().to_string();
        let inner = error.into_inner();
        if inner.is_data() {
            let field = if path == "." { "body".to_owned() } else { path };
            Refusal::from(Error::field(field, inner.to_string()))
        } else {
            Refusal::MalformedBody(inner.to_string())
        }
    })?;
    deserializer.end().map_err(|error| Refusal::MalformedBody(error.to_string()))?;
    Ok(JsonBody { value, fingerprint })
}

/// The fields of a query.
pub(crate) struct Query<T>(pub(crate) T);

impl<S: Send + Sync, T: DeserializeOwned> FromRequestParts<S> for Query<T> {
    type Rejection = Refusal;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Refusal> {
        match axum::extract::Query::try_from_uri(&parts.uri) {
            Ok(axum::extract::Query(value)) => Ok(Self(value)),
            Err(rejection) => Err(Refusal::InvalidQuery(cause(&rejection))),
        }
    }
}

/// The variable parts of a path.
pub(crate) struct Path<T>(pub(crate) T);

impl<S: Send + Sync, T: DeserializeOwned + Send> FromRequestParts<S> for Path<T> {
    type Rejection = Refusal;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Refusal> {
        match axum::extract::Path::from_request_parts(parts, state).await {
            Ok(axum::extract::Path(value)) => Ok(Self(value)),
            Err(rejection) => Err(Refusal::InvalidPath(rejection.body_text())),
        }
    }
}

/// What lies under a rejection of axum: the field and what is wrong with it.
fn cause(rejection: &dyn std::error::Error) -> String {
    rejection.source().map_or_else(|| rejection.to_string(), ToString::to_string)
}

/// The one of several alternatives that is there, or `None`.
///
/// # Errors
/// [`Error::InvalidField`] at `path` if there are several.
pub(super) fn only_one<T>(
    path: &str,
    alternatives: impl IntoIterator<Item = (&'static str, Option<T>)>,
) -> Result<Option<T>, Error> {
    let mut found: Option<(&str, T)> = None;
    for (name, value) in alternatives {
        let Some(value) = value else { continue };
        if let Some((before, _)) = &found {
            return Err(Error::field(path, format!("`{before}` and `{name}`, one is taken")));
        }
        found = Some((name, value));
    }
    Ok(found.map(|(_, value)| value))
}

/// The number of a map version in a path or query; 0 stands for the published one.
///
/// # Errors
/// [`Error::InvalidField`] unless it is a number from 1 on or `latest`.
pub(super) fn version_number(text: &str) -> Result<u64, Error> {
    if text == "latest" {
        return Ok(0);
    }
    text.parse().ok().filter(|&number| number != 0).ok_or_else(|| {
        let shown: String = text.chars().take(20).collect();
        Error::field("version", format!("`{shown}` is neither `latest` nor a number from 1 on"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rest::geometry::Pose;

    fn refused(body: &str) -> String {
        match parsed::<Pose>(body.as_bytes()) {
            Err(refusal) => refusal.to_string(),
            Ok(_) => panic!("{body} was taken"),
        }
    }

    #[test]
    fn says_where_a_body_is_wrong() {
        assert!(
            refused(r#"{"x_m": 1, "y_m": "a", "theta_rad": 0}"#).starts_with("y_m: invalid type"),
            "the field is named"
        );
        assert!(
            refused(r#"{"x_m": 1, "y_m": 2, "theta_rad": 0, "z_m": 0}"#).contains("unknown field"),
            "unknown fields are refused"
        );
        assert!(refused(r#"{"x_m": 1"#).starts_with("the body is not JSON"), "cut off");
        assert!(
            refused(r#"{"x_m": 1, "y_m": 2, "theta_rad": 0} 1"#).starts_with("the body is not"),
            "something follows"
        );
        assert!(
            refused(r#"{"x_m": 1e999, "y_m": 2, "theta_rad": 0}"#).contains("range"),
            "too far"
        );
    }

    #[test]
    fn versions_by_number_or_latest() {
        assert_eq!(version_number("latest").ok(), Some(0), "the published one");
        assert_eq!(version_number("18446744073709551615").ok(), Some(u64::MAX), "any number");
        for bad in ["0", "-1", "1.0", "newest", ""] {
            assert!(version_number(bad).is_err(), "`{bad}` is none");
        }
    }

    #[test]
    fn one_of_several() {
        let both = only_one("kind", [("a", Some(1)), ("b", None), ("c", Some(3))]);
        assert_eq!(
            both.expect_err("two").to_string(),
            "kind: `a` and `c`, one is taken",
            "both are named"
        );
        assert_eq!(only_one("kind", [("a", None), ("b", Some(2))]).ok(), Some(Some(2)), "one");
    }
}
