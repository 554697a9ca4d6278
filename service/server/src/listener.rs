//! The accept loop: REST and gRPC on one port, with limits on time and number.
//!
//! HTTP/2 is told from HTTP/1 by its preface, within the header timeout, so that a client that
//! sends half a header, half a preface or nothing holds nothing for long.

use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::extract::Request;
use hyper_util::rt::{TokioExecutor, TokioIo, TokioTimer};
use hyper_util::server::conn::auto;
use hyper_util::server::graceful::GracefulShutdown;
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;
use tokio_util::sync::CancellationToken;
use tower::ServiceExt;

use crate::settings::ServerSettings;

/// What an HTTP/2 client sends first.
const HTTP2_PREFACE: &[u8; 24] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
/// Pings to clients that say nothing, and how long the answer may take: a robot's Wi-Fi that went
/// away is noticed within a minute.
const KEEP_ALIVE_INTERVAL: Duration = Duration::from_secs(30);
const KEEP_ALIVE_TIMEOUT: Duration = Duration::from_secs(20);
/// Streams of one HTTP/2 connection.
const N_STREAMS_MAX: u32 = 256;
/// HTTP/2 windows in bytes: a few batches a stream, many streams a connection.
const STREAM_WINDOW_BYTES: u32 = 1 << 20;
const CONNECTION_WINDOW_BYTES: u32 = 1 << 22;
/// Header bytes of a request.
const HEADER_BYTES_MAX: u32 = 16 * 1024;
/// Between attempts to find out what an undecided client speaks.
const PREFACE_POLL: Duration = Duration::from_millis(5);

/// Accepts connections until `stop`, then drains them.
pub(crate) async fn accept(
    listener: TcpListener,
    router: Router,
    settings: &ServerSettings,
    stop: CancellationToken,
) {
    let room = std::sync::Arc::new(Semaphore::new(settings.n_connections_max));
    let header_timeout = Duration::from_millis(settings.header_timeout_ms);
    let graceful = GracefulShutdown::new();
    loop {
        let accepted = tokio::select! {
            permit = room.clone().acquire_owned() => {
                let Ok(permit) = permit else { break };
                tokio::select! {
                    accepted = listener.accept() => accepted.map(|(stream, _)| (stream, permit)),
                    () = stop.cancelled() => break,
                }
            }
            () = stop.cancelled() => break,
        };
        let (stream, permit) = match accepted {
            Ok(accepted) => accepted,
            Err(error) => {
                // Out of file descriptors, most likely: wait for some to be given back.
                tracing::warn!(%error, "a connection could not be accepted");
                tokio::time::sleep(Duration::from_millis(100)).await;
                continue;
            }
        };
        let watcher = graceful.watcher();
        let router = router.clone();
        tokio::spawn(async move {
            serve_connection(stream, router, header_timeout, watcher).await;
            drop(permit);
        });
    }
    drop(listener);
    let drain = Duration::from_millis(settings.drain_ms);
    if tokio::time::timeout(drain, graceful.shutdown()).await.is_err() {
        tracing::info!("some connections were cut after the drain time");
    }
}

async fn serve_connection(
    stream: TcpStream,
    router: Router,
    header_timeout: Duration,
    watcher: hyper_util::server::graceful::Watcher,
) {
    // Acks are small and should not wait for more to send.
    if stream.set_nodelay(true).is_err() {
        return;
    }
    let Ok(Some(is_http2)) = tokio::time::timeout(header_timeout, speaks_http2(&stream)).await
    else {
        return;
    };
    let mut builder = auto::Builder::new(TokioExecutor::new());
    builder.http1().timer(TokioTimer::new()).header_read_timeout(header_timeout);
    builder
        .http2()
        .timer(TokioTimer::new())
        .keep_alive_interval(KEEP_ALIVE_INTERVAL)
        .keep_alive_timeout(KEEP_ALIVE_TIMEOUT)
        .max_concurrent_streams(N_STREAMS_MAX)
        .initial_stream_window_size(STREAM_WINDOW_BYTES)
        .initial_connection_window_size(CONNECTION_WINDOW_BYTES)
        .max_header_list_size(HEADER_BYTES_MAX);
    let builder = if is_http2 { builder.http2_only() } else { builder.http1_only() };
    let service =
        TowerToHyperService::new(router.map_request(|request: Request<_>| request.map(Body::new)));
    let connection =
        builder.serve_connection_with_upgrades(TokioIo::new(stream), service).into_owned();
    if let Err(error) = watcher.watch(connection).await {
        tracing::debug!(error = %error, "a connection ended early");
    }
}

/// Whether the client's first bytes are HTTP/2's; `None` if it left.
async fn speaks_http2(stream: &TcpStream) -> Option<bool> {
    let mut first = [0_u8; HTTP2_PREFACE.len()];
    loop {
        let n = stream.peek(&mut first).await.ok()?;
        if n == 0 {
            return None;
        }
        if first[..n] != HTTP2_PREFACE[..n] {
            return Some(false);
        }
        if n == first.len() {
            return Some(true);
        }
        tokio::time::sleep(PREFACE_POLL).await;
    }
}
