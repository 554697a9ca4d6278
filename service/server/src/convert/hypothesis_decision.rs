//! What people decide about maps of places, as the journal keeps it.

use meetpoint_places::Sighting;
use meetpoint_storage::SessionId;
use prost::Message;
use uuid::Uuid;

use crate::error::Error;
use crate::hypotheses::Assertion;

/// A decision. Field numbers are kept for ever.
#[derive(Clone, PartialEq, Message)]
struct Decided {
    #[prost(bytes = "vec", tag = "1")]
    session: Vec<u8>,
    #[prost(string, tag = "2")]
    hypothesis: String,
    /// Whether what was said of that hypothesis is taken back.
    #[prost(bool, tag = "3")]
    is_undone: bool,
    /// What the map says of every visit: the earliest one to the same place, and the gateway of
    /// arrival as counted from that visit's.
    #[prost(uint32, repeated, tag = "4")]
    first_visits: Vec<u32>,
    #[prost(uint32, repeated, tag = "5")]
    gateways: Vec<u32>,
    #[prost(string, tag = "6")]
    reason: String,
    #[prost(string, tag = "7")]
    author: String,
    #[prost(int64, tag = "8")]
    time_ns: i64,
}

/// That somebody says that a map is true, for the journal.
///
/// # Errors
/// [`Error::Internal`] for a travel of more visits than fit.
pub(crate) fn asserted(session: SessionId, said: &Assertion) -> Result<Vec<u8>, Error> {
    let Assertion { hypothesis, sightings, reason, author, time_ns } = said;
    let first_visits = sightings.iter().map(|sighting| u32::try_from(sighting.first_visit));
    let decided = Decided {
        session: session.0.as_bytes().to_vec(),
        hypothesis: hypothesis.clone(),
        is_undone: false,
        first_visits: first_visits.collect::<Result<_, _>>().map_err(Error::internal)?,
        gateways: sightings.iter().map(|sighting| u32::from(sighting.gateway)).collect(),
        reason: reason.clone(),
        author: author.clone(),
        time_ns: *time_ns,
    };
    Ok(decided.encode_to_vec())
}

/// That somebody takes back what was said of a map, for the journal.
pub(crate) fn undone(
    session: SessionId,
    hypothesis: &str,
    [reason, author]: [String; 2],
    time_ns: i64,
) -> Vec<u8> {
    let decided = Decided {
        session: session.0.as_bytes().to_vec(),
        hypothesis: hypothesis.to_owned(),
        is_undone: true,
        first_visits: Vec::new(),
        gateways: Vec::new(),
        reason,
        author,
        time_ns,
    };
    decided.encode_to_vec()
}

/// What was said of maps of places and is not taken back.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Said {
    /// Of this session's, in the order of saying.
    pub(crate) in_force: Vec<Assertion>,
    /// Ids of those that were taken back, and not said again.
    pub(crate) undone: Vec<String>,
}

/// What all decisions of the journal come to for one session.
///
/// # Errors
/// [`Error::Internal`] if the journal holds what was never written.
pub(crate) fn said(session: SessionId, payloads: &[Vec<u8>]) -> Result<Said, Error> {
    let mut said = Said::default();
    for payload in payloads {
        let decided = Decided::decode(payload.as_slice()).map_err(Error::internal)?;
        if Uuid::from_slice(&decided.session).map_err(Error::internal)? != session.0 {
            continue;
        }
        let hypothesis = &decided.hypothesis;
        said.in_force.retain(|known| known.hypothesis != *hypothesis);
        said.undone.retain(|known| known != hypothesis);
        if decided.is_undone {
            said.undone.push(hypothesis.clone());
        } else {
            said.in_force.push(assertion(decided)?);
        }
    }
    Ok(said)
}

fn assertion(decided: Decided) -> Result<Assertion, Error> {
    let Decided { hypothesis, first_visits, gateways, reason, author, time_ns, .. } = decided;
    let sighting = |(first_visit, gateway): (u32, u32)| {
        let gateway = u8::try_from(gateway).map_err(Error::internal)?;
        Ok(Sighting { first_visit: first_visit as usize, gateway })
    };
    let sightings = first_visits.into_iter().zip(gateways).map(sighting);
    let sightings = sightings.collect::<Result<Vec<_>, Error>>()?;
    Ok(Assertion { hypothesis, sightings, reason, author, time_ns })
}

#[cfg(test)]
mod tests {
    use super::*;

    const ANN: SessionId = SessionId(Uuid::from_u128(1));
    const BOB: SessionId = SessionId(Uuid::from_u128(2));

    fn assertion_of(hypothesis: &str) -> Assertion {
        Assertion {
            hypothesis: hypothesis.to_owned(),
            sightings: vec![
                Sighting { first_visit: 0, gateway: 0 },
                Sighting { first_visit: 1, gateway: 0 },
                Sighting { first_visit: 0, gateway: 3 },
            ],
            reason: "seen".to_owned(),
            author: "anna".to_owned(),
            time_ns: 7,
        }
    }

    fn taken_back(session: SessionId, hypothesis: &str) -> Vec<u8> {
        undone(session, hypothesis, ["mistaken".to_owned(), "anna".to_owned()], 8)
    }

    #[test]
    fn what_was_said_and_not_taken_back_holds() {
        let asserted = |session, hypothesis: &str| {
            asserted(session, &assertion_of(hypothesis)).expect("a short travel")
        };
        let journal = [
            asserted(ANN, "a"),
            asserted(BOB, "b"),
            asserted(ANN, "c"),
            taken_back(ANN, "a"),
            taken_back(ANN, "c"),
            asserted(ANN, "c"),
        ];
        let of_ann = said(ANN, &journal).expect("as it was written");
        assert_eq!(of_ann.in_force, [assertion_of("c")], "said again, with all that was said");
        assert_eq!(of_ann.undone, ["a"], "and this was taken back");
        let of_bob = said(BOB, &journal).expect("as it was written");
        assert_eq!(of_bob.in_force, [assertion_of("b")], "another session's");
    }
}
