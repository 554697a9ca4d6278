//! Merges: from what was found to the wire, into records and out of them.

use meetpoint_geometry::Pose;
use meetpoint_merging as merging;
use meetpoint_proto::v1;
use meetpoint_relaxation::LandmarkAlignment;
use meetpoint_storage::{MergeId, MergeRecord, MergeState, SessionId};
use prost::Message;
use uuid::{Builder, Uuid};

use super::{pose, slug};
use crate::error::Error;

/// Characters of why something was decided and of who said so.
const TEXT_LEN_MAX: usize = 200;

/// The same id whenever a session is looked at.
pub(crate) fn id_of(session: SessionId) -> MergeId {
    MergeId(made_id(&[b"merge", session.0.as_bytes()]))
}

/// The same id for the same place of a session.
fn alignment_id(session: SessionId, onto: Option<SessionId>, at: Pose) -> Uuid {
    let onto = onto.map(|onto| *onto.0.as_bytes()).unwrap_or_default();
    let [x_m, y_m, theta_rad] = pose::to_record(at).map(f64::to_le_bytes);
    made_id(&[b"alignment", session.0.as_bytes(), &onto, &x_m, &y_m, &theta_rad])
}

/// An id that is made of what it names.
fn made_id(of: &[&[u8]]) -> Uuid {
    let mut hash = blake3::Hasher::new();
    for part in of {
        hash.update(part);
    }
    let mut id = [0; 16];
    id.copy_from_slice(&hash.finalize().as_bytes()[..16]);
    Builder::from_custom_bytes(id).into_uuid()
}

/// A merge's id.
pub(crate) fn id(text: &str) -> Result<MergeId, Error> {
    Uuid::parse_str(text).map(MergeId).map_err(|_| Error::field("merge", "not a UUID"))
}

/// Texts for people that come with a decision.
pub(crate) fn said([reason, author]: [&str; 2]) -> Result<[String; 2], Error> {
    Ok([slug::text("reason", reason, TEXT_LEN_MAX)?, slug::text("author", author, TEXT_LEN_MAX)?])
}

/// A place of a session, as a search found it.
pub(crate) fn alignment(
    session: SessionId,
    onto: Option<SessionId>,
    found: &merging::Alignment,
) -> v1::MergeAlignment {
    let merging::Alignment {
        site_from_newcomer,
        covariance: [[xx, xy, xt], [_, yy, yt], [_, _, tt]],
        log_odds,
        margin,
        overlap_m2,
        overlap_share,
        agreement,
        contradiction,
        n_named,
        n_named_agreeing,
        n_nameless_agreeing,
        n_nameless_alone,
    } = found;
    let n_contradicted = n_named.saturating_sub(*n_named_agreeing) + n_nameless_alone;
    v1::MergeAlignment {
        id: alignment_id(session, onto, *site_from_newcomer).to_string(),
        onto_session: onto.map(|onto| onto.0.to_string()).unwrap_or_default(),
        onto_from_session: Some(pose::to_wire(*site_from_newcomer)),
        covariance: vec![*xx, *xy, *xt, *yy, *yt, *tt],
        score: *log_odds,
        overlap_m2: *overlap_m2,
        overlap_share: *overlap_share,
        agreement: *agreement,
        contradiction: *contradiction,
        margin: *margin,
        landmarks_matched: count(n_named_agreeing + n_nameless_agreeing),
        landmarks_contradicted: count(n_contradicted),
    }
}

/// A place of a session, as its landmarks say.
pub(crate) fn landmark_alignment(
    session: SessionId,
    onto: Option<SessionId>,
    found: &LandmarkAlignment,
) -> v1::MergeAlignment {
    let LandmarkAlignment {
        site_from_other,
        covariance,
        log_evidence,
        log_odds,
        n_matched,
        n_contradicted,
        overlap_m2,
        matches: _,
    } = found;
    let of = |row: usize, column: usize| covariance[(row, column)];
    let (matched, contradicted) = (*n_matched as f64, *n_contradicted as f64);
    let n_looked_for = (matched + contradicted).max(1.0);
    v1::MergeAlignment {
        id: alignment_id(session, onto, *site_from_other).to_string(),
        onto_session: onto.map(|onto| onto.0.to_string()).unwrap_or_default(),
        onto_from_session: Some(pose::to_wire(*site_from_other)),
        covariance: vec![of(0, 0), of(0, 1), of(0, 2), of(1, 1), of(1, 2), of(2, 2)],
        score: *log_evidence,
        overlap_m2: *overlap_m2,
        overlap_share: 0.0,
        agreement: matched / n_looked_for,
        contradiction: contradicted / n_looked_for,
        margin: Some(*log_odds),
        landmarks_matched: count(*n_matched),
        landmarks_contradicted: count(*n_contradicted),
    }
}

fn count(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}

