//! `MapService`.

use meetpoint_proto::v1;
use meetpoint_storage::MapId;
use tokio::sync::broadcast::error::RecvError;
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Request, Response, Status, Streaming};
use v1::map_service_server::MapService;

use super::imports;
use crate::live::Event;
use crate::service::Service;

/// Events on their way to one watcher.
const N_EVENTS_BUFFERED: usize = 64;

#[tonic::async_trait]
impl MapService for Service {
    async fn create_map(
        &self,
        request: Request<v1::CreateMapRequest>,
    ) -> Result<Response<v1::CreateMapResponse>, Status> {
        Ok(self.create_map(request.into_inner()).await?.into())
    }

    async fn get_map(
        &self,
        request: Request<v1::GetMapRequest>,
    ) -> Result<Response<v1::GetMapResponse>, Status> {
        Ok(self.get_map(request.into_inner()).await?.into())
    }

    async fn list_maps(
        &self,
        request: Request<v1::ListMapsRequest>,
    ) -> Result<Response<v1::ListMapsResponse>, Status> {
        Ok(self.list_maps(request.into_inner()).await?.into())
    }

    async fn get_mapping_parameters(
        &self,
        request: Request<v1::GetMappingParametersRequest>,
    ) -> Result<Response<v1::GetMappingParametersResponse>, Status> {
        Ok(self.get_mapping_parameters(request.into_inner()).await?.into())
    }

    async fn set_mapping_parameters(
        &self,
        request: Request<v1::SetMappingParametersRequest>,
    ) -> Result<Response<v1::SetMappingParametersResponse>, Status> {
        Ok(self.set_mapping_parameters(request.into_inner()).await?.into())
    }

    type WatchMapStream = ReceiverStream<Result<v1::WatchMapResponse, Status>>;

    async fn watch_map(
        &self,
        request: Request<v1::WatchMapRequest>,
    ) -> Result<Response<Self::WatchMapStream>, Status> {
        let map = self.map_record(&request.into_inner().map).await?.id;
        let (sender, receiver) = mpsc::channel(N_EVENTS_BUFFERED);
        tokio::spawn(watch(self.clone(), map, sender));
        Ok(ReceiverStream::new(receiver).into())
    }

    async fn list_map_versions(
        &self,
        request: Request<v1::ListMapVersionsRequest>,
    ) -> Result<Response<v1::ListMapVersionsResponse>, Status> {
        Ok(self.list_map_versions(request.into_inner()).await?.into())
    }

    async fn get_map_version(
        &self,
        request: Request<v1::GetMapVersionRequest>,
    ) -> Result<Response<v1::GetMapVersionResponse>, Status> {
        Ok(self.get_map_version(request.into_inner()).await?.into())
    }

    async fn publish_map_version(
        &self,
        request: Request<v1::PublishMapVersionRequest>,
    ) -> Result<Response<v1::PublishMapVersionResponse>, Status> {
        Ok(self.publish_map_version(request.into_inner()).await?.into())
    }

    async fn import_map(
        &self,
        request: Request<Streaming<v1::ImportMapRequest>>,
    ) -> Result<Response<v1::ImportMapResponse>, Status> {
        Ok(imports::import(self, request.into_inner()).await?.into())
    }
}

/// Passes a map's events on until the watcher leaves or falls too far behind.
async fn watch(
    service: Service,
    map: MapId,
    sender: mpsc::Sender<Result<v1::WatchMapResponse, Status>>,
) {
    use v1::watch_map_response::Kind;
    let mut events = service.live.watch();
    loop {
        let event = tokio::select! {
            event = events.recv() => event,
            () = service.stop.cancelled() => {
                let _ = sender.send(Err(crate::error::Error::Stopping.into())).await;
                return;
            }
            () = sender.closed() => return,
        };
        let kind = match event {
            Ok((of, event)) if of == map => match event {
                Event::Version(version) => Kind::Version(version),
                Event::Session(session) => Kind::Session(session),
                Event::Correction(correction) => Kind::Correction(correction),
                Event::Costs(costs) => Kind::Costs(costs),
                Event::Job(_) => continue,
            },
            Ok(_) => continue,
            Err(RecvError::Lagged(n)) => {
                let left_out =
                    format!("{n} events were left out: read the map again and watch anew");
                let _ = sender.send(Err(Status::data_loss(left_out))).await;
                return;
            }
            Err(RecvError::Closed) => return,
        };
        if sender.send(Ok(v1::WatchMapResponse { kind: Some(kind) })).await.is_err() {
            return;
        }
    }
}
