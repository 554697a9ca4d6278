//! Where robots are that do not know where they started.

use meetpoint_proto::v1;

use crate::jobs::relax::whereabouts::{KnownLandmarks, whereabouts};
use crate::{error::Error, service::Service};

impl Service {
    /// Where a session's robot is among the landmarks of its map that others saw.
    pub(crate) async fn get_whereabouts(
        &self,
        request: v1::GetWhereaboutsRequest,
    ) -> Result<v1::GetWhereaboutsResponse, Error> {
        let v1::GetWhereaboutsRequest { session, step, picture } = request;
        let record = self.session_record(&session).await?;
        let version = self.version_record(&record.map.0, 0).await?;
        let mut landmarks = self.all_landmarks(&version.map.0, version.number).await?;
        let own = record.id.0.to_string();
        landmarks.retain(|landmark| landmark.session != own);
        let known =
            KnownLandmarks { map: version.map.0.clone(), version: version.number, landmarks };
        whereabouts(self, &record, known, (step, picture)).await
    }
}
