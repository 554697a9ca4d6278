//! `/v1/maps/{map}/exploration`.

use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use meetpoint_proto::v1;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::Rest;
use super::geometry::{Point, Pose};
use super::integer::{Signed64, Unsigned64};
use super::maps::MapPath;
use super::openapi::SessionGridProblems;
use super::plans::robot;
use super::problem::Refusal;
use super::reply::{filled, ok};
use super::request::{Path, Query};
use crate::error::Error;

/// How exploration is told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum ExplorationFormat {
    /// Goals and figures.
    #[default]
    Json,
    /// The values as a picture: white is unexplored, the darker the farther from it, black cannot be
    /// reached.
    Png,
}

/// Who explores.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct ExplorationQuery {
    /// Ids of robots, with commas between them, each taken to be at the newest pose of its open session
    /// on the map. With neither robots nor positions: every robot that has an open session there.
    #[param(example = "rover-1,rover-2")]
    robots: Option<String>,
    /// Places that are asked about as if robots were there: `x,y` in metres in the frame that is
    /// explored, with semicolons between them. With the robots 32 at most.
    #[param(example = "1.5,2;-3,0.25")]
    positions: Option<String>,
    /// Name of a profile, of which only the radius counts; absent for `default`.
    profile: Option<String>,
    /// Radius of the robots, metres, 0 to 5.
    robot_radius_m: Option<f64>,
    /// Number of a version; absent for the map as it is now, with what was mapped since the last one.
    map_version: Option<u64>,
    /// A session of unknown start: the frame that it maps in is explored instead of the map's.
    session: Option<String>,
    /// `json` is the default.
    #[serde(default)]
    #[param(inline)]
    format: ExplorationFormat,
}

/// Where robots are to go, and what is left.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Exploration {
    /// Id of the map.
    map: String,
    /// The newest version that was there, or the one asked for; 0 before the first.
    map_version: Unsigned64,
    cost_revision: Unsigned64,
    /// Whether the answer is from the map as it grows, beyond that version.
    live: bool,
    /// Radius that the answer holds for, in metres.
    #[schema(example = 0.25)]
    robot_radius_m: f64,
    /// In the order asked, or by when their sessions were opened.
    robots: Vec<RobotExploration>,
    /// Whether none of them, and at least one has a place in the map, can reach anything unexplored.
    explored: bool,
    /// The longest, at most 256.
    frontiers: Vec<Frontier>,
    /// Length of all frontiers, in metres; 0 when all is explored. How much lies behind nobody knows.
    frontier_m: f64,
    /// Area that was observed, in square metres.
    observed_m2: f64,
    /// Area that the centre of one of them can reach without leaving what was observed, in square
    /// metres.
    reached_m2: f64,
    planning_time_us: Signed64,
    /// The session in whose frame all of this is; absent for the map's frame.
    #[serde(skip_serializing_if = "String::is_empty")]
    #[schema(required = false)]
    frame_session: String,
    /// Ids of closed arcs that the version does not have: nothing stands in the way there.
    missing_arcs: Vec<Unsigned64>,
}

/// What one robot is to do.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct RobotExploration {
    /// Id of the robot; absent for a position that was asked about.
    #[serde(skip_serializing_if = "String::is_empty")]
    #[schema(required = false, example = "rover-1")]
    robot: String,
    /// The session whose pose was taken; absent if there is none.
    #[serde(skip_serializing_if = "String::is_empty")]
    #[schema(required = false)]
    session: String,
    /// `OK`: go to the goal. `EXPLORED`: it can reach nothing that is unexplored; one wrong reading may
    /// close a door for a moment, so look around and ask again. `LEFT_TO_OTHERS`: the others will see all that it can reach. `START_OCCUPIED`: it does not fit where it is.
    /// `OUTSIDE_MAP`: it is away from all that was observed. `NOT_PLACED`: nobody knows where in the
    /// frame that is explored it is.
    #[schema(example = "OK")]
    code: &'static str,
    /// Where it was taken to be, in the frame that is explored; absent if `NOT_PLACED`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pose: Option<Pose>,
    /// When it was there, by the robot's clock, in nanoseconds; 0 for a position.
    stamp_ns: Signed64,
    /// Centre of the nearest unexplored cell, in the same frame; this and what follows only if `OK`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    goal: Option<Point>,
    /// Where to head for now, in radians in that frame; absent at the goal.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    heading_rad: Option<f64>,
    /// Length of the way, in metres.
    distance_m: f64,
    /// The way: where it starts, turns and ends, in that frame, clear of obstacles by the radius.
    points: Vec<Point>,
    /// If `NOT_PLACED` because it maps in another frame: the session to ask with; empty for the map's
    /// frame, which is asked about without one.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    frame_session: Option<String>,
}

/// Unexplored cells side by side, one step from ground that can be reached.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Frontier {
    /// The one in the middle, in the frame that is explored.
    point: Point,
    /// So many cells' edges, in metres.
    length_m: f64,
}

impl From<v1::Exploration> for Exploration {
    fn from(wire: v1::Exploration) -> Self {
        let v1::Exploration {
            map,
            map_version,
            cost_revision,
            live,
            robot_radius_m,
            robots,
            explored,
            frontiers,
            frontier_m,
            observed_m2,
            reached_m2,
            planning_time_us,
            frame_session,
            missing_arcs,
        } = wire;
        let frontier = |v1::Frontier { point, length_m }| Frontier {
            point: point.unwrap_or_default().into(),
            length_m,
        };
        Self {
            map,
            map_version: Unsigned64(map_version),
            cost_revision: Unsigned64(cost_revision),
            live,
            robot_radius_m,
            robots: robots.into_iter().map(RobotExploration::from).collect(),
            explored,
            frontiers: frontiers.into_iter().map(frontier).collect(),
            frontier_m,
            observed_m2,
            reached_m2,
            planning_time_us: Signed64(planning_time_us),
            frame_session,
            missing_arcs: missing_arcs.into_iter().map(Unsigned64).collect(),
        }
    }
}

