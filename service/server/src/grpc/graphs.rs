//! `GraphService`.

use meetpoint_proto::v1;
use tonic::{Request, Response, Status};
use v1::graph_service_server::GraphService;

use crate::service::Service;

#[tonic::async_trait]
impl GraphService for Service {
    async fn get_graph(
        &self,
        request: Request<v1::GetGraphRequest>,
    ) -> Result<Response<v1::GetGraphResponse>, Status> {
        Ok(self.get_graph(request.into_inner()).await?.into())
    }

    async fn get_region(
        &self,
        request: Request<v1::GetRegionRequest>,
    ) -> Result<Response<v1::GetRegionResponse>, Status> {
        Ok(self.get_region(request.into_inner()).await?.into())
    }
}