/// The place of a session whose frame becomes that of an empty map.
pub(crate) fn founding(session: SessionId) -> v1::MergeAlignment {
    v1::MergeAlignment {
        id: alignment_id(session, None, Pose::IDENTITY).to_string(),
        onto_from_session: Some(pose::to_wire(Pose::IDENTITY)),
        covariance: vec![0.0; 6],
        ..v1::MergeAlignment::default()
    }
}

/// What a search says of a session.
pub(crate) fn verdict(verdict: merging::Verdict) -> v1::MergeVerdict {
    match verdict {
        merging::Verdict::Merged => v1::MergeVerdict::Merged,
        merging::Verdict::Proposed => v1::MergeVerdict::Proposed,
        merging::Verdict::Ambiguous => v1::MergeVerdict::Ambiguous,
        merging::Verdict::NoOverlap => v1::MergeVerdict::NoOverlap,
        merging::Verdict::NotEnoughSeen => v1::MergeVerdict::NotEnoughSeen,
    }
}

/// Where an alignment puts a session: the session in whose frame (`None` for the map's), and its own frame
/// seen from there.
///
/// # Errors
/// [`Error::Internal`] for one that no search has made.
pub(crate) fn place(alignment: &v1::MergeAlignment) -> Result<(Option<SessionId>, Pose), Error> {
    let onto = match alignment.onto_session.as_str() {
        "" => None,
        text => Some(SessionId(Uuid::parse_str(text).map_err(Error::internal)?)),
    };
    let at = alignment.onto_from_session.ok_or_else(|| Error::internal("a place without pose"))?;
    Ok((onto, pose::pose("onto_from_session", at)?))
}

/// What was found of a session, out of its record.
///
/// # Errors
/// [`Error::Internal`] for bytes that are no merge.
pub(crate) fn to_wire(record: &MergeRecord) -> Result<v1::Merge, Error> {
    let found = v1::Merge::decode(record.payload.as_slice()).map_err(Error::internal)?;
    let decision = record.decision.as_deref().map(v1::MergeDecision::decode);
    Ok(v1::Merge {
        id: record.id.0.to_string(),
        map: record.map.0.clone(),
        session: record.session.0.to_string(),
        state: state_to_wire(record.state).into(),
        decision: decision.transpose().map_err(Error::internal)?,
        job: record.job.0.to_string(),
        ..found
    })
}

fn state_to_wire(state: MergeState) -> v1::MergeState {
    match state {
        MergeState::Open => v1::MergeState::Open,
        MergeState::Accepted => v1::MergeState::Accepted,
        MergeState::Rejected => v1::MergeState::Rejected,
        MergeState::Undone => v1::MergeState::Undone,
    }
}

/// Which merges are asked for, by what was decided about them.
pub(crate) fn state(wire: i32) -> Result<Option<MergeState>, Error> {
    match v1::MergeState::try_from(wire) {
        Ok(v1::MergeState::Unspecified) => Ok(None),
        Ok(v1::MergeState::Open) => Ok(Some(MergeState::Open)),
        Ok(v1::MergeState::Accepted) => Ok(Some(MergeState::Accepted)),
        Ok(v1::MergeState::Rejected) => Ok(Some(MergeState::Rejected)),
        Ok(v1::MergeState::Undone) => Ok(Some(MergeState::Undone)),
        Err(_) => Err(Error::field("state", format!("{wire} is none of its values"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_alignment_says_where_a_session_lies() {
        let (session, onto) = (SessionId(Uuid::from_u128(1)), SessionId(Uuid::from_u128(2)));
        let found = merging::Alignment {
            site_from_newcomer: Pose::new(1.0, 2.0, 0.5),
            covariance: [[1.0, 2.0, 3.0], [2.0, 4.0, 5.0], [3.0, 5.0, 6.0]],
            log_odds: 40.0,
            margin: Some(9.0),
            overlap_m2: 50.0,
            overlap_share: 0.5,
            agreement: 0.9,
            contradiction: 0.01,
            n_named: 5,
            n_named_agreeing: 4,
            n_nameless_agreeing: 3,
            n_nameless_alone: 2,
        };
        let wire = alignment(session, Some(onto), &found);
        assert_eq!(wire.covariance, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0], "the upper half");
        assert_eq!((wire.landmarks_matched, wire.landmarks_contradicted), (7, 3), "of all");
        let at = place(&wire).expect("just made");
        assert_eq!(at, (Some(onto), found.site_from_newcomer), "where it was found");
        let again = alignment(session, Some(onto), &merging::Alignment { log_odds: 1.0, ..found });
        assert_eq!(again.id, wire.id, "the same place");
        let founding = founding(session);
        assert_eq!(place(&founding).expect("just made"), (None, Pose::IDENTITY), "the map itself");
        assert_ne!(founding.id, wire.id, "another place");
    }
}
