//! Where merges in force put sessions of unknown start.
//!
//! A merge puts a session into the map's frame or into that of another session, which may be put
//! somewhere itself: what lies in it goes with it. Taking a merge back frees the session and leaves what
//! lies in its frame there.

use std::collections::{BTreeMap, BTreeSet};

use meetpoint_geometry::Pose;
use meetpoint_storage::{JournalSeq, MapId, Placement, SessionId, Store};

use crate::convert::merge_decision::{self, Deciding, MergeDecided};
use crate::convert::pose;
use crate::error::Error;

/// Where sessions are put.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Placements {
    /// What each session was put onto (`None`: the map), and its own frame seen from there.
    onto: BTreeMap<SessionId, (Option<SessionId>, Pose)>,
    /// Sessions that were ever put anywhere.
    ever: BTreeSet<SessionId>,
}

/// Where a session lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Place {
    /// The session in whose frame it is mapped; `None` for the map's.
    pub(crate) frame: Option<SessionId>,
    /// Its own frame seen from there.
    pub(crate) frame_from_session: Pose,
}

impl Place {
    /// In the map, at its declared start.
    pub(crate) fn declared(map_from_session: Pose) -> Self {
        Self { frame: None, frame_from_session: map_from_session }
    }

    /// In a frame of its own.
    pub(crate) fn own(session: SessionId) -> Self {
        Self { frame: Some(session), frame_from_session: Pose::IDENTITY }
    }
}

impl Placements {
    /// Those of a map up to a place in its journal, and the newest decision among them.
    ///
    /// # Errors
    /// The store's; [`Error::Internal`] if a decision cannot be read.
    pub(crate) async fn load(
        store: &Store,
        map: &MapId,
        through: JournalSeq,
    ) -> Result<(Self, JournalSeq), Error> {
        let (mut placements, mut newest) = (Self::default(), JournalSeq::START);
        for record in store.merge_decisions(map, through).await? {
            placements.decide(&merge_decision::from_bytes(&record.payload)?);
            newest = record.seq;
        }
        Ok((placements, newest))
    }

    /// Takes the next decision of the journal in.
    pub(crate) fn decide(&mut self, decided: &MergeDecided) {
        let session = decided.session;
        match decided.what {
            Deciding::Accepted { onto, onto_from_session, .. } => {
                self.onto.insert(session, (onto, onto_from_session));
                self.ever.insert(session);
            }
            Deciding::Undone => {
                self.onto.remove(&session);
            }
            Deciding::Rejected => {}
        }
    }

    /// Where a session of unknown start lies.
    pub(crate) fn place(&self, session: SessionId) -> Place {
        let mut place = Place::own(session);
        // Nothing lies in itself: no way is longer than there are merges.
        for _ in 0..self.onto.len() {
            let Some((onto, pose)) = place.frame.and_then(|frame| self.onto.get(&frame)) else {
                break;
            };
            place = Place { frame: *onto, frame_from_session: *pose * place.frame_from_session };
        }
        place
    }

    /// True if a session was put anywhere at any time, even if that was taken back.
    pub(crate) fn was_ever_put(&self, session: SessionId) -> bool {
        self.ever.contains(&session)
    }

    /// True if a session lies in another one's frame, or is that one.
    pub(crate) fn lies_in(&self, session: SessionId, other: SessionId) -> bool {
        let mut at = Some(session);
        for _ in 0..=self.onto.len() {
            match at {
                Some(frame) if frame == other => return true,
                Some(frame) => at = self.onto.get(&frame).and_then(|(onto, _)| *onto),
                None => return false,
            }
        }
        false
    }

    /// All sessions that are put somewhere, for the store.
    pub(crate) fn list(&self) -> Vec<Placement> {
        let of = |&session: &SessionId| {
            let Place { frame, frame_from_session } = self.place(session);
            Placement { session, frame, frame_from_session: pose::to_record(frame_from_session) }
        };
        self.onto.keys().map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use meetpoint_storage::MergeId;
    use uuid::Uuid;

    use super::*;

    const ANNA: SessionId = SessionId(Uuid::from_u128(1));
    const BERT: SessionId = SessionId(Uuid::from_u128(2));
    const CARL: SessionId = SessionId(Uuid::from_u128(3));

    fn decided(session: SessionId, what: Deciding) -> MergeDecided {
        let merge = MergeId(session.0);
        let (author, reason) = (String::new(), String::new());
        MergeDecided { merge, session, what, by_rule: false, author, reason }
    }

    fn put(session: SessionId, onto: Option<SessionId>, pose: Pose) -> MergeDecided {
        let alignment = Uuid::from_u128(9);
        decided(session, Deciding::Accepted { alignment, onto, onto_from_session: pose })
    }

    #[test]
    fn what_lies_in_a_session_goes_with_it() {
        let mut placements = Placements::default();
        placements.decide(&put(BERT, Some(ANNA), Pose::new(1.0, 0.0, 0.0)));
        placements.decide(&put(CARL, Some(BERT), Pose::new(0.0, 2.0, 0.0)));
        let carl = placements.place(CARL);
        assert_eq!(carl.frame, Some(ANNA), "by way of bert");
        assert_eq!(carl.frame_from_session, Pose::new(1.0, 2.0, 0.0), "one after the other");
        assert!(placements.lies_in(CARL, ANNA) && !placements.lies_in(ANNA, CARL), "one way");

        placements.decide(&put(ANNA, None, Pose::new(10.0, 0.0, FRAC_PI_2)));
        let Place { frame, frame_from_session } = placements.place(CARL);
        let expected = Pose::new(8.0, 1.0, FRAC_PI_2);
        assert_eq!(frame, None, "in the map");
        assert!(frame_from_session.step_to(expected).distance_m() < 1e-12, "with all in it");
        assert_eq!(placements.list().len(), 3, "all three");

        placements.decide(&decided(ANNA, Deciding::Undone));
        assert_eq!(placements.place(CARL), carl, "as before");
        assert_eq!(placements.place(ANNA), Place::own(ANNA), "on its own");
        assert!(placements.was_ever_put(ANNA), "once");
        placements.decide(&decided(BERT, Deciding::Rejected));
        assert_eq!(placements.place(BERT).frame, Some(ANNA), "rejecting moves nothing");
    }
}
