//! `SessionService`; its stream is in `ingest.rs`.

use meetpoint_proto::v1;
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Request, Response, Status, Streaming};
use v1::session_service_server::SessionService;

use super::ingest;
use crate::service::Service;

#[tonic::async_trait]
impl SessionService for Service {
    async fn open_session(
        &self,
        request: Request<v1::OpenSessionRequest>,
    ) -> Result<Response<v1::OpenSessionResponse>, Status> {
        Ok(self.open_session(request.into_inner()).await?.into())
    }

    async fn get_session(
        &self,
        request: Request<v1::GetSessionRequest>,
    ) -> Result<Response<v1::GetSessionResponse>, Status> {
        Ok(self.get_session(request.into_inner()).await?.into())
    }

    async fn list_sessions(
        &self,
        request: Request<v1::ListSessionsRequest>,
    ) -> Result<Response<v1::ListSessionsResponse>, Status> {
        Ok(self.list_sessions(request.into_inner()).await?.into())
    }

    async fn close_session(
        &self,
        request: Request<v1::CloseSessionRequest>,
    ) -> Result<Response<v1::CloseSessionResponse>, Status> {
        Ok(self.close_session(request.into_inner()).await?.into())
    }

    type IngestStream = ReceiverStream<Result<v1::IngestResponse, Status>>;

    async fn ingest(
        &self,
        request: Request<Streaming<v1::IngestRequest>>,
    ) -> Result<Response<Self::IngestStream>, Status> {
        Ok(ReceiverStream::new(ingest::stream(self.clone(), request.into_inner())).into())
    }

    async fn ingest_batch(
        &self,
        request: Request<v1::IngestBatchRequest>,
    ) -> Result<Response<v1::IngestBatchResponse>, Status> {
        Ok(self.ingest_batch(request.into_inner()).await?.into())
    }

    async fn get_trajectory(
        &self,
        request: Request<v1::GetTrajectoryRequest>,
    ) -> Result<Response<v1::GetTrajectoryResponse>, Status> {
        Ok(self.get_trajectory(request.into_inner()).await?.into())
    }
}
