//! Entity tags: what has not changed is not sent again.
//!
//! A tag is a hash of what determines the bytes: the map version (by number and time of making, so
//! that a fresh database does not pass for the old one), the part and the format asked for. It is
//! known before anything is drawn.

use axum::body::Body;
use axum::extract::Request;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

/// Cached for a year: what a version says never changes.
const IMMUTABLE: &str = "public, max-age=31536000, immutable";
/// Asked for every time: the pointer may have moved.
const ASK_AGAIN: &str = "no-cache";
/// Bytes of the hash that a tag shows: 2⁻⁶⁴ for two to be the same.
const N_HASH_BYTES: usize = 16;

/// A strong entity tag, and how long what it tags may be kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct EntityTag {
    text: String,
    /// True if the URL names a version.
    is_immutable: bool,
}

impl EntityTag {
    /// The tag of what these facts determine.
    pub(super) fn of(facts: &[&str], is_immutable: bool) -> Self {
        let mut hasher = blake3::Hasher::new();
        // What the same facts look like may change with the program.
        for fact in std::iter::once(&env!("CARGO_PKG_VERSION")).chain(facts) {
            hasher.update(&(fact.len() as u64).to_le_bytes());
            hasher.update(fact.as_bytes());
        }
        let hash = hasher.finalize().to_hex();
        Self { text: format!("\"{}\"", &hash[..2 * N_HASH_BYTES]), is_immutable }
    }

    /// 304 if the client has it: `If-None-Match`, compared weakly as RFC 9110 asks.
    pub(super) fn not_modified(&self, request: &HeaderMap) -> Option<Response> {
        let opaque = |tag: &str| tag.trim().trim_start_matches("W/").to_owned();
        let known = request.get_all(header::IF_NONE_MATCH).iter().any(|value| {
            let list = value.to_str().unwrap_or_default();
            list.split(',').any(|tag| opaque(tag) == self.text || tag.trim() == "*")
        });
        known.then(|| self.on(StatusCode::NOT_MODIFIED.into_response()))
    }

    /// Tags a response.
    pub(super) fn on(&self, mut response: Response) -> Response {
        let cache = if self.is_immutable { IMMUTABLE } else { ASK_AGAIN };
        let headers = response.headers_mut();
        headers.insert(header::CACHE_CONTROL, HeaderValue::from_static(cache));
        // Quotes and hexadecimal figures are always a header's value.
        if let Ok(text) = HeaderValue::try_from(&self.text) {
            headers.insert(header::ETAG, text);
        }
        response
    }
}

/// Layer, around compression: compressed bytes are other bytes, so their tag is a weak one.
pub(super) async fn weakened(request: Request, next: Next) -> Response<Body> {
    let mut response = next.run(request).await;
    let headers = response.headers_mut();
    if !headers.contains_key(header::CONTENT_ENCODING) {
        return response;
    }
    let strong = headers.get(header::ETAG).and_then(|tag| tag.to_str().ok());
    let weak = strong.filter(|tag| tag.starts_with('"')).map(|tag| format!("W/{tag}"));
    if let Some(weak) = weak.and_then(|tag| HeaderValue::try_from(tag).ok()) {
        headers.insert(header::ETAG, weak);
    }
    response
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asks_with(value: &str) -> HeaderMap {
        let mut headers = HeaderMap::new();
        headers.insert(header::IF_NONE_MATCH, value.parse().expect("a header"));
        headers
    }

    #[test]
    fn other_facts_other_tag() {
        let of = |facts: &[&str]| EntityTag::of(facts, true);
        assert_ne!(of(&["ab", "c"]), of(&["a", "bc"]), "where one fact ends counts");
        assert_eq!(of(&["a"]), of(&["a"]), "nothing else does");
    }

    #[test]
    fn a_known_tag_is_not_sent_again() {
        let tag = EntityTag::of(&["intel", "7"], false);
        for known in [tag.text.clone(), format!("W/{}", tag.text), format!("\"x\", {}", tag.text)] {
            let response = tag.not_modified(&asks_with(&known)).expect("known");
            assert_eq!(response.status(), StatusCode::NOT_MODIFIED, "304 for {known}");
            assert_eq!(response.headers()[header::CACHE_CONTROL], "no-cache", "as with 200");
        }
        assert!(tag.not_modified(&asks_with("\"x\"")).is_none(), "another tag");
        assert!(tag.not_modified(&HeaderMap::new()).is_none(), "no tag");
    }
}
