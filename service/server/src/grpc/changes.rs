//! `ChangeService`.

use meetpoint_proto::v1;
use tonic::{Request, Response, Status};
use v1::change_service_server::ChangeService;

use crate::service::Service;

#[tonic::async_trait]
impl ChangeService for Service {
    async fn list_changes(
        &self,
        request: Request<v1::ListChangesRequest>,
    ) -> Result<Response<v1::ListChangesResponse>, Status> {
        Ok(self.list_changes(request.into_inner()).await?.into())
    }

    async fn list_doors(
        &self,
        request: Request<v1::ListDoorsRequest>,
    ) -> Result<Response<v1::ListDoorsResponse>, Status> {
        Ok(self.list_doors(request.into_inner()).await?.into())
    }
}
