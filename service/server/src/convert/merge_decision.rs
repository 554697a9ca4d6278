//! What was decided about a merge, as the journal keeps it.

use meetpoint_geometry::Pose;
use meetpoint_storage::{MergeId, SessionId};
use prost::Message;
use uuid::Uuid;

use super::pose;
use crate::error::Error;

/// The layout of [`Recorded`]; field numbers are kept for ever.
const FORMAT: u32 = 1;

const ACCEPTED: u32 = 1;
const REJECTED: u32 = 2;
const UNDONE: u32 = 3;

/// A decision about where a session of unknown start lies.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct MergeDecided {
    /// The merge.
    pub(crate) merge: MergeId,
    /// The session.
    pub(crate) session: SessionId,
    /// What was decided.
    pub(crate) what: Deciding,
    /// Whether a rule decided; else a person.
    pub(crate) by_rule: bool,
    /// Who said so, for people.
    pub(crate) author: String,
    /// Why, for people.
    pub(crate) reason: String,
}

/// What was decided.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Deciding {
    /// The session lies there.
    Accepted {
        /// The alignment.
        alignment: Uuid,
        /// The session in whose frame it lies; `None` for the map's.
        onto: Option<SessionId>,
        /// Its own frame seen from there.
        onto_from_session: Pose,
    },
    /// It stays where it is.
    Rejected,
    /// It goes back into a frame of its own.
    Undone,
}

#[derive(Clone, PartialEq, Message)]
struct Recorded {
    #[prost(uint32, tag = "1")]
    format: u32,
    #[prost(bytes = "vec", tag = "2")]
    merge: Vec<u8>,
    #[prost(bytes = "vec", tag = "3")]
    session: Vec<u8>,
    #[prost(uint32, tag = "4")]
    what: u32,
    #[prost(bytes = "vec", tag = "5")]
    alignment: Vec<u8>,
    /// Empty for the map's frame.
    #[prost(bytes = "vec", tag = "6")]
    onto: Vec<u8>,
    #[prost(double, repeated, tag = "7")]
    onto_from_session: Vec<f64>,
    #[prost(bool, tag = "8")]
    by_rule: bool,
    #[prost(string, tag = "9")]
    author: String,
    #[prost(string, tag = "10")]
    reason: String,
}

/// The bytes of a decision.
pub(crate) fn to_bytes(decided: &MergeDecided) -> Vec<u8> {
    let MergeDecided { merge, session, what, by_rule, author, reason } = decided.clone();
    let recorded = Recorded {
        format: FORMAT,
        merge: merge.0.as_bytes().to_vec(),
        session: session.0.as_bytes().to_vec(),
        by_rule,
        author,
        reason,
        ..Recorded::default()
    };
    match what {
        Deciding::Accepted { alignment, onto, onto_from_session } => Recorded {
            what: ACCEPTED,
            alignment: alignment.as_bytes().to_vec(),
            onto: onto.map(|onto| onto.0.as_bytes().to_vec()).unwrap_or_default(),
            onto_from_session: pose::to_record(onto_from_session).to_vec(),
            ..recorded
        },
        Deciding::Rejected => Recorded { what: REJECTED, ..recorded },
        Deciding::Undone => Recorded { what: UNDONE, ..recorded },
    }
    .encode_to_vec()
}

/// A decision out of its bytes.
///
/// # Errors
/// [`Error::Internal`] if they are of another format or no decision.
pub(crate) fn from_bytes(bytes: &[u8]) -> Result<MergeDecided, Error> {
    let recorded = Recorded::decode(bytes).map_err(Error::internal)?;
    let format = recorded.format;
    if format != FORMAT {
        return Err(Error::internal(format!("a decision of format {format}, not {FORMAT}")));
    }
    read(recorded).ok_or_else(|| Error::internal("no decision about a merge"))
}

fn read(recorded: Recorded) -> Option<MergeDecided> {
    let Recorded {
        merge,
        session,
        what,
        alignment,
        onto,
        onto_from_session,
        by_rule,
        author,
        reason,
        ..
    } = recorded;
    let id = |bytes: &[u8]| Uuid::from_slice(bytes).ok();
    let what = match what {
        ACCEPTED => Deciding::Accepted {
            alignment: id(&alignment)?,
            onto: if onto.is_empty() { None } else { Some(SessionId(id(&onto)?)) },
            onto_from_session: pose::from_record(onto_from_session.try_into().ok()?),
        },
        REJECTED => Deciding::Rejected,
        UNDONE => Deciding::Undone,
        _ => return None,
    };
    let (merge, session) = (MergeId(id(&merge)?), SessionId(id(&session)?));
    Some(MergeDecided { merge, session, what, by_rule, author, reason })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_bit_for_bit() {
        let accepted = |onto| Deciding::Accepted {
            alignment: Uuid::from_u128(3),
            onto,
            onto_from_session: Pose::new(0.1 + 0.2, -0.0, 3.0),
        };
        let onto = Some(SessionId(Uuid::from_u128(4)));
        for what in [accepted(None), accepted(onto), Deciding::Rejected, Deciding::Undone] {
            let decided = MergeDecided {
                merge: MergeId(Uuid::from_u128(1)),
                session: SessionId(Uuid::from_u128(2)),
                what,
                by_rule: true,
                author: "rule".into(),
                reason: "margin 9.5".into(),
            };
            let bytes = to_bytes(&decided);
            assert_eq!(from_bytes(&bytes).expect("just written"), decided, "as it was");
            assert!(from_bytes(&bytes[..bytes.len() - 3]).is_err(), "cut off");
        }
        assert!(from_bytes(b"\x08\x07").is_err(), "an unknown format");
    }
}
