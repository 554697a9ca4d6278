//! `meetpoint serve`.

use std::path::PathBuf;

use crate::{serve, settings, telemetry};

/// Options of `meetpoint serve`.
#[derive(Debug, clap::Args)]
pub struct ServeArgs {
    /// A file of settings that differ from the defaults (see --print-settings)
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Folder of the embedded database
    #[arg(long, value_name = "FOLDER")]
    data: Option<PathBuf>,
    /// Address to listen on
    #[arg(long, value_name = "ADDRESS")]
    host: Option<std::net::IpAddr>,
    /// Port for REST and gRPC; 0 takes a free one
    #[arg(long)]
    port: Option<u16>,
    /// Log JSON lines, for machines
    #[arg(long)]
    json: bool,
    /// Print all settings with their defaults and reasons, and end
    #[arg(long)]
    print_settings: bool,
}

/// Serves until it is told to stop by Ctrl-C or a termination signal.
///
/// # Errors
/// If it cannot start, or a part of it failed.
pub async fn run(args: ServeArgs) -> anyhow::Result<()> {
    if args.print_settings {
        print!("{}", settings::DEFAULTS);
        return Ok(());
    }
    telemetry::start_logging(args.json);
    let mut chosen = settings::read(args.settings.as_deref(), std::env::vars())?;
    if let Some(data) = args.data {
        chosen.server.data = data;
    }
    if let Some(host) = args.host {
        chosen.server.host = host;
    }
    if let Some(port) = args.port {
        chosen.server.port = port;
    }
    tracing::info!(settings = ?chosen, "settings");
    let data = chosen.server.data.clone();
    let running = serve::start(chosen).await?;
    // One line that people and scripts can read, on standard output, with the real port.
    println!("meetpoint listens on http://{} with its data in {}", running.address, data.display());
    asked_to_stop().await;
    tracing::info!("stopping");
    running.stop().await
}

/// Waits for Ctrl-C or, on Unix, a termination signal.
pub(crate) async fn asked_to_stop() {
    #[cfg(unix)]
    {
        use tokio::signal::unix::{SignalKind, signal};
        if let Ok(mut terminate) = signal(SignalKind::terminate()) {
            tokio::select! {
                _ = tokio::signal::ctrl_c() => {}
                _ = terminate.recv() => {}
            }
            return;
        }
    }
    // A service that cannot hear Ctrl-C goes on until it is killed, which loses nothing.
    if tokio::signal::ctrl_c().await.is_err() {
        std::future::pending::<()>().await;
    }
}
