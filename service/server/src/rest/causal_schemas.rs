//! `/v1/maps/{map}/schemas`: what a travel says of views and actions, before there is any place.

use axum::extract::State;
use axum::response::Response;
use meetpoint_proto::v1;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::Rest;
use super::maps::MapPath;
use super::openapi::ReadProblems;
use super::problem::Refusal;
use super::reply::ok;
use super::request::{Path, Query};

/// Whose travel is meant.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct SchemasQuery {
    /// Id of the session; absent or empty for the one that was opened last of those that told of visits.
    #[serde(default)]
    session: String,
}

/// Which way a robot looks that stands in a gateway.
#[derive(Clone, Copy, Debug, Serialize, ToSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub(crate) enum CausalFacing {
    /// Not told by the service of that version.
    Unspecified,
    /// It has just come in.
    Inward,
    /// It is about to leave.
    Outward,
}

/// What is seen at a distinctive state.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct CausalView {
    /// From 0, in the order in which they were met.
    number: u32,
    facing: CausalFacing,
    /// The star as read from the gateway in which the robot stands, and the place's looks where they were
    /// compared.
    #[schema(example = "aba@hall")]
    seen: String,
}

impl From<v1::CausalView> for CausalView {
    fn from(wire: v1::CausalView) -> Self {
        let facing = match wire.facing() {
            v1::CausalFacing::Unspecified => CausalFacing::Unspecified,
            v1::CausalFacing::Inward => CausalFacing::Inward,
            v1::CausalFacing::Outward => CausalFacing::Outward,
        };
        let v1::CausalView { number, facing: _, seen } = wire;
        Self { number, facing, seen }
    }
}

/// What is done at a distinctive state.
#[derive(Clone, Copy, Debug, Serialize, ToSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub(crate) enum CausalAction {
    /// Not told by the service of that version.
    Unspecified,
    /// Along the path to the next place.
    Travel,
    /// To the gateway by which one came in.
    TurnAround,
    /// To the gateway where the path that one came by goes on.
    GoStraight,
    /// To a gateway on the left of that path.
    TurnLeft,
    /// To a gateway on the right of it.
    TurnRight,
    /// To another gateway of a place where the path ends: it has no sides there.
    Turn,
}

impl From<v1::CausalAction> for CausalAction {
    fn from(wire: v1::CausalAction) -> Self {
        match wire {
            v1::CausalAction::Unspecified => Self::Unspecified,
            v1::CausalAction::Travel => Self::Travel,
            v1::CausalAction::TurnAround => Self::TurnAround,
            v1::CausalAction::GoStraight => Self::GoStraight,
            v1::CausalAction::TurnLeft => Self::TurnLeft,
            v1::CausalAction::TurnRight => Self::TurnRight,
            v1::CausalAction::Turn => Self::Turn,
        }
    }
}

/// What came of an action.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct CausalOutcome {
    /// The view afterwards, by its number.
    view: u32,
    /// Visits at which it was begun, ascending.
    visits: Vec<u32>,
}

/// A view, an action, and all that came of it.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct CausalSchema {
    /// From 0, in the order in which they were met.
    number: u32,
    /// The view before, by its number.
    view: u32,
    action: CausalAction,
    /// Gateways clockwise from the one by which one came in; absent of a travel.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    turn: Option<u32>,
    /// In the order in which they were met.
    outcomes: Vec<CausalOutcome>,
    /// Whether no place has all of these: then the states were different ones that look alike.
    tells_apart: bool,
}

impl From<v1::CausalSchema> for CausalSchema {
    fn from(wire: v1::CausalSchema) -> Self {
        let action = wire.action();
        let v1::CausalSchema { number, view, action: _, turn, outcomes, tells_apart } = wire;
        let outcome = |v1::CausalOutcome { view, visits }| CausalOutcome { view, visits };
        Self {
            number,
            view,
            action: action.into(),
            turn: (action != v1::CausalAction::Travel).then_some(turn),
            outcomes: outcomes.into_iter().map(outcome).collect(),
            tells_apart,
        }
    }
}

/// Two visits that looked alike and were to different states.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct ToldApart {
    visit: u32,
    earlier: u32,
    /// After so many turns and travels, the same from both, something else was seen.
    travels: u32,
}

/// What a travel says of views and actions.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct CausalSchemas {
    /// Id of the map.
    map: String,
    /// Id of the session whose travel it is.
    session: String,
    /// Visits that it is made of.
    visits: u32,
    /// Whether these are read from firings: of a robot that is told step by step.
    by_steps: bool,
    /// By their numbers.
    views: Vec<CausalView>,
    /// By their numbers.
    schemas: Vec<CausalSchema>,
    /// Pairs of visits that looked alike and were to different states, as what followed shows: the first 1000.
    told_apart: Vec<ToldApart>,
    /// Number of all of them.
    told_apart_count: u32,
}

impl From<v1::ListCausalSchemasResponse> for CausalSchemas {
    fn from(wire: v1::ListCausalSchemasResponse) -> Self {
        let v1::ListCausalSchemasResponse {
            map,
            session,
            visits,
            by_steps,
            views,
            schemas,
            told_apart,
            told_apart_count,
        } = wire;
        let pair = |wire: v1::ToldApart| {
            let v1::ToldApart { visit, earlier, travels } = wire;
            ToldApart { visit, earlier, travels }
        };
        Self {
            map,
            session,
            visits,
            by_steps,
            views: views.into_iter().map(CausalView::from).collect(),
            schemas: schemas.into_iter().map(CausalSchema::from).collect(),
            told_apart: told_apart.into_iter().map(pair).collect(),
            told_apart_count,
        }
    }
}

/// The causal schemas of a travel: what was seen, what was done then, and what was seen next.
///
/// They do not depend on what is assumed. Numbers are given in the order in which things were met: a longer travel only
/// adds to them. `NOTHING_TRAVELLED` where no visit was told of.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/schemas",
    tag = "hypotheses",
    params(MapPath, SchemasQuery),
    responses((status = 200, description = "Views and schemas.", body = CausalSchemas), ReadProblems)
)]
pub(super) async fn list_causal_schemas(
    State(rest): State<Rest>,
    Path(path): Path<MapPath>,
    Query(query): Query<SchemasQuery>,
) -> Result<Response, Refusal> {
    let SchemasQuery { session } = query;
    let request = v1::ListCausalSchemasRequest { map: path.map, session };
    let told = rest.service.list_causal_schemas(request).await?;
    Ok(ok(&CausalSchemas::from(told)))
}
