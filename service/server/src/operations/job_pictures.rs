//! Pictures of what jobs found.

use meetpoint_geometry::Point2;
use meetpoint_proto::v1;

use crate::convert::way_picture::{self, Way};
use crate::{error::Error, service::Service};

/// Poses read at a time.
const N_POSES_READ: u32 = 100_000;

impl Service {
    /// A session's way and landmarks in the version that a relax job made, or in the one before.
    pub(crate) async fn get_job_picture(
        &self,
        request: v1::GetJobPictureRequest,
    ) -> Result<v1::GetJobPictureResponse, Error> {
        let v1::GetJobPictureRequest { job: id, picture, session: asked } = request;
        let picture = v1::JobPicture::try_from(picture).unwrap_or_default();
        let v1::GetJobResponse { job } =
            self.get_job(v1::GetJobRequest { job: id.clone() }).await?;
        let job = job.unwrap_or_default();
        let Some(v1::job::Result::RelaxResult(v1::RelaxResult { sessions })) = job.result else {
            return Err(Error::NoPicture(job.id));
        };
        let mut names = sessions.into_iter().map(|found| found.session);
        let session =
            if asked.is_empty() { names.next() } else { names.find(|name| *name == asked) };
        let session = session.ok_or_else(|| Error::NoPicture(job.id.clone()))?;
        let after = self.way(&job.map, &session, job.result_version).await?;
        let before = match job.result_version.saturating_sub(1) {
            0 => Way::default(),
            number => self.way(&job.map, &session, number).await?,
        };
        let drawn = tokio::task::spawn_blocking(move || match picture {
            v1::JobPicture::Before => way_picture::png(&before, &after),
            v1::JobPicture::After => way_picture::png(&after, &before),
            v1::JobPicture::Unspecified => Err(Error::field("picture", "missing")),
        });
        Ok(v1::GetJobPictureResponse { png: drawn.await.map_err(Error::internal)?? })
    }

    /// A session's way and landmarks in a version; empty where the version has none.
    async fn way(&self, map: &str, session: &str, version: u64) -> Result<Way, Error> {
        let point = |at: v1::Point| Point2::new(at.x_m, at.y_m);
        let mut way = Way::default();
        let mut request = v1::GetTrajectoryRequest {
            session: session.to_owned(),
            version,
            page_size: N_POSES_READ,
            ..v1::GetTrajectoryRequest::default()
        };
        let detectors = self.detectors(session).await?;
        loop {
            let page = match self.get_trajectory(request.clone()).await {
                Ok(page) => page,
                Err(Error::NothingPublished(_)) => break,
                Err(error) => return Err(error),
            };
            for pose in page.trajectory.into_iter().flat_map(|trajectory| trajectory.poses) {
                let v1::Pose { x_m, y_m, .. } = pose.pose.unwrap_or_default();
                way.points.push(Point2::new(x_m, y_m));
                if detectors.contains(&pose.sensor_id) {
                    way.seen.push(Point2::new(x_m, y_m));
                }
            }
            if page.next_offset == 0 {
                break;
            }
            request.offset = page.next_offset;
        }
        let landmarks = self.all_landmarks(map, version).await?;
        let own = landmarks.into_iter().filter(|landmark| landmark.session == session);
        way.landmarks = own
            .map(|landmark| {
                let v1::Covariance { xx_m2, xy_m2, yy_m2 } =
                    landmark.covariance.unwrap_or_default();
                (point(landmark.position.unwrap_or_default()), [xx_m2, xy_m2, yy_m2])
            })
            .collect();
        Ok(way)
    }

    /// The sensors of a session that see landmarks.
    async fn detectors(&self, session: &str) -> Result<Vec<String>, Error> {
        let request = v1::GetSessionRequest { session: session.to_owned() };
        let sensors = self.get_session(request).await?.session.unwrap_or_default().sensors;
        let is_detector = |sensor: &v1::Sensor| {
            matches!(sensor.kind, Some(v1::sensor::Kind::LandmarkDetector(_)))
        };
        Ok(sensors.into_iter().filter(is_detector).map(|sensor| sensor.id).collect())
    }
}
