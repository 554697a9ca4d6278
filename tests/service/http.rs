//! REST as any program would speak it.

use std::io::{BufRead, BufReader};
use std::time::Duration;

use serde_json::Value;
use ureq::http::{HeaderMap, Response};
use ureq::{Agent, Body};

/// An answer that takes longer will not come: a guard against hanging for ever, not a measure.
const GUARD: Duration = Duration::from_mins(1);
/// The largest body taken.
const BODY_BYTES_MAX: u64 = 64 << 20;

/// A REST client.
#[derive(Clone, Debug)]
pub(crate) struct Http {
    agent: Agent,
    url: String,
}

/// An answer, whatever its status.
#[derive(Debug)]
pub(crate) struct Reply {
    pub(crate) status: u16,
    pub(crate) headers: HeaderMap,
    pub(crate) body: Vec<u8>,
}

impl Http {
    pub(crate) fn new(url: String) -> Self {
        // A connection a request: none is left over that the service has closed meanwhile.
        let config = Agent::config_builder()
            .http_status_as_error(false)
            .timeout_global(Some(GUARD))
            .max_idle_connections(0)
            .build();
        Self { agent: config.into(), url }
    }

    fn at(&self, path: &str) -> String {
        format!("{}{path}", self.url)
    }

    pub(crate) fn get(&self, path: &str) -> Reply {
        self.get_with(path, &[])
    }

    pub(crate) fn get_with(&self, path: &str, headers: &[(&str, &str)]) -> Reply {
        let mut request = self.agent.get(self.at(path));
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        reply(path, request.call())
    }

    pub(crate) fn post(&self, path: &str, body: &Value) -> Reply {
        self.post_with(path, &[("content-type", "application/json")], body.to_string().as_bytes())
    }

    pub(crate) fn post_with(&self, path: &str, headers: &[(&str, &str)], body: &[u8]) -> Reply {
        let mut request = self.agent.post(self.at(path));
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        reply(path, request.send(body))
    }

    pub(crate) fn put(&self, path: &str, body: &Value) -> Reply {
        let request = self.agent.put(self.at(path)).header("content-type", "application/json");
        reply(path, request.send(body.to_string().as_bytes()))
    }

    pub(crate) fn delete(&self, path: &str) -> Reply {
        reply(path, self.agent.delete(self.at(path)).call())
    }

    /// Server-sent events, from now on.
    pub(crate) fn events(&self, path: &str) -> Events {
        let response = self.agent.get(self.at(path)).call().expect("an answer");
        assert_eq!(response.status().as_u16(), 200, "{path} is a stream of events");
        Events(BufReader::new(Box::new(response.into_body().into_reader())))
    }
}

fn reply(path: &str, response: Result<Response<Body>, ureq::Error>) -> Reply {
    response.and_then(whole).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// A response and its body.
fn whole(mut response: Response<Body>) -> Result<Reply, ureq::Error> {
    let body = response.body_mut().with_config().limit(BODY_BYTES_MAX).read_to_vec()?;
    Ok(Reply { status: response.status().as_u16(), headers: response.headers().clone(), body })
}

impl Reply {
    /// The header's text; empty if it is not there.
    pub(crate) fn header(&self, name: &str) -> &str {
        self.headers.get(name).and_then(|value| value.to_str().ok()).unwrap_or_default()
    }

    pub(crate) fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }

    pub(crate) fn json(&self) -> Value {
        serde_json::from_slice(&self.body)
            .unwrap_or_else(|error| panic!("{error} in {} {}", self.status, self.text()))
    }

    /// The document of an error, checked for what RFC 9457 and the contract ask of each.
    pub(crate) fn problem(&self) -> Value {
        assert_eq!(self.header("content-type"), "application/problem+json", "{}", self.text());
        let problem = self.json();
        assert_eq!(problem["status"], self.status, "the status is repeated: {problem}");
        let code = problem["code"].as_str().unwrap_or_default();
        let kind = format!("/problems/{}", code.to_lowercase().replace('_', "-"));
        assert_eq!(problem["type"], kind, "the type is the code: {problem}");
        for member in ["title", "detail", "instance", "request_id"] {
            assert!(problem[member].is_string(), "`{member}` is missing: {problem}");
        }
        problem
    }
}

/// Server-sent events as they come.
pub(crate) struct Events(BufReader<Box<dyn std::io::Read + Send>>);

impl Events {
    /// The next event's name and data; `None` when the stream ended.
    pub(crate) fn next(&mut self) -> Option<(String, Value)> {
        let (mut name, mut data) = (String::new(), String::new());
        loop {
            let mut line = String::new();
            if self.0.read_line(&mut line).expect("the stream can be read") == 0 {
                return None;
            }
            let line = line.trim_end();
            if let Some(text) = line.strip_prefix("event:") {
                text.trim().clone_into(&mut name);
            } else if let Some(text) = line.strip_prefix("data:") {
                data.push_str(text.trim());
            } else if line.is_empty() && !name.is_empty() {
                return Some((name, serde_json::from_str(&data).expect("data is JSON")));
            }
        }
    }
}
