//! Merges in JSON.

use meetpoint_proto::v1;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::geometry::Pose;
use super::integer::{Signed64, Unsigned64};

/// Where a session of unknown start may lie.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Merge {
    /// A UUID, the same whenever the session is looked at.
    #[schema(example = "0199d3a6-6ac5-8c4e-9d51-2d9a3f1f3c11")]
    id: String,
    /// Id of the map.
    map: String,
    /// Id of the session that is to be placed. Sessions that were put into its frame go with it.
    session: String,
    verdict: MergeVerdict,
    /// Why, for people.
    reasons: Vec<String>,
    /// Where it may lie, best first.
    alignments: Vec<MergeAlignment>,
    state: MergeState,
    /// Who decided the state, and why; absent while it is open.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    decision: Option<MergeDecision>,
    /// Id of the merge job that found the alignments.
    job: String,
    /// The map version that it looked at.
    map_version: Unsigned64,
    /// When it was looked at, by the service's clock, nanoseconds since 1970.
    update_time_ns: Signed64,
}

/// What the evidence says of a session's place.
#[derive(Clone, Copy, Debug, Serialize, ToSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub(crate) enum MergeVerdict {
    /// Not told by the service of that version.
    Unspecified,
    /// The first alignment is beyond doubt: a rule may accept it.
    Merged,
    /// The first alignment is likely; a person has to look at it.
    Proposed,
    /// It fits several places nearly as well: the first alignment and its rivals.
    Ambiguous,
    /// What the session saw is not on the map.
    NoOverlap,
    /// The session, or the map, has not seen enough yet to tell.
    NotEnoughSeen,
}

/// What was decided about a merge.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub(crate) enum MergeState {
    /// Not told by the service of that version; not taken in requests.
    Unspecified,
    /// Nothing yet: a rule or a person may.
    Open,
    /// The session lies where an alignment says.
    Accepted,
    /// The session stays in its own frame. Rules leave it alone, people may accept it.
    Rejected,
    /// It was accepted, and taken back. Rules leave it alone, people may accept it.
    Undone,
}

/// A place where a session may lie, and what speaks for it.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct MergeAlignment {
    /// A UUID, made of the session and the place.
    #[schema(example = "0199d3a6-6ac5-8c4e-9d51-2d9a3f1f3c11")]
    id: String,
    /// The session in whose frame it would lie; absent for the map's frame.
    #[serde(skip_serializing_if = "String::is_empty")]
    #[schema(required = false)]
    onto_session: String,
    /// The session's frame seen from there.
    onto_from_session: Pose,
    /// How far off that may be, in the frame that it lies in: xx, xy, x theta, yy, y theta, theta theta, in
    /// square metres, metre radians and square radians.
    covariance: Vec<f64>,
    /// Logarithm of the odds against the two lying nowhere on one another.
    score: f64,
    /// What both observed, in square metres.
    overlap_m2: f64,
    /// The same as a share of what the one observed that observed less; 0 where landmarks alone tell.
    #[schema(minimum = 0, maximum = 1, example = 0.4)]
    overlap_share: f64,
    /// Share of the walls, or landmarks, that both observed which agree.
    #[schema(minimum = 0, maximum = 1, example = 0.9)]
    agreement: f64,
    /// Share of the walls of either, where the other looked, that lie in what is free there; of landmarks, of
    /// those that the other did not see where it should have.
    #[schema(minimum = 0, maximum = 1, example = 0.02)]
    contradiction: f64,
    /// Logarithm of the odds against the likeliest other place; absent if there is none. Of landmarks, against
    /// all else.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    margin: Option<f64>,
    /// Landmarks of both that are the same; where walls tell, of those that have names.
    landmarks_matched: u32,
    /// Landmarks of either that the other should have seen and did not; where walls tell, names that both have
    /// and that lie elsewhere.
    landmarks_contradicted: u32,
}

/// A decision about a merge.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct MergeDecision {
    /// Id of the alignment that was accepted; absent if none was.
    #[serde(skip_serializing_if = "String::is_empty")]
    #[schema(required = false)]
    alignment: String,
    /// Whether a rule decided; else a person.
    by_rule: bool,
    /// Who said so, for people.
    author: String,
    /// Why, for people; of a rule, by which figures.
    reason: String,
    /// By the service's clock, nanoseconds since 1970.
    time_ns: Signed64,
}

impl From<v1::MergeVerdict> for MergeVerdict {
    fn from(wire: v1::MergeVerdict) -> Self {
        match wire {
            v1::MergeVerdict::Unspecified => Self::Unspecified,
            v1::MergeVerdict::Merged => Self::Merged,
            v1::MergeVerdict::Proposed => Self::Proposed,
            v1::MergeVerdict::Ambiguous => Self::Ambiguous,
            v1::MergeVerdict::NoOverlap => Self::NoOverlap,
            v1::MergeVerdict::NotEnoughSeen => Self::NotEnoughSeen,
        }
    }
}

/// A verdict by its number.
pub(super) fn verdict(wire: i32) -> MergeVerdict {
    v1::MergeVerdict::try_from(wire).unwrap_or_default().into()
}

impl From<v1::MergeState> for MergeState {
    fn from(wire: v1::MergeState) -> Self {
        match wire {
            v1::MergeState::Unspecified => Self::Unspecified,
            v1::MergeState::Open => Self::Open,
            v1::MergeState::Accepted => Self::Accepted,
            v1::MergeState::Rejected => Self::Rejected,
            v1::MergeState::Undone => Self::Undone,
        }
    }
}

impl From<MergeState> for v1::MergeState {
    fn from(state: MergeState) -> Self {
        match state {
            MergeState::Unspecified => Self::Unspecified,
            MergeState::Open => Self::Open,
            MergeState::Accepted => Self::Accepted,
            MergeState::Rejected => Self::Rejected,
            MergeState::Undone => Self::Undone,
        }
    }
}

impl From<v1::Merge> for Merge {
    fn from(wire: v1::Merge) -> Self {
        let v1::Merge {
            id,
            map,
            session,
            verdict: said,
            reasons,
            alignments,
            state,
            decision,
            job,
            map_version,
            update_time_ns,
        } = wire;
        Self {
            id,
            map,
            session,
            verdict: verdict(said),
            reasons,
            alignments: alignments.into_iter().map(MergeAlignment::from).collect(),
            state: v1::MergeState::try_from(state).unwrap_or_default().into(),
            decision: decision.map(MergeDecision::from),
            job,
            map_version: Unsigned64(map_version),
            update_time_ns: Signed64(update_time_ns),
        }
    }
}

impl From<v1::MergeAlignment> for MergeAlignment {
    fn from(wire: v1::MergeAlignment) -> Self {
        let v1::MergeAlignment {
            id,
            onto_session,
            onto_from_session,
            covariance,
            score,
            overlap_m2,
            overlap_share,
            agreement,
            contradiction,
            margin,
            landmarks_matched,
            landmarks_contradicted,
        } = wire;
        Self {
            id,
            onto_session,
            onto_from_session: onto_from_session.unwrap_or_default().into(),
            covariance,
            score,
            overlap_m2,
            overlap_share,
            agreement,
            contradiction,
            margin,
            landmarks_matched,
            landmarks_contradicted,
        }
    }
}

impl From<v1::MergeDecision> for MergeDecision {
    fn from(wire: v1::MergeDecision) -> Self {
        let v1::MergeDecision { alignment, by_rule, author, reason, time_ns } = wire;
        Self { alignment, by_rule, author, reason, time_ns: Signed64(time_ns) }
    }
}
