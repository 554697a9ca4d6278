//! Maps of places that fit what robots saw.

use meetpoint_proto::v1::{
    GetHypothesisRequest, GetHypothesisResponse, GetNextTravelRequest, GetNextTravelResponse,
    GetPlaceMapRequest, GetPlaceMapResponse, ListCausalSchemasRequest, ListCausalSchemasResponse,
    ListHypothesesRequest, ListHypothesesResponse, ListPlacesRequest, ListPlacesResponse,
    place_service_client::PlaceServiceClient,
};
use tonic::transport::Channel;

use super::{ANSWER_BYTES_MAX, Client, call};
use crate::error::Error;

impl Client {
    /// A page of the maps that fit a travel, and what would tell which is true.
    ///
    /// # Errors
    ///
    /// `MAP_NOT_FOUND`, `SESSION_NOT_FOUND` or `NOTHING_TRAVELLED`.
    pub async fn hypotheses(
        &self,
        request: ListHypothesesRequest,
    ) -> Result<ListHypothesesResponse, Error> {
        Ok(self.place_service().list_hypotheses(call(request)).await?.into_inner())
    }

    /// One of these maps, or the simplest, with its places and edges.
    ///
    /// # Errors
    ///
    /// Those of [`Self::hypotheses`], and `HYPOTHESIS_NOT_FOUND`.
    pub async fn hypothesis(
        &self,
        request: GetHypothesisRequest,
    ) -> Result<GetHypothesisResponse, Error> {
        Ok(self.place_service().get_hypothesis(call(request)).await?.into_inner())
    }

    /// What was seen of one of its places on one visit: a local map with gateways and stars.
    ///
    /// # Errors
    ///
    /// Those of [`Self::hypothesis`], `PLACE_NOT_FOUND`, and `PLACE_NOT_SCANNED`.
    pub async fn place_map(
        &self,
        request: GetPlaceMapRequest,
    ) -> Result<GetPlaceMapResponse, Error> {
        Ok(self.place_service().get_place_map(call(request)).await?.into_inner())
    }

    /// What a session's travel says of views and actions, before there is any place.
    ///
    /// # Errors
    ///
    /// Those of [`Self::hypotheses`].
    pub async fn causal_schemas(
        &self,
        request: ListCausalSchemasRequest,
    ) -> Result<ListCausalSchemasResponse, Error> {
        Ok(self.place_service().list_causal_schemas(call(request)).await?.into_inner())
    }

    /// What a robot is to do next that has told of its last visit.
    ///
    /// # Errors
    ///
    /// Those of [`Self::hypotheses`].
    pub async fn next_travel(
        &self,
        request: GetNextTravelRequest,
    ) -> Result<GetNextTravelResponse, Error> {
        Ok(self.place_service().get_next_travel(call(request)).await?.into_inner())
    }

    /// The places of a version's grid, their gateways and how paths join them, by pages.
    ///
    /// # Errors
    ///
    /// `MAP_NOT_FOUND`, `NOTHING_PUBLISHED`, `VERSION_NOT_FOUND`, `NOTHING_OBSERVED` or `GRID_TOO_LARGE`.
    pub async fn places(&self, request: ListPlacesRequest) -> Result<ListPlacesResponse, Error> {
        Ok(self.place_service().list_places(call(request)).await?.into_inner())
    }

    fn place_service(&self) -> PlaceServiceClient<Channel> {
        PlaceServiceClient::new(self.channel.clone()).max_decoding_message_size(ANSWER_BYTES_MAX)
    }
}
