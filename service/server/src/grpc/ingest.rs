//! `SessionService.Ingest`: batches up; acks and corrections down.
//!
//! One task reads, checks and queues; another waits for each commit in order and answers. Between
//! them stands a bounded queue, and before the journal another: when they are full nothing is read
//! from the stream, which the sender feels as flow control. Nothing is dropped.

use std::sync::Arc;
use std::time::Instant;

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

/// Replies on their way to one robot.
const N_REPLIES_BUFFERED: usize = 16;

/// An upload and when it came, in the order of the stream; or what ends the stream.
enum Step {
    Queued(Queued, Instant),
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
    let came = Instant::now();
    let upload = match kind {
        Some(Up::Batch(batch)) => Upload::Batch(batch),
        Some(Up::Skip(skip)) => Upload::Skip(skip),
        Some(Up::Attach(_)) => return Step::Failed(Error::NotAttached.into()),
        None => return Step::Failed(Error::field("kind", "missing or unknown here").into()),
    };
    match service.queue_upload(known, epoch, upload).await {
        Ok(queued) => Step::Queued(queued, came),
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
    loop {
        tokio::select! {
            biased;
            step = queued.recv() => {
                let reply = match step {
                    None => return,
                    Some(Step::Failed(status)) => Err(status),
                    Some(Step::Queued(upload, came)) => acknowledge(upload, came).await,
                };
                let ended = reply.is_err();
                if replies.send(reply).await.is_err() || ended {
                    return;
                }
            }
            Ok(()) = progress.changed() => {
                let correction = progress.borrow_and_update().correction.clone();
                if let Some(correction) = correction {
                    let reply = v1::IngestResponse { kind: Some(Down::Correction(correction)) };
                    if replies.send(Ok(reply)).await.is_err() {
                        return;
                    }
                }
            }
        }
    }
}

async fn acknowledge(upload: Queued, came: Instant) -> Result<v1::IngestResponse, Status> {
    let ack = upload.durable().await?;
    metrics::histogram!("meetpoint_ack_seconds").record(came.elapsed().as_secs_f64());
    Ok(v1::IngestResponse { kind: Some(Down::Ack(ack)) })
}
