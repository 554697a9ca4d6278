//! Pictures of what jobs found.

use meetpoint_geometry::Point2;
use meetpoint_proto::v1;

use crate::convert::way_picture::{self, Way};
use crate::convert::{job, landmark, session, table_picture};
use crate::jobs::relax::tables::{Which, table};
use crate::{error::Error, service::Service};

/// Poses read at a time.
const N_POSES_READ: u32 = 100_000;

impl Service {
    /// A session's way and landmarks in the version that a relax job made, or in the one before, or a
    /// table of probabilities.
    pub(crate) async fn get_job_picture(
        &self,
        request: v1::GetJobPictureRequest,
    ) -> Result<v1::GetJobPictureResponse, Error> {
        let v1::GetJobPictureRequest { job: id, picture, session: asked, step } = request;
        let picture = v1::JobPicture::try_from(picture).unwrap_or_default();
        let record = self.job_record(&id).await?;
        let wire = job::to_wire(record.clone());
        let no_picture = || Error::NoPicture(wire.id.clone());
        let Some(v1::job::Result::RelaxResult(v1::RelaxResult { sessions })) = &wire.result else {
            return Err(no_picture());
        };
        let mut names = sessions.iter().map(|found| found.session.clone());
        let session =
            if asked.is_empty() { names.next() } else { names.find(|name| *name == asked) };
        let session = session.ok_or_else(no_picture)?;
        let which = match picture {
            v1::JobPicture::Unspecified => return Err(Error::field("picture", "missing")),
            v1::JobPicture::Before | v1::JobPicture::After => None,
            v1::JobPicture::Alpha => Some(Which::Alpha),
            v1::JobPicture::Beta => Some(Which::Beta),
            v1::JobPicture::Posterior => Some(Which::Posterior),
        };
        if let Some(which) = which {
            let at = (which, usize::try_from(step).unwrap_or(usize::MAX));
            let id = session::id("session", &session)?;
            let table = table(self, &record, id, at).await?.ok_or_else(no_picture)?;
            let drawn = tokio::task::spawn_blocking(move || table_picture::png(&table));
            return Ok(v1::GetJobPictureResponse { png: drawn.await.map_err(Error::internal)?? });
        }
        self.way_picture(&wire, &session, picture == v1::JobPicture::After).await
    }

    /// A session's way after a job, or before it.
    async fn way_picture(
        &self,
        job: &v1::Job,
        session: &str,
        is_after: bool,
    ) -> Result<v1::GetJobPictureResponse, Error> {
        let after = self.way(&job.map, session, job.result_version).await?;
        let before = match job.result_version.saturating_sub(1) {
            0 => Way::default(),
            number => self.way(&job.map, session, number).await?,
        };
        let drawn = tokio::task::spawn_blocking(move || {
            if is_after {
                way_picture::png(&after, &before)
            } else {
                way_picture::png(&before, &after)
            }
        });
        Ok(v1::GetJobPictureResponse { png: drawn.await.map_err(Error::internal)?? })
    }

    /// A session's way and landmarks in a version; empty where the version has none.
    pub(super) async fn way(&self, map: &str, session: &str, version: u64) -> Result<Way, Error> {
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
        way.landmarks = own.map(|own| landmark::place(&own)).collect();
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
