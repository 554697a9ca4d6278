//! Trajectories of sessions, as a map version holds them.

use meetpoint_geometry::Pose;
use meetpoint_proto::v1;

use crate::convert::{pose, sensor, session, trajectory};
use crate::{error::Error, service::Service};

/// Poses a page where nothing is asked for, and at most: 64 bytes each on the wire.
const N_POSES_DEFAULT: u32 = 10_000;
const N_POSES_MAX: u32 = 100_000;

impl Service {
    /// A page of a session's estimated poses.
    pub(crate) async fn get_trajectory(
        &self,
        request: v1::GetTrajectoryRequest,
    ) -> Result<v1::GetTrajectoryResponse, Error> {
        let v1::GetTrajectoryRequest { session: id, version, frame, offset, page_size } = request;
        let record = self.session_record(&id).await?;
        let sensors = sensor::sensors(&session::declaration(&record.declaration)?.sensors)?;
        let robot_from_frame = trajectory::robot_from_frame(&frame, &sensors)?;
        let version = self.version_record(&record.map.0, version).await?;
        let limit = if page_size == 0 { N_POSES_DEFAULT } else { page_size.min(N_POSES_MAX) };
        let page =
            self.store.trajectory(record.id, version.number, offset, limit).await?.ok_or_else(
                || Error::NothingPublished(format!("{}` of session `{id}", record.map.0)),
            )?;
        let placed = record.map_from_session.map(pose::from_record);
        let reference_from_session = placed.unwrap_or(Pose::IDENTITY);
        let to_wire = |stored| {
            trajectory::pose_to_wire(stored, reference_from_session, robot_from_frame, &sensors)
        };
        let end = offset + page.poses.len() as u64;
        Ok(v1::GetTrajectoryResponse {
            trajectory: Some(v1::Trajectory {
                session: id,
                map: record.map.0,
                map_version: version.number,
                reference_frame: if placed.is_some() { "map" } else { "session" }.to_owned(),
                frame: if frame.is_empty() { "robot".to_owned() } else { frame },
                origin: trajectory::origin_to_wire(page.origin).into(),
                poses: page.poses.iter().map(to_wire).collect(),
            }),
            next_offset: if end < page.n_poses { end } else { 0 },
        })
    }
}
