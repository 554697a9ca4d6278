//! Relaxations: decisions of jobs in the journal, kept together with the job's checkpoint.

use meetpoint_storage::{
    ClaimedJob, Error, JobId, JobOutcome, JournalEvent, JournalSeq, MapId, NewJob, NewRelaxation,
    Store,
};
use uuid::Uuid;

use crate::fixture::{Fixture, hall};

const ANN: Uuid = Uuid::from_u128(1);

pub(crate) async fn claimed(store: &Store) -> ClaimedJob {
    let new = NewJob {
        id: JobId(Uuid::from_u128(7)),
        map: hall(),
        kind: "relax".to_owned(),
        params: Vec::new(),
        priority: 0,
        time_ns: 1,
    };
    store.create_job(&new).await.expect("the map exists");
    store.claim_job(ANN, 2, 10).await.expect("writing works").expect("there is work")
}

pub(crate) fn found(job: &ClaimedJob, what: &str) -> NewRelaxation {
    NewRelaxation {
        map: hall(),
        job: job.job.id,
        fence: job.fence,
        payload: what.as_bytes().to_vec(),
        sessions: Vec::new(),
        closures: Vec::new(),
        checkpoint: b"decided".to_vec(),
        time_ns: 5,
    }
}

#[tokio::test]
async fn what_was_found_is_in_the_journal_and_the_job_knows() {
    let fixture = Fixture::new().await;
    let job = claimed(&fixture.store).await;
    let first = fixture.store.record_relaxation(&found(&job, "bent")).await.expect("it is held");
    let second = fixture.store.record_relaxation(&found(&job, "straight")).await.expect("held");
    let Fixture { store, .. } = &fixture.reopened().await;
    let kept = store.job(job.job.id).await.expect("reading works").expect("it was made");
    assert_eq!(kept.checkpoint.as_deref(), Some(&b"decided"[..]), "in one transaction");
    let of = async |through| {
        let records = store.relaxations(&hall(), through).await.expect("reading works");
        records.into_iter().map(|record| (record.seq, record.payload)).collect::<Vec<_>>()
    };
    let all = [(first, b"bent".to_vec()), (second, b"straight".to_vec())];
    assert_eq!(of(second).await, all, "in order");
    assert_eq!(of(first).await, all[..1], "up to a place");
    assert_eq!(of(JournalSeq::START).await, [], "none before");
    let journal = store.journal(&hall(), first, 9, 99).await.expect("reading works");
    let expected = JournalEvent::SessionsRelaxed { payload: b"straight".to_vec() };
    assert_eq!(journal[0].event, expected, "an entry as any other");
}

#[tokio::test]
async fn who_does_not_hold_the_job_decides_nothing() {
    let Fixture { store, .. } = &Fixture::new().await;
    let job = claimed(store).await;
    let stale = NewRelaxation { fence: job.fence - 1, ..found(&job, "stale") };
    let elsewhere = NewRelaxation { map: MapId("attic".to_owned()), ..found(&job, "lost") };
    let refused = store.record_relaxation(&stale).await;
    assert!(matches!(refused, Err(Error::LeaseLost)), "an older fence");
    let refused = store.record_relaxation(&elsewhere).await;
    assert!(matches!(refused, Err(Error::NoSuchMap(_))), "no map");
    let cancelled = JobOutcome::Cancelled;
    store.finish_job(job.job.id, job.fence, 6, &cancelled).await.expect("it is held");
    let refused = store.record_relaxation(&found(&job, "late")).await;
    assert!(matches!(refused, Err(Error::LeaseLost)), "it has ended");
    let end = store.journal_end(&hall()).await.expect("reading works");
    assert_eq!(store.relaxations(&hall(), end).await.expect("reading works"), [], "nothing");
}
