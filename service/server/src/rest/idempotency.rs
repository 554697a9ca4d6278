//! `Idempotency-Key`: a request that creates something may be sent again without doing it twice.
//!
//! The reply to a key is kept for a day and given again, with `Idempotency-Replayed: true`. The same
//! key on the same route with other bytes in the body is refused; so is a key whose first request is
//! still under way. Only successes are kept: what was refused may be tried again. If the service
//! dies between creating and keeping the reply, sending again answers that the id is taken.

use std::collections::HashSet;
use std::future::Future;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use axum::extract::FromRequestParts;
use axum::http::request::Parts;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use meetpoint_storage::{ContentHash, RememberedReply};
use serde::Serialize;
use serde_json::Value;
use utoipa::IntoParams;
use utoipa::openapi::path::{Parameter, ParameterBuilder, ParameterIn};
use utoipa::openapi::{ObjectBuilder, Required, schema::Type};

use super::Rest;
use super::problem::Refusal;
use crate::{clock, error::Error};

/// The request's header.
const KEY: &str = "idempotency-key";
/// The reply's header, where it was given before.
const REPLAYED: &str = "idempotency-replayed";
/// Characters of a key.
const KEY_LEN_MAX: usize = 255;
/// How long replies are kept: a robot that was off for a night finds them.
const KEPT: Duration = Duration::from_hours(24);

/// The key that a request came with, if any.
pub(crate) struct IdempotencyKey(Option<String>);

impl<S: Send + Sync> FromRequestParts<S> for IdempotencyKey {
    type Rejection = Refusal;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Refusal> {
        let Some(value) = parts.headers.get(KEY) else { return Ok(Self(None)) };
        let wrong = || {
            let limits = format!("not 1 to {KEY_LEN_MAX} printable ASCII characters");
            Refusal::from(Error::field("Idempotency-Key", limits))
        };
        let text = value.to_str().map_err(|_| wrong())?.trim();
        // A structured field is quoted; many clients send the bare text.
        let bare = text.strip_prefix('"').and_then(|text| text.strip_suffix('"')).unwrap_or(text);
        if bare.is_empty() || bare.len() > KEY_LEN_MAX {
            return Err(wrong());
        }
        Ok(Self(Some(bare.to_owned())))
    }
}

impl IntoParams for IdempotencyKey {
    fn into_params(_: impl Fn() -> Option<ParameterIn>) -> Vec<Parameter> {
        let key = ObjectBuilder::new()
            .schema_type(Type::String)
            .min_length(Some(1))
            .max_length(Some(KEY_LEN_MAX))
            .pattern(Some("^[\\x21-\\x7e]+$"));
        let parameter = ParameterBuilder::new()
            .name("Idempotency-Key")
            .parameter_in(ParameterIn::Header)
            .required(Required::False)
            .description(Some(
                "Makes sending again safe: the same key with the same body gets the first reply \
                 again, for 24 hours. Quotes around it are optional.",
            ))
            .schema(Some(key))
            .example(Some(Value::from("8e03978e-40d5-43dd-bc93-6894a57f9324")));
        vec![parameter.build()]
    }
}

/// A route that creates.
pub(super) struct Creation {
    /// Method and path, the scope of a key.
    pub(super) route: &'static str,
    /// Path of the resources that it makes, if each has one of its own.
    pub(super) collection: Option<&'static str>,
    /// JSON pointer of the new resource's id in the reply.
    pub(super) id: &'static str,
}

/// Status and JSON of a success.
pub(super) struct Reply {
    status: StatusCode,
    body: Vec<u8>,
}

impl Reply {
    /// # Errors
    /// [`Error::Internal`] if `body` cannot be written as JSON.
    pub(super) fn new(status: StatusCode, body: &impl Serialize) -> Result<Self, Error> {
        Ok(Self { status, body: serde_json::to_vec(body).map_err(Error::internal)? })
    }

    fn into_response(self, creation: &Creation) -> Response {
        let body: Value = serde_json::from_slice(&self.body).unwrap_or_default();
        let id = body.pointer(creation.id).and_then(Value::as_str).unwrap_or_default();
        let location =
            creation.collection.map(|path| HeaderValue::try_from(format!("{path}/{id}")));
        let json = [(header::CONTENT_TYPE, "application/json")];
        let mut response = (self.status, json, self.body).into_response();
        if let Some(Ok(location)) = location {
            response.headers_mut().insert(header::LOCATION, location);
        }
        response
    }
}

