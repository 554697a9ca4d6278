//! How merge jobs are asked for, and what comes of them, in JSON.

use meetpoint_proto::v1;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::merge_parts::{MergeVerdict, verdict};

/// How a merge job is to be done.
#[derive(Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct MergeParams {
    /// Only these sessions, all of unknown start. Absent or empty for all of the map that are not placed.
    #[serde(default)]
    sessions: Vec<String>,
    /// Looks for nothing, but draws the map by what was decided about merges.
    #[serde(default)]
    draw_only: bool,
    /// Where the map is empty: takes the frame of the oldest session as the map's, even if no other session
    /// lies on it.
    #[serde(default)]
    found_map: bool,
}

impl From<v1::MergeParams> for MergeParams {
    fn from(wire: v1::MergeParams) -> Self {
        let v1::MergeParams { sessions, draw_only, found_map } = wire;
        Self { sessions, draw_only, found_map }
    }
}

impl From<MergeParams> for v1::MergeParams {
    fn from(params: MergeParams) -> Self {
        let MergeParams { sessions, draw_only, found_map } = params;
        Self { sessions, draw_only, found_map }
    }
}

/// What came of a merge job.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct MergeResult {
    /// In the order in which the sessions were opened.
    sessions: Vec<MergedSession>,
}

/// What came of one session.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct MergedSession {
    /// Id of the session.
    session: String,
    /// Id of its merge.
    merge: String,
    verdict: MergeVerdict,
    /// Whether a rule accepted the first alignment.
    accepted: bool,
}

impl From<v1::MergeResult> for MergeResult {
    fn from(wire: v1::MergeResult) -> Self {
        let v1::MergeResult { sessions } = wire;
        Self { sessions: sessions.into_iter().map(MergedSession::from).collect() }
    }
}

impl From<v1::MergedSession> for MergedSession {
    fn from(wire: v1::MergedSession) -> Self {
        let v1::MergedSession { session, merge, verdict: said, accepted } = wire;
        Self { session, merge, verdict: verdict(said), accepted }
    }
}
