//! `/v1/robots`.

use axum::extract::State;
use axum::http::StatusCode;
use axum::response::Response;
use meetpoint_proto::v1;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::Rest;
use super::idempotency::{Creation, IdempotencyKey, Reply, once};
use super::integer::{Signed64, Unsigned64};
use super::openapi::{CreationProblems, ListProblems, ReadProblems};
use super::page::Page;
use super::problem::Refusal;
use super::reply::{filled, ok};
use super::request::{JsonBody, Path, Query};

const CREATION: Creation =
    Creation { route: "POST /v1/robots", collection: Some("/v1/robots"), id: "/id" };

/// A machine.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Robot {
    /// Chosen by people: 1 to 63 of a-z, 0-9, `-`, `_`, beginning with a letter or digit.
    #[schema(example = "rover-1")]
    id: String,
    /// For people. May be empty.
    display_name: String,
    /// The highest epoch that the robot has opened a session with. Older ones are fenced.
    epoch: Unsigned64,
    /// When it was registered, by the service's clock, nanoseconds since 1970.
    create_time_ns: Signed64,
}

impl From<v1::Robot> for Robot {
    fn from(wire: v1::Robot) -> Self {
        let v1::Robot { id, display_name, epoch, create_time_ns } = wire;
        Self {
            id,
            display_name,
            epoch: Unsigned64(epoch),
            create_time_ns: Signed64(create_time_ns),
        }
    }
}

/// A robot to be registered.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct NewRobot {
    /// 1 to 63 of a-z, 0-9, `-`, `_`, beginning with a letter or digit. Never used again for another.
    #[schema(pattern = "^[a-z0-9][a-z0-9_-]{0,62}$", example = "rover-1")]
    id: String,
    /// For people: up to 200 characters.
    #[serde(default)]
    #[schema(max_length = 200, example = "The first rover")]
    display_name: String,
}

impl From<NewRobot> for v1::CreateRobotRequest {
    fn from(robot: NewRobot) -> Self {
        let NewRobot { id, display_name } = robot;
        Self { robot: Some(v1::Robot { id, display_name, ..v1::Robot::default() }) }
    }
}

/// A page of robots.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct RobotList {
    robots: Vec<Robot>,
    /// Empty on the last page.
    next_page_token: String,
}

/// Names a robot.
#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
pub(crate) struct RobotPath {
    /// Id of the robot.
    #[param(example = "rover-1")]
    robot: String,
}

/// Registers a robot. A robot's first session does so too.
#[utoipa::path(
    post,
    path = "/v1/robots",
    tag = "robots",
    params(IdempotencyKey),
    request_body = NewRobot,
    responses(
        (status = 201, description = "The new robot.", body = Robot,
            headers(("Location" = String, description = "Where it is found."))),
        CreationProblems,
    )
)]
pub(super) async fn create_robot(
    State(rest): State<Rest>,
    key: IdempotencyKey,
    body: JsonBody<NewRobot>,
) -> Result<Response, Refusal> {
    let service = rest.service.clone();
    once(&rest, &CREATION, key, body.fingerprint, async move {
        let v1::CreateRobotResponse { robot } = service.create_robot(body.value.into()).await?;
        Ok(Reply::new(StatusCode::CREATED, &Robot::from(filled(robot, "robot")?))?)
    })
    .await
}

/// All robots, by id.
#[utoipa::path(
    get,
    path = "/v1/robots",
    tag = "robots",
    params(Page),
    responses((status = 200, description = "A page of robots.", body = RobotList), ListProblems)
)]
pub(super) async fn list_robots(
    State(rest): State<Rest>,
    Query(page): Query<Page>,
) -> Result<Response, Refusal> {
    let Page { page_size, page_token } = page;
    let request = v1::ListRobotsRequest { page_size, page_token };
    let reply = rest.service.list_robots(request).await?;
    let v1::ListRobotsResponse { robots, next_page_token } = reply;
    Ok(ok(&RobotList { robots: robots.into_iter().map(Robot::from).collect(), next_page_token }))
}

/// One robot.
#[utoipa::path(
    get,
    path = "/v1/robots/{robot}",
    tag = "robots",
    params(RobotPath),
    responses((status = 200, description = "The robot.", body = Robot), ReadProblems)
)]
pub(super) async fn get_robot(
    State(rest): State<Rest>,
    Path(path): Path<RobotPath>,
) -> Result<Response, Refusal> {
    let request = v1::GetRobotRequest { robot: path.robot };
    let v1::GetRobotResponse { robot } = rest.service.get_robot(request).await?;
    Ok(ok(&Robot::from(filled(robot, "robot")?)))
}
