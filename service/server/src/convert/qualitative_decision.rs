//! What people decide about explorations, as the journal keeps it.

use meetpoint_places::PlaceId;
use meetpoint_places::qualitative::SelectionRule;
use meetpoint_storage::SessionId;
use prost::Message;
use uuid::Uuid;

use crate::error::Error;
use crate::qualitative::{Begun, Decided, Decision};

/// A decision: one of `begun`, `most_rotation`, `marked`. Field numbers are kept for ever.
#[derive(Clone, PartialEq, Message)]
struct Recorded {
    #[prost(bytes = "vec", tag = "1")]
    session: Vec<u8>,
    #[prost(uint64, tag = "2")]
    after_batch: u64,
    #[prost(message, optional, tag = "3")]
    begun: Option<RecordedBegin>,
    /// The rule of selection: whether the most rotation comes first.
    #[prost(bool, optional, tag = "4")]
    most_rotation: Option<bool>,
    #[prost(message, optional, tag = "5")]
    marked: Option<RecordedMark>,
    #[prost(string, tag = "6")]
    reason: String,
    #[prost(string, tag = "7")]
    author: String,
    #[prost(int64, tag = "8")]
    time_ns: i64,
}

/// How an exploration begins.
#[derive(Clone, PartialEq, Message)]
struct RecordedBegin {
    #[prost(string, tag = "1")]
    sensor: String,
    #[prost(bool, tag = "2")]
    compass: bool,
    #[prost(bool, tag = "3")]
    most_rotation: bool,
    #[prost(double, tag = "4")]
    corridor_width_m: f64,
    #[prost(uint32, tag = "5")]
    rehearsal_edges_max: u32,
}

/// That a place is home, or is not.
#[derive(Clone, PartialEq, Message)]
struct RecordedMark {
    #[prost(uint32, tag = "1")]
    place: u32,
    #[prost(bool, tag = "2")]
    is_home: bool,
}

/// A decision, for the journal.
pub(crate) fn recorded(session: SessionId, decision: &Decision) -> Vec<u8> {
    let Decision { after_batch, decided, said_by: [reason, author], time_ns } = decision;
    let mut recorded = Recorded {
        session: session.0.as_bytes().to_vec(),
        after_batch: *after_batch,
        begun: None,
        most_rotation: None,
        marked: None,
        reason: reason.clone(),
        author: author.clone(),
        time_ns: *time_ns,
    };
    match decided {
        Decided::Begun(Begun {
            sensor,
            has_compass,
            selection,
            corridor_width_m,
            n_rehearsal_edges_max,
        }) => {
            recorded.begun = Some(RecordedBegin {
                sensor: sensor.clone(),
                compass: *has_compass,
                most_rotation: *selection == SelectionRule::MostRotation,
                corridor_width_m: *corridor_width_m,
                rehearsal_edges_max: u32::try_from(*n_rehearsal_edges_max).unwrap_or(u32::MAX),
            });
        }
        Decided::Selected(selection) => {
            recorded.most_rotation = Some(*selection == SelectionRule::MostRotation);
        }
        Decided::Marked { place, is_home } => {
            recorded.marked = Some(RecordedMark { place: place.0, is_home: *is_home });
        }
    }
    recorded.encode_to_vec()
}

/// The decisions of the journal that are about one session, in order.
///
/// # Errors
/// [`Error::Internal`] if the journal holds what was never written.
pub(crate) fn decisions(session: SessionId, payloads: &[Vec<u8>]) -> Result<Vec<Decision>, Error> {
    let mut decisions = Vec::new();
    for payload in payloads {
        let recorded = Recorded::decode(payload.as_slice()).map_err(Error::internal)?;
        if Uuid::from_slice(&recorded.session).map_err(Error::internal)? == session.0 {
            decisions.push(decision(recorded)?);
        }
    }
    Ok(decisions)
}

fn decision(recorded: Recorded) -> Result<Decision, Error> {
    let Recorded { session: _, after_batch, begun, most_rotation, marked, reason, author, time_ns } =
        recorded;
    let decided = match (begun, most_rotation, marked) {
        (Some(begun), None, None) => {
            let RecordedBegin {
                sensor,
                compass,
                most_rotation,
                corridor_width_m,
                rehearsal_edges_max,
            } = begun;
            Decided::Begun(Begun {
                sensor,
                has_compass: compass,
                selection: rule(most_rotation),
                corridor_width_m,
                n_rehearsal_edges_max: rehearsal_edges_max as usize,
            })
        }
        (None, Some(most_rotation), None) => Decided::Selected(rule(most_rotation)),
        (None, None, Some(RecordedMark { place, is_home })) => {
            Decided::Marked { place: PlaceId(place), is_home }
        }
        _ => return Err(Error::internal("a decision about an exploration that says nothing")),
    };
    Ok(Decision { after_batch, decided, said_by: [reason, author], time_ns })
}

fn rule(most_rotation: bool) -> SelectionRule {
    if most_rotation { SelectionRule::MostRotation } else { SelectionRule::LeastRotation }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_decided_is_read_again() {
        let [ann, bob] = [1, 2].map(|id| SessionId(Uuid::from_u128(id)));
        let begun = Begun {
            sensor: "ring".to_owned(),
            has_compass: true,
            corridor_width_m: 2.4,
            ..Begun::DEFAULT
        };
        let decided = [
            Decided::Begun(begun),
            Decided::Selected(SelectionRule::LeastRotation),
            Decided::Marked { place: PlaceId(3), is_home: true },
        ];
        let said_by = ["seen", "anna"].map(str::to_owned);
        let decision = |decided: &Decided| Decision {
            after_batch: 7,
            decided: decided.clone(),
            said_by: said_by.clone(),
            time_ns: 8,
        };
        let all: Vec<Decision> = decided.iter().map(decision).collect();
        let mut journal: Vec<Vec<u8>> = all.iter().map(|of| recorded(ann, of)).collect();
        journal.insert(1, recorded(bob, &all[2]));
        assert_eq!(decisions(ann, &journal).expect("as written"), all, "all that was said");
        assert_eq!(decisions(bob, &journal).expect("as written"), all[2..], "another session's");
    }
}
