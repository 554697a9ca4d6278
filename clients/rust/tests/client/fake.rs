//! A session service by its contract, with faults drawn from a seed.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, MutexGuard},
    time::Duration,
};

use meetpoint_client::v1::session_service_server::{SessionService, SessionServiceServer};
use meetpoint_client::v1::{
    Ack, Attached, Batch, CloseSessionRequest, CloseSessionResponse, GetSessionRequest,
    GetSessionResponse, GetTrajectoryRequest, GetTrajectoryResponse, IngestBatchRequest,
    IngestBatchResponse, IngestLimits, IngestRequest, IngestResponse, ListSessionsRequest,
    ListSessionsResponse, OpenSessionRequest, OpenSessionResponse, Session, SessionState,
    ingest_request, ingest_response,
};
use rand::{Rng, RngExt, SeedableRng, rngs::StdRng};
use tokio::{net::TcpListener, sync::mpsc};
use tokio_stream::wrappers::{ReceiverStream, TcpListenerStream};
use tonic::{Code, Request, Response, Status, Streaming};
use tonic_types::{ErrorDetails, StatusExt};

/// Batches that a client may have under way.
pub(crate) const N_IN_FLIGHT_MAX: u64 = 8;
/// Batches of a session on a bad day; the last one is always acknowledged.
pub(crate) const N_BATCHES_UNRELIABLE: u64 = 150;
/// Acks that wait in the stream.
const QUEUE: usize = 64;

/// How likely each fault is, at every message.
#[derive(Clone, Copy)]
pub(crate) struct Faults {
    /// The stream breaks; half of the time with what was not acknowledged lost.
    pub(crate) breaks: f64,
    /// The number is refused as a gap.
    pub(crate) gap: f64,
    /// No ack now; a later one covers it.
    pub(crate) late_ack: f64,
    /// The same ack twice.
    pub(crate) double_ack: f64,
}

impl Faults {
    /// A service on its best day.
    pub(crate) const NONE: Self = Self { breaks: 0.0, gap: 0.0, late_ack: 0.0, double_ack: 0.0 };
    /// A bad day.
    pub(crate) const ALL: Self = Self { breaks: 0.04, gap: 0.02, late_ack: 0.4, double_ack: 0.1 };
}

/// What the service remembers of a session.
struct Journal {
    /// All batches taken in, by number; holes are absent.
    taken: Vec<Batch>,
    /// The number to send next.
    expected: u64,
    /// Durable up to here.
    acked_through: u64,
    n_in_flight_seen: u64,
    closed: bool,
}

impl Default for Journal {
    fn default() -> Self {
        let taken = Vec::new();
        Self { taken, expected: 1, acked_through: 0, n_in_flight_seen: 0, closed: false }
    }
}

/// Journals by session, in the order in which the sessions were first named.
#[derive(Default)]
struct Journals(Vec<(String, Journal)>);

impl Journals {
    fn of(&mut self, session: &str) -> &mut Journal {
        let known = self.0.iter().position(|(name, _)| name == session);
        let index = known.unwrap_or_else(|| {
            self.0.push((session.to_owned(), Journal::default()));
            self.0.len() - 1
        });
        &mut self.0[index].1
    }
}

/// The service, and the eyes of the test on it.
#[derive(Clone)]
pub(crate) struct Fake {
    journals: Arc<Mutex<Journals>>,
    rng: Arc<Mutex<StdRng>>,
    faults: Faults,
}

impl Fake {
    /// Starts it on a free port of loopback.
    pub(crate) async fn start(faults: Faults, seed: u64) -> (Self, String) {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
        let address = listener.local_addr().expect("it is bound");
        let fake = Self {
            journals: Arc::default(),
            rng: Arc::new(Mutex::new(StdRng::seed_from_u64(seed))),
            faults,
        };
        let service = SessionServiceServer::new(fake.clone());
        let server = tonic::transport::Server::builder().add_service(service);
        tokio::spawn(server.serve_with_incoming(TcpListenerStream::new(listener)));
        (fake, format!("http://{address}"))
    }

