//! `/v1/maps/{map}/closures`: the ledger, and what people decide about it.

use axum::extract::State;
use axum::response::Response;
use meetpoint_proto::v1;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::Rest;
use super::geometry::{Point, Pose};
use super::integer::Signed64;
use super::maps::MapPath;
use super::openapi::{ChangeProblems, ReadProblems};
use super::problem::Refusal;
use super::reply::{filled, ok};
use super::request::{JsonBody, Path, Query};

/// What a relax job made of a closure.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub(crate) enum ClosureVerdict {
    /// Not told by the service of that version; not taken in requests.
    Unspecified,
    /// The poses rest on it.
    Accepted,
    /// They do not.
    Refused,
}

/// Why a closure was refused.
#[derive(Clone, Copy, Debug, Serialize, ToSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub(crate) enum ClosureRefusal {
    /// An operator had switched it off.
    SwitchedOff,
    /// Another pose within reach explains what was seen nearly as well.
    Ambiguous,
    /// Too few of the scans taken there agree by themselves.
    FewScansAgree,
    /// What was seen from one moment contradicts what was seen from the other.
    Contradicted,
    /// It is far from what the way driven says, and no other closure says the same.
    Unsupported,
    /// The other closures and the way driven say otherwise.
    Inconsistent,
}

/// Two moments of a session or of two, and how the robots' poses at them relate by what was seen.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Closure {
    /// A UUID; the same moments have the same, whichever job considers them.
    #[schema(example = "0199d3a6-6ac5-8c4e-9d51-2d9a3f1f3c11")]
    id: String,
    /// Id of the map.
    map: String,
    /// Id of the session of the first moment: of the one that was opened first, if there are two.
    from_session: String,
    /// Stamp of the first moment's scan, by that robot's clock.
    from_time_ns: Signed64,
    /// Id of the session of the second moment.
    to_session: String,
    /// Stamp of the second moment's scan, by the clock of the second session's robot; later than the
    /// first if both are of one session.
    to_time_ns: Signed64,
    /// The pose at the second moment seen from the first, by what was seen.
    from_to: Pose,
    /// How far off `from_to` may be in its own frame: xx, xy, x theta, yy, y theta, theta theta, in
    /// square metres, metre radians and square radians.
    covariance: Vec<f64>,
    /// Mean agreement of what was seen at both.
    #[schema(minimum = 0, maximum = 1, example = 0.87)]
    score: f64,
    /// How far `from_to` is from what the relaxed poses say, in metres.
    residual_m: f64,
    /// The same in radians.
    residual_rad: f64,
    /// The same squared in units of the covariance, of three degrees of freedom.
    chi2: f64,
    verdict: ClosureVerdict,
    /// Why it was refused; absent if it was accepted.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    refusal: Option<ClosureRefusal>,
    /// Other poses within reach that explain what was seen nearly as well, best first; empty for a
    /// closure that is beyond doubt.
    alternatives: Vec<ClosureAlternative>,
    /// Where the job found the robot at the first moment, in the map's frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    from_position: Option<Point>,
    /// The same at the second moment.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    to_position: Option<Point>,
    /// Id of the relax job that said so.
    job: String,
    /// Whether an operator has switched it off.
    switched_off: bool,
    /// Whether the map was drawn before it was switched off, or on again: a relax job is needed for
    /// that to take effect.
    relax_needed: bool,
}

/// Another pose at which what was seen agrees.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct ClosureAlternative {
    /// The pose at the second moment seen from the first.
    from_to: Pose,
    /// Mean agreement of what was seen at both.
    #[schema(minimum = 0, maximum = 1, example = 0.81)]
    score: f64,
}

impl From<v1::ClosureVerdict> for ClosureVerdict {
    fn from(wire: v1::ClosureVerdict) -> Self {
        match wire {
            v1::ClosureVerdict::Unspecified => Self::Unspecified,
            v1::ClosureVerdict::Accepted => Self::Accepted,
            v1::ClosureVerdict::Refused => Self::Refused,
        }
    }
}

impl From<ClosureVerdict> for v1::ClosureVerdict {
    fn from(verdict: ClosureVerdict) -> Self {
        match verdict {
            ClosureVerdict::Unspecified => Self::Unspecified,
            ClosureVerdict::Accepted => Self::Accepted,
            ClosureVerdict::Refused => Self::Refused,
        }
    }
}

fn refusal(wire: i32) -> Option<ClosureRefusal> {
    match v1::ClosureRefusal::try_from(wire).unwrap_or_default() {
        v1::ClosureRefusal::Unspecified => None,
        v1::ClosureRefusal::SwitchedOff => Some(ClosureRefusal::SwitchedOff),
        v1::ClosureRefusal::Ambiguous => Some(ClosureRefusal::Ambiguous),
        v1::ClosureRefusal::FewScansAgree => Some(ClosureRefusal::FewScansAgree),
        v1::ClosureRefusal::Contradicted => Some(ClosureRefusal::Contradicted),
        v1::ClosureRefusal::Unsupported => Some(ClosureRefusal::Unsupported),
        v1::ClosureRefusal::Inconsistent => Some(ClosureRefusal::Inconsistent),
    }
}

