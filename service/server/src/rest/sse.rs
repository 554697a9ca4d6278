//! Server-sent events: one channel for one watcher, kept alive by comments.

use std::convert::Infallible;
use std::time::Duration;

use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;

use super::problem::{Problem, Refusal};
use crate::error::Error;

/// Events on their way to one watcher.
const N_EVENTS_BUFFERED: usize = 64;
/// Between comments that tell proxies and clients that the stream lives.
const KEEP_ALIVE: Duration = Duration::from_secs(15);

/// Sends to one watcher.
pub(super) struct Watcher(mpsc::Sender<Result<Event, Infallible>>);

/// The watcher has gone.
pub(super) struct Gone;

impl Watcher {
    /// A watcher, and the response that it reads.
    pub(super) fn new() -> (Self, Response) {
        let (sender, receiver) = mpsc::channel(N_EVENTS_BUFFERED);
        let keep_alive = KeepAlive::new().interval(KEEP_ALIVE).text("keep-alive");
        let response = Sse::new(ReceiverStream::new(receiver)).keep_alive(keep_alive);
        (Self(sender), response.into_response())
    }

    /// Sends an event, waiting for room.
    ///
    /// # Errors
    /// [`Gone`] if nobody reads any more.
    pub(super) async fn send(&self, name: &str, data: &impl Serialize) -> Result<(), Gone> {
        let event = Event::default().event(name);
        let event = match event.json_data(data) {
            Ok(event) => event,
            Err(error) => {
                Error::internal(error).log();
                return Err(Gone);
            }
        };
        self.0.send(Ok(event)).await.map_err(|_| Gone)
    }

    /// Sends what ends the stream.
    pub(super) async fn send_error(&self, error: Error) {
        error.log();
        // Whoever has gone needs no reason.
        let _ = self.send("error", &Problem::of(&Refusal::Service(error))).await;
    }

    /// Waits until nobody reads any more.
    pub(super) async fn gone(&self) {
        self.0.closed().await;
    }
}
