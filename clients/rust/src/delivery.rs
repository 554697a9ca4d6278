//! Delivers the batches of a session over the ingest stream, once each, in order, whatever happens
//! to the connection.

mod window;

use std::{io, time::Duration};

use meetpoint_proto::v1::{
    Ack, Attach, Attached, IngestRequest, IngestResponse, PoseCorrection, Rejection, Session, Skip,
    ingest_request, ingest_response,
};
use tokio::{
    sync::mpsc,
    time::{Instant, sleep, sleep_until, timeout},
};
use tokio_stream::wrappers::ReceiverStream;
use tonic::Streaming;

use crate::{
    backoff::{Backoff, BackoffParams},
    client::Client,
    error::Error,
    source::{BatchSource, Outgoing},
};
use window::Window;

/// Messages between the source and the transport. The transport's own buffers do the rest.
const QUEUE: usize = 4;

/// Tunables of [`deliver`].
#[derive(Clone, Copy, Debug)]
pub struct DeliveryParams {
    /// How to wait between attempts.
    pub backoff: BackoffParams,
    /// A stream that is not answered within this time has failed.
    pub attach_timeout: Duration,
    /// With batches under way, a stream without any answer for so long has failed. Above the
    /// service's longest wait for its disk, or a slow service would never be let finish.
    pub ack_timeout: Duration,
    /// Give up when nothing was acknowledged for so long; `None` never gives up.
    pub give_up_after: Option<Duration>,
}

impl DeliveryParams {
    /// For robots, which have nothing better to do with their batches than to keep trying.
    pub const ROBOT: Self = Self {
        backoff: BackoffParams::ROBOT,
        attach_timeout: Duration::from_secs(15),
        ack_timeout: Duration::from_mins(1),
        give_up_after: None,
    };
}

/// Names the session to deliver to.
#[derive(Clone, Debug, PartialEq)]
pub struct SessionName {
    /// The service's id of the session.
    pub id: String,
    /// The epoch that it was opened with.
    pub epoch: u64,
    /// Batches up to this number are known to be durable.
    pub acked_through: u64,
}

impl From<&Session> for SessionName {
    fn from(session: &Session) -> Self {
        let Session { id, epoch, acked_through, .. } = session;
        Self { id: id.clone(), epoch: *epoch, acked_through: *acked_through }
    }
}

/// What happens during a delivery.
#[derive(Debug)]
pub enum DeliveryEvent {
    /// A stream stands, and the service expects this number.
    Attached {
        /// The number that the service wants next.
        expected: u64,
    },
    /// All up to this number was handed to the stream.
    Sent {
        /// The number.
        through: u64,
    },
    /// The service keeps all up to this number for ever.
    Acked {
        /// The number.
        through: u64,
    },
    /// The service kept an observation and will not use it. After a lost connection the same
    /// rejection may come twice.
    Rejected(Rejection),
    /// Where the robot was, as the map says.
    Corrected(PoseCorrection),
    /// The connection failed; the next attempt begins after this time.
    Reconnecting {
        /// Until the next attempt.
        delay: Duration,
        /// What happened.
        error: Error,
    },
}

/// How a delivery ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Delivered {
    /// The last number; all up to it is durable.
    pub acked_through: u64,
    /// How often the connection was made anew.
    pub n_reconnects: u64,
}

/// Sends what `source` gives until it ends and all is acknowledged.
///
/// Keeps as many batches under way as the service allows, begins again at the number that the
/// service expects whenever the stream breaks or a gap is reported, and waits with exponential
/// backoff while the service is away. Dropping the future stops the delivery cleanly.
///
/// # Errors
///
/// What trying again cannot heal: refusals such as `SESSION_FENCED` or `BATCH_CONTENT_MISMATCH`, a
/// service that lost data, a source that fails. Also the last error, if
/// [`DeliveryParams::give_up_after`] has passed.
pub async fn deliver<S: BatchSource>(
    client: &Client,
    session: &SessionName,
    source: &mut S,
    params: &DeliveryParams,
    events: impl FnMut(DeliveryEvent) + Send,
) -> Result<Delivered, Error> {
    let window = Window::new(session.acked_through);
    source.forget_through(session.acked_through).await.map_err(Error::Source)?;
    let mut run = Run { client, session, source, params, window, events };
    let mut backoff = Backoff::new(params.backoff);
    let mut n_reconnects = 0;
    let mut last_progress = Instant::now();
    loop {
        let acked_before = run.window.acked_through();
        let error = match run.stream().await {
            Ok(()) => {
                let acked_through = run.window.acked_through();
                return Ok(Delivered { acked_through, n_reconnects });
            }
            Err(error) => error,
        };
        if acked_before < run.window.acked_through() {
            backoff.reset();
            last_progress = Instant::now();
        }
        let tired = params.give_up_after.is_some_and(|limit| limit < last_progress.elapsed());
        if tired || !(error.is_retryable() || error.is_gap()) {
            return Err(error);
        }
        let delay = backoff.next_delay(error.retry_after());
        (run.events)(DeliveryEvent::Reconnecting { delay, error });
        n_reconnects += 1;
        sleep(delay).await;
    }
}

/// One delivery under way.
struct Run<'a, S, F> {
    client: &'a Client,
    session: &'a SessionName,
    source: &'a mut S,
    params: &'a DeliveryParams,
    window: Window,
    events: F,
}

