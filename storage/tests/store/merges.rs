//! Merges: found again and again, decided once, and where that puts sessions.

use meetpoint_storage::{
    Error, FoundMerges, JobId, JournalEvent, JournalSeq, MergeDecision, MergeFilter, MergeId,
    MergeState, NewJob, NewMerge, NewMergeDecisions, NewSession, Placement, SessionId,
    SessionRecord, Store,
};
use uuid::Uuid;

use crate::fixture::{Fixture, hall, new_session};
use crate::relaxations::claimed;

const MERGE: MergeId = MergeId(Uuid::from_u128(77));

/// A session of unknown start.
async fn newcomer(fixture: &Fixture, robot: &str) -> SessionRecord {
    let new = NewSession { map_from_session: None, ..new_session(robot, "run") };
    fixture.store.open_session(&new).await.expect("the session opens").session
}

fn undecided(known: JournalSeq) -> NewMergeDecisions {
    NewMergeDecisions {
        map: hall(),
        known,
        decisions: Vec::new(),
        placements: Vec::new(),
        jobs: Vec::new(),
        time_ns: 9,
    }
}

fn decided(known: JournalSeq, state: MergeState, placements: Vec<Placement>) -> NewMergeDecisions {
    let (decision, payload) = (b"by anna".to_vec(), b"decided".to_vec());
    let decisions = vec![MergeDecision { merge: MERGE, state, decision, payload }];
    NewMergeDecisions { decisions, placements, ..undecided(known) }
}

/// What a job found of a session's place.
async fn found(fixture: &Fixture, session: SessionId, payload: &[u8]) -> FoundMerges {
    let job = claimed(&fixture.store).await;
    let payload = payload.to_vec();
    let new = NewMerge { id: MERGE, session, n_poses: 5, n_scans_drawn: 7, payload };
    FoundMerges {
        job: job.job.id,
        fence: job.fence,
        merges: vec![new],
        decided: undecided(JournalSeq::START),
        checkpoint: b"half".to_vec(),
    }
}

async fn decisions(store: &Store) -> Vec<JournalSeq> {
    let end = store.journal_end(&hall()).await.expect("reading works");
    let records = store.merge_decisions(&hall(), end).await.expect("reading works");
    records.into_iter().map(|record| record.seq).collect()
}

fn put(session: SessionId, frame: Option<SessionId>) -> Placement {
    Placement { session, frame, frame_from_session: [1.0, 2.0, 0.5] }
}

#[tokio::test]
async fn found_again_and_decided_once() {
    let fixture = Fixture::new().await;
    let session = newcomer(&fixture, "anna").await;
    assert_eq!((session.map_from_session, session.frame), (None, Some(session.id)), "on its own");
    let first = found(&fixture, session.id, b"far").await;
    fixture.store.record_found_merges(&first).await.expect("it is held");
    let again = FoundMerges {
        merges: vec![NewMerge { payload: b"near".to_vec(), ..first.merges[0].clone() }],
        ..first
    };
    let store = &fixture.store;
    store.record_found_merges(&again).await.expect("it is held");
    let all = store.merges(&MergeFilter::default(), None, 9).await.expect("reading works");
    let [merge] = all.as_slice() else { panic!("one a session: {all:?}") };
    assert_eq!((merge.payload.as_slice(), merge.state), (&b"near"[..], MergeState::Open), "anew");
    assert_eq!(decisions(store).await, [], "nobody has decided");

    let accepted = decided(JournalSeq::START, MergeState::Accepted, vec![put(session.id, None)]);
    store.decide_merges(&accepted).await.expect("it is there");
    let refused = store.decide_merges(&accepted).await;
    assert!(matches!(refused, Err(Error::MergesChanged(_))), "decided meanwhile: {refused:?}");
    let placed = store.session(session.id).await.expect("reading works").expect("it is there");
    assert_eq!((placed.map_from_session, placed.frame), (Some([1.0, 2.0, 0.5]), None), "placed");
    let seqs = decisions(store).await;
    let entries = store.journal(&hall(), JournalSeq(seqs[0].0 - 1), 9, 99).await;
    let entry = entries.expect("reading works").remove(0);
    assert_eq!(entry.event, JournalEvent::MergeDecided { payload: b"decided".to_vec() }, "kept");

    let undone = decided(seqs[0], MergeState::Undone, Vec::new());
    store.decide_merges(&undone).await.expect("it is there");
    let free = store.session(session.id).await.expect("reading works").expect("it is there");
    assert_eq!(free, session, "as before");
    let filter = MergeFilter { state: Some(MergeState::Undone), ..MergeFilter::default() };
    let listed = store.merges(&filter, None, 9).await.expect("reading works");
    assert_eq!(listed[0].seq, decisions(store).await.last().copied(), "by its entry");
}

/// What rules decide, the job's checkpoint and the jobs that follow are kept together or not at all.
#[tokio::test]
async fn with_the_job_or_not_at_all() {
    let fixture = Fixture::new().await;
    let (anna, bert) = (newcomer(&fixture, "anna").await, newcomer(&fixture, "bert").await);
    let found = found(&fixture, anna.id, b"near").await;
    let next = NewJob {
        id: JobId(Uuid::from_u128(99)),
        map: hall(),
        kind: "relax".to_owned(),
        params: Vec::new(),
        priority: 0,
        time_ns: 9,
    };
    let jobs = vec![next];
    let placements = vec![put(anna.id, Some(bert.id))];
    let by_rule = decided(JournalSeq::START, MergeState::Accepted, placements);
    let by_rule = NewMergeDecisions { jobs, ..by_rule };
    let found = FoundMerges { decided: by_rule, ..found };
    let store = &fixture.store;
    let lost = FoundMerges { fence: found.fence + 1, ..found.clone() };
    let refused = store.record_found_merges(&lost).await;
    assert!(matches!(refused, Err(Error::LeaseLost)), "{refused:?}");
    let late = NewMergeDecisions { known: JournalSeq(1), ..found.decided.clone() };
    let late = store.record_found_merges(&FoundMerges { decided: late, ..found.clone() }).await;
    assert!(matches!(late, Err(Error::MergesChanged(_))), "{late:?}");
    assert_eq!(store.merge(MERGE).await.expect("reading works"), None, "nothing is kept");

    store.record_found_merges(&found).await.expect("it is held");
    let merge = store.merge(MERGE).await.expect("reading works").expect("it is there");
    assert_eq!(
        (merge.state, merge.decision),
        (MergeState::Accepted, Some(b"by anna".to_vec())),
        "decided"
    );
    let job = store.job(found.job).await.expect("reading works").expect("it is there");
    assert_eq!(job.checkpoint, Some(b"half".to_vec()), "where it goes on");
    let queued = store.job(JobId(Uuid::from_u128(99))).await.expect("reading works");
    assert!(queued.is_some(), "what follows");
    let placed = store.session(anna.id).await.expect("reading works").expect("it is there");
    assert_eq!(
        (placed.map_from_session, placed.frame),
        (None, Some(bert.id)),
        "in another's frame"
    );
}
