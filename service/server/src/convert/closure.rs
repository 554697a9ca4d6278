//! Closures: from tracking to the wire, into records and out of them.

use meetpoint_geometry::{Point2, Pose};
use meetpoint_proto::v1;
use meetpoint_storage::{ClosureEnds, ClosureId, ClosureRecord, NewClosure, SessionId};
use meetpoint_tracking as tracking;
use prost::Message;
use tracking::{ClosureKey, ClosureMoment, Refusal, Sharpness, Verdict};
use uuid::{Builder, Uuid};

use super::{pose, slug};
use crate::error::Error;

/// Characters of why something was decided and of who said so.
const TEXT_LEN_MAX: usize = 200;

/// A closure that a job considered in some sessions. `map_from_robot_at` says where the robot of one was.
/// `None` for a moment of none of them.
pub(crate) fn found(
    sessions: &[SessionId],
    closure: &tracking::Closure,
    map_from_robot_at: impl Fn(ClosureMoment) -> Option<Pose>,
) -> Option<v1::Closure> {
    let tracking::Closure {
        key,
        from_to,
        covariance: [[xx, xy, xt], [_, yy, yt], [_, _, tt]],
        score,
        alternatives,
        residual_m,
        residual_rad,
        chi2,
        verdict,
    } = closure;
    let (verdict, refusal) = verdict_to_wire(*verdict);
    let position = |moment| map_from_robot_at(moment).map(|pose| point(pose.position()));
    let ends = ClosureEnds {
        from_session: *sessions.get(key.from.travel)?,
        from_ns: key.from.stamp_ns,
        to_session: *sessions.get(key.to.travel)?,
        to_ns: key.to.stamp_ns,
    };
    Some(v1::Closure {
        id: id_of(&ends).0.to_string(),
        from_session: ends.from_session.0.to_string(),
        from_time_ns: ends.from_ns,
        to_session: ends.to_session.0.to_string(),
        to_time_ns: ends.to_ns,
        from_to: Some(pose::to_wire(*from_to)),
        covariance: vec![*xx, *xy, *xt, *yy, *yt, *tt],
        score: *score,
        residual_m: *residual_m,
        residual_rad: *residual_rad,
        chi2: *chi2,
        verdict: verdict.into(),
        refusal: refusal.into(),
        alternatives: alternatives.iter().map(alternative).collect(),
        from_position: position(key.from),
        to_position: position(key.to),
        ..v1::Closure::default()
    })
}

/// A closure of the ledger as a job judged it, by the places of its sessions; `None` if one of them is not
/// among these, or it cannot be read.
pub(crate) fn known(sessions: &[SessionId], record: &ClosureRecord) -> Option<tracking::Closure> {
    let [key] = keys_among(sessions, &[record.ends])[..] else { return None };
    let wire = v1::Closure::decode(record.payload.as_slice()).ok()?;
    let [xx, xy, xt, yy, yt, tt] = wire.covariance[..] else { return None };
    let alternative = |other: &v1::ClosureAlternative| {
        Some((pose::pose("from_to", other.from_to?).ok()?, other.score))
    };
    Some(tracking::Closure {
        key,
        from_to: pose::pose("from_to", wire.from_to?).ok()?,
        covariance: [[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]],
        score: wire.score,
        alternatives: wire.alternatives.iter().filter_map(alternative).collect(),
        residual_m: wire.residual_m,
        residual_rad: wire.residual_rad,
        chi2: wire.chi2,
        verdict: verdict_from_wire(wire.refusal),
    })
}

/// The closures among `ends` whose two moments are of some sessions, by the places of these.
pub(crate) fn keys_among(sessions: &[SessionId], ends: &[ClosureEnds]) -> Vec<ClosureKey> {
    let place = |session| sessions.iter().position(|&other| other == session);
    let key = |ends: &ClosureEnds| {
        let ClosureEnds { from_session, from_ns, to_session, to_ns } = *ends;
        let from = ClosureMoment { travel: place(from_session)?, stamp_ns: from_ns };
        let to = ClosureMoment { travel: place(to_session)?, stamp_ns: to_ns };
        Some(ClosureKey { from, to })
    };
    ends.iter().filter_map(key).collect()
}

fn alternative((from_to, score): &(Pose, f64)) -> v1::ClosureAlternative {
    v1::ClosureAlternative { from_to: Some(pose::to_wire(*from_to)), score: *score }
}

fn point(at: Point2<f64>) -> v1::Point {
    v1::Point { x_m: at.x, y_m: at.y }
}

fn verdict_to_wire(verdict: Verdict) -> (v1::ClosureVerdict, v1::ClosureRefusal) {
    let refusal = match verdict {
        Verdict::Accepted => {
            return (v1::ClosureVerdict::Accepted, v1::ClosureRefusal::Unspecified);
        }
        Verdict::Refused(Refusal::SwitchedOff) => v1::ClosureRefusal::SwitchedOff,
        Verdict::Refused(Refusal::Ambiguous) => v1::ClosureRefusal::Ambiguous,
        Verdict::Refused(Refusal::FewScansAgree) => v1::ClosureRefusal::FewScansAgree,
        Verdict::Refused(Refusal::Contradicted) => v1::ClosureRefusal::Contradicted,
        Verdict::Refused(Refusal::Unsupported) => v1::ClosureRefusal::Unsupported,
        Verdict::Refused(Refusal::Inconsistent) => v1::ClosureRefusal::Inconsistent,
    };
    (v1::ClosureVerdict::Refused, refusal)
}

