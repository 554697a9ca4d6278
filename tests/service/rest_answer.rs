//! What REST answers: a body, or a problem document.

use std::time::Duration;

use serde_json::Value;

use crate::door::{Answer, Refused};
use crate::http::Reply;

/// The body of an answer with one of these statuses.
pub(crate) fn answer(reply: &Reply, statuses: &[u16]) -> Answer<Value> {
    if reply.status < 400 {
        assert!(statuses.contains(&reply.status), "{} {}", reply.status, reply.text());
        return Ok(reply.json());
    }
    let problem = reply.problem();
    let text = |value: &Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
    let own = ["type", "title", "status", "detail", "instance", "code", "request_id"];
    let members = problem.as_object().into_iter().flatten();
    let facts = members.filter(|(name, _)| !own.contains(&name.as_str()));
    Err(Refused {
        code: text(&problem["code"]),
        message: text(&problem["detail"]),
        facts: facts.map(|(name, value)| (name.clone(), text(value))).collect(),
        retry_after: reply.header("retry-after").parse().ok().map(Duration::from_secs),
    })
}

/// A body that is no JSON, if the answer is one.
pub(crate) fn answered_bytes(reply: Reply) -> Answer<Vec<u8>> {
    if reply.status == 200 {
        return Ok(reply.body);
    }
    answer(&reply, &[200]).map(|body| panic!("{body} is no picture"))
}
