//! The ingest stream, message by message.

use std::io::Write;

use meetpoint_client::v1;
use prost::Message;
use tokio::sync::{mpsc, watch};
use tokio_stream::wrappers::ReceiverStream;
use tonic::Streaming;
use v1::ingest_request::Kind as Up;
use v1::ingest_response::Kind as Down;

use crate::door::{Door, Refused, eventually};
use crate::drive::{SimulatedDrive, mark, opened, opening, send};
use crate::grpc_door::GrpcDoor;
use crate::running::{Launch, Running, empty_folder};

/// One stream from the client's side.
struct Stream {
    up: mpsc::Sender<v1::IngestRequest>,
    down: Streaming<v1::IngestResponse>,
}

impl Stream {
    async fn begun(door: &GrpcDoor) -> Self {
        // A client that may hurry: what it sends is bounded by the service alone.
        let (up, requests) = mpsc::channel(1024);
        // The service answers at once; the first message is sent afterwards.
        let requests = ReceiverStream::new(requests);
        let down = door.sessions.clone().ingest(requests).await.expect("a stream").into_inner();
        Self { up, down }
    }

    async fn send(&self, kind: Up) {
        let request = v1::IngestRequest { kind: Some(kind) };
        // A stream that the service has ended takes nothing: its error is what is looked at.
        let _ = self.up.send(request).await;
    }

    async fn attach(&self, session: &v1::Session) {
        let attach = v1::Attach { session: session.id.clone(), epoch: session.epoch };
        self.send(Up::Attach(attach)).await;
    }

    /// The next answer but corrections and flow control, which come when they come.
    async fn answer(&mut self) -> Result<Option<Down>, Refused> {
        loop {
            match self.down.message().await? {
                Some(v1::IngestResponse {
                    kind: Some(Down::Correction(_) | Down::FlowControl(_)),
                }) => {}
                other => return Ok(other.and_then(|response| response.kind)),
            }
        }
    }

    async fn attached(&mut self) -> u64 {
        match self.answer().await {
            Ok(Some(Down::Attached(attached))) => attached.expected_number,
            other => panic!("not attached: {other:?}"),
        }
    }

    async fn acked(&mut self) -> u64 {
        match self.answer().await {
            Ok(Some(Down::Ack(ack))) => ack.acked_through,
            other => panic!("no ack: {other:?}"),
        }
    }

    #[track_caller]
    fn refusal(answer: Result<Option<Down>, Refused>, code: &str) -> Refused {
        crate::door::refused(answer, code)
    }
}

async fn started(data: &std::path::Path) -> (Running, GrpcDoor, v1::Session) {
    let service = Launch::at(data).start();
    let door = service.grpc();
    door.create_map("site", 0.05).await.expect("a new map");
    let session = opened(&door, opening("site", "rover", &[])).await;
    (service, door, session)
}

#[tokio::test(flavor = "multi_thread")]
async fn keeps_the_contract() {
    let data = empty_folder();
    let (_service, door, session) = started(data.path()).await;
    let mut stream = Stream::begun(&door).await;
    stream.attach(&session).await;
    assert_eq!(stream.attached().await, 1, "the first is expected");
    for number in 1..=3 {
        stream.send(Up::Batch(mark(number, "a"))).await;
    }
    while stream.acked().await < 3 {}
    stream.send(Up::Batch(mark(2, "a"))).await;
    assert_eq!(stream.acked().await, 3, "a duplicate is acknowledged");
    let skip = v1::Skip { from: 4, through: 5, reason: String::new() };
    stream.send(Up::Skip(skip)).await;
    assert_eq!(stream.acked().await, 5, "a hole is acknowledged");
    stream.send(Up::Batch(mark(9, "a"))).await;
    let gap = Stream::refusal(stream.answer().await, "SEQUENCE_GAP");
    assert_eq!(gap.fact("expected_number"), "6", "{gap:?}");

    let mut stream = Stream::begun(&door).await;
    stream.attach(&session).await;
    assert_eq!(stream.attached().await, 6, "goes on where the other ended");
    stream.send(Up::Batch(mark(3, "b"))).await;
    Stream::refusal(stream.answer().await, "BATCH_CONTENT_MISMATCH");
}

