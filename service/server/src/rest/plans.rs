//! `/v1/maps/{map}/paths`, `matrix`, `next-motion`.

use axum::extract::State;
use axum::response::Response;
use meetpoint_proto::v1;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::Rest;
use super::geometry::Point;
use super::hypotheses::{TreeQuery, tree};
use super::integer::{Signed64, Unsigned64};
use super::maps::MapPath;
use super::openapi::{PlanProblems, ReadProblems};
use super::planned_path::{Basis, PathReply, code_name};
use super::problem::Refusal;
use super::reply::{ok, ok_long};
use super::request::{JsonBody, Path, Query, only_one};
use crate::error::Error;

/// Entries of a matrix that are written on the async thread: half a millisecond.
const INLINE_ENTRIES_MAX: usize = 2000;

/// How a path is found.
#[derive(Clone, Copy, Debug, Default, Deserialize, ToSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub(crate) enum Mode {
    /// The shortest path in the grid.
    #[default]
    Exact,
    /// Triplet plans along the regions of the shortest path, the last two regions planned together.
    Triplet,
    /// As Thrun 1998, section 3.2: fewest regions, triplet plans, final goal plan.
    Paper,
}

impl From<Mode> for v1::PlanMode {
    fn from(mode: Mode) -> Self {
        match mode {
            Mode::Exact => Self::Exact,
            Mode::Triplet => Self::Triplet,
            Mode::Paper => Self::Paper,
        }
    }
}

/// A question for a path.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is a word of the question, and of the wire"
)]
pub(crate) struct PathQuestion {
    /// In the map's frame. Not with `hypothesis`.
    #[schema(nullable = false)]
    start: Option<Point>,
    #[schema(nullable = false)]
    goal: Option<Point>,
    /// Name of a profile; absent for `default`. Not beside `robot_radius_m`.
    #[schema(nullable = false, example = "default")]
    profile: Option<String>,
    /// Answered from the profile of that radius or the next larger one, and computed for the radius
    /// itself if there is none or the larger robot does not get through. Metres, 0 to 5.
    #[schema(nullable = false, minimum = 0.0, maximum = 5.0)]
    robot_radius_m: Option<f64>,
    #[serde(default)]
    mode: Mode,
    /// Other routes to find besides the best.
    #[serde(default)]
    #[schema(maximum = 8)]
    alternatives: u32,
    /// Absent for the published version.
    #[schema(nullable = false)]
    map_version: Option<Unsigned64>,
    /// Leaves out the points of the dense path, its length and its clearance.
    #[serde(default)]
    route_only: bool,
    /// Whether the cells of the path in the grid are wanted too.
    #[serde(default)]
    cells: bool,
    /// A path on a map of places in place of a version: its id, or `simplest`. Regions and arcs are then those of
    /// `graph?hypothesis=`: places, by their numbers plus one, and edges. It is as long as these were when they were
    /// travelled; `TRAVEL_NOT_MEASURED` where one has neither a length nor odometry.
    #[serde(default)]
    #[schema(example = "")]
    hypothesis: String,
    /// With `hypothesis`: number of a place; absent for where the session's robot is by that map.
    #[schema(nullable = false)]
    from_place: Option<u32>,
    /// With `hypothesis`: likewise.
    #[schema(nullable = false)]
    to_place: Option<u32>,
    /// With `hypothesis`: id of the session; absent or empty for the one that was opened last of those that told of
    /// visits.
    #[serde(default)]
    session: String,
    /// With `hypothesis`: no two ways cross but at places.
    #[serde(default)]
    planar: bool,
    /// With `hypothesis`: ways may come back to a place that they pass.
    #[serde(default)]
    circles: bool,
    /// With `hypothesis`: maps against which odometry speaks are left out.
    #[serde(default)]
    metrical: bool,
}