impl From<v1::RobotExploration> for RobotExploration {
    fn from(wire: v1::RobotExploration) -> Self {
        let code = code_name(wire.code());
        let v1::RobotExploration {
            robot,
            session,
            code: _,
            pose,
            stamp_ns,
            goal,
            heading_rad,
            distance_m,
            points,
            frame_session,
        } = wire;
        Self {
            robot,
            session,
            code,
            pose: pose.map(Pose::from),
            stamp_ns: Signed64(stamp_ns),
            goal: goal.map(Point::from),
            heading_rad,
            distance_m,
            points: points.into_iter().map(Point::from).collect(),
            frame_session,
        }
    }
}

/// A code as JSON and people read it.
pub(crate) fn code_name(code: v1::ExplorationCode) -> &'static str {
    use v1::ExplorationCode as Code;
    match code {
        Code::Unspecified => "UNSPECIFIED",
        Code::Ok => "OK",
        Code::Explored => "EXPLORED",
        Code::LeftToOthers => "LEFT_TO_OTHERS",
        Code::StartOccupied => "START_OCCUPIED",
        Code::OutsideMap => "OUTSIDE_MAP",
        Code::NotPlaced => "NOT_PLACED",
    }
}

/// Who is asked about.
fn explorers(
    robots: Option<String>,
    positions: Option<String>,
) -> Result<Vec<v1::Explorer>, Error> {
    use v1::explorer::Kind;
    let robots = robots.unwrap_or_default();
    let robots = robots.split(',').map(str::trim).filter(|name| !name.is_empty());
    let robots = robots.map(|name| Ok(Kind::Robot(name.to_owned())));
    let positions = positions.unwrap_or_default();
    let positions = positions.split(';').filter(|text| !text.trim().is_empty());
    let positions = positions.map(|text| position(text).map(Kind::Position));
    let explorer = |kind: Result<Kind, Error>| Ok(v1::Explorer { kind: Some(kind?) });
    robots.chain(positions).map(explorer).collect()
}

/// Reads `x,y` in metres.
fn position(text: &str) -> Result<v1::Point, Error> {
    let numbers: Option<Vec<f64>> =
        text.split(',').map(|number| number.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x_m, y_m]) => Ok(v1::Point { x_m, y_m }),
        _ => {
            let shown: String = text.chars().take(80).collect();
            Err(Error::field("positions", format!("`{shown}` is not x,y: two numbers in metres")))
        }
    }
}

/// Where robots go to see what nobody has seen, and how much is left.
///
/// A robot explores by asking again while it drives, every second or so: the answer holds for what is
/// mapped then, after every correction of the map. `NOTHING_OBSERVED` before the first scan is mapped. One
/// whose start is unknown asks with `session` until it is placed, which `SESSION_PLACED` says. Obstacles and
/// closed arcs of the map's frame bar ways; tolls and zones do not.
#[utoipa::path(
    get,
    path = "/v1/maps/{map}/exploration",
    tag = "plans",
    params(MapPath, ExplorationQuery),
    responses(
        (status = 200, description = "A goal for each, or why there is none.",
            content((Exploration = "application/json"), ("image/png"))),
        SessionGridProblems,
    )
)]
pub(super) async fn get_exploration(
    State(rest): State<Rest>,
    Path(path): Path<MapPath>,
    Query(query): Query<ExplorationQuery>,
) -> Result<Response, Refusal> {
    let ExplorationQuery {
        robots,
        positions,
        profile,
        robot_radius_m,
        map_version,
        session,
        format,
    } = query;
    let picture = format == ExplorationFormat::Png;
    let request = v1::GetExplorationRequest {
        map: path.map,
        explorers: explorers(robots, positions)?,
        robot: robot(profile, robot_radius_m)?,
        map_version: map_version.unwrap_or(0),
        picture,
        session: session.unwrap_or_default(),
    };
    let v1::GetExplorationResponse { exploration, png } =
        rest.service.get_exploration(request).await?;
    if picture {
        return Ok(([(header::CONTENT_TYPE, "image/png")], png).into_response());
    }
    Ok(ok(&Exploration::from(filled(exploration, "exploration")?)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn robots_and_positions() {
        use v1::explorer::Kind;
        let read = explorers(Some("a, b".into()), Some("1,-2.5;3e0,4".into())).expect("four");
        let kinds: Vec<Kind> = read.into_iter().filter_map(|explorer| explorer.kind).collect();
        let point = |x_m, y_m| Kind::Position(v1::Point { x_m, y_m });
        let robot = |name: &str| Kind::Robot(name.to_owned());
        assert_eq!(kinds, [robot("a"), robot("b"), point(1.0, -2.5), point(3.0, 4.0)], "in order");
        assert_eq!(explorers(None, Some(String::new())).expect("nobody"), [], "nobody");
        assert_eq!(
            explorers(None, Some("1".into())).expect_err("one number").to_string(),
            "positions: `1` is not x,y: two numbers in metres",
            "what is wrong is told"
        );
    }
}
