//! `MergeService`.

use meetpoint_proto::v1;
use tonic::{Request, Response, Status};
use v1::merge_service_server::MergeService;

use crate::service::Service;

#[tonic::async_trait]
impl MergeService for Service {
    async fn list_merges(
        &self,
        request: Request<v1::ListMergesRequest>,
    ) -> Result<Response<v1::ListMergesResponse>, Status> {
        Ok(self.list_merges(request.into_inner()).await?.into())
    }

    async fn get_merge(
        &self,
        request: Request<v1::GetMergeRequest>,
    ) -> Result<Response<v1::GetMergeResponse>, Status> {
        Ok(self.get_merge(request.into_inner()).await?.into())
    }

    async fn get_merge_preview(
        &self,
        request: Request<v1::GetMergePreviewRequest>,
    ) -> Result<Response<v1::GetMergePreviewResponse>, Status> {
        Ok(self.get_merge_preview(request.into_inner()).await?.into())
    }

    async fn accept_merge(
        &self,
        request: Request<v1::AcceptMergeRequest>,
    ) -> Result<Response<v1::AcceptMergeResponse>, Status> {
        Ok(self.accept_merge(request.into_inner()).await?.into())
    }

    async fn reject_merge(
        &self,
        request: Request<v1::RejectMergeRequest>,
    ) -> Result<Response<v1::RejectMergeResponse>, Status> {
        Ok(self.reject_merge(request.into_inner()).await?.into())
    }

    async fn undo_merge(
        &self,
        request: Request<v1::UndoMergeRequest>,
    ) -> Result<Response<v1::UndoMergeResponse>, Status> {
        Ok(self.undo_merge(request.into_inner()).await?.into())
    }
}
