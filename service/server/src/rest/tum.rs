//! A whole trajectory as text, sent while it is read.

use axum::body::{Body, Bytes};
use axum::http::{HeaderValue, header};
use axum::response::Response;
use meetpoint_proto::v1;
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;

use super::problem::Refusal;
use super::reply::filled;
use crate::convert::tum;
use crate::{error::Error, service::Service};

/// Poses that are fetched and written at once: some 100 kB of text, half a millisecond.
const N_POSES_AT_ONCE: u32 = 1000;
/// Pieces of text on their way to one client.
const N_PIECES_BUFFERED: usize = 2;

/// All poses from the request's offset on, fetched page by page as the client reads. All are of the
/// version that the first page is of, whatever is published in between.
pub(super) async fn all_poses(
    service: Service,
    request: v1::GetTrajectoryRequest,
) -> Result<Response, Refusal> {
    let first = v1::GetTrajectoryRequest { page_size: N_POSES_AT_ONCE, ..request };
    let reply = service.get_trajectory(first.clone()).await?;
    let v1::GetTrajectoryResponse { trajectory, next_offset } = reply;
    let trajectory = filled(trajectory, "trajectory")?;
    let v1::Trajectory { session, map_version, reference_frame, frame, poses, .. } = trajectory;
    let (pieces, receiver) = mpsc::channel(N_PIECES_BUFFERED);
    let next = v1::GetTrajectoryRequest { version: map_version, offset: next_offset, ..first };
    tokio::spawn(async move {
        // Whoever stopped reading is not told.
        if pieces.send(Ok(Bytes::from(tum::lines(&poses)))).await.is_ok() && next_offset != 0 {
            send_pages(&service, next, &pieces).await;
        }
    });
    let mut response = Response::new(Body::from_stream(ReceiverStream::new(receiver)));
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static("text/plain; charset=utf-8"));
    headers.insert("meetpoint-map-version", HeaderValue::from(map_version));
    let named = [
        (header::HeaderName::from_static("meetpoint-reference-frame"), reference_frame),
        (header::HeaderName::from_static("meetpoint-frame"), frame),
        (header::CONTENT_DISPOSITION, format!("inline; filename=\"{session}.tum\"")),
    ];
    for (name, text) in named {
        headers.insert(name, HeaderValue::try_from(text).map_err(Error::internal)?);
    }
    Ok(response)
}

/// Sends page after page. An error cuts the transfer off, so that no reader takes it for complete.
async fn send_pages(
    service: &Service,
    mut request: v1::GetTrajectoryRequest,
    pieces: &mpsc::Sender<Result<Bytes, Error>>,
) {
    loop {
        let page = tokio::select! {
            page = service.get_trajectory(request.clone()) => page,
            () = service.stop.cancelled() => Err(Error::Stopping),
        };
        let piece = page.and_then(|v1::GetTrajectoryResponse { trajectory, next_offset }| {
            request.offset = next_offset;
            Ok(Bytes::from(tum::lines(&filled(trajectory, "trajectory")?.poses)))
        });
        if let Err(error) = &piece {
            error.log();
        }
        let is_last = piece.is_err() || request.offset == 0;
        if pieces.send(piece).await.is_err() || is_last {
            return;
        }
    }
}
