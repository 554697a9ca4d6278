//! `ExplorationService`.

use meetpoint_proto::v1;
use tonic::{Request, Response, Status};
use v1::exploration_service_server::ExplorationService;

use crate::service::Service;

#[tonic::async_trait]
impl ExplorationService for Service {
    async fn get_exploration(
        &self,
        request: Request<v1::GetExplorationRequest>,
    ) -> Result<Response<v1::GetExplorationResponse>, Status> {
        Ok(self.get_exploration(request.into_inner()).await?.into())
    }
}
