//! Trajectories as text, in the format of the TUM RGB-D benchmark.
//!
//! One pose a line, `t x y z qx qy qz qw`: seconds, metres, a unit quaternion. In the plane z, qx and
//! qy are 0, and a heading theta gives
//!
//! ```text
//! qz = sin(theta / 2),   qw = cos(theta / 2)
//! ```
//!
//! J. Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", IROS 2012.

use std::fmt::Write;

use axum::body::{Body, Bytes};
use axum::http::{HeaderValue, header};
use axum::response::Response;
use meetpoint_proto::v1;
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;

use super::problem::Refusal;
use super::reply::filled;
use crate::{error::Error, service::Service};

/// Poses that are fetched and written at once: some 100 kB of text, half a millisecond.
const N_POSES_AT_ONCE: u32 = 1000;
/// Pieces of text on their way to one client.
const N_PIECES_BUFFERED: usize = 2;
/// Bytes of a line, about.
const LINE_BYTES: usize = 100;

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
        if pieces.send(Ok(Bytes::from(lines(&poses)))).await.is_ok() && next_offset != 0 {
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
            Ok(Bytes::from(lines(&filled(trajectory, "trajectory")?.poses)))
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

fn lines(poses: &[v1::TrajectoryPose]) -> String {
    let mut text = String::with_capacity(poses.len() * LINE_BYTES);
    for stamped in poses {
        let v1::TrajectoryPose { stamp_ns, pose, .. } = stamped;
        let v1::Pose { x_m, y_m, theta_rad } = pose.unwrap_or_default();
        let (qz, qw) = (theta_rad / 2.0).sin_cos();
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{} {x_m} {y_m} 0 0 0 {qz} {qw}", seconds(*stamp_ns));
    }
    text
}

/// Nanoseconds as seconds with nine decimals, exactly.
fn seconds(stamp_ns: i64) -> String {
    let sign = if stamp_ns < 0 { "-" } else { "" };
    let magnitude_ns = stamp_ns.unsigned_abs();
    format!("{sign}{}.{:09}", magnitude_ns / 1_000_000_000, magnitude_ns % 1_000_000_000)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_to_the_nanosecond() {
        assert_eq!(seconds(1_763_840_000_000_000_001), "1763840000.000000001", "no rounding");
        assert_eq!(seconds(-1), "-0.000000001", "before the beginning");
        assert_eq!(seconds(i64::MIN), "-9223372036.854775808", "the smallest");
    }

    #[test]
    fn a_quarter_turn() {
        let theta_rad = std::f64::consts::FRAC_PI_2;
        let pose = Some(v1::Pose { x_m: 1.25, y_m: -0.5, theta_rad });
        let stamped = v1::TrajectoryPose { stamp_ns: 10_000_000, pose, ..Default::default() };
        assert_eq!(
            lines(&[stamped]),
            "0.010000000 1.25 -0.5 0 0 0 0.7071067811865475 0.7071067811865476\n",
            "eight numbers"
        );
    }
}
