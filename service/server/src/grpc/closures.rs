//! `ClosureService`.

use meetpoint_proto::v1;
use tonic::{Request, Response, Status};
use v1::closure_service_server::ClosureService;

use crate::service::Service;

#[tonic::async_trait]
impl ClosureService for Service {
    async fn list_closures(
        &self,
        request: Request<v1::ListClosuresRequest>,
    ) -> Result<Response<v1::ListClosuresResponse>, Status> {
        Ok(self.list_closures(request.into_inner()).await?.into())
    }

    async fn switch_closure_off(
        &self,
        request: Request<v1::SwitchClosureOffRequest>,
    ) -> Result<Response<v1::SwitchClosureOffResponse>, Status> {
        Ok(self.switch_closure_off(request.into_inner()).await?.into())
    }

    async fn switch_closure_on(
        &self,
        request: Request<v1::SwitchClosureOnRequest>,
    ) -> Result<Response<v1::SwitchClosureOnResponse>, Status> {
        Ok(self.switch_closure_on(request.into_inner()).await?.into())
    }
}
