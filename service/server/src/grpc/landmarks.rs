//! `LandmarkService`.

use meetpoint_proto::v1;
use tonic::{Request, Response, Status};
use v1::landmark_service_server::LandmarkService;

use crate::service::Service;

#[tonic::async_trait]
impl LandmarkService for Service {
    async fn list_landmarks(
        &self,
        request: Request<v1::ListLandmarksRequest>,
    ) -> Result<Response<v1::ListLandmarksResponse>, Status> {
        Ok(self.list_landmarks(request.into_inner()).await?.into())
    }

    async fn get_whereabouts(
        &self,
        request: Request<v1::GetWhereaboutsRequest>,
    ) -> Result<Response<v1::GetWhereaboutsResponse>, Status> {
        Ok(self.get_whereabouts(request.into_inner()).await?.into())
    }
}
