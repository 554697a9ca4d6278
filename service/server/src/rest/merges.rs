//! `/v1/merges`: where sessions of unknown start lie, and what is decided about it.

use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use meetpoint_proto::v1;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::Rest;
use super::merge_parts::{Merge, MergeState};
use super::openapi::{ChangeProblems, ListProblems, ReadProblems};
use super::problem::Refusal;
use super::reply::{filled, ok};
use super::request::{JsonBody, Path, Query};

/// A page of merges.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct MergeList {
    merges: Vec<Merge>,
    /// Empty on the last page.
    next_page_token: String,
}

/// A merge after a decision.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct DecidedMerge {
    merge: Merge,
    /// Id of the job that draws the map by the decision; absent if nothing changed.
    #[serde(skip_serializing_if = "String::is_empty")]
    #[schema(required = false)]
    job: String,
}

/// Which merges are asked for.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct MergesQuery {
    /// Only this map's; absent or empty for all.
    #[serde(default)]
    #[param(example = "intel")]
    map: String,
    /// Only this session's; absent or empty for all.
    #[serde(default)]
    session: String,
    /// Only `OPEN`, `ACCEPTED`, `REJECTED` or `UNDONE`; absent for all.
    #[param(inline)]
    state: Option<MergeState>,
    /// Rows wanted: 0 or absent for the default of 100; cut at 1000.
    #[serde(default)]
    #[param(minimum = 0, maximum = 4_294_967_295_u32, example = 100)]
    page_size: u32,
    /// The previous reply's `next_page_token`; absent or empty for the first page.
    #[serde(default)]
    #[param(example = "")]
    page_token: String,
}

/// Names a merge.
#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub(crate) struct MergePath {
    /// Id of the merge.
    #[param(format = "uuid", example = "0199d3a6-6ac5-8c4e-9d51-2d9a3f1f3c11")]
    merge: String,
}

/// Which alignment a preview shows.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct PreviewQuery {
    /// Id of an alignment of the merge; absent for the first.
    #[serde(default)]
    #[param(example = "")]
    alignment: String,
}

/// Which alignment is accepted, why, and who says so.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct MergeAcceptance {
    /// Id of an alignment of the merge; absent or empty for the first.
    #[serde(default)]
    alignment: String,
    /// For people, up to 200 characters.
    #[serde(default)]
    reason: String,
    /// For people, up to 200 characters.
    #[serde(default)]
    author: String,
}

/// Why a merge is rejected or undone, and who says so.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct MergeRefusal {
    /// For people, up to 200 characters.
    #[serde(default)]
    reason: String,
    /// For people, up to 200 characters.
    #[serde(default)]
    author: String,
}

/// The merges of sessions, in the order in which they were first looked at.
#[utoipa::path(
    get,
    path = "/v1/merges",
    tag = "merges",
    params(MergesQuery),
    responses((status = 200, description = "A page of merges.", body = MergeList), ListProblems)
)]
pub(super) async fn list_merges(
    State(rest): State<Rest>,
    Query(query): Query<MergesQuery>,
) -> Result<Response, Refusal> {
    let MergesQuery { map, session, state, page_size, page_token } = query;
    let state = state.map_or(v1::MergeState::Unspecified, v1::MergeState::from).into();
    let request = v1::ListMergesRequest { map, session, state, page_size, page_token };
    let v1::ListMergesResponse { merges, next_page_token } =
        rest.service.list_merges(request).await?;
    Ok(ok(&MergeList { merges: merges.into_iter().map(Merge::from).collect(), next_page_token }))
}

/// One merge.
#[utoipa::path(
    get,
    path = "/v1/merges/{merge}",
    tag = "merges",
    params(MergePath),
    responses((status = 200, description = "The merge.", body = Merge), ReadProblems)
)]
pub(super) async fn get_merge(
    State(rest): State<Rest>,
    Path(path): Path<MergePath>,
) -> Result<Response, Refusal> {
    let request = v1::GetMergeRequest { merge: path.merge };
    let v1::GetMergeResponse { merge } = rest.service.get_merge(request).await?;
    Ok(ok(&Merge::from(filled(merge, "merge")?)))
}

