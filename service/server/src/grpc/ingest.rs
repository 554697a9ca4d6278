//! `SessionService.Ingest`: batches up; acks and corrections down.
//!
//! One task reads, checks and queues; another waits for each commit in order and answers. Between
//! them stands a bounded queue, and before the journal another: when they are full nothing is read
//! from the stream, which the sender feels as flow control. Nothing is dropped.

use std::sync::Arc;

use meetpoint_proto::v1;
use tokio::sync::mpsc;
use tonic::{Status, Streaming};
use v1::ingest_request::Kind as Up;
use v1::ingest_response::Kind as Down;

use super::too_large;
use crate::convert::session;
use crate::error::Error;
use crate::ingest::KnownSession;
use crate::operations::upload::{Queued, Upload};
use crate::service::Service;

type Replies = mpsc::Sender<Result<v1::IngestResponse, Status>>;

/// Batches that a robot may have under way while the journal's queue is crowded.
const N_IN_FLIGHT_CROWDED: u32 = 4;
/// Replies on their way to one robot.
const N_REPLIES_BUFFERED: usize = 16;

/// An upload, in the order of the stream; or what ends the stream.
enum Step {
    Queued(Queued),
    Failed(Status),
}

/// Serves a stream in the background.
pub(super) fn stream(
    service: Service,
    requests: Streaming<v1::IngestRequest>,
) -> mpsc::Receiver<Result<v1::IngestResponse, Status>> {
    let (replies, receiver) = mpsc::channel(N_REPLIES_BUFFERED);
    tokio::spawn(serve(service, requests, replies));
    receiver
}

async fn serve(service: Service, mut requests: Streaming<v1::IngestRequest>, replies: Replies) {
    let (known, epoch) = match attach(&service, &mut requests, &replies).await {
        Ok(attached) => attached,
        Err(status) => {
            let _ = replies.send(Err(status)).await;
            return;
        }
    };
    let n_in_flight_max = service.settings.limits.n_in_flight_max as usize;
    let (steps, queued) = mpsc::channel(n_in_flight_max);
    let answering = tokio::spawn(answer(service.clone(), known.clone(), queued, replies));
    let reading = read(&service, &known, epoch, &mut requests, &steps);
    tokio::select! {
        () = reading => {}
        () = service.stop.cancelled() => {
            let _ = steps.send(Step::Failed(Error::Stopping.into())).await;
        }
    }
    drop(steps);
    if let Err(error) = answering.await {
        Error::internal(error).log();
    }
}

async fn attach(
    service: &Service,
    requests: &mut Streaming<v1::IngestRequest>,
    replies: &Replies,
) -> Result<(Arc<KnownSession>, u64), Status> {
    let first = message(service, requests).await?;
    let Some(v1::IngestRequest { kind: Some(Up::Attach(attach)) }) = first else {
        return Err(Error::NotAttached.into());
    };
    let v1::Attach { session, epoch } = attach;
    let id = session::id("attach.session", &session)?;
    let limits = &service.settings.limits;
    let known = service.known_sessions.get(&service.store, id, limits).await?;
    let record = service.session_record(&session).await?;
    if record.epoch != epoch {
        return Err(Error::SessionFenced { newest: None }.into());
    }
    let attached = v1::Attached {
        expected_number: record.acked_through + 1,
        limits: Some(session::limits(limits)),
    };
    let reply = v1::IngestResponse { kind: Some(Down::Attached(attached)) };
    // A robot that has left is noticed at the next read.
    let _ = replies.send(Ok(reply)).await;
    Ok((known, epoch))
}

async fn message(
    service: &Service,
    requests: &mut Streaming<v1::IngestRequest>,
) -> Result<Option<v1::IngestRequest>, Status> {
    let limit_bytes = service.settings.limits.request_bytes_max;
    let mend = |status: Status| too_large::mended(&status, limit_bytes).unwrap_or(status);
    requests.message().await.map_err(mend)
}

/// Reads until the stream ends or an upload is refused.
async fn read(
    service: &Service,
    known: &KnownSession,
    epoch: u64,
    requests: &mut Streaming<v1::IngestRequest>,
    steps: &mpsc::Sender<Step>,
) {
    loop {
        let step = match message(service, requests).await {
            Ok(None) => return,
            Ok(Some(v1::IngestRequest { kind })) => queue(service, known, epoch, kind).await,
            Err(status) => Step::Failed(status),
        };
        let failed = matches!(step, Step::Failed(_));
        if steps.send(step).await.is_err() || failed {
            return;
        }
    }
}

async fn queue(service: &Service, known: &KnownSession, epoch: u64, kind: Option<Up>) -> Step {
    let upload = match kind {
        Some(Up::Batch(batch)) => Upload::Batch(batch),
        Some(Up::Skip(skip)) => Upload::Skip(skip),
        Some(Up::Attach(_)) => return Step::Failed(Error::NotAttached.into()),
        None => return Step::Failed(Error::field("kind", "missing or unknown here").into()),
    };
    match service.queue_upload(known, epoch, upload).await {
        Ok(queued) => Step::Queued(queued),
        Err(error) => Step::Failed(error.into()),
    }
}

/// Answers in the order of the stream, with corrections in between.
async fn answer(
    service: Service,
    known: Arc<KnownSession>,
    mut queued: mpsc::Receiver<Step>,
    replies: Replies,
) {
    let mut progress = service.live.follow(known.id);
    let mut window = service.settings.limits.n_in_flight_max;
    loop {
        let reply = tokio::select! {
            biased;
            step = queued.recv() => match step {
                None => return,
                Some(Step::Failed(status)) => Err(status),
                Some(Step::Queued(upload)) => match upload.durable().await {
                    Ok(ack) => Ok(Down::Ack(ack)),
                    Err(error) => Err(error.into()),
                },
            },
            Ok(()) = progress.changed() => {
                let told = progress.borrow_and_update().clone();
                let Some(correction) = told.and_then(|now| now.correction) else { continue };
                Ok(Down::Correction(correction))
            }
        };
        let ended = reply.is_err();
        let down = reply.map(|kind| v1::IngestResponse { kind: Some(kind) });
        if replies.send(down).await.is_err() || ended {
            return;
        }
        let allowed = window_now(&service);
        if allowed != window {
            window = allowed;
            let kind = Some(Down::FlowControl(v1::FlowControl { n_in_flight_max: window }));
            if replies.send(Ok(v1::IngestResponse { kind })).await.is_err() {
                return;
            }
        }
    }
}

/// Batches that a robot may have under way: few while the journal's queue is crowded.
fn window_now(service: &Service) -> u32 {
    let n_max = service.settings.limits.n_in_flight_max;
    if service.journal.is_crowded() { n_max.min(N_IN_FLIGHT_CROWDED) } else { n_max }
}
