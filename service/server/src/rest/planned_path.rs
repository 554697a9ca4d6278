//! Answers about paths, in JSON.

use meetpoint_proto::v1;
use serde::Serialize;
use utoipa::ToSchema;

use super::geometry::Point;
use super::integer::{Signed64, Unsigned64};
use super::reply::filled;
use crate::error::Error;

/// What answers are computed from: for which robot, on which version.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Basis {
    /// Id of the map.
    map: String,
    map_version: Unsigned64,
    cost_revision: Unsigned64,
    /// Name of the profile; absent if it was computed for the radius that was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, example = "default")]
    profile: Option<String>,
    /// Of the robot that the answer holds for, in metres: at least the one asked for.
    robot_radius_m: f64,
    /// `TABLES`, or `SEARCH` while these are being made or for a radius that no profile has; `PLACES` of a map of
    /// places.
    #[schema(example = "TABLES")]
    answered_by: &'static str,
    /// Id of the map of places that answers; absent of a version. Version, cost revision and radius are then 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    hypothesis: Option<String>,
}

impl Basis {
    /// # Errors
    /// [`Error::Internal`] if it is missing.
    pub(super) fn of(wire: Option<v1::PlanBasis>) -> Result<Self, Error> {
        let wire = filled(wire, "basis")?;
        let answered_by = match wire.answered_by() {
            v1::AnsweredBy::Unspecified | v1::AnsweredBy::Search => "SEARCH",
            v1::AnsweredBy::Tables => "TABLES",
            v1::AnsweredBy::Places => "PLACES",
        };
        let v1::PlanBasis {
            map,
            map_version,
            cost_revision,
            profile,
            robot_radius_m,
            answered_by: _,
            hypothesis,
        } = wire;
        Ok(Self {
            map,
            map_version: Unsigned64(map_version),
            cost_revision: Unsigned64(cost_revision),
            profile: (!profile.is_empty()).then_some(profile),
            robot_radius_m,
            answered_by,
            hypothesis: (!hypothesis.is_empty()).then_some(hypothesis),
        })
    }
}

/// The name of a code.
pub(super) fn code_name(code: v1::PlanCode) -> &'static str {
    match code {
        v1::PlanCode::Unspecified => "UNSPECIFIED",
        v1::PlanCode::Ok => "OK",
        v1::PlanCode::NoRoute => "NO_ROUTE",
        v1::PlanCode::StartOccupied => "START_OCCUPIED",
        v1::PlanCode::GoalOccupied => "GOAL_OCCUPIED",
        v1::PlanCode::StartUnknown => "START_UNKNOWN",
        v1::PlanCode::GoalUnknown => "GOAL_UNKNOWN",
        v1::PlanCode::OutsideMap => "OUTSIDE_MAP",
    }
}

/// A path, or why there is none.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct PathReply {
    /// `OK`, `NO_ROUTE`, `START_OCCUPIED`, `GOAL_OCCUPIED`, `START_UNKNOWN`, `GOAL_UNKNOWN` or
    /// `OUTSIDE_MAP`.
    #[schema(example = "OK")]
    code: &'static str,
    #[serde(flatten)]
    basis: Basis,
    /// The best path; absent unless the code is `OK`.
    #[serde(flatten)]
    path: Option<PlannedPath>,
    /// Paths by other arcs, the shortest first; absent if there are none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    alternatives: Vec<PlannedPath>,
    /// For people, what is worth knowing.
    warnings: Vec<String>,
    /// For people, what can be done about a code other than `OK`; absent if it is `OK`.
    #[serde(skip_serializing_if = "String::is_empty")]
    what_to_do: String,
    /// Where the path starts, if the start had to be moved to where the robot can be.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    snapped_start: Option<Point>,
    /// Where the path ends, if the goal had to be moved.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    snapped_goal: Option<Point>,
    planning_time_us: Signed64,
}

impl PathReply {
    /// # Errors
    /// [`Error::Internal`] if a part is missing.
    pub(crate) fn new(wire: v1::PlanPathResponse) -> Result<Self, Error> {
        let code = code_name(wire.code());
        let v1::PlanPathResponse {
            code: _,
            basis,
            path,
            alternatives,
            warnings,
            what_to_do,
            snapped_start,
            snapped_goal,
            planning_time_us,
        } = wire;
        Ok(Self {
            code,
            basis: Basis::of(basis)?,
            path: path.map(PlannedPath::from),
            alternatives: alternatives.into_iter().map(PlannedPath::from).collect(),
            warnings,
            what_to_do,
            snapped_start: snapped_start.map(Point::from),
            snapped_goal: snapped_goal.map(Point::from),
            planning_time_us: Signed64(planning_time_us),
        })
    }
}

/// A path, sparse and dense.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct PlannedPath {
    /// The regions from start to goal, and the arcs between them.
    route: Vec<RouteStep>,
    /// Of the shortest path in the grid, in metres: straight and diagonal steps between cell centres.
    grid_length_m: f64,
    /// Of the dense path, in metres; absent if it was left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    path_length_m: Option<f64>,
    /// From the dense path to the nearest obstacle, in metres, at most 256 cells.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    clearance_min_m: Option<f64>,
    /// Where the dense path starts, turns and ends, in the map's frame.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    points: Vec<Point>,
    /// Centres of the cells of the path in the grid; absent unless asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    cells: Vec<Point>,
    /// In metres of free travel: the grid's length, weighed by clearance, occupancy and zones, and
    /// tolls.
    cost_m: f64,
    /// The cost is at most so much more than that of the best path, as a share of it.
    loss_bound: f64,
}

impl From<v1::PlannedPath> for PlannedPath {
    fn from(wire: v1::PlannedPath) -> Self {
        let v1::PlannedPath {
            route,
            grid_length_m,
            path_length_m,
            clearance_min_m,
            points,
            cells,
            cost_m,
            loss_bound,
        } = wire;
        // Of a map of places there may be a length without points, and there is no clearance.
        let is_dense = !points.is_empty() || 0.0 < path_length_m;
        Self {
            route: route.into_iter().map(RouteStep::from).collect(),
            grid_length_m,
            path_length_m: is_dense.then_some(path_length_m),
            clearance_min_m: (0.0 < clearance_min_m).then_some(clearance_min_m),
            points: points.into_iter().map(Point::from).collect(),
            cells: cells.into_iter().map(Point::from).collect(),
            cost_m,
            loss_bound,
        }
    }
}

/// A region on the way.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct RouteStep {
    /// Id of the region.
    region: Unsigned64,
    /// Id of the arc by which it is entered; absent in the first, and where a corner is cut between
    /// two regions that no arc joins.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    arc: Option<Unsigned64>,
}

impl From<v1::RouteStep> for RouteStep {
    fn from(wire: v1::RouteStep) -> Self {
        let v1::RouteStep { region, arc } = wire;
        Self { region: Unsigned64(region), arc: Unsigned64::above_zero(arc) }
    }
}
