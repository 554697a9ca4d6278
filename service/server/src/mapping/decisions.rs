//! What was decided about the past of a map: where robots had been, where sessions of unknown start lie, and what
//! readings are taken to mean.
//!
//! Decisions speak of what was before they were made, so they are known before the first entry is
//! applied: a map's state is a function of the journal up to one place and of the decisions up to
//! another, and both are kept with it.

use std::sync::Arc;

use meetpoint_geometry::Pose;
use meetpoint_storage::{JournalSeq, MapId, SessionId, Store};

use super::placements::{Place, Placements};
use super::relaxations::Relaxations;
use super::sensing::Sensing;
use crate::convert::relaxation::{self, RelaxedSession};
use crate::error::Error;

/// The decisions that a map is drawn by.
#[derive(Clone, Debug)]
pub(crate) struct Decisions {
    through: JournalSeq,
    relaxations: Relaxations,
    placements: Placements,
    /// What readings are taken to mean; `None` where nobody decided.
    parameters: Option<Vec<u8>>,
}

impl Decisions {
    /// Those of a map up to a place in its journal.
    ///
    /// A relaxation counts as long as all of its sessions lie where they lay when it was made: one that
    /// rests on a merge that was taken back does not.
    ///
    /// # Errors
    /// The store's; [`Error::Internal`] if one cannot be read.
    pub(crate) async fn load(
        store: &Store,
        map: &MapId,
        through: JournalSeq,
    ) -> Result<Self, Error> {
        let (placements, _) = Placements::load(store, map, through).await?;
        let mut relaxations = Relaxations::default();
        for record in store.relaxations(map, through).await? {
            let found = relaxation::from_bytes(&record.payload)?;
            if found.iter().all(|session| holds(session, &placements)) {
                relaxations.add(found);
            }
        }
        let parameters = store.mapping_parameters(map, through).await?;
        Ok(Self { through, relaxations, placements, parameters })
    }

    /// The same with parameters that were decided later, on a map that has nothing yet to decide about.
    pub(super) fn with_parameters(mut self, payload: Vec<u8>, seq: JournalSeq) -> Self {
        (self.parameters, self.through) = (Some(payload), seq);
        self
    }

    /// By what the map is drawn.
    ///
    /// # Errors
    /// [`Error::Internal`] if what was decided cannot be read any more.
    pub(super) fn sensing(&self, service: &Arc<Sensing>) -> Result<Arc<Sensing>, Error> {
        service.of(self.parameters.as_deref()).map_err(Error::internal)
    }

    /// The same with what a job found out besides, before it is decided.
    pub(crate) fn with(mut self, found: &[RelaxedSession]) -> Self {
        self.relaxations.add(found.to_vec());
        self
    }

    /// The same without what relaxations know of a session.
    pub(crate) fn without(mut self, session: SessionId) -> Self {
        self.relaxations.remove(session);
        self
    }

    /// Of how many first observations of a session a relaxation has told.
    pub(crate) fn n_relaxed(&self, session: SessionId) -> usize {
        self.relaxations.n_poses(session)
    }

    /// The place in the journal up to which decisions are in.
    pub(super) fn through(&self) -> JournalSeq {
        self.through
    }

    /// Where robots had been.
    pub(super) fn relaxations(&self) -> &Relaxations {
        &self.relaxations
    }

    /// Where a session lies that declared this start.
    pub(super) fn place(&self, session: SessionId, declared: Option<Pose>) -> Place {
        declared.map_or_else(|| self.placements.place(session), Place::declared)
    }
}

/// True if a session lies where it lay when it was relaxed.
fn holds(relaxed: &RelaxedSession, placements: &Placements) -> bool {
    let now = placements.place(relaxed.session);
    let was_declared = !placements.was_ever_put(relaxed.session);
    was_declared || now == Place::declared(relaxed.map_from_session)
}

#[cfg(test)]
mod tests {
    use meetpoint_storage::MergeId;
    use uuid::Uuid;

    use super::*;
    use crate::convert::merge_decision::{Deciding, MergeDecided};

    fn decided(session: SessionId, what: Deciding) -> MergeDecided {
        let (author, reason) = (String::new(), String::new());
        MergeDecided { merge: MergeId(session.0), session, what, by_rule: true, author, reason }
    }

    #[test]
    fn a_relaxation_rests_on_where_its_session_lay() {
        let (session, at) = (SessionId(Uuid::from_u128(1)), Pose::new(3.0, 1.0, 0.5));
        let (poses, landmarks) = (Vec::new(), Vec::new());
        let relaxed = RelaxedSession { session, map_from_session: at, poses, landmarks };
        let accepted = |onto_from_session| {
            let alignment = Uuid::from_u128(9);
            decided(session, Deciding::Accepted { alignment, onto: None, onto_from_session })
        };
        let mut placements = Placements::default();
        assert!(holds(&relaxed, &placements), "its start was known");
        placements.decide(&accepted(at));
        assert!(holds(&relaxed, &placements), "it lies there");
        placements.decide(&decided(session, Deciding::Undone));
        assert!(!holds(&relaxed, &placements), "that was taken back");
        placements.decide(&accepted(Pose::new(3.0, 1.0, 0.6)));
        assert!(!holds(&relaxed, &placements), "it lies elsewhere");
        placements.decide(&accepted(at));
        assert!(holds(&relaxed, &placements), "it lies there again");
    }
}