#[tokio::test(flavor = "multi_thread")]
async fn begins_with_attach() {
    let data = empty_folder();
    let (_service, door, session) = started(data.path()).await;
    let mut stream = Stream::begun(&door).await;
    stream.send(Up::Batch(mark(1, "a"))).await;
    Stream::refusal(stream.answer().await, "NOT_ATTACHED");

    let mut stream = Stream::begun(&door).await;
    stream.attach(&session).await;
    stream.attached().await;
    stream.attach(&session).await;
    Stream::refusal(stream.answer().await, "NOT_ATTACHED");

    let mut stream = Stream::begun(&door).await;
    stream.attach(&v1::Session { epoch: 7, ..session.clone() }).await;
    Stream::refusal(stream.answer().await, "SESSION_FENCED");

    let nobody = "0199d3a6-6ac5-7c4e-9d51-2d9a3f1f3c11".to_owned();
    let mut stream = Stream::begun(&door).await;
    stream.attach(&v1::Session { id: nobody, ..session.clone() }).await;
    Stream::refusal(stream.answer().await, "SESSION_NOT_FOUND");

    let mut stream = Stream::begun(&door).await;
    stream.attach(&session).await;
    stream.attached().await;
    let nothing = v1::IngestRequest { kind: None };
    stream.up.send(nothing).await.expect("the stream stands");
    Stream::refusal(stream.answer().await, "INVALID_FIELD");
}

#[tokio::test(flavor = "multi_thread")]
async fn is_fenced_while_it_stands() {
    let data = empty_folder();
    let (_service, door, session) = started(data.path()).await;
    let mut stream = Stream::begun(&door).await;
    stream.attach(&session).await;
    stream.attached().await;
    let newer = v1::OpenSessionRequest {
        client_key: "after a cold start".into(),
        epoch: 2,
        ..opening("site", "rover", &[])
    };
    opened(&door, newer).await;
    stream.send(Up::Batch(mark(1, "a"))).await;
    Stream::refusal(stream.answer().await, "SESSION_FENCED");
}

#[tokio::test(flavor = "multi_thread")]
async fn is_closed_while_it_stands() {
    let data = empty_folder();
    let (_service, door, session) = started(data.path()).await;
    let mut stream = Stream::begun(&door).await;
    stream.attach(&session).await;
    stream.attached().await;
    door.close(&session.id, session.epoch).await.expect("it can be closed");
    stream.send(Up::Batch(mark(1, "a"))).await;
    Stream::refusal(stream.answer().await, "SESSION_CLOSED");
}

#[tokio::test(flavor = "multi_thread")]
async fn tells_where_the_robot_was() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    let door = service.grpc();
    let drive = SimulatedDrive::through_the_hall(4);
    door.create_map("hall", 0.05).await.expect("a new map");
    let request = opening("hall", "rover", std::slice::from_ref(&drive.sensor));
    let session = opened(&door, request).await;
    let mut stream = Stream::begun(&door).await;
    stream.attach(&session).await;
    stream.attached().await;
    stream.send(Up::Batch(drive.batches(20).remove(0))).await;
    let correction = loop {
        let response = stream.down.message().await.expect("it stands").expect("it stands");
        if let Some(Down::Correction(correction)) = response.kind {
            break correction;
        }
    };
    assert_eq!(correction.batch_number, 1, "{correction:?}");
    assert!(correction.map_from_robot.is_some(), "where it was: {correction:?}");
    assert!(correction.map_from_odometry.is_some(), "how to go on: {correction:?}");
    assert!(!correction.lost, "{correction:?}");
}

/// A message of 100 MB is refused by its size alone, in a stream and by itself.
#[tokio::test(flavor = "multi_thread")]
async fn a_huge_message_is_refused() {
    let data = empty_folder();
    let (service, door, session) = started(data.path()).await;
    let huge = v1::Batch { number: 1, observations: mark(1, &"x".repeat(100 << 20)).observations };
    let mut stream = Stream::begun(&door).await;
    stream.attach(&session).await;
    stream.attached().await;
    stream.send(Up::Batch(huge.clone())).await;
    let refused = Stream::refusal(stream.answer().await, "MESSAGE_TOO_LARGE");
    assert_eq!(refused.fact("limit_bytes"), "4194304", "{refused:?}");
    let upload = v1::ingest_batch_request::Kind::Batch(huge);
    let refused = door.upload(&session.id, session.epoch, upload).await;
    Stream::refusal(refused.map(|_| None), "MESSAGE_TOO_LARGE");
    send(&door, &session, &[mark(1, "small")]).await;
    let resident = service.resident_bytes();
    assert!(resident.is_none_or(|bytes| bytes < 300 << 20), "{resident:?} bytes");
}