impl From<v1::Closure> for Closure {
    fn from(wire: v1::Closure) -> Self {
        let v1::Closure {
            id,
            map,
            from_session,
            from_time_ns,
            to_session,
            to_time_ns,
            from_to,
            covariance,
            score,
            residual_m,
            residual_rad,
            chi2,
            verdict,
            refusal: why,
            alternatives,
            from_position,
            to_position,
            job,
            switched_off,
            relax_needed,
        } = wire;
        Self {
            id,
            map,
            from_session,
            from_time_ns: Signed64(from_time_ns),
            to_session,
            to_time_ns: Signed64(to_time_ns),
            from_to: from_to.unwrap_or_default().into(),
            covariance,
            score,
            residual_m,
            residual_rad,
            chi2,
            verdict: v1::ClosureVerdict::try_from(verdict).unwrap_or_default().into(),
            refusal: refusal(why),
            alternatives: alternatives.into_iter().map(ClosureAlternative::from).collect(),
            from_position: from_position.map(Point::from),
            to_position: to_position.map(Point::from),
            job,
            switched_off,
            relax_needed,
        }
    }
}

impl From<v1::ClosureAlternative> for ClosureAlternative {
    fn from(wire: v1::ClosureAlternative) -> Self {
        let v1::ClosureAlternative { from_to, score } = wire;
        Self { from_to: from_to.unwrap_or_default().into(), score }
    }
}

/// A page of closures.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct ClosureList {
    closures: Vec<Closure>,
    /// Empty on the last page.
    next_page_token: String,
}

/// Which closures are asked for.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct ClosuresQuery {
    /// Only those of which a moment is this session's; absent or empty for all.
    #[serde(default)]
    session: String,
    /// Only `ACCEPTED` or only `REFUSED`; absent for all.
    #[param(inline)]
    verdict: Option<ClosureVerdict>,
    /// Rows wanted: 0 or absent for the default of 100; cut at 1000.
    #[serde(default)]
    #[param(minimum = 0, maximum = 4_294_967_295_u32, example = 100)]
    page_size: u32,
    /// The previous reply's `next_page_token`; absent or empty for the first page.
    #[serde(default)]
    #[param(example = "")]
    page_token: String,
}

/// Names a closure.
#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub(crate) struct ClosurePath {
    /// Id of the map.
    #[param(example = "intel")]
    map: String,
    /// Id of the closure.
    #[param(format = "uuid", example = "0199d3a6-6ac5-8c4e-9d51-2d9a3f1f3c11")]
    closure: String,
}

/// Why a closure is switched, and who says so.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ClosureSwitch {
    /// For people, up to 200 characters.
    #[serde(default)]
    reason: String,
    /// For people, up to 200 characters.
    #[serde(default)]
    author: String,
}

/// The ledger of closures.
///
/// Those that the newest relax job of each session considered, within it and between it and the sessions
/// that were relaxed together with it, job by job in the order of their moments; and those that are
/// switched off.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/closures",
    tag = "closures",
    params(MapPath, ClosuresQuery),
    responses(
        (status = 200, description = "A page of closures.", body = ClosureList),
        ReadProblems,
    )
)]
pub(super) async fn list_closures(
    State(rest): State<Rest>,
    Path(path): Path<MapPath>,
    Query(query): Query<ClosuresQuery>,
) -> Result<Response, Refusal> {
    let ClosuresQuery { session, verdict, page_size, page_token } = query;
    let verdict = verdict.map_or(v1::ClosureVerdict::Unspecified, v1::ClosureVerdict::from).into();
    let map = path.map;
    let request = v1::ListClosuresRequest { map, session, verdict, page_size, page_token };
    let v1::ListClosuresResponse { closures, next_page_token } =
        rest.service.list_closures(request).await?;
    let closures = closures.into_iter().map(Closure::from).collect();
    Ok(ok(&ClosureList { closures, next_page_token }))
}

/// Lets no relax job rest poses on a closure any more.
///
/// The map stays as it is until the next one: `relax_needed` says whether it rests on the closure still.
/// Switching off one that is off changes nothing.
#[utoipa::path(
    post,
    path = "/v1/maps/{map}/closures/{closure}/switch-off",
    tag = "closures",
    params(ClosurePath),
    request_body = ClosureSwitch,
    responses((status = 200, description = "The closure as it is now.", body = Closure), ChangeProblems)
)]
pub(super) async fn switch_closure_off(
    State(rest): State<Rest>,
    Path(path): Path<ClosurePath>,
    body: JsonBody<ClosureSwitch>,
) -> Result<Response, Refusal> {
    let (ClosurePath { map, closure }, ClosureSwitch { reason, author }) = (path, body.value);
    let request = v1::SwitchClosureOffRequest { map, closure, reason, author };
    let v1::SwitchClosureOffResponse { closure } = rest.service.switch_closure_off(request).await?;
    Ok(ok(&Closure::from(filled(closure, "closure")?)))
}

/// Leaves a closure to the judgement of relax jobs again.
///
/// The map stays as it is until the next one: `relax_needed` says whether it was drawn without the
/// closure.
#[utoipa::path(
    post,
    path = "/v1/maps/{map}/closures/{closure}/switch-on",
    tag = "closures",
    params(ClosurePath),
    request_body = ClosureSwitch,
    responses((status = 200, description = "The closure as it is now.", body = Closure), ChangeProblems)
)]
pub(super) async fn switch_closure_on(
    State(rest): State<Rest>,
    Path(path): Path<ClosurePath>,
    body: JsonBody<ClosureSwitch>,
) -> Result<Response, Refusal> {
    let (ClosurePath { map, closure }, ClosureSwitch { reason, author }) = (path, body.value);
    let request = v1::SwitchClosureOnRequest { map, closure, reason, author };
    let v1::SwitchClosureOnResponse { closure } = rest.service.switch_closure_on(request).await?;
    Ok(ok(&Closure::from(filled(closure, "closure")?)))
}