    /// The batches of a session that are durable, in the order in which they were taken in.
    pub(crate) fn durable(&self, session: &str) -> Vec<Batch> {
        let mut journals = self.journals();
        let journal = journals.of(session);
        let durable = |batch: &&Batch| batch.number <= journal.acked_through;
        journal.taken.iter().filter(durable).cloned().collect()
    }

    /// The sessions in order, and whether each was closed.
    pub(crate) fn sessions(&self) -> Vec<(String, bool)> {
        self.journals().0.iter().map(|(name, journal)| (name.clone(), journal.closed)).collect()
    }

    /// The most batches that were ever under way.
    pub(crate) fn n_in_flight_seen(&self, session: &str) -> u64 {
        self.journals().of(session).n_in_flight_seen
    }

    fn journals(&self) -> MutexGuard<'_, Journals> {
        self.journals.lock().expect("no test panicked")
    }

    fn happens(&self, probability: f64) -> bool {
        self.rng.lock().expect("no test panicked").random_bool(probability)
    }

    /// Takes in one message; what to answer, or how the stream ends.
    fn take(&self, session: &str, kind: ingest_request::Kind) -> Result<Vec<u64>, Status> {
        let mut journals = self.journals();
        let journal = journals.of(session);
        if self.happens(self.faults.breaks) {
            if self.happens(0.5) {
                let kept = journal.acked_through;
                journal.taken.retain(|batch| batch.number <= kept);
                journal.expected = kept + 1;
            }
            return Err(self.broken());
        }
        let (number, through) = match &kind {
            ingest_request::Kind::Batch(batch) => (batch.number, batch.number),
            ingest_request::Kind::Skip(skip) => (skip.from, skip.through),
            ingest_request::Kind::Attach(_) => return Err(Status::invalid_argument("attached")),
        };
        if journal.expected < number || self.happens(self.faults.gap) {
            return Err(gap(journal.expected));
        }
        if number == journal.expected {
            if let ingest_request::Kind::Batch(batch) = kind {
                journal.taken.push(batch);
            }
            journal.expected = through + 1;
        } else if matches!(kind, ingest_request::Kind::Skip(_)) {
            return Err(gap(journal.expected));
        }
        if through == number {
            let in_flight = number.saturating_sub(journal.acked_through);
            journal.n_in_flight_seen = journal.n_in_flight_seen.max(in_flight);
        }
        // An ack that is late comes when the window is full, at the latest.
        let full =
            journal.acked_through + N_IN_FLIGHT_MAX <= through || through == N_BATCHES_UNRELIABLE;
        if self.happens(self.faults.late_ack) && !full {
            return Ok(Vec::new());
        }
        journal.acked_through = journal.expected - 1;
        let n_acks = 1 + usize::from(self.happens(self.faults.double_ack));
        Ok(vec![journal.acked_through; n_acks])
    }

    /// One of the ways in which a stream breaks.
    fn broken(&self) -> Status {
        let way = self.rng.lock().expect("no test panicked").next_u32() % 5;
        match way {
            0 => Status::unavailable("restarting"),
            1 => Status::deadline_exceeded("slow"),
            2 => Status::aborted("try again"),
            3 => Status::cancelled("proxy"),
            _ => {
                let mut details = ErrorDetails::with_retry_info(Some(Duration::from_millis(2)));
                details.set_error_info("BUSY", "test", HashMap::new());
                Status::with_error_details(Code::ResourceExhausted, "busy", details)
            }
        }
    }

    async fn serve(
        self,
        session: String,
        mut requests: Streaming<IngestRequest>,
        responses: mpsc::Sender<Result<IngestResponse, Status>>,
    ) {
        while let Ok(Some(request)) = requests.message().await {
            let kind = request.kind.expect("the client sends no empty message");
            match self.take(&session, kind) {
                Ok(acks) => {
                    for acked_through in acks {
                        let ack = Ack { acked_through, rejected: Vec::new() };
                        let ack = answer(ingest_response::Kind::Ack(ack));
                        if responses.send(Ok(ack)).await.is_err() {
                            return;
                        }
                    }
                }
                Err(status) => {
                    // The client may be gone already.
                    let _ = responses.send(Err(status)).await;
                    return;
                }
            }
        }
    }
}