impl<S: BatchSource, F: FnMut(DeliveryEvent) + Send> Run<'_, S, F> {
    /// One stream from attach to its end: `Ok` if all is delivered.
    async fn stream(&mut self) -> Result<(), Error> {
        let (requests, receiver) = mpsc::channel(QUEUE);
        let limit = self.params.attach_timeout;
        let mut responses = timeout(limit, self.attach(&requests, receiver))
            .await
            .map_err(|_| silence("an answer to attach", limit))??;
        let mut deadline = self.ack_deadline();
        while !self.window.is_done() {
            tokio::select! {
                biased;
                response = responses.message() => {
                    self.receive(response?.ok_or_else(stream_ended)?).await?;
                    deadline = self.ack_deadline();
                }
                outgoing = next(self.source, &self.window, &requests) => {
                    if self.window.n_in_flight() == 0 {
                        deadline = self.ack_deadline();
                    }
                    self.take_out(outgoing?);
                }
                () = sleep_until(deadline), if 0 < self.window.n_in_flight() => {
                    return Err(silence("an acknowledgement", self.params.ack_timeout));
                }
            }
        }
        Ok(())
    }

    async fn attach(
        &mut self,
        requests: &mpsc::Sender<IngestRequest>,
        receiver: mpsc::Receiver<IngestRequest>,
    ) -> Result<Streaming<IngestResponse>, Error> {
        let SessionName { id, epoch, .. } = self.session;
        let attach = Attach { session: id.clone(), epoch: *epoch };
        let attach = request(ingest_request::Kind::Attach(attach));
        requests.try_send(attach).map_err(|_| stream_ended())?;
        let mut responses = self.client.ingest(ReceiverStream::new(receiver)).await?;
        let first = responses.message().await?.ok_or_else(stream_ended)?;
        let Some(ingest_response::Kind::Attached(attached)) = first.kind else {
            return Err(Error::Malformed("attached"));
        };
        let Attached { expected_number, limits } = attached;
        let limits = limits.ok_or(Error::Malformed("attached.limits"))?;
        self.window.attach(expected_number, limits.n_in_flight_max)?;
        (self.events)(DeliveryEvent::Attached { expected: expected_number });
        Ok(responses)
    }

    /// Takes in a message of the service.
    async fn receive(&mut self, response: IngestResponse) -> Result<(), Error> {
        match response.kind {
            Some(ingest_response::Kind::Ack(Ack { acked_through, rejected })) => {
                for rejection in rejected {
                    (self.events)(DeliveryEvent::Rejected(rejection));
                }
                if self.window.ack(acked_through) {
                    self.source.forget_through(acked_through).await.map_err(Error::Source)?;
                    (self.events)(DeliveryEvent::Acked { through: acked_through });
                }
            }
            Some(ingest_response::Kind::Correction(correction)) => {
                (self.events)(DeliveryEvent::Corrected(correction));
            }
            Some(ingest_response::Kind::FlowControl(flow)) => {
                self.window.allow(flow.n_in_flight_max);
            }
            // A newer service may say more than we know.
            Some(ingest_response::Kind::Attached(_)) | None => {}
        }
        Ok(())
    }

    /// Books what was handed to the stream.
    fn take_out(&mut self, handed: Handed) {
        match handed {
            Handed::Through(through) => {
                self.window.sent_through(through);
                (self.events)(DeliveryEvent::Sent { through });
            }
            Handed::End => self.window.ended(),
        }
    }

    fn ack_deadline(&self) -> Instant {
        Instant::now() + self.params.ack_timeout
    }
}

/// What [`next`] did.
#[derive(Clone, Copy)]
enum Handed {
    /// All up to this number is with the stream.
    Through(u64),
    /// There is nothing more.
    End,
}

/// Waits until something may be sent and is there, and hands it to the stream. Nothing is lost if
/// the future is dropped half way: the place in the queue is taken first.
async fn next<S: BatchSource>(
    source: &mut S,
    window: &Window,
    requests: &mpsc::Sender<IngestRequest>,
) -> Result<Handed, Error> {
    let Some(number) = window.to_send() else {
        return std::future::pending().await;
    };
    let Ok(place) = requests.reserve().await else {
        // The transport is gone; the other half of the stream tells why.
        return std::future::pending().await;
    };
    match source.get(number).await.map_err(Error::Source)? {
        Outgoing::Batch(batch) if batch.number == number => {
            place.send(request(ingest_request::Kind::Batch(batch)));
            Ok(Handed::Through(number))
        }
        Outgoing::Batch(batch) => Err(Error::Source(io::Error::other(format!(
            "batch {} given for number {number}",
            batch.number
        )))),
        Outgoing::Skip { through, reason } => {
            if let Some(from) = window.skip_from(through) {
                place.send(request(ingest_request::Kind::Skip(Skip { from, through, reason })));
            }
            Ok(Handed::Through(through.max(number)))
        }
        Outgoing::End => Ok(Handed::End),
    }
}

fn request(kind: ingest_request::Kind) -> IngestRequest {
    IngestRequest { kind: Some(kind) }
}

fn stream_ended() -> Error {
    Error::Unreachable("the service ended the stream".to_owned())
}

fn silence(what: &str, limit: Duration) -> Error {
    Error::Unreachable(format!("{what} did not come within {} s", limit.as_secs()))
}
