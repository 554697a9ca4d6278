//! Appending against its definition: a slot for every number, filled once.

use std::collections::BTreeMap;

use meetpoint_storage::{
    AppendRequest, Appended, ContentHash, JournalEvent, JournalSeq, NewEntry, Refusal,
    RejectionRecord, SessionRecord,
};
use proptest::prelude::*;

use crate::fixture::{Fixture, batch_rejecting, hall, rejection, skip};

/// What a generated history consists of. Numbers are relative to what is expected, robots index
/// into [`ROBOTS`].
#[derive(Clone, Debug)]
enum Step {
    Append(Vec<Sent>),
    Close {
        robot: usize,
    },
    /// The robot starts anew, which fences what it had.
    Restart {
        robot: usize,
    },
    /// The database is closed and opened again.
    Reopen,
}

#[derive(Clone, Debug)]
struct Sent {
    robot: usize,
    /// 0 is the number expected, negative ones were sent before.
    offset: i64,
    what: What,
    from_an_older_process: bool,
}

#[derive(Clone, Debug)]
enum What {
    Batch { content: u8, n_rejected: u32 },
    Skip { length: u64 },
}

const ROBOTS: [&str; 3] = ["ann", "bob", "cid"];

fn sent() -> impl Strategy<Value = Sent> {
    let what = prop_oneof![
        // Two contents, so that the same number is often sent with the same content.
        5 => (0..2_u8, 0..2_u32).prop_map(|(content, n_rejected)| What::Batch { content, n_rejected }),
        1 => (0..4_u64).prop_map(|length| What::Skip { length }),
    ];
    let offset = prop_oneof![6 => Just(0_i64), 3 => -4..0_i64, 1 => 1..3_i64];
    (0..ROBOTS.len(), offset, what, prop::bool::weighted(0.05)).prop_map(
        |(robot, offset, what, from_an_older_process)| Sent {
            robot,
            offset,
            what,
            from_an_older_process,
        },
    )
}

fn step() -> impl Strategy<Value = Step> {
    prop_oneof![
        10 => prop::collection::vec(sent(), 1..40).prop_map(Step::Append),
        1 => (0..ROBOTS.len()).prop_map(|robot| Step::Close { robot }),
        1 => (0..ROBOTS.len()).prop_map(|robot| Step::Restart { robot }),
        1 => Just(Step::Reopen),
    ]
}

/// What fills a number.
#[derive(Clone, Debug, PartialEq)]
enum Slot {
    Batch { hash: ContentHash, payload: Vec<u8>, rejections: Vec<RejectionRecord> },
    Skip { from: u64, through: u64 },
}

/// The definition: a session is a row of slots.
struct Model {
    record: SessionRecord,
    slots: Vec<Slot>,
    is_closed: bool,
}

impl Model {
    fn new(record: SessionRecord) -> Self {
        Self { record, slots: Vec::new(), is_closed: false }
    }

    fn expected(&self) -> u64 {
        self.slots.len() as u64 + 1
    }

    fn slot(&self, number: u64) -> Option<&Slot> {
        self.slots.get(usize::try_from(number.checked_sub(1)?).ok()?)
    }

    /// What the store should answer; places in the journal as 0.
    fn answer(&mut self, request: &AppendRequest) -> Result<Appended, Refusal> {
        if request.epoch != self.record.epoch {
            return Err(Refusal::SessionFenced);
        }
        let seq = match &request.entry {
            NewEntry::Batch { number, payload, content_hash, rejections, .. } => {
                let slot = Slot::Batch {
                    hash: *content_hash,
                    payload: payload.clone(),
                    rejections: rejections.clone(),
                };
                self.batch(*number, slot)?
            }
            NewEntry::Skip { from, through, .. } => self.skip(*from, *through)?,
        };
        let first = match &request.entry {
            NewEntry::Batch { number, .. } => *number,
            NewEntry::Skip { from, .. } => *from,
        };
        let rejections = match self.slot(first) {
            Some(Slot::Batch { rejections, .. }) => rejections.clone(),
            _ => Vec::new(),
        };
        Ok(Appended { seq, acked_through: self.expected() - 1, rejections })
    }

    fn batch(&mut self, number: u64, sent: Slot) -> Result<Option<JournalSeq>, Refusal> {
        let expected = self.expected();
        match (self.slot(number), &sent) {
            (Some(Slot::Batch { hash, .. }), Slot::Batch { hash: again, .. }) if hash == again => {
                Ok(None)
            }
            (Some(_), _) => Err(Refusal::ContentMismatch { number }),
            (None, _) if self.is_closed => Err(Refusal::SessionClosed),
            (None, _) if number != expected => Err(Refusal::SequenceGap { expected }),
            (None, _) => {
                self.slots.push(sent);
                Ok(Some(JournalSeq::START))
            }
        }
    }