/// By why it was refused; accepted if there is no reason.
fn verdict_from_wire(refusal: i32) -> Verdict {
    let refusal = match v1::ClosureRefusal::try_from(refusal).unwrap_or_default() {
        v1::ClosureRefusal::Unspecified => return Verdict::Accepted,
        v1::ClosureRefusal::SwitchedOff => Refusal::SwitchedOff,
        v1::ClosureRefusal::Ambiguous => Refusal::Ambiguous,
        v1::ClosureRefusal::FewScansAgree => Refusal::FewScansAgree,
        v1::ClosureRefusal::Contradicted => Refusal::Contradicted,
        v1::ClosureRefusal::Unsupported => Refusal::Unsupported,
        v1::ClosureRefusal::Inconsistent => Refusal::Inconsistent,
    };
    Verdict::Refused(refusal)
}

/// The same id for the same moments.
fn id_of(ends: &ClosureEnds) -> ClosureId {
    let ClosureEnds { from_session, from_ns, to_session, to_ns } = ends;
    let mut hash = blake3::Hasher::new();
    hash.update(b"closure").update(from_session.0.as_bytes());
    for stamp_ns in [from_ns, to_ns] {
        hash.update(&stamp_ns.to_le_bytes());
    }
    // Closures within a session keep the ids that they had when there were no others.
    if from_session != to_session {
        hash.update(to_session.0.as_bytes());
    }
    let mut id = [0; 16];
    id.copy_from_slice(&hash.finalize().as_bytes()[..16]);
    ClosureId(Builder::from_custom_bytes(id).into_uuid())
}

/// A closure for a record, without what the record knows beside it.
///
/// # Errors
/// [`Error::Internal`] for an id that is none.
pub(crate) fn to_record(closure: &v1::Closure) -> Result<NewClosure, Error> {
    let id = |text: &str| Uuid::parse_str(text).map_err(Error::internal);
    Ok(NewClosure {
        id: ClosureId(id(&closure.id)?),
        ends: ClosureEnds {
            from_session: SessionId(id(&closure.from_session)?),
            from_ns: closure.from_time_ns,
            to_session: SessionId(id(&closure.to_session)?),
            to_ns: closure.to_time_ns,
        },
        is_accepted: closure.verdict == i32::from(v1::ClosureVerdict::Accepted),
        payload: closure.encode_to_vec(),
    })
}

/// A closure of a map out of its record.
///
/// # Errors
/// [`Error::Internal`] for bytes that are no closure.
pub(crate) fn to_wire(map: &str, record: &ClosureRecord) -> Result<v1::Closure, Error> {
    let closure = v1::Closure::decode(record.payload.as_slice()).map_err(Error::internal)?;
    let was_off = closure.refusal == i32::from(v1::ClosureRefusal::SwitchedOff);
    let relax_needed = if record.is_off { record.is_accepted } else { was_off };
    Ok(v1::Closure {
        // What was kept before there were closures between sessions names one only.
        to_session: record.ends.to_session.0.to_string(),
        map: map.to_owned(),
        job: record.job.0.to_string(),
        switched_off: record.is_off,
        relax_needed,
        ..closure
    })
}

/// A closure's id.
pub(crate) fn id(text: &str) -> Result<ClosureId, Error> {
    Uuid::parse_str(text).map(ClosureId).map_err(|_| Error::field("closure", "not a UUID"))
}

/// Which verdict is asked for: accepted, refused, or either.
pub(crate) fn verdict(wire: i32) -> Result<Option<bool>, Error> {
    match v1::ClosureVerdict::try_from(wire) {
        Ok(v1::ClosureVerdict::Unspecified) => Ok(None),
        Ok(v1::ClosureVerdict::Accepted) => Ok(Some(true)),
        Ok(v1::ClosureVerdict::Refused) => Ok(Some(false)),
        Err(_) => Err(Error::field("verdict", format!("{wire} is none of its values"))),
    }
}

/// What a person decides about a closure, as the journal keeps it. Field numbers are kept for ever.
#[derive(Clone, PartialEq, Message)]
struct Decided {
    #[prost(bytes = "vec", tag = "1")]
    closure: Vec<u8>,
    #[prost(bool, tag = "2")]
    is_off: bool,
    #[prost(string, tag = "3")]
    reason: String,
    #[prost(string, tag = "4")]
    author: String,
}

