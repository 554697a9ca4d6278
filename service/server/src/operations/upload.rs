//! Batches and skips: checked, queued for a group commit, answered when durable.

use std::time::Instant;

use meetpoint_proto::v1;
use meetpoint_storage::{AppendRequest, ContentHash, NewEntry};
use tokio::sync::oneshot;

use crate::convert::session;
use crate::ingest::{KnownSession, Outcome};
use crate::{clock, error::Error, service::Service};

/// Characters of a skip's reason.
const SKIP_REASON_LEN_MAX: usize = 200;

/// What a robot sends in order.
pub(crate) enum Upload {
    /// Observations.
    Batch(v1::Batch),
    /// Numbers that will never come.
    Skip(v1::Skip),
}

/// An upload that is on its way to the disk.
pub(crate) struct Queued {
    /// The batch, or the last one skipped.
    number: u64,
    came: Instant,
    outcome: oneshot::Receiver<Outcome>,
}

impl Queued {
    /// Waits until it is durable.
    pub(crate) async fn durable(self) -> Result<v1::Ack, Error> {
        let appended = self.outcome.await.map_err(|_| Error::Stopping)??;
        metrics::histogram!("meetpoint_ack_seconds").record(self.came.elapsed().as_secs_f64());
        Ok(v1::Ack {
            acked_through: appended.acked_through,
            rejected: session::rejections(self.number, appended.rejections),
        })
    }
}

impl Service {
    /// The unary twin of a stream's message.
    pub(crate) async fn ingest_batch(
        &self,
        request: v1::IngestBatchRequest,
    ) -> Result<v1::IngestBatchResponse, Error> {
        let v1::IngestBatchRequest { session, epoch, kind } = request;
        let upload = match kind {
            Some(v1::ingest_batch_request::Kind::Batch(batch)) => Upload::Batch(batch),
            Some(v1::ingest_batch_request::Kind::Skip(skip)) => Upload::Skip(skip),
            None => return Err(Error::field("kind", "missing: neither batch nor skip")),
        };
        let id = session::id("session", &session)?;
        let known = self.known_sessions.get(&self.store, id, &self.settings.limits).await?;
        let ack = self.queue_upload(&known, epoch, upload).await?.durable().await?;
        Ok(v1::IngestBatchResponse { ack: Some(ack) })
    }

    /// Checks an upload and queues it, waiting for room.
    pub(crate) async fn queue_upload(
        &self,
        known: &KnownSession,
        epoch: u64,
        upload: Upload,
    ) -> Result<Queued, Error> {
        let came = Instant::now();
        let (number, entry) = match upload {
            Upload::Batch(batch) => (batch.number, self.checked_batch(known, &batch)?),
            Upload::Skip(v1::Skip { from, through, reason }) => {
                let reason =
                    crate::convert::slug::text("skip.reason", &reason, SKIP_REASON_LEN_MAX)?;
                (through, NewEntry::Skip { from, through, reason })
            }
        };
        let receive_time_ns = clock::now_ns();
        let request = AppendRequest { session: known.id, epoch, receive_time_ns, entry };
        let outcome = self.journal.queue(known.map.clone(), request).await?;
        Ok(Queued { number, came, outcome })
    }

    fn checked_batch(&self, known: &KnownSession, batch: &v1::Batch) -> Result<NewEntry, Error> {
        let checked = known.check(batch, &self.settings.limits)?;
        metrics::counter!("meetpoint_batches_received").increment(1);
        metrics::counter!("meetpoint_scans_received").increment(u64::from(checked.n_scans));
        metrics::counter!("meetpoint_observations_rejected")
            .increment(checked.rejections.len() as u64);
        Ok(NewEntry::Batch {
            number: batch.number,
            content_hash: ContentHash(*blake3::hash(&checked.payload).as_bytes()),
            payload: checked.payload,
            rejections: checked.rejections,
            n_scans: checked.n_scans,
            n_visits: checked.n_visits,
            stamps_ns: checked.stamps_ns,
        })
    }
}
