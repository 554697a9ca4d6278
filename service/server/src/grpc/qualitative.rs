//! `QualitativeService`.

use meetpoint_proto::v1;
use tonic::{Request, Response, Status};
use v1::qualitative_service_server::QualitativeService;

use crate::service::Service;

#[tonic::async_trait]
impl QualitativeService for Service {
    async fn get_next_step(
        &self,
        request: Request<v1::GetNextStepRequest>,
    ) -> Result<Response<v1::GetNextStepResponse>, Status> {
        Ok(self.get_next_step(request.into_inner()).await?.into())
    }

    async fn get_qualitative_exploration(
        &self,
        request: Request<v1::GetQualitativeExplorationRequest>,
    ) -> Result<Response<v1::GetQualitativeExplorationResponse>, Status> {
        Ok(self.get_qualitative_exploration(request.into_inner()).await?.into())
    }

    async fn begin_qualitative_exploration(
        &self,
        request: Request<v1::BeginQualitativeExplorationRequest>,
    ) -> Result<Response<v1::BeginQualitativeExplorationResponse>, Status> {
        Ok(self.begin_qualitative_exploration(request.into_inner()).await?.into())
    }

    async fn select_directions(
        &self,
        request: Request<v1::SelectDirectionsRequest>,
    ) -> Result<Response<v1::SelectDirectionsResponse>, Status> {
        Ok(self.select_directions(request.into_inner()).await?.into())
    }

    async fn mark_home(
        &self,
        request: Request<v1::MarkHomeRequest>,
    ) -> Result<Response<v1::MarkHomeResponse>, Status> {
        Ok(self.mark_home(request.into_inner()).await?.into())
    }
}