fn answer(kind: ingest_response::Kind) -> IngestResponse {
    IngestResponse { kind: Some(kind) }
}

fn gap(expected: u64) -> Status {
    let facts = HashMap::from([("expected_number".to_owned(), expected.to_string())]);
    let details = ErrorDetails::with_error_info("SEQUENCE_GAP", "test", facts);
    Status::with_error_details(Code::OutOfRange, "gap", details)
}

fn fenced() -> Status {
    let details = ErrorDetails::with_error_info("SESSION_FENCED", "test", HashMap::new());
    Status::with_error_details(Code::FailedPrecondition, "fenced", details)
}

#[tonic::async_trait]
impl SessionService for Fake {
    type IngestStream = ReceiverStream<Result<IngestResponse, Status>>;

    async fn ingest(
        &self,
        request: Request<Streaming<IngestRequest>>,
    ) -> Result<Response<Self::IngestStream>, Status> {
        let mut requests = request.into_inner();
        let first = requests.message().await?.and_then(|request| request.kind);
        let Some(ingest_request::Kind::Attach(attach)) = first else {
            return Err(Status::invalid_argument("not attached"));
        };
        if attach.epoch == 0 {
            return Err(fenced());
        }
        let expected_number = self.journals().of(&attach.session).expected;
        let limits = IngestLimits {
            n_in_flight_max: u32::try_from(N_IN_FLIGHT_MAX).expect("it is small"),
            batch_bytes_max: 1 << 20,
            observations_max: 4096,
        };
        let attached = Attached { expected_number, limits: Some(limits) };
        let (sender, receiver) = mpsc::channel(QUEUE);
        let first = sender.send(Ok(answer(ingest_response::Kind::Attached(attached)))).await;
        first.expect("the receiver is ours");
        tokio::spawn(self.clone().serve(attach.session, requests, sender));
        Ok(Response::new(ReceiverStream::new(receiver)))
    }

    async fn open_session(
        &self,
        request: Request<OpenSessionRequest>,
    ) -> Result<Response<OpenSessionResponse>, Status> {
        let request = request.into_inner();
        let resumed = self.sessions().iter().any(|(name, _)| *name == request.client_key);
        let session = Session {
            acked_through: self.journals().of(&request.client_key).acked_through,
            id: request.client_key.clone(),
            map: request.map,
            robot: request.robot,
            epoch: request.epoch,
            client_key: request.client_key,
            state: SessionState::Open.into(),
            ..Session::default()
        };
        Ok(Response::new(OpenSessionResponse { session: Some(session), resumed, limits: None }))
    }

    async fn get_session(
        &self,
        _: Request<GetSessionRequest>,
    ) -> Result<Response<GetSessionResponse>, Status> {
        Err(Status::unimplemented("not asked for here"))
    }

    async fn list_sessions(
        &self,
        _: Request<ListSessionsRequest>,
    ) -> Result<Response<ListSessionsResponse>, Status> {
        Err(Status::unimplemented("not asked for here"))
    }

    async fn close_session(
        &self,
        request: Request<CloseSessionRequest>,
    ) -> Result<Response<CloseSessionResponse>, Status> {
        let CloseSessionRequest { session, epoch } = request.into_inner();
        self.journals().of(&session).closed = true;
        let state = SessionState::Closed.into();
        let session = Some(Session { id: session, epoch, state, ..Session::default() });
        Ok(Response::new(CloseSessionResponse { session }))
    }

    async fn ingest_batch(
        &self,
        _: Request<IngestBatchRequest>,
    ) -> Result<Response<IngestBatchResponse>, Status> {
        Err(Status::unimplemented("not asked for here"))
    }

    async fn get_trajectory(
        &self,
        _: Request<GetTrajectoryRequest>,
    ) -> Result<Response<GetTrajectoryResponse>, Status> {
        Err(Status::unimplemented("not asked for here"))
    }
}
