//! `GridService`.

use meetpoint_proto::v1;
use tonic::{Request, Response, Status};
use v1::grid_service_server::GridService;

use crate::service::Service;

#[tonic::async_trait]
impl GridService for Service {
    async fn get_grid(
        &self,
        request: Request<v1::GetGridRequest>,
    ) -> Result<Response<v1::GetGridResponse>, Status> {
        Ok(self.get_grid(request.into_inner()).await?.into())
    }

    async fn get_session_grid(
        &self,
        request: Request<v1::GetSessionGridRequest>,
    ) -> Result<Response<v1::GetSessionGridResponse>, Status> {
        Ok(self.get_session_grid(request.into_inner()).await?.into())
    }
}
