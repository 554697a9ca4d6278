//! `JobService`.

use meetpoint_proto::v1;
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Request, Response, Status};
use v1::job_service_server::JobService;

use crate::error::Error;
use crate::service::Service;

/// States on their way to one watcher.
const N_STATES_BUFFERED: usize = 16;

#[tonic::async_trait]
impl JobService for Service {
    async fn create_job(
        &self,
        request: Request<v1::CreateJobRequest>,
    ) -> Result<Response<v1::CreateJobResponse>, Status> {
        Ok(self.create_job(request.into_inner()).await?.into())
    }

    async fn get_job(
        &self,
        request: Request<v1::GetJobRequest>,
    ) -> Result<Response<v1::GetJobResponse>, Status> {
        Ok(self.get_job(request.into_inner()).await?.into())
    }

    async fn list_jobs(
        &self,
        request: Request<v1::ListJobsRequest>,
    ) -> Result<Response<v1::ListJobsResponse>, Status> {
        Ok(self.list_jobs(request.into_inner()).await?.into())
    }

    async fn cancel_job(
        &self,
        request: Request<v1::CancelJobRequest>,
    ) -> Result<Response<v1::CancelJobResponse>, Status> {
        Ok(self.cancel_job(request.into_inner()).await?.into())
    }

    async fn get_job_picture(
        &self,
        request: Request<v1::GetJobPictureRequest>,
    ) -> Result<Response<v1::GetJobPictureResponse>, Status> {
        Ok(self.get_job_picture(request.into_inner()).await?.into())
    }

    type WatchJobStream = ReceiverStream<Result<v1::WatchJobResponse, Status>>;

    async fn watch_job(
        &self,
        request: Request<v1::WatchJobRequest>,
    ) -> Result<Response<Self::WatchJobStream>, Status> {
        let mut changes = self.watch_job(&request.into_inner().job).await?;
        let (sender, receiver) = mpsc::channel(N_STATES_BUFFERED);
        let stop = self.stop.clone();
        tokio::spawn(async move {
            loop {
                let state = tokio::select! {
                    state = changes.next() => state,
                    () = stop.cancelled() => Some(Err(Error::Stopping)),
                    () = sender.closed() => return,
                };
                let Some(state) = state else { return };
                let reply = state.map(|job| v1::WatchJobResponse { job: Some(job) });
                let ended = reply.is_err();
                if sender.send(reply.map_err(Status::from)).await.is_err() || ended {
                    return;
                }
            }
        });
        Ok(ReceiverStream::new(receiver).into())
    }
}