/// Enums and fields of a newer protocol: the first is named, the second ignored.
#[tokio::test(flavor = "multi_thread")]
async fn what_a_newer_client_says() {
    let data = empty_folder();
    let (_service, door, _) = started(data.path()).await;
    let odd = v1::OpenSessionRequest { delivery: 77, ..opening("site", "newer", &[]) };
    let refused = crate::door::refused(door.open(odd).await, "INVALID_FIELD");
    assert_eq!(refused.fact("field"), "delivery", "{refused:?}");
    let kind = v1::CreateJobRequest { map: "site".into(), kind: 77, ..Default::default() };
    let refused = door.jobs.clone().create_job(kind).await.map_err(Refused::from);
    assert_eq!(crate::door::refused(refused, "INVALID_FIELD").fact("field"), "kind", "named");
    // An observation of a kind that this service does not know is an empty one to it.
    let session = opened(&door, opening("site", "newest", &[])).await;
    let mut bytes = v1::Observation { stamp_ns: 5, ..Default::default() }.encode_to_vec();
    // Field 999, of length 3.
    bytes.write_all(&[0xba, 0x3e, 3, 1, 2, 3]).expect("it grows");
    let unknown = v1::Observation::decode(bytes.as_slice()).expect("unknown fields are no error");
    let batch = v1::Batch { number: 1, observations: vec![unknown] };
    let upload = v1::ingest_batch_request::Kind::Batch(batch);
    let ack = door.upload(&session.id, session.epoch, upload).await.expect("it is taken");
    assert_eq!(ack.rejected[0].code, "EMPTY_OBSERVATION", "{ack:?}");
}

/// A robot that sends and does not read is slowed down; others are not, memory stays bounded, and
/// nothing is dropped: when it reads, it goes on.
#[tokio::test(flavor = "multi_thread")]
async fn a_robot_that_does_not_read_is_slowed_down() {
    /// Far more than the service may have under way for one robot.
    const N_BATCHES: u64 = 200;
    /// Observations a batch, all rejected: some 300 kB up, and as many of rejections down.
    const N_OBSERVATIONS: usize = 4000;
    /// Characters of the sensor's name in each, which no buffer on the way holds many of.
    const N_NAME_CHARS: usize = 70;
    /// Looks in a row at a sender that stands still.
    const N_LOOKS: u32 = 60;
    let data = empty_folder();
    let (service, door, session) = started(data.path()).await;
    let mut stream = Stream::begun(&door).await;
    stream.attach(&session).await;
    stream.attached().await;
    let (up, (sent, watched)) = (stream.up.clone(), watch::channel(0));
    let sending = tokio::spawn(async move {
        for number in 1..=N_BATCHES {
            let sensor_id = "x".repeat(N_NAME_CHARS);
            let empty = v1::Observation { sensor_id, ..Default::default() };
            let observations = vec![empty; N_OBSERVATIONS];
            let kind = Some(Up::Batch(v1::Batch { number, observations }));
            // Behind this stands the channel of 1024: room in it is no word of the service.
            while up.max_capacity() != up.capacity() {
                tokio::task::yield_now().await;
            }
            up.send(v1::IngestRequest { kind }).await.expect("it stands");
            sent.send_replace(number);
        }
    });
    let (mut before, mut n_looks) = (0, 0);
    eventually("a sender that stands still", || {
        let now = *watched.borrow();
        n_looks = if 0 < now && now == before { n_looks + 1 } else { 0 };
        before = now;
        let is_still = N_LOOKS <= n_looks;
        async move { is_still.then_some(()) }
    })
    .await;
    let still_at = *watched.borrow();
    assert!(still_at < N_BATCHES, "it was slowed down");
    let other = opened(&door, opening("site", "other", &[])).await;
    let batches: Vec<v1::Batch> = (1..=100).map(|number| mark(number, "b")).collect();
    send(&door, &other, &batches).await;
    let resident = service.resident_bytes();
    assert!(resident.is_none_or(|bytes| bytes < 400 << 20), "{resident:?} bytes");
    while stream.acked().await < N_BATCHES {}
    sending.await.expect("all is sent");
    let now = door.session(&session.id).await.expect("it was opened");
    assert_eq!(now.rejected, N_BATCHES * N_OBSERVATIONS as u64, "nothing was dropped");
}
