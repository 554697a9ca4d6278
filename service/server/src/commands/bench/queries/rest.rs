//! One kept-alive connection to REST.

use anyhow::Context;
use axum::body::{Body, Bytes};
use http::{Method, Request, StatusCode, header};
use hyper::client::conn::http1::{SendRequest, handshake};
use hyper_util::rt::TokioIo;
use tokio::net::TcpStream;

use super::question::RestQuestion;

/// Bytes of an answer, at most: a matrix has 10 000 numbers.
const ANSWER_BYTES_MAX: usize = 4 << 20;

/// A connection, over which one question is asked after the other.
pub(super) struct RestConnection {
    host: String,
    requests: SendRequest<Body>,
}

impl RestConnection {
    /// Connects to the service at `url`.
    pub(super) async fn open(url: &str) -> anyhow::Result<Self> {
        let host = url.strip_prefix("http://").unwrap_or(url).trim_end_matches('/').to_owned();
        let stream = TcpStream::connect(&host).await.context("nobody listens")?;
        stream.set_nodelay(true)?;
        let (requests, connection) = handshake(TokioIo::new(stream)).await?;
        // What breaks the connection is told to whoever asks over it.
        tokio::spawn(async move { drop(connection.await) });
        Ok(Self { host, requests })
    }

    /// The body of the answer.
    ///
    /// # Errors
    /// If the connection broke, or the answer is a refusal.
    pub(super) async fn ask(&mut self, question: RestQuestion) -> anyhow::Result<Bytes> {
        let RestQuestion { target, body } = question;
        let request = Request::builder().uri(&target).header(header::HOST, &self.host);
        let request = match body {
            Some(body) => request
                .method(Method::POST)
                .header(header::CONTENT_TYPE, "application/json")
                .body(Body::from(body.to_string()))?,
            None => request.method(Method::GET).body(Body::empty())?,
        };
        self.requests.ready().await?;
        let response = self.requests.send_request(request).await?;
        let status = response.status();
        let body = axum::body::to_bytes(Body::new(response.into_body()), ANSWER_BYTES_MAX).await?;
        let text = || String::from_utf8_lossy(&body);
        anyhow::ensure!(status == StatusCode::OK, "{status} to {target}: {}", text());
        Ok(body)
    }
}