    fn skip(&mut self, from: u64, through: u64) -> Result<Option<JournalSeq>, Refusal> {
        let expected = self.expected();
        let skip = Slot::Skip { from, through };
        match self.slot(from) {
            Some(slot) if *slot == skip => Ok(None),
            Some(_) => Err(Refusal::InvalidSkip { from, through, expected }),
            None if self.is_closed => Err(Refusal::SessionClosed),
            None if from != expected => Err(Refusal::SequenceGap { expected }),
            None if through < from => Err(Refusal::InvalidSkip { from, through, expected }),
            None => {
                self.slots.extend((from..=through).map(|_| skip.clone()));
                Ok(Some(JournalSeq::START))
            }
        }
    }

    /// What the journal should say of this session: batches and skips by their first numbers.
    fn history(&self) -> BTreeMap<u64, Slot> {
        let numbered = (1..).zip(&self.slots);
        let begins = |(number, slot): &(u64, &Slot)| match slot {
            Slot::Batch { .. } => true,
            Slot::Skip { from, .. } => from == number,
        };
        numbered.filter(begins).map(|(number, slot)| (number, slot.clone())).collect()
    }
}

fn request(model: &Model, sent: &Sent) -> AppendRequest {
    let number = model.expected().saturating_add_signed(sent.offset);
    let mut request = match sent.what {
        What::Batch { content, n_rejected } => {
            let rejections = (0..n_rejected).map(rejection).collect();
            batch_rejecting(&model.record, number, &format!("content {content}"), rejections)
        }
        What::Skip { length } => skip(&model.record, number, (number + length).saturating_sub(1)),
    };
    if sent.from_an_older_process {
        request.epoch -= 1;
    }
    request
}

/// Sends a group to both and compares the answers.
async fn append_to_both(
    fixture: &Fixture,
    models: &mut [Model],
    group: &[Sent],
) -> Result<(), TestCaseError> {
    let mut requests = Vec::new();
    let mut expected = Vec::new();
    for sent in group {
        let model = &mut models[sent.robot];
        let request = request(model, sent);
        expected.push(model.answer(&request));
        requests.push(request);
    }
    let mut answers = fixture.store.append(&requests).await.expect("the group commits");
    let seqs: Vec<JournalSeq> = answers.iter().flatten().filter_map(|answer| answer.seq).collect();
    prop_assert!(seqs.is_sorted_by(|a, b| a < b), "not in order: {:?}", seqs);
    for answer in answers.iter_mut().flatten() {
        answer.seq = answer.seq.map(|_| JournalSeq::START);
    }
    prop_assert_eq!(answers, expected);
    Ok(())
}

async fn play(steps: Vec<Step>) -> Result<(), TestCaseError> {
    let mut fixture = Fixture::new().await;
    let mut models = Vec::new();
    let mut past = Vec::new();
    for robot in ROBOTS {
        models.push(Model::new(fixture.open(robot, "run 0").await));
    }
    for (index, step) in steps.into_iter().enumerate() {
        match step {
            Step::Append(group) => append_to_both(&fixture, &mut models, &group).await?,
            Step::Close { robot } => {
                let SessionRecord { id, epoch, .. } = models[robot].record;
                fixture.store.close_session(id, epoch, 400).await.expect("it can be closed");
                models[robot].is_closed = true;
            }
            Step::Restart { robot } => {
                let record = fixture.open(ROBOTS[robot], &format!("run {}", index + 1)).await;
                past.push(std::mem::replace(&mut models[robot], Model::new(record)));
            }
            Step::Reopen => fixture = fixture.reopened().await,
        }
    }
    for model in models.iter().chain(&past) {
        prop_assert_eq!(history(&fixture, model).await, model.history());
        let stored = fixture.store.session(model.record.id).await.expect("reading works");
        let acked_through = stored.map(|record| record.acked_through);
        prop_assert_eq!(acked_through, Some(model.expected() - 1));
    }
    Ok(())
}

/// What the journal says of the model's session. Codes and details of rejections are filled in.
async fn history(fixture: &Fixture, model: &Model) -> BTreeMap<u64, Slot> {
    let journal = fixture.store.journal(&hall(), JournalSeq::START, 100_000, 1 << 30).await;
    let of_session = |event| match event {
        JournalEvent::Batch { session, number, payload, rejected }
            if session == model.record.id =>
        {
            let hash = ContentHash::of(&payload);
            let rejections = rejected.into_iter().map(rejection).collect();
            Some((number, Slot::Batch { hash, payload, rejections }))
        }
        JournalEvent::Skipped { session, from, through } if session == model.record.id => {
            Some((from, Slot::Skip { from, through }))
        }
        _ => None,
    };
    let journal = journal.expect("reading works");
    journal.into_iter().filter_map(|entry| of_session(entry.event)).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_history_is_kept_as_defined(steps in prop::collection::vec(step(), 1..12)) {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
        runtime.expect("a runtime can be made").block_on(play(steps))?;
    }
}
