//! `MapService.ImportMap`: collects the pieces of a map's files.

use meetpoint_proto::v1;
use tonic::{Status, Streaming};
use v1::import_map_request::Kind;

use super::too_large;
use crate::error::Error;
use crate::operations::imports::in_time;
use crate::service::Service;

/// Takes a stream to its end and imports what it held.
pub(super) async fn import(
    service: &Service,
    requests: Streaming<v1::ImportMapRequest>,
) -> Result<v1::ImportMapResponse, Status> {
    let slot = service.import_slot().await?;
    let (map, files) = in_time(collected(service, requests)).await?;
    Ok(service.import_map(slot, &map, files).await?)
}

/// The map's id and the files.
async fn collected(
    service: &Service,
    mut requests: Streaming<v1::ImportMapRequest>,
) -> Result<(String, v1::MapServerFiles), Status> {
    let limit_bytes = service.settings.limits.request_bytes_max;
    let mended = |status: Status| too_large::mended(&status, limit_bytes).unwrap_or(status);
    let first = requests.message().await.map_err(mended)?;
    let Some(v1::ImportMapRequest { kind: Some(Kind::Head(head)) }) = first else {
        return Err(Error::field("kind", "the first message of an import is `head`").into());
    };
    let v1::ImportHead { map, yaml } = head;
    let mut files = v1::MapServerFiles { yaml, image: Vec::new() };
    while let Some(v1::ImportMapRequest { kind }) = requests.message().await.map_err(mended)? {
        let Some(Kind::Image(piece)) = kind else {
            return Err(Error::field("kind", "after `head` come pieces of the image").into());
        };
        service.check_import_bytes(files.yaml.len() + files.image.len() + piece.len())?;
        files.image.extend_from_slice(&piece);
    }
    Ok((map, files))
}
