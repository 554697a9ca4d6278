//! Ways along a map of places, and what a robot is to do next that is driven by it.

use axum::extract::State;
use axum::response::Response;
use meetpoint_proto::v1;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::Rest;
use super::hypotheses::{HypothesisPath, TreeQuery, tree};
use super::hypothesis_tree::HypothesisTree;
use super::maps::MapPath;
use super::openapi::ReadProblems;
use super::problem::Refusal;
use super::reply::{filled, ok};
use super::request::{Path, Query};

/// From where to where.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct TravelQuery {
    /// Id of the session; absent or empty for the one that was opened last of those that told of visits.
    #[serde(default)]
    session: String,
    /// No two ways cross but at places: no bridges, no stairs.
    #[serde(default)]
    planar: bool,
    /// Ways may come back to a place that they pass: corridors in a circle.
    #[serde(default)]
    circles: bool,
    /// Maps whose places cannot lie in one frame as odometry says (`moved` of visits) are left out.
    #[serde(default)]
    metrical: bool,
    /// Number of a place; absent for where the robot is.
    from: Option<u32>,
    /// Number of a place.
    #[param(example = 3)]
    to: u32,
}

/// Which of the gateways is taken that are equally near.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, ToSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub(crate) enum TravelSelection {
    /// The one that takes the least rotation.
    #[default]
    LeastRotation,
    /// The one that takes the most: what is explored grows roughly concentrically.
    MostRotation,
}

impl From<TravelSelection> for v1::TravelSelection {
    fn from(selection: TravelSelection) -> Self {
        match selection {
            TravelSelection::LeastRotation => Self::LeastRotation,
            TravelSelection::MostRotation => Self::MostRotation,
        }
    }
}

/// Which robot asks, and how it explores.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct NextTravelQuery {
    /// Id of the session; absent or empty for the one that was opened last of those that told of visits.
    #[serde(default)]
    session: String,
    /// No two ways cross but at places: no bridges, no stairs.
    #[serde(default)]
    planar: bool,
    /// Ways may come back to a place that they pass: corridors in a circle.
    #[serde(default)]
    circles: bool,
    /// Maps whose places cannot lie in one frame as odometry says (`moved` of visits) are left out.
    #[serde(default)]
    metrical: bool,
    /// Of gateways that are equally near: `LEAST_ROTATION` if absent, or `MOST_ROTATION`.
    #[serde(default)]
    #[param(inline)]
    selection: TravelSelection,
}

/// What is true of a way between two places.
#[derive(Clone, Copy, Debug, Serialize, ToSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub(crate) enum TravelPlanCode {
    /// Not told by the service of that version.
    Unspecified,
    Ok,
    /// The map has no such place.
    PlaceUnknown,
}

/// What a robot is to do.
#[derive(Clone, Copy, Debug, Serialize, ToSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub(crate) enum TravelErrand {
    /// Not told by the service of that version.
    Unspecified,
    /// A travel that refutes one of several simplest maps.
    Rehearse,
    /// A travel along a known edge, to see whether the place that was just taken for a known one is it.
    Confirm,
    /// A travel through a gateway that nobody has been through.
    Explore,
    /// Nothing: the simplest map has no such gateway.
    Explored,
    /// Nothing: no map fits, so something was seen, assumed or asserted wrongly; or the tree is truncated, and
    /// the true map was given up.
    Refuted,
}

/// A travel from a place to the next.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct TravelLeg {
    place: u32,
    /// The gateway through which the place is left.
    gateway: u32,
    /// The same counted clockwise from the gateway where one came in: of the first leg from where the
    /// robot came in if it is there, else from the place's gateway 0.
    turn: u32,
    to_place: u32,
    /// In metres; absent where nobody told.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    length_m: Option<f64>,
}