/// A picture of one map laid over the other by an alignment.
///
/// Walls of what lies still are blue, those of the session orange, black where both agree; in the frame
/// of what lies still. Of a session without a laser the way is blue, where it saw landmarks orange, the
/// landmarks of the map red.
#[utoipa::path(
    get,
    path = "/v1/merges/{merge}/preview",
    tag = "merges",
    params(MergePath, PreviewQuery),
    responses(
        (status = 200, description = "The picture.", content_type = "image/png", body = [u8]),
        ReadProblems,
    )
)]
pub(super) async fn get_merge_preview(
    State(rest): State<Rest>,
    Path(path): Path<MergePath>,
    Query(query): Query<PreviewQuery>,
) -> Result<Response, Refusal> {
    let request = v1::GetMergePreviewRequest { merge: path.merge, alignment: query.alignment };
    let v1::GetMergePreviewResponse { png } = rest.service.get_merge_preview(request).await?;
    Ok(([(header::CONTENT_TYPE, "image/png")], png).into_response())
}

/// Puts the session where an alignment says.
///
/// From its first scan on; `job` draws the map by that. Accepting what is accepted changes nothing.
#[utoipa::path(
    post,
    path = "/v1/merges/{merge}/accept",
    tag = "merges",
    params(MergePath),
    request_body = MergeAcceptance,
    responses((status = 200, description = "The merge as it is now.", body = DecidedMerge), ChangeProblems)
)]
pub(super) async fn accept_merge(
    State(rest): State<Rest>,
    Path(path): Path<MergePath>,
    body: JsonBody<MergeAcceptance>,
) -> Result<Response, Refusal> {
    let MergeAcceptance { alignment, reason, author } = body.value;
    let request = v1::AcceptMergeRequest { merge: path.merge, alignment, reason, author };
    let v1::AcceptMergeResponse { merge, job } = rest.service.accept_merge(request).await?;
    decided(merge, job)
}

/// Leaves the session where it is, whatever merge jobs find.
///
/// Until it is accepted. Rejecting what is rejected changes nothing.
#[utoipa::path(
    post,
    path = "/v1/merges/{merge}/reject",
    tag = "merges",
    params(MergePath),
    request_body = MergeRefusal,
    responses((status = 200, description = "The merge as it is now.", body = DecidedMerge), ChangeProblems)
)]
pub(super) async fn reject_merge(
    State(rest): State<Rest>,
    Path(path): Path<MergePath>,
    body: JsonBody<MergeRefusal>,
) -> Result<Response, Refusal> {
    let MergeRefusal { reason, author } = body.value;
    let request = v1::RejectMergeRequest { merge: path.merge, reason, author };
    let v1::RejectMergeResponse { merge } = rest.service.reject_merge(request).await?;
    decided(merge, String::new())
}

/// Takes an accepted merge back, at any later time.
///
/// The session is in a frame of its own again; `job` draws the map without it. Relaxations that rest on it do
/// not count while it is not in force. Undoing what is undone changes nothing.
#[utoipa::path(
    post,
    path = "/v1/merges/{merge}/undo",
    tag = "merges",
    params(MergePath),
    request_body = MergeRefusal,
    responses((status = 200, description = "The merge as it is now.", body = DecidedMerge), ChangeProblems)
)]
pub(super) async fn undo_merge(
    State(rest): State<Rest>,
    Path(path): Path<MergePath>,
    body: JsonBody<MergeRefusal>,
) -> Result<Response, Refusal> {
    let MergeRefusal { reason, author } = body.value;
    let request = v1::UndoMergeRequest { merge: path.merge, reason, author };
    let v1::UndoMergeResponse { merge, job } = rest.service.undo_merge(request).await?;
    decided(merge, job)
}

fn decided(merge: Option<v1::Merge>, job: String) -> Result<Response, Refusal> {
    Ok(ok(&DecidedMerge { merge: filled(merge, "merge")?.into(), job }))
}