/// Keys whose first request is not answered yet.
#[derive(Clone, Debug, Default)]
pub(crate) struct KeysInUse(Arc<Mutex<HashSet<(String, &'static str)>>>);

impl KeysInUse {
    fn claim(&self, key: &str, route: &'static str) -> Result<Claim, Refusal> {
        let entry = (key.to_owned(), route);
        if self.keys().insert(entry.clone()) {
            Ok(Claim { keys: self.clone(), entry })
        } else {
            Err(Refusal::KeyInUse)
        }
    }

    /// A panic while the lock was held cannot leave the set half changed.
    fn keys(&self) -> MutexGuard<'_, HashSet<(String, &'static str)>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A key in use, until it is dropped.
struct Claim {
    keys: KeysInUse,
    entry: (String, &'static str),
}

impl Drop for Claim {
    fn drop(&mut self) {
        self.keys.keys().remove(&self.entry);
    }
}

/// Answers a request that creates: from memory if its key was answered before, else by `operation`,
/// which goes on to its end even if the client leaves.
pub(super) async fn once(
    rest: &Rest,
    creation: &'static Creation,
    key: IdempotencyKey,
    fingerprint: ContentHash,
    operation: impl Future<Output = Result<Reply, Refusal>> + Send + 'static,
) -> Result<Response, Refusal> {
    let IdempotencyKey(Some(key)) = key else {
        return Ok(operation.await?.into_response(creation));
    };
    let claim = rest.keys_in_use.claim(&key, creation.route)?;
    if let Some(reply) = remembered(rest, &key, creation, fingerprint).await? {
        let mut response = reply.into_response(creation);
        response.headers_mut().insert(REPLAYED, HeaderValue::from_static("true"));
        return Ok(response);
    }
    let store = rest.service.store.clone();
    let answering = tokio::spawn(async move {
        let _claim = claim;
        let reply = operation.await?;
        let kept = RememberedReply {
            fingerprint,
            status: reply.status.as_u16(),
            body: reply.body.clone(),
            time_ns: clock::now_ns(),
        };
        store.forget_replies_before(oldest_ns()).await.map_err(Error::from)?;
        store.remember_reply(&key, creation.route, &kept).await.map_err(Error::from)?;
        Ok::<_, Refusal>(reply)
    });
    let reply = answering.await.map_err(Error::internal)??;
    Ok(reply.into_response(creation))
}

async fn remembered(
    rest: &Rest,
    key: &str,
    creation: &Creation,
    asked: ContentHash,
) -> Result<Option<Reply>, Refusal> {
    let found = rest.service.store.remembered_reply(key, creation.route).await;
    let Some(found) = found.map_err(Error::from)? else { return Ok(None) };
    let RememberedReply { fingerprint, status, body, time_ns } = found;
    if time_ns < oldest_ns() {
        return Ok(None);
    }
    if fingerprint != asked {
        return Err(Error::IdempotencyKeyReused.into());
    }
    let status = StatusCode::from_u16(status).map_err(Error::internal)?;
    Ok(Some(Reply { status, body }))
}

/// Replies before this time, by the service's clock, are no longer kept.
fn oldest_ns() -> i64 {
    let kept_ns = i64::try_from(KEPT.as_nanos()).unwrap_or(i64::MAX);
    clock::now_ns().saturating_sub(kept_ns)
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::Request;

    async fn key(header: &[u8]) -> Result<Option<String>, String> {
        let value = HeaderValue::from_bytes(header).expect("a header");
        let (mut parts, ()) =
            Request::builder().header(KEY, value).body(()).expect("one").into_parts();
        let read = IdempotencyKey::from_request_parts(&mut parts, &()).await;
        read.map(|key| key.0).map_err(|refusal| refusal.to_string())
    }

    #[tokio::test]
    async fn quotes_are_optional() {
        assert_eq!(key(b"\"a-1\"").await, Ok(Some("a-1".to_owned())), "a structured field");
        assert_eq!(key(b"a-1").await, Ok(Some("a-1".to_owned())), "bare");
        for bad in [&b"\"\""[..], b"", "k\u{e4}se".as_bytes(), &[b'a'; 256]] {
            assert!(key(bad).await.is_err(), "{bad:?} is no key");
        }
    }

    #[test]
    fn a_key_is_free_again_after_its_request() {
        let keys = KeysInUse::default();
        let claim = keys.claim("a", "POST /v1/maps").map_err(|refusal| refusal.to_string());
        assert!(claim.is_ok(), "the first");
        assert!(keys.claim("a", "POST /v1/maps").is_err(), "under way");
        assert!(keys.claim("a", "POST /v1/jobs").is_ok(), "another route");
        drop(claim);
        assert!(keys.claim("a", "POST /v1/maps").is_ok(), "answered");
    }
}