/// A way from place to place.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct TravelPlan {
    tree: HypothesisTree,
    /// Id of the map of places.
    hypothesis: String,
    code: TravelPlanCode,
    /// The shortest way, if every edge that was travelled has a length; else one of the fewest edges.
    legs: Vec<TravelLeg>,
    /// Length of all legs, in metres; absent where one has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    length_m: Option<f64>,
}

/// What a robot is to do next.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct NextTravel {
    tree: HypothesisTree,
    errand: TravelErrand,
    /// Turns, each followed by a travel: gateways clockwise from the one where the robot came in. Only the
    /// first is certain to be wanted.
    turns: Vec<u32>,
    /// The place of the simplest map whose gateway the last of the turns is through.
    place: u32,
    /// The gateway.
    gateway: u32,
}

/// The best way between two places, along edges that were travelled.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/hypotheses/{hypothesis}/route",
    tag = "hypotheses",
    params(HypothesisPath, TravelQuery),
    responses((status = 200, description = "The way.", body = TravelPlan), ReadProblems)
)]
pub(super) async fn plan_travel(
    State(rest): State<Rest>,
    Path(path): Path<HypothesisPath>,
    Query(query): Query<TravelQuery>,
) -> Result<Response, Refusal> {
    let TravelQuery { session, planar, circles, metrical, from: from_place, to: to_place } = query;
    let (map, hypothesis) = path.named();
    let tree = Some(tree(map, TreeQuery { session, planar, circles, metrical }));
    let request = v1::PlanTravelRequest { tree, hypothesis, from_place, to_place };
    let v1::PlanTravelResponse { tree, hypothesis, code, legs, length_m } =
        rest.service.plan_travel(request).await?;
    let code = match v1::TravelPlanCode::try_from(code).unwrap_or_default() {
        v1::TravelPlanCode::Unspecified => TravelPlanCode::Unspecified,
        v1::TravelPlanCode::Ok => TravelPlanCode::Ok,
        v1::TravelPlanCode::PlaceUnknown => TravelPlanCode::PlaceUnknown,
    };
    let legs = legs.into_iter().map(|wire| {
        let v1::TravelLeg { place, gateway, turn, to_place, length_m } = wire;
        TravelLeg { place, gateway, turn, to_place, length_m }
    });
    let tree = filled(tree, "tree")?.into();
    Ok(ok(&TravelPlan { tree, hypothesis, code, legs: legs.collect(), length_m }))
}

/// What a robot is to do next that is driven by the service.
///
/// To be asked again at each place, since what the robot sees there changes what is to be done.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/next-travel",
    tag = "hypotheses",
    params(MapPath, NextTravelQuery),
    responses((status = 200, description = "What it is to do.", body = NextTravel), ReadProblems)
)]
pub(super) async fn get_next_travel(
    State(rest): State<Rest>,
    Path(path): Path<MapPath>,
    Query(query): Query<NextTravelQuery>,
) -> Result<Response, Refusal> {
    let NextTravelQuery { session, planar, circles, metrical, selection } = query;
    let tree = Some(tree(path.map, TreeQuery { session, planar, circles, metrical }));
    let selection = v1::TravelSelection::from(selection).into();
    let request = v1::GetNextTravelRequest { tree, selection };
    let v1::GetNextTravelResponse { tree, errand, turns, place, gateway } =
        rest.service.get_next_travel(request).await?;
    let errand = match v1::TravelErrand::try_from(errand).unwrap_or_default() {
        v1::TravelErrand::Unspecified => TravelErrand::Unspecified,
        v1::TravelErrand::Rehearse => TravelErrand::Rehearse,
        v1::TravelErrand::Confirm => TravelErrand::Confirm,
        v1::TravelErrand::Explore => TravelErrand::Explore,
        v1::TravelErrand::Explored => TravelErrand::Explored,
        v1::TravelErrand::Refuted => TravelErrand::Refuted,
    };
    Ok(ok(&NextTravel { tree: filled(tree, "tree")?.into(), errand, turns, place, gateway }))
}
