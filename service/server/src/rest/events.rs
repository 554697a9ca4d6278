//! `/v1/events`: what happens, by server-sent events.

use axum::extract::State;
use axum::response::Response;
use meetpoint_proto::v1;
use meetpoint_storage::MapId;
use serde::{Deserialize, Serialize};
use tokio::sync::broadcast::error::RecvError;
use utoipa::{IntoParams, ToSchema};

use super::Rest;
use super::costs::CostsChanged;
use super::geometry::Pose;
use super::integer::{Signed64, Unsigned64};
use super::jobs::Job;
use super::openapi::ReadProblems;
use super::problem::Refusal;
use super::request::Query;
use super::sessions::Session;
use super::sse::{Gone, Watcher};
use super::versions::MapVersion;
use crate::error::Error;
use crate::live::Event;
use crate::service::Service;

/// Where a robot of a session was.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct SessionCorrection {
    /// Id of the map.
    map: String,
    /// Id of the session.
    session: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    correction: Option<PoseCorrection>,
}

impl SessionCorrection {
    fn new(map: MapId, wire: v1::SessionCorrection) -> Self {
        let v1::SessionCorrection { session, correction } = wire;
        Self { map: map.0, session, correction: correction.map(PoseCorrection::from) }
    }
}

/// Where the robot was at one of its scans, after matching.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct PoseCorrection {
    batch_number: Unsigned64,
    /// The robot's clock: the scan's stamp, nanoseconds.
    stamp_ns: Signed64,
    /// The sensor whose reading it is.
    sensor_id: String,
    /// The robot's pose in the map (in the frame of `frame_session` while the session is not placed).
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    map_from_robot: Option<Pose>,
    /// To be put before the robot's own odometry.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    map_from_odometry: Option<Pose>,
    /// True if the tracker does not trust it.
    lost: bool,
    /// The session in whose frame the poses are; absent for the map's frame. It changes when a merge is
    /// accepted or undone: from then on earlier poses are of no use beside later ones.
    #[serde(skip_serializing_if = "String::is_empty")]
    #[schema(required = false)]
    frame_session: String,
}

impl From<v1::PoseCorrection> for PoseCorrection {
    fn from(wire: v1::PoseCorrection) -> Self {
        let v1::PoseCorrection {
            batch_number,
            stamp_ns,
            sensor_id,
            map_from_robot,
            map_from_odometry,
            lost,
            frame_session,
        } = wire;
        Self {
            batch_number: Unsigned64(batch_number),
            stamp_ns: Signed64(stamp_ns),
            sensor_id,
            map_from_robot: map_from_robot.map(Pose::from),
            map_from_odometry: map_from_odometry.map(Pose::from),
            lost,
            frame_session,
        }
    }
}

/// Events that a slow watcher missed.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Lagged {
    /// How many, over all maps.
    left_out: Unsigned64,
}

/// Which events are asked for.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct EventsQuery {
    /// Only this map's; absent or empty for all.
    #[serde(default)]
    #[param(example = "intel")]
    map: String,
}

/// What happens from now on, by server-sent events.
///
/// `version`: a version was made, or the pointer moved (a map version). `session`: one opened, closed or
/// was fenced (a session). `correction`: where a robot was (a session correction). `job`: a job moved on
/// (a job). `lagged`: this watcher was too slow and missed `left_out` events: read again what matters.
/// `costs`: a cost or a profile was changed (costs changed). `error`: a problem document; the stream ends. Comments keep it alive.
#[utoipa::path(
    get,
    path = "/v1/events",
    tag = "events",
    params(EventsQuery),
    responses(
        (status = 200, description = "Events, each with JSON.",
            content_type = "text/event-stream", body = String),
        ReadProblems,
    )
)]
pub(super) async fn watch_events(
    State(rest): State<Rest>,
    Query(query): Query<EventsQuery>,
) -> Result<Response, Refusal> {
    let EventsQuery { map } = query;
    let map = if map.is_empty() { None } else { Some(rest.service.map_record(&map).await?.id) };
    let (watcher, response) = Watcher::new();
    tokio::spawn(watch(rest.service, map, watcher));
    Ok(response)
}

async fn watch(service: Service, only: Option<MapId>, watcher: Watcher) {
    let mut events = service.live.watch();
    loop {
        let event = tokio::select! {
            event = events.recv() => event,
            () = service.stop.cancelled() => return watcher.send_error(Error::Stopping).await,
            () = watcher.gone() => return,
        };
        let sent = match event {
            Ok((map, event)) if only.as_ref().is_none_or(|only| *only == map) => {
                send(&service, &watcher, map, event).await
            }
            Ok(_) => Ok(()),
            Err(RecvError::Lagged(n)) => {
                watcher.send("lagged", &Lagged { left_out: Unsigned64(n) }).await
            }
            Err(RecvError::Closed) => return,
        };
        if sent.is_err() {
            return;
        }
    }
}

async fn send(service: &Service, watcher: &Watcher, map: MapId, event: Event) -> Result<(), Gone> {
    match event {
        Event::Version(version) => watcher.send("version", &MapVersion::from(version)).await,
        Event::Session(session) => watcher.send("session", &Session::from(*session)).await,
        Event::Correction(correction) => {
            watcher.send("correction", &SessionCorrection::new(map, correction)).await
        }
        Event::Costs(costs) => watcher.send("costs", &CostsChanged::from(costs)).await,
        Event::Job(id) => {
            let request = v1::GetJobRequest { job: id.0.to_string() };
            match service.get_job(request).await {
                Ok(v1::GetJobResponse { job: Some(job) }) => {
                    watcher.send("job", &Job::from(job)).await
                }
                Ok(v1::GetJobResponse { job: None }) => Ok(()),
                Err(error) => {
                    watcher.send_error(error).await;
                    Err(Gone)
                }
            }
        }
    }
}
