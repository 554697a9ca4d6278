//! `PlaceService`.

use meetpoint_proto::v1;
use tonic::{Request, Response, Status};
use v1::place_service_server::PlaceService;

use crate::service::Service;

#[tonic::async_trait]
impl PlaceService for Service {
    async fn list_hypotheses(
        &self,
        request: Request<v1::ListHypothesesRequest>,
    ) -> Result<Response<v1::ListHypothesesResponse>, Status> {
        Ok(self.list_hypotheses(request.into_inner()).await?.into())
    }

    async fn get_hypothesis(
        &self,
        request: Request<v1::GetHypothesisRequest>,
    ) -> Result<Response<v1::GetHypothesisResponse>, Status> {
        Ok(self.get_hypothesis(request.into_inner()).await?.into())
    }

    async fn assert_hypothesis(
        &self,
        request: Request<v1::AssertHypothesisRequest>,
    ) -> Result<Response<v1::AssertHypothesisResponse>, Status> {
        Ok(self.assert_hypothesis(request.into_inner()).await?.into())
    }

    async fn undo_hypothesis(
        &self,
        request: Request<v1::UndoHypothesisRequest>,
    ) -> Result<Response<v1::UndoHypothesisResponse>, Status> {
        Ok(self.undo_hypothesis(request.into_inner()).await?.into())
    }

    async fn plan_travel(
        &self,
        request: Request<v1::PlanTravelRequest>,
    ) -> Result<Response<v1::PlanTravelResponse>, Status> {
        Ok(self.plan_travel(request.into_inner()).await?.into())
    }

    async fn get_next_travel(
        &self,
        request: Request<v1::GetNextTravelRequest>,
    ) -> Result<Response<v1::GetNextTravelResponse>, Status> {
        Ok(self.get_next_travel(request.into_inner()).await?.into())
    }

    async fn get_place_map(
        &self,
        request: Request<v1::GetPlaceMapRequest>,
    ) -> Result<Response<v1::GetPlaceMapResponse>, Status> {
        Ok(self.get_place_map(request.into_inner()).await?.into())
    }

    async fn list_causal_schemas(
        &self,
        request: Request<v1::ListCausalSchemasRequest>,
    ) -> Result<Response<v1::ListCausalSchemasResponse>, Status> {
        Ok(self.list_causal_schemas(request.into_inner()).await?.into())
    }

    async fn list_places(
        &self,
        request: Request<v1::ListPlacesRequest>,
    ) -> Result<Response<v1::ListPlacesResponse>, Status> {
        Ok(self.list_places(request.into_inner()).await?.into())
    }
}
