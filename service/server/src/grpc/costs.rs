//! `CostService`.

use meetpoint_proto::v1;
use tonic::{Request, Response, Status};
use v1::cost_service_server::CostService;

use crate::service::Service;

#[tonic::async_trait]
impl CostService for Service {
    async fn list_costs(
        &self,
        request: Request<v1::ListCostsRequest>,
    ) -> Result<Response<v1::ListCostsResponse>, Status> {
        Ok(self.list_costs(request.into_inner()).await?.into())
    }

    async fn create_cost(
        &self,
        request: Request<v1::CreateCostRequest>,
    ) -> Result<Response<v1::CreateCostResponse>, Status> {
        Ok(self.create_cost(request.into_inner()).await?.into())
    }

    async fn delete_cost(
        &self,
        request: Request<v1::DeleteCostRequest>,
    ) -> Result<Response<v1::DeleteCostResponse>, Status> {
        Ok(self.delete_cost(request.into_inner()).await?.into())
    }

    async fn close_arc(
        &self,
        request: Request<v1::CloseArcRequest>,
    ) -> Result<Response<v1::CloseArcResponse>, Status> {
        Ok(self.close_arc(request.into_inner()).await?.into())
    }

    async fn open_arc(
        &self,
        request: Request<v1::OpenArcRequest>,
    ) -> Result<Response<v1::OpenArcResponse>, Status> {
        Ok(self.open_arc(request.into_inner()).await?.into())
    }

    async fn set_arc_toll(
        &self,
        request: Request<v1::SetArcTollRequest>,
    ) -> Result<Response<v1::SetArcTollResponse>, Status> {
        Ok(self.set_arc_toll(request.into_inner()).await?.into())
    }

    async fn list_profiles(
        &self,
        request: Request<v1::ListProfilesRequest>,
    ) -> Result<Response<v1::ListProfilesResponse>, Status> {
        Ok(self.list_profiles(request.into_inner()).await?.into())
    }

    async fn set_profile(
        &self,
        request: Request<v1::SetProfileRequest>,
    ) -> Result<Response<v1::SetProfileResponse>, Status> {
        Ok(self.set_profile(request.into_inner()).await?.into())
    }

    async fn delete_profile(
        &self,
        request: Request<v1::DeleteProfileRequest>,
    ) -> Result<Response<v1::DeleteProfileResponse>, Status> {
        Ok(self.delete_profile(request.into_inner()).await?.into())
    }
}
