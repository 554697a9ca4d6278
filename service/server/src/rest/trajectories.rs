//! `/v1/sessions/{session}/trajectory`.

use axum::extract::State;
use axum::response::Response;
use meetpoint_proto::v1;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::Rest;
use super::geometry::Pose;
use super::integer::{Signed64, Unsigned64};
use super::openapi::ReadProblems;
use super::problem::Refusal;
use super::reply::{filled, ok_long};
use super::request::{Path, Query, version_number};
use super::session_routes::SessionPath;
use super::tum;
use crate::error::Error;

/// The estimated poses of a session, in the order in which its observations were received.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Trajectory {
    /// Id of the session.
    session: String,
    /// Id of the map.
    map: String,
    /// The map version that it belongs to.
    map_version: Unsigned64,
    /// `map`, or `session` while a session of unknown start is not placed.
    #[schema(example = "map")]
    reference_frame: String,
    /// Whose pose: `robot` or a sensor's id.
    #[schema(example = "robot")]
    frame: String,
    origin: TrajectoryOrigin,
    poses: Vec<TrajectoryPose>,
    /// The `offset` of the next page; absent at the end.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    next_offset: Option<Unsigned64>,
}

impl Trajectory {
    /// A trajectory, or the part of it before `next_offset` (0 at the end).
    pub(crate) fn new(wire: v1::Trajectory, next_offset: u64) -> Self {
        let v1::Trajectory { session, map, map_version, reference_frame, frame, origin, poses } =
            wire;
        Self {
            session,
            map,
            map_version: Unsigned64(map_version),
            reference_frame,
            frame,
            origin: v1::TrajectoryOrigin::try_from(origin).unwrap_or_default().into(),
            poses: poses.into_iter().map(TrajectoryPose::from).collect(),
            next_offset: Unsigned64::above_zero(next_offset),
        }
    }
}

/// How the poses were estimated.
#[derive(Clone, Copy, Debug, Serialize, ToSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub(crate) enum TrajectoryOrigin {
    /// Not told by the service of that version.
    Unspecified,
    /// Dead reckoning alone.
    Odometry,
    /// Odometry and matching against the map, scan by scan.
    Tracking,
    /// The past repaired by a relax job.
    Relaxation,
}

impl From<v1::TrajectoryOrigin> for TrajectoryOrigin {
    fn from(wire: v1::TrajectoryOrigin) -> Self {
        match wire {
            v1::TrajectoryOrigin::Unspecified => Self::Unspecified,
            v1::TrajectoryOrigin::Odometry => Self::Odometry,
            v1::TrajectoryOrigin::Tracking => Self::Tracking,
            v1::TrajectoryOrigin::Relaxation => Self::Relaxation,
        }
    }
}

/// Where the robot, or its sensor, was at one reading.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct TrajectoryPose {
    /// The robot's clock: the scan's stamp, nanoseconds.
    stamp_ns: Signed64,
    /// The sensor whose reading it is.
    sensor_id: String,
    /// In the frame that `reference_frame` names.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pose: Option<Pose>,
    /// True if the tracker did not trust this pose; the scan was not drawn into the map.
    lost: bool,
}

impl From<v1::TrajectoryPose> for TrajectoryPose {
    fn from(wire: v1::TrajectoryPose) -> Self {
        let v1::TrajectoryPose { stamp_ns, sensor_id, pose, lost } = wire;
        Self { stamp_ns: Signed64(stamp_ns), sensor_id, pose: pose.map(Pose::from), lost }
    }
}

/// What a trajectory is given as.
#[derive(Clone, Copy, Debug, Default, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum TrajectoryFormat {
    /// A page, with everything known of each pose.
    #[default]
    Json,
    /// All poses as text: `t x y z qx qy qz qw`, seconds and metres.
    Tum,
}

/// Which trajectory is asked for.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct TrajectoryQuery {
    /// `json` (the default) gives a page, `tum` gives all poses from `offset` on.
    #[serde(default)]
    #[param(inline)]
    format: TrajectoryFormat,
    /// Number of a map version from 1 on; absent or `latest` for the published one.
    #[param(pattern = "^(latest|[1-9][0-9]*)$", example = "latest")]
    version: Option<String>,
    /// Whose poses: `robot` (the default) or the id of a sensor.
    #[serde(default)]
    #[param(example = "robot")]
    frame: String,
    /// Leaves out this many poses.
    #[serde(default)]
    #[param(minimum = 0)]
    offset: u64,
    /// Poses wanted: 0 or absent for the default of 10 000; cut at 100 000. Only with `json`.
    #[serde(default)]
    #[param(minimum = 0, maximum = 4_294_967_295_u32, example = 1000)]
    page_size: u32,
}

/// The estimated poses of a session.
///
/// As TUM each line is `t x y z qx qy qz qw`: the stamp in seconds with nine decimals, exactly; metres;
/// z, qx and qy are 0. The headers say the map version and the frames.
#[utoipa::path(
    get,
    path = "/v1/sessions/{session}/trajectory",
    tag = "sessions",
    params(SessionPath, TrajectoryQuery),
    responses(
        (status = 200, description = "The poses.",
            content(
                (Trajectory = "application/json"),
                (String = "text/plain", example = "1763840000.010000000 1.25 -0.5 0 0 0 0.7071067811865475 0.7071067811865476"),
            ),
            headers(
                ("Meetpoint-Map-Version" = u64, description = "The map version that it belongs to. With `tum`."),
                ("Meetpoint-Reference-Frame" = String, description = "`map` or `session`. With `tum`."),
                ("Meetpoint-Frame" = String, description = "Whose poses: `robot` or a sensor's id. With `tum`."),
            )),
        ReadProblems,
    )
)]
pub(super) async fn get_trajectory(
    State(rest): State<Rest>,
    Path(path): Path<SessionPath>,
    Query(query): Query<TrajectoryQuery>,
) -> Result<Response, Refusal> {
    let TrajectoryQuery { format, version, frame, offset, page_size } = query;
    let version = version.as_deref().map_or(Ok(0), version_number)?;
    let request =
        v1::GetTrajectoryRequest { session: path.session, version, frame, offset, page_size };
    match format {
        TrajectoryFormat::Json => {
            let reply = rest.service.get_trajectory(request).await?;
            let v1::GetTrajectoryResponse { trajectory, next_offset } = reply;
            let trajectory = filled(trajectory, "trajectory")?;
            ok_long(Trajectory::new(trajectory, next_offset)).await
        }
        TrajectoryFormat::Tum if page_size == 0 => tum::all_poses(rest.service, request).await,
        TrajectoryFormat::Tum => {
            Err(Error::field("page_size", "only with format=json; tum gives all poses").into())
        }
    }
}
