//! What may be decided about a merge, and what that comes to: the same for people and rules.

use meetpoint_proto::v1;
use meetpoint_storage::{
    JobId, JournalSeq, MapId, MergeDecision, MergeRecord, MergeState, NewJob, NewMergeDecisions,
    Store,
};
use prost::Message;
use uuid::Uuid;

use crate::convert::job::{MERGE, RELAX};
use crate::convert::merge_decision::{self, Deciding, MergeDecided};
use crate::convert::{job, merge};
use crate::error::Error;
use crate::mapping::Placements;

/// What is decided about the merges of a map already.
#[derive(Clone, Debug)]
pub(crate) struct Known {
    map: MapId,
    /// The newest decision.
    newest: JournalSeq,
    /// Where the decisions put sessions, those that are about to be made among them.
    placements: Placements,
    decisions: Vec<MergeDecision>,
    jobs: Vec<NewJob>,
    now_ns: i64,
}

impl Known {
    /// All decisions about merges of a map.
    ///
    /// # Errors
    /// The store's; [`Error::Internal`] if one cannot be read.
    pub(crate) async fn load(store: &Store, map: &MapId, now_ns: i64) -> Result<Self, Error> {
        let (placements, newest) = Placements::load(store, map, JournalSeq(i64::MAX)).await?;
        let (decisions, jobs) = (Vec::new(), Vec::new());
        Ok(Self { map: map.clone(), newest, placements, decisions, jobs, now_ns })
    }

    /// Where the decisions put sessions, those that are about to be made among them.
    pub(crate) fn placements(&self) -> &Placements {
        &self.placements
    }

    /// True if something is to be decided.
    pub(crate) fn decides(&self) -> bool {
        !self.decisions.is_empty()
    }

    /// Takes in what is to be decided next.
    pub(crate) fn decide(&mut self, decided: &MergeDecided) {
        let MergeDecided { merge, session: _, what, by_rule, author, reason } = decided.clone();
        let alignment = match &what {
            Deciding::Accepted { alignment, .. } => alignment.to_string(),
            Deciding::Rejected | Deciding::Undone => String::new(),
        };
        let state = match what {
            Deciding::Accepted { .. } => MergeState::Accepted,
            Deciding::Rejected => MergeState::Rejected,
            Deciding::Undone => MergeState::Undone,
        };
        let told = v1::MergeDecision { alignment, by_rule, author, reason, time_ns: self.now_ns };
        let (decision, payload) = (told.encode_to_vec(), merge_decision::to_bytes(decided));
        self.placements.decide(decided);
        self.decisions.push(MergeDecision { merge, state, decision, payload });
    }

    /// Has the map drawn by what is decided; the job that does it.
    pub(crate) fn then_draw(&mut self) -> JobId {
        let params = v1::MergeParams { draw_only: true, ..v1::MergeParams::default() };
        self.then(MERGE, params.encode_to_vec())
    }

    /// Has the map relaxed with those that are placed.
    pub(crate) fn then_relax(&mut self) {
        self.then(RELAX, v1::RelaxParams::default().encode_to_vec());
    }

    fn then(&mut self, kind: &str, params: Vec<u8>) -> JobId {
        let id = JobId(Uuid::now_v7());
        let (map, kind, time_ns) = (self.map.clone(), kind.to_owned(), self.now_ns);
        self.jobs.push(NewJob { id, map, kind, params, priority: job::PRIORITY_USUAL, time_ns });
        id
    }

    /// All of it, for the store.
    pub(crate) fn into_decisions(self) -> NewMergeDecisions {
        let Self { map, newest, placements, decisions, jobs, now_ns } = self;
        let placements = placements.list();
        NewMergeDecisions { map, known: newest, decisions, placements, jobs, time_ns: now_ns }
    }
}

/// What accepting an alignment of a merge (empty: the first) comes to; `None` if it is in force.
///
/// # Errors
/// [`Error::NoSuchAlignment`], [`Error::MergeAccepted`], [`Error::MergeCycle`].
pub(crate) fn accepting(
    record: &MergeRecord,
    wanted: &str,
    placements: &Placements,
) -> Result<Option<Deciding>, Error> {
    let merge = merge::to_wire(record)?;
    let in_force = merge.decision.filter(|_| record.state == MergeState::Accepted);
    if let Some(decision) = in_force {
        // Whoever asks for the first is content with the one that was the first then.
        let is_same = wanted.is_empty() || decision.alignment == wanted;
        return if is_same { Ok(None) } else { Err(Error::MergeAccepted(merge.id)) };
    }
    let mut alignments = merge.alignments.iter();
    let found = alignments.find(|alignment| wanted.is_empty() || alignment.id == wanted);
    let Some(found) = found else {
        return Err(Error::NoSuchAlignment { merge: merge.id, alignment: wanted.to_owned() });
    };
    let (onto, onto_from_session) = merge::place(found)?;
    if let Some(onto) = onto.filter(|onto| placements.lies_in(*onto, record.session)) {
        let (session, onto) = (merge.session, onto.0.to_string());
        return Err(Error::MergeCycle { session, onto });
    }
    let alignment = Uuid::parse_str(&found.id).map_err(Error::internal)?;
    Ok(Some(Deciding::Accepted { alignment, onto, onto_from_session }))
}

/// What rejecting a merge comes to; `None` if it is rejected.
///
/// # Errors
/// [`Error::MergeAccepted`].
pub(crate) fn rejecting(record: &MergeRecord) -> Result<Option<Deciding>, Error> {
    match record.state {
        MergeState::Open | MergeState::Undone => Ok(Some(Deciding::Rejected)),
        MergeState::Rejected => Ok(None),
        MergeState::Accepted => Err(Error::MergeAccepted(record.id.to_string())),
    }
}

/// What undoing a merge comes to; `None` if it is undone.
///
/// # Errors
/// [`Error::MergeNotAccepted`].
pub(crate) fn undoing(record: &MergeRecord) -> Result<Option<Deciding>, Error> {
    match record.state {
        MergeState::Accepted => Ok(Some(Deciding::Undone)),
        MergeState::Undone => Ok(None),
        MergeState::Open | MergeState::Rejected => {
            Err(Error::MergeNotAccepted(record.id.to_string()))
        }
    }
}