/// What a question says of the robot.
///
/// # Errors
/// [`Error::InvalidField`] if it says two things.
pub(super) fn robot(
    profile: Option<String>,
    robot_radius_m: Option<f64>,
) -> Result<Option<v1::RobotChoice>, Error> {
    use v1::robot_choice::Kind;
    let kind = only_one(
        "robot",
        [
            ("profile", profile.map(Kind::Profile)),
            ("robot_radius_m", robot_radius_m.map(Kind::RobotRadiusM)),
        ],
    )?;
    Ok(kind.map(|kind| v1::RobotChoice { kind: Some(kind) }))
}

fn number(version: Option<Unsigned64>) -> u64 {
    version.map_or(0, |version| version.0)
}

/// The shortest path between two points, by cost, and others if asked for; or between two places of a map of places.
///
/// What is true of the world is an answer with a `code`; what is wrong with the question is an error.
#[utoipa::path(
    post,
    path = "/v1/maps/{map}/paths",
    tag = "plans",
    params(MapPath),
    request_body = PathQuestion,
    responses((status = 200, description = "A path, or why there is none.", body = PathReply), PlanProblems)
)]
pub(super) async fn plan_path(
    State(rest): State<Rest>,
    Path(path): Path<MapPath>,
    body: JsonBody<PathQuestion>,
) -> Result<Response, Refusal> {
    let PathQuestion {
        start,
        goal,
        profile,
        robot_radius_m,
        mode,
        alternatives,
        map_version,
        route_only,
        cells,
        hypothesis,
        from_place,
        to_place,
        session,
        planar,
        circles,
        metrical,
    } = body.value;
    let tree = tree(path.map.clone(), TreeQuery { session, planar, circles, metrical });
    let request = v1::PlanPathRequest {
        map: path.map,
        start: start.map(v1::Point::from),
        goal: goal.map(v1::Point::from),
        robot: robot(profile, robot_radius_m)?,
        mode: v1::PlanMode::from(mode).into(),
        alternatives,
        map_version: number(map_version),
        route_only,
        cells,
        tree: (!hypothesis.is_empty()).then_some(tree),
        hypothesis,
        from_place,
        to_place,
    };
    Ok(ok(&PathReply::new(rest.service.plan_path(request).await?)?))
}

/// A question for lengths.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct MatrixQuestion {
    /// In the map's frame.
    starts: Vec<Point>,
    goals: Vec<Point>,
    /// Name of a profile; absent for `default`. Not beside `robot_radius_m`.
    #[schema(nullable = false, example = "default")]
    profile: Option<String>,
    /// Metres, 0 to 5: the profile of that radius or the next larger one, or the radius itself.
    #[schema(nullable = false, minimum = 0.0, maximum = 5.0)]
    robot_radius_m: Option<f64>,
    /// Absent for the published version.
    #[schema(nullable = false)]
    map_version: Option<Unsigned64>,
}

/// Lengths from every start to every goal.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct MatrixReply {
    #[serde(flatten)]
    basis: Basis,
    /// One row a start, one entry a goal: the cost of the best path, in metres; null where there is
    /// none.
    lengths_m: Vec<Vec<Option<f64>>>,
    /// `OK`, or why the robot cannot be at a start.
    start_codes: Vec<&'static str>,
    /// `OK`, or why it cannot be at a goal.
    goal_codes: Vec<&'static str>,
    planning_time_us: Signed64,
}

