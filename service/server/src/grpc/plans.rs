//! `PlanService`.

use meetpoint_proto::v1;
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Request, Response, Status};
use v1::plan_service_server::PlanService;

use crate::service::Service;

#[tonic::async_trait]
impl PlanService for Service {
    async fn plan_path(
        &self,
        request: Request<v1::PlanPathRequest>,
    ) -> Result<Response<v1::PlanPathResponse>, Status> {
        Ok(self.plan_path(request.into_inner()).await?.into())
    }

    async fn plan_matrix(
        &self,
        request: Request<v1::PlanMatrixRequest>,
    ) -> Result<Response<v1::PlanMatrixResponse>, Status> {
        Ok(self.plan_matrix(request.into_inner()).await?.into())
    }

    async fn next_motion(
        &self,
        request: Request<v1::NextMotionRequest>,
    ) -> Result<Response<v1::NextMotionResponse>, Status> {
        Ok(self.next_motion(request.into_inner()).await?.into())
    }

    async fn get_nearest_free_point(
        &self,
        request: Request<v1::GetNearestFreePointRequest>,
    ) -> Result<Response<v1::GetNearestFreePointResponse>, Status> {
        Ok(self.get_nearest_free_point(request.into_inner()).await?.into())
    }

    async fn get_reachable_area(
        &self,
        request: Request<v1::GetReachableAreaRequest>,
    ) -> Result<Response<v1::GetReachableAreaResponse>, Status> {
        Ok(self.get_reachable_area(request.into_inner()).await?.into())
    }

    type DownloadPlanTablesStream = ReceiverStream<Result<v1::DownloadPlanTablesResponse, Status>>;

    async fn download_plan_tables(
        &self,
        request: Request<v1::DownloadPlanTablesRequest>,
    ) -> Result<Response<Self::DownloadPlanTablesStream>, Status> {
        let pieces = self.plan_tables(request.into_inner()).await?;
        let (sender, receiver) = tokio::sync::mpsc::channel(N_PIECES_BUFFERED);
        tokio::spawn(async move {
            for piece in pieces {
                let piece = v1::DownloadPlanTablesResponse { piece };
                if sender.send(Ok(piece)).await.is_err() {
                    return;
                }
            }
        });
        Ok(ReceiverStream::new(receiver).into())
    }
}

/// Pieces of a file on their way to one robot.
const N_PIECES_BUFFERED: usize = 2;
