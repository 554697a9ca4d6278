//! Group commit: what many robots send at once becomes durable together, with one fsync.
//!
//! Requests queue up while the previous group is being written and form the next one. The queue is
//! bounded: a sender waits for room, which is what slows a robot down.

use std::time::Instant;

use meetpoint_storage::{AppendRequest, Appended, MapId, NewEntry, Refusal, SessionId, Store};
use tokio::sync::{mpsc, oneshot, watch};

use crate::activity::Activity;
use crate::mapping::Actors;
use crate::{error::Error, settings::JournalSettings};

/// Less than this part of the queue free is crowded.
const CROWDED_BELOW: usize = 4;

/// What became of one request.
pub(crate) type Outcome = Result<Appended, Error>;

struct Waiting {
    map: MapId,
    request: AppendRequest,
    reply: oneshot::Sender<Outcome>,
}

/// The way into the journal.
#[derive(Clone, Debug)]
pub(crate) struct JournalWriter {
    queue: mpsc::Sender<Waiting>,
    failure: watch::Receiver<Option<String>>,
    activity: Activity,
}

impl JournalWriter {
    /// Starts the task that commits. It ends when the last writer is dropped.
    pub(crate) fn start(
        (store, actors, activity): (Store, Actors, Activity),
        settings: JournalSettings,
    ) -> (Self, tokio::task::JoinHandle<()>) {
        let (queue, waiting) = mpsc::channel(settings.queue_n_max);
        let (told, failure) = watch::channel(None);
        let task = tokio::spawn(commit_groups(store, actors, settings, waiting, told));
        (Self { queue, failure, activity }, task)
    }

    /// Why the last commit failed, until one succeeds.
    pub(crate) fn failure(&self) -> Option<String> {
        self.failure.borrow().clone()
    }

    /// True while so many wait that senders should hold back.
    pub(crate) fn is_crowded(&self) -> bool {
        self.queue.capacity() < self.queue.max_capacity() / CROWDED_BELOW
    }

    /// Queues a request, waiting for room. The receiver tells when it is durable, or why not.
    ///
    /// # Errors
    /// [`Error::Stopping`].
    pub(crate) async fn queue(
        &self,
        map: MapId,
        request: AppendRequest,
    ) -> Result<oneshot::Receiver<Outcome>, Error> {
        self.activity.touch();
        let (reply, outcome) = oneshot::channel();
        self.queue.send(Waiting { map, request, reply }).await.map_err(|_| Error::Stopping)?;
        Ok(outcome)
    }
}

async fn commit_groups(
    store: Store,
    actors: Actors,
    settings: JournalSettings,
    mut waiting: mpsc::Receiver<Waiting>,
    told: watch::Sender<Option<String>>,
) {
    while let Some(first) = waiting.recv().await {
        let mut n_bytes = payload_bytes(&first.request);
        let mut group = vec![first];
        while group.len() < settings.group_n_max && n_bytes < settings.group_bytes_max {
            let Ok(next) = waiting.try_recv() else { break };
            n_bytes += payload_bytes(&next.request);
            group.push(next);
        }
        metrics::gauge!("meetpoint_journal_queue_depth").set(waiting.len() as f64);
        let failure = commit(&store, &actors, group).await;
        told.send_if_modified(|last| std::mem::replace(last, failure.clone()) != failure);
    }
}

fn payload_bytes(request: &AppendRequest) -> usize {
    match &request.entry {
        NewEntry::Batch { payload, .. } => payload.len(),
        NewEntry::Skip { .. } => 0,
    }
}

/// Commits a group and answers it; why it failed, if it did.
async fn commit(store: &Store, actors: &Actors, group: Vec<Waiting>) -> Option<String> {
    let (mut requests, mut waiting) = (Vec::new(), Vec::new());
    for Waiting { map, request, reply } in group {
        waiting.push((map, request.session, reply));
        requests.push(request);
    }
    let begun = Instant::now();
    let outcomes = store.append(&requests).await;
    metrics::histogram!("meetpoint_database_seconds", "what" => "append")
        .record(begun.elapsed().as_secs_f64());
    metrics::histogram!("meetpoint_group_commit_batches").record(requests.len() as f64);
    match outcomes {
        Ok(outcomes) => {
            for ((map, session, reply), outcome) in waiting.into_iter().zip(outcomes) {
                if matches!(outcome, Ok(Appended { seq: Some(_), .. })) {
                    actors.wake(&map);
                }
                // A sender that went away asks again; the batch is durable all the same.
                let _ = reply.send(outcome.map_err(|refusal| refused(session, &refusal)));
            }
            None
        }
        Err(error) => {
            let error = Error::from(error);
            error.log();
            for (_, _, reply) in waiting {
                let _ = reply.send(Err(again(&error)));
            }
            Some(error.to_string())
        }
    }
}

/// The same failure of the store, for each of a group.
fn again(error: &Error) -> Error {
    match error {
        Error::StorageFull => Error::StorageFull,
        Error::StorageBusy => Error::StorageBusy,
        Error::StorageDamaged => Error::StorageDamaged,
        other => Error::internal(other.to_string()),
    }
}

fn refused(session: SessionId, refusal: &Refusal) -> Error {
    match refusal {
        Refusal::NoSuchSession => Error::NoSuchSession(session.0.to_string()),
        Refusal::SessionFenced => Error::SessionFenced { newest: None },
        Refusal::SessionClosed => Error::SessionClosed,
        Refusal::SequenceGap { expected } => Error::SequenceGap { expected: *expected },
        Refusal::ContentMismatch { number } => Error::BatchContentMismatch { number: *number },
        Refusal::InvalidSkip { .. } => Error::field("skip", refusal.to_string()),
    }
}