/// Lengths of the shortest paths from each of several points to each of others.
#[utoipa::path(
    post,
    path = "/v1/maps/{map}/matrix",
    tag = "plans",
    params(MapPath),
    request_body = MatrixQuestion,
    responses((status = 200, description = "Lengths.", body = MatrixReply), PlanProblems)
)]
pub(super) async fn plan_matrix(
    State(rest): State<Rest>,
    Path(path): Path<MapPath>,
    body: JsonBody<MatrixQuestion>,
) -> Result<Response, Refusal> {
    let MatrixQuestion { starts, goals, profile, robot_radius_m, map_version } = body.value;
    let points = |points: Vec<Point>| points.into_iter().map(v1::Point::from).collect();
    let request = v1::PlanMatrixRequest {
        map: path.map,
        starts: points(starts),
        goals: points(goals),
        robot: robot(profile, robot_radius_m)?,
        map_version: number(map_version),
    };
    let reply = rest.service.plan_matrix(request).await?;
    let names = |codes: &[i32]| {
        let name = |&code: &i32| code_name(v1::PlanCode::try_from(code).unwrap_or_default());
        codes.iter().map(name).collect()
    };
    let (start_codes, goal_codes) = (names(&reply.start_codes), names(&reply.goal_codes));
    let v1::PlanMatrixResponse { basis, rows, start_codes: _, goal_codes: _, planning_time_us } =
        reply;
    let entry = |length_m: f64| (0.0 <= length_m).then_some(length_m);
    let row = |row: v1::MatrixRow| row.lengths_m.into_iter().map(entry).collect();
    let reply = MatrixReply {
        basis: Basis::of(basis)?,
        lengths_m: rows.into_iter().map(row).collect(),
        start_codes,
        goal_codes,
        planning_time_us: Signed64(planning_time_us),
    };
    if reply.start_codes.len() * reply.goal_codes.len() <= INLINE_ENTRIES_MAX {
        return Ok(ok(&reply));
    }
    ok_long(reply).await
}

/// Where a robot is and where it goes.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct MotionQuery {
    /// Where the robot is, in metres in the map's frame.
    x_m: f64,
    /// Where the robot is, in metres in the map's frame.
    y_m: f64,
    /// Where it goes.
    goal_x_m: f64,
    /// Where it goes.
    goal_y_m: f64,
    /// Name of a profile; absent for `default`.
    profile: Option<String>,
    /// Metres, 0 to 5: the profile of that radius or the next larger one, or the radius itself.
    robot_radius_m: Option<f64>,
    /// Number of a version; absent for the published one.
    map_version: Option<u64>,
}

/// Which way to go now.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct MotionReply {
    /// `OK`, or as for a path.
    #[schema(example = "OK")]
    code: &'static str,
    #[serde(flatten)]
    basis: Basis,
    /// Where to head for, in radians in the map's frame: along the next step of a shortest path.
    /// Absent in the goal's cell.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    heading_rad: Option<f64>,
    /// Cost of what is left, in metres.
    distance_left_m: f64,
    /// Id of the region that the robot is in; absent if it is in none.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    region: Option<Unsigned64>,
    /// Id of the arc that is crossed next; absent if none is.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    next_arc: Option<Unsigned64>,
    /// Centre of the cell that the step leads to.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    next_point: Option<Point>,
    /// For people, what can be done about a code other than `OK`.
    #[serde(skip_serializing_if = "String::is_empty")]
    what_to_do: String,
}

/// Which way to go now, for a robot that may stand anywhere.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/next-motion",
    tag = "plans",
    params(MapPath, MotionQuery),
    responses((status = 200, description = "A heading, or why there is none.", body = MotionReply), ReadProblems)
)]
pub(super) async fn next_motion(
    State(rest): State<Rest>,
    Path(path): Path<MapPath>,
    Query(query): Query<MotionQuery>,
) -> Result<Response, Refusal> {
    let MotionQuery { x_m, y_m, goal_x_m, goal_y_m, profile, robot_radius_m, map_version } = query;
    let request = v1::NextMotionRequest {
        map: path.map,
        position: Some(v1::Point { x_m, y_m }),
        goal: Some(v1::Point { x_m: goal_x_m, y_m: goal_y_m }),
        robot: robot(profile, robot_radius_m)?,
        map_version: map_version.unwrap_or(0),
    };
    let reply = rest.service.next_motion(request).await?;
    let code = code_name(reply.code());
    let v1::NextMotionResponse {
        code: _,
        basis,
        heading_rad,
        distance_left_m,
        region,
        next_arc,
        next_point,
        what_to_do,
    } = reply;
    Ok(ok(&MotionReply {
        code,
        basis: Basis::of(basis)?,
        heading_rad,
        distance_left_m,
        region: Unsigned64::above_zero(region),
        next_arc: Unsigned64::above_zero(next_arc),
        next_point: next_point.map(Point::from),
        what_to_do,
    }))
}