/// A decision for the journal.
///
/// # Errors
/// [`Error::InvalidField`] for texts that are too long.
pub(crate) fn decision(
    closure: ClosureId,
    is_off: bool,
    [reason, author]: [&str; 2],
) -> Result<Vec<u8>, Error> {
    let closure = closure.0.as_bytes().to_vec();
    let reason = slug::text("reason", reason, TEXT_LEN_MAX)?;
    let author = slug::text("author", author, TEXT_LEN_MAX)?;
    Ok(Decided { closure, is_off, reason, author }.encode_to_vec())
}

/// How sharp a grid is.
pub(crate) fn sharpness(sharpness: Sharpness) -> v1::GridSharpness {
    v1::GridSharpness {
        cells: sharpness.n_cells,
        entropy_bits: sharpness.entropy_bits,
        entropy_mean_bits: sharpness.mean_bits(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use meetpoint_storage::JobId;

    fn closure(verdict: Verdict) -> v1::Closure {
        let closure = tracking::Closure {
            key: ClosureKey { from: moment(0, 5), to: moment(1, 9) },
            from_to: Pose::new(1.0, 2.0, 0.5),
            covariance: [[1.0, 2.0, 3.0], [2.0, 4.0, 5.0], [3.0, 5.0, 6.0]],
            score: 0.75,
            alternatives: vec![(Pose::IDENTITY, 0.5)],
            residual_m: 0.01,
            residual_rad: 0.02,
            chi2: 3.0,
            verdict,
        };
        let sessions = [7, 8].map(|id| SessionId(Uuid::from_u128(id)));
        found(&sessions, &closure, |at| Some(Pose::new(at.stamp_ns as f64, 0.0, 0.0)))
            .expect("of these sessions")
    }

    fn moment(travel: usize, stamp_ns: i64) -> ClosureMoment {
        ClosureMoment { travel, stamp_ns }
    }

    fn kept(closure: &v1::Closure, is_off: bool) -> v1::Closure {
        let NewClosure { id, ends, is_accepted, payload } =
            to_record(closure).expect("it has an id");
        let (position, job) = (1, JobId(Uuid::from_u128(3)));
        let record = ClosureRecord { position, id, ends, job, is_accepted, is_off, payload };
        to_wire("hall", &record).expect("just written")
    }

    /// The record that was made of a closure within a session, when there were no others.
    fn old_record(closure: &v1::Closure) -> ClosureRecord {
        let from_session = SessionId(Uuid::from_u128(7));
        let ends = ClosureEnds { from_session, from_ns: 5, to_session: from_session, to_ns: 9 };
        let (id, job) = (ClosureId(Uuid::from_u128(1)), JobId(Uuid::from_u128(3)));
        let payload = closure.encode_to_vec();
        ClosureRecord { position: 1, id, ends, job, is_accepted: true, is_off: false, payload }
    }

    #[test]
    fn closures_are_known_by_their_sessions() {
        let [a, b, c] = [7, 8, 9].map(|id| SessionId(Uuid::from_u128(id)));
        let ends = |from_session, to_session| ClosureEnds {
            from_session,
            from_ns: 1,
            to_session,
            to_ns: 2,
        };
        let keys = keys_among(&[b, a], &[ends(a, b), ends(a, c), ends(b, b)]);
        let expected = [
            ClosureKey { from: moment(1, 1), to: moment(0, 2) },
            ClosureKey { from: moment(0, 1), to: moment(0, 2) },
        ];
        assert_eq!(keys, expected, "but none with another");
        assert_ne!(id_of(&ends(a, b)), id_of(&ends(a, a)), "another moment");
        assert_ne!(id_of(&ends(a, b)), id_of(&ends(b, a)), "of another robot");
    }

    #[test]
    fn what_is_kept_is_told_with_what_people_decided() {
        let accepted = closure(Verdict::Accepted);
        assert_eq!(accepted.covariance, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0], "the upper half");
        assert_eq!(accepted.to_position, Some(v1::Point { x_m: 9.0, y_m: 0.0 }), "where it was");
        let (first, second) = (Uuid::from_u128(7).to_string(), Uuid::from_u128(8).to_string());
        assert_eq!((&accepted.from_session, &accepted.to_session), (&first, &second), "whose");
        let within = v1::Closure { to_session: String::new(), ..accepted.clone() };
        let read = to_wire("hall", &old_record(&within)).expect("just written");
        assert_eq!(read.to_session, first, "kept before there were two");
        let on = kept(&accepted, false);
        assert_eq!(
            (on.switched_off, on.relax_needed, on.map.as_str()),
            (false, false, "hall"),
            "on"
        );
        let off = kept(&accepted, true);
        assert!(off.switched_off && off.relax_needed, "the map rests on it");
        let honoured = closure(Verdict::Refused(Refusal::SwitchedOff));
        assert_eq!(honoured.id, accepted.id, "the same moments");
        assert!(!kept(&honoured, true).relax_needed, "the map was drawn without it");
        assert!(kept(&honoured, false).relax_needed, "it was switched on since");
        let doubtful = closure(Verdict::Refused(Refusal::Ambiguous));
        assert!(!kept(&doubtful, true).relax_needed, "the map did not rest on it");
    }
}
